"""Drawings of a hunting map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from design.cycles.labels import PARAMETER_LABELS
from design.style import SERIES, STABLE, UNSTABLE, axes_or_new, drawn_on, style

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.cycles.hunting_map import HuntingMap


def plot_map(chart: HuntingMap, ax: Axes | None = None) -> control.ControlPlot:
    """Draw where a vehicle never hunts, may hunt and must hunt."""
    with style():
        ax = axes_or_new(ax, (6.8, 4.6))
        x, hopf, onset = chart.value, chart.hopf_speed, chart.onset_speed
        lower = np.fmin(onset, hopf)
        top = 1.12 * float(np.nanmax(hopf))
        bottom = 0.85 * float(np.nanmin(lower))
        ax.fill_between(x, bottom, lower, color=STABLE, alpha=0.16, lw=0, label="never hunts")
        ax.fill_between(x, lower, hopf, color=SERIES[1], alpha=0.28, lw=0, label="may hunt")
        ax.fill_between(x, hopf, top, color=UNSTABLE, alpha=0.20, lw=0, label="must hunt")
        ax.plot(x, hopf, "o-", color=UNSTABLE, ms=4, label="Hopf point")
        ax.plot(x, onset, "s-", color=STABLE, ms=4, label="nonlinear critical speed")
        ax.set_ylim(bottom, top)
        ax.set_xlim(float(x.min()), float(x.max()))
        ax.set_xlabel(PARAMETER_LABELS.get(chart.parameter, chart.parameter.replace("_", " ")))
        ax.set_ylabel("speed (m/s)")
        ax.set_title(f"{chart.model_name}: where it hunts")
        ax.legend(loc="best")
        return drawn_on(ax)
