"""Drawings of a critical speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import control

from design.style import axes_or_new, drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.stability.loss import CriticalSpeed


def plot_mode(result: CriticalSpeed, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the critical mode: magnitude of each displacement, with its phase written above."""
    shape = result.mode_shape
    if shape is not None:
        return shape.bars(ax)
    with style():
        ax = axes_or_new(ax)
        ax.text(0.5, 0.5, str(result), ha="center", transform=ax.transAxes)
        return drawn_on(ax)
