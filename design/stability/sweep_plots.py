"""Drawings of critical speeds over the curve radius."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING

import control
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from design.style import RADIUS_TICKS, SERIES, axes_or_new, drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.stability.sweep import CurveSweep

LOSS_MARKERS = {
    "hunting": ("o", "hunting"),
    "divergence": ("^", "divergence"),
    "fold": ("s", "tread equilibrium ends in a fold"),
    "end": ("x", "equilibrium ends, a wheel lifts"),
    "none": ("2", "stable to the end of the range"),
}
"""Marker and legend of each kind of end of steady running."""


def plot_sweep(
    sweep: CurveSweep, ax: Axes | None = None, label: str | None = None, color: str | None = None
) -> control.ControlPlot:
    """Draw critical speed over radius; markers show how steady running ends."""
    with style():
        ax = axes_or_new(ax)
        color = color or SERIES[0]
        losses = [r.loss for r in sweep.results]
        ax.plot([], [], color=color, label=label or sweep.model_name)
        for a, b in pairwise(range(len(losses))):
            if losses[a] == losses[b]:  # no line from one kind of loss to another
                ax.plot(sweep.radius[[a, b]], sweep.speed[[a, b]], color=color, lw=1.4)
        for loss, (marker, _) in LOSS_MARKERS.items():
            chosen = np.array([found == loss for found in losses])
            height = sweep.speed if loss != "none" else np.full(len(losses), sweep.highest_speed)
            ax.plot(sweep.radius[chosen], height[chosen], marker, color=color, ms=5, mew=1.3)
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(FixedLocator(RADIUS_TICKS))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(ScalarFormatter())
        ax.set_xlabel("curve radius (m)")
        ax.set_ylabel("critical speed (m/s)")
        ax.set_ylim(0.0, None, auto=True)
        ax.legend(handles=[*ax.get_legend_handles_labels()[0], *loss_handles(losses)])
        return drawn_on(ax)


def loss_handles(losses: Iterable[str]) -> list[Line2D]:
    """Return legend entries that explain the markers of the losses that occur."""
    present = set(losses)
    return [
        Line2D([], [], ls="", marker=marker, color="#333333", label=text, ms=5, mew=1.3)
        for loss, (marker, text) in LOSS_MARKERS.items()
        if loss in present
    ]
