"""Simulated bifurcation diagrams of closed loops: what disturbances of several sizes settle at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller, equipped
from agents.evaluation.nonlinear import OFFSET, Place, amplitudes
from railenv import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

OFFSETS = (1e-4, 2e-3, OFFSET)
"""m, lateral, of all bodies at the start."""


@dataclass(frozen=True)
class ClosedLoopDiagram:
    """Amplitudes that disturbances settle at, over speed.

    Attributes
    ----------
    controller : str
    speed : ndarray, shape (n_speeds,)
        m/s.
    offset : ndarray, shape (n_offsets,)
        m, lateral, of all bodies at the start.
    amplitude : ndarray, shape (n_offsets, n_speeds)
        Half the range of the leading wheelset's lateral displacement in the last second, m; infinity
        where there is no running equilibrium.
    duration : float
        s, of each run.
    """

    controller: str
    speed: Array
    offset: Array
    amplitude: Array
    duration: float

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the amplitudes over speed; a marker for each offset."""
        from agents.evaluation.diagram_plots import plot_diagram

        return plot_diagram(self, ax)


def closed_loop_diagram(
    controller: Controller,
    model: Model,
    speeds: Sequence[float],
    *,
    name: str | None = None,
    radius: float = math.inf,
    cant: float = 0.0,
    offsets: Sequence[float] = OFFSETS,
    duration: float = 12.0,
) -> ClosedLoopDiagram:
    """Simulate a controlled vehicle at many speeds, from disturbances of several sizes.

    Parameters
    ----------
    controller : Controller
    model : Model
        With default actuators and sensors if it has none.
    speeds : sequence of float
        m/s.
    name : str, optional
        What to call the controller; its class's name when left out.
    radius, cant : float
        m (``math.inf`` on tangent track), rad.
    offsets : sequence of float
        m, lateral, of all bodies at the start.
    duration : float
        s, of each run.

    Raises
    ------
    ParameterError
        If the controller does not suit the vehicle, or a number is none that a run can have.
    """
    vehicle, place = equipped(model), Place(radius, cant)
    left = [
        amplitudes(vehicle, controller, place, list(speeds), offset=offset, duration=duration)
        for offset in offsets
    ]
    return ClosedLoopDiagram(
        name or controller.name,
        np.asarray(speeds, dtype=float),
        np.asarray(offsets, dtype=float),
        np.array(left),
        duration,
    )
