"""Drawings of a table of modes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import control
import numpy as np

from design.style import NEUTRAL, SERIES, UNSTABLE, axes_or_new, drawn_on, style
from railenv.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.stability.mode_table import ModeTable

_HEIGHT, _REST = 0.26, 1.3  # inches of a figure: a mode, and the space around them


def plot_table(table: ModeTable, ax: Axes | None) -> control.ControlPlot:
    """Draw a bar for each mode, the slowest on top, with the share of each part of the vehicle."""
    if not len(table):
        raise ParameterError(f"{table.model_name} has no oscillating modes at {table.condition}")
    with style():
        own_figure = ax is None
        ax = axes_or_new(ax, (7.6, _REST + _HEIGHT * len(table)))
        rows, parts = table.rows(), table.parts
        height = np.arange(len(rows))
        left = np.zeros(len(rows))
        for part, color in zip(parts, (SERIES[0], SERIES[1], NEUTRAL, SERIES[3]), strict=False):
            share = np.array([row[part] for row in rows])
            ax.barh(height, share, left=left, color=color, height=0.72, label=part)
            left += share
        for y, row in zip(height, rows, strict=True):
            told = f"{row['frequency']:.2f} Hz, {row['damping']:+.3f}"
            color = UNSTABLE if row["damping"] < 0.0 else "#333333"
            ax.text(1.02, float(y), told, va="center", fontsize=8, color=color)
        ax.set_yticks(height, [row["mode"] for row in rows])
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.set_xlim(0.0, 1.0)
        ax.grid(axis="y", visible=False)
        ax.set_xlabel(f"share of {table.measure}; on the right: frequency, damping ratio")
        ax.set_title(f"{table.model_name}, {table.condition}")
        if own_figure and parts:
            ax.figure.legend(loc="outside lower center", ncols=len(parts))
        elif parts:
            ax.legend(loc="lower left")
        return drawn_on(ax)
