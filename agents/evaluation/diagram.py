"""Simulated bifurcation diagrams of closed loops: final amplitudes from several disturbances."""

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
"""Lateral displacements of all bodies at the start, m."""


@dataclass(frozen=True)
class ClosedLoopDiagram:
    """Final amplitudes after disturbances, over speed.

    Attributes
    ----------
    controller : str
    speed : ndarray, shape (n_speeds,)
        m/s.
    offset : ndarray, shape (n_offsets,)
        Lateral displacement of all bodies at the start, m.
    amplitude : ndarray, shape (n_offsets, n_speeds)
        Half the range of the leading wheelset's lateral displacement in the last second, m; infinity
        where there is no running equilibrium.
    duration : float
        Duration of each run, s.
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
        Vehicle; with default actuators and sensors if it has none.
    speeds : sequence of float
        m/s.
    name : str, optional
        Name of the controller; its class's name when left out.
    radius, cant : float
        m (``math.inf`` on tangent track), rad.
    offsets : sequence of float
        Lateral displacements of all bodies at the start, m.
    duration : float
        Duration of each run, s.

    Raises
    ------
    ParameterError
        If the controller does not fit the vehicle, or a number is not allowed in a run.
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
