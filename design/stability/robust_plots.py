"""Drawings of a robust critical speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import control

from design.style import STABLE, UNSTABLE, axes_or_new, drawn_on, style
from railenv import checks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.stability.robust import RobustCriticalSpeed


def plot_robust(
    result: RobustCriticalSpeed, parameter: str, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw the speeds up to which sampled vehicles are stable over one varied quantity."""
    checks.known("varied quantity", [parameter], list(result.box))
    with style():
        ax = axes_or_new(ax)
        values = [vehicle[parameter] for vehicle, _ in result.samples]
        speeds = [speed for _, speed in result.samples]
        ax.plot(values, speeds, ".", color=STABLE, ms=6, label="vehicles tried")
        if result.speed is not None:
            ax.plot(
                result.worst[parameter],
                result.speed,
                "o",
                color=UNSTABLE,
                mfc="white",
                mew=2,
                ms=9,
                label=f"worst: {result.speed:.1f} m/s",
            )
        ax.set_xlabel(parameter.replace("_", " "))
        ax.set_ylabel("stable up to (m/s)")
        ax.set_ylim(0.0, None)
        ax.set_title("Vehicles of the box; speeds beyond the worst are not followed far")
        ax.legend(loc="best")
        return drawn_on(ax)
