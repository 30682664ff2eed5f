"""Style of the package's drawings: one style, one meaning per colour and line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import control
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes


STABLE = "#1f6f8b"
UNSTABLE = "#c8432b"
NEUTRAL = "#9aa5ab"
SERIES = ("#1f6f8b", "#d98b1f", "#5b7f3a", "#8a4f7d")
"""Colours for comparisons side by side."""

_STYLE: Any = {
    "axes.grid": True,
    "grid.color": "#e3e6e8",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#5c666b",
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.labelsize": 10,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "figure.dpi": 110,
    "savefig.dpi": 150,
    "figure.constrained_layout.use": True,
}


@contextmanager
def style() -> Iterator[None]:
    """Draw in the package's style; other figures keep their own."""
    with mpl.rc_context(_STYLE):
        yield


def axes_or_new(ax: Axes | None, size: tuple[float, float] = (6.4, 4.4)) -> Axes:
    """Return the given axes, or new ones in a new figure."""
    return plt.subplots(figsize=size)[1] if ax is None else ax


def drawn_on(ax: Axes) -> control.ControlPlot:
    """Return the drawing on some axes in python-control's form."""
    return control.ControlPlot(np.array(ax.lines, dtype=object), ax, ax.figure)


def curve_title(radius: float, cant: float) -> str:
    """Return the text of a curve for titles."""
    if math.isinf(radius):
        return "tangent track"
    return f"R = {radius:g} m, cant {cant:g} rad"


RADIUS_TICKS = [100, 250, 500, 1000, 2500, 5000, 10000, 25000, 50000]
"""Ticks of logarithmic axes, m."""
