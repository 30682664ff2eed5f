"""Drawings of actuators as dampers and springs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import control
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from agents.evaluation.colors import INK, colors
from design.style import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Damper(Protocol):
    """Data to draw: speeds (m/s), rates (N m s/rad) and stiffnesses (N m/rad)."""

    @property
    def speed(self) -> NDArray[np.float64]:
        """Return the speeds."""

    @property
    def rate(self) -> NDArray[np.float64]:
        """Return the rates."""

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Return the stiffnesses."""


def plot_equivalent(
    dampers: Mapping[str, Damper],
    axes: Sequence[Axes] | None = None,
    palette: Mapping[str, str] | None = None,
) -> control.ControlPlot:
    """Draw rates and stiffnesses over speed, one below the other.

    Parameters
    ----------
    dampers : mapping of str to agents.EquivalentDamper
        Dampers by their labels.
    axes : sequence of two Axes, optional
    palette : mapping of str to str, optional
        Colours, the same for several figures.
    """
    chosen = palette or colors(dampers)
    with style():
        above, below = plt.subplots(2, 1, figsize=(6.8, 5.0), sharex=True)[1] if axes is None else axes
        for name, damper in dampers.items():
            above.plot(damper.speed, 1e-3 * damper.rate, color=chosen[name], label=name)
            below.plot(damper.speed, 1e-6 * damper.stiffness, color=chosen[name], label=name)
        for ax in (above, below):
            ax.axhline(0.0, color=INK, lw=0.8)
        above.set_ylabel("damping (kN m s/rad)")
        below.set_ylabel("stiffness (MN m/rad)")
        below.set_xlabel("speed (m/s)")
        if any(dampers):
            above.legend(loc="best")
        lines = np.array([*above.lines, *below.lines], dtype=object)
        return control.ControlPlot(lines, np.array([above, below], dtype=object), above.figure)
