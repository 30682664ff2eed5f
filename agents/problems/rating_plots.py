"""Drawings of ratings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import control
import matplotlib.pyplot as plt

from design.style import SERIES, STABLE, drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from agents.problems.rating import Rating


def plot_ratings(ratings: Sequence[Rating], ax: Axes | None = None) -> control.ControlPlot:
    """Draw for each controller the robust critical speed, and that of each vehicle."""
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(7.2, 1.4 + 0.42 * len(ratings)), layout="constrained")[1]
        rows = list(reversed(ratings))
        ax.barh(
            range(len(rows)),
            [rating.robust or 0.0 for rating in rows],
            height=0.5,
            color=SERIES[0],
            label="all vehicles stable",
        )
        for row, rating in enumerate(rows):
            speeds = [loss.speed or 0.0 for loss in rating.losses]
            label = "each vehicle tried" if row == 0 else None
            ax.plot(speeds, [row] * len(speeds), "|", color=STABLE, ms=11, mew=1.6, label=label)
        ax.set_yticks(range(len(rows)), [rating.controller for rating in rows])
        ax.set_ylim(-0.5 - 0.3 * len(rows) ** 0.5, len(rows) - 0.5)
        ax.set_xlim(0.0, 1.02 * max(rating.highest_speed for rating in ratings))
        ax.set_xlabel("linear critical speed (m/s)")
        ax.set_title(ratings[0].problem)
        ax.legend(loc="upper right")
        return drawn_on(ax)
