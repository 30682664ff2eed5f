"""How the package's results are drawn: one style, one meaning per colour and line."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import control
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

from railenv import checks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.critical_speed import CriticalSpeed
    from design.robust import RobustCriticalSpeed
    from design.sampled import ClosedLoop
    from design.sweep import CurveSweep

STABLE = "#1f6f8b"
UNSTABLE = "#c8432b"
NEUTRAL = "#9aa5ab"
SERIES = ("#1f6f8b", "#d98b1f", "#5b7f3a", "#8a4f7d")
"""Colours of things compared side by side."""

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
    """Draw in the package's style; other figures keep theirs."""
    with mpl.rc_context(_STYLE):
        yield


def _axes(ax: Axes | None, size: tuple[float, float] = (6.4, 4.4)) -> Axes:
    return plt.subplots(figsize=size)[1] if ax is None else ax


def _drawn(ax: Axes) -> control.ControlPlot:
    return control.ControlPlot(np.array(ax.lines, dtype=object), ax, ax.figure)


def _curve(radius: float, cant: float) -> str:
    if math.isinf(radius):
        return "tangent track"
    return f"R = {radius:g} m, cant {cant:g} rad"


def plot_mode(result: CriticalSpeed, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the critical mode: magnitude of each displacement, with its phase written above."""
    shape = result.mode_shape
    if shape is not None:
        return shape.bars(ax)
    with style():
        ax = _axes(ax)
        ax.text(0.5, 0.5, str(result), ha="center", transform=ax.transAxes)
        return _drawn(ax)


def plot_multipliers(loop: ClosedLoop, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the multipliers of a closed loop in the unit circle."""
    with style():
        ax = _axes(ax, (5.0, 5.0))
        angle = np.linspace(0.0, 2.0 * math.pi, 361)
        ax.plot(np.cos(angle), np.sin(angle), color="#333333", lw=1.0)
        values = loop.multipliers
        for chosen, color, label in (
            (np.abs(values) < 1.0, STABLE, "stable"),
            (np.abs(values) >= 1.0, UNSTABLE, "unstable"),
        ):
            if chosen.any():
                ax.plot(
                    values[chosen].real, values[chosen].imag, "x", color=color, mew=1.6, label=label
                )
        ax.set_aspect("equal")
        ax.set_xlabel("real part (1)")
        ax.set_ylabel("imaginary part (1)")
        ax.set_title(f"{loop.model_name}, {loop.speed:g} m/s, {_curve(loop.radius, loop.cant)}")
        ax.legend(loc="upper right")
        return _drawn(ax)


def plot_robust(
    result: RobustCriticalSpeed, parameter: str, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw the speeds up to which sampled vehicles are stable over one varied quantity."""
    checks.known("varied quantity", [parameter], list(result.box))
    with style():
        ax = _axes(ax)
        values = [vehicle[parameter] for vehicle, _ in result.samples]
        speeds = [speed for _, speed in result.samples]
        ax.plot(values, speeds, ".", color=STABLE, ms=6, label="vehicles looked at")
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
        return _drawn(ax)


RADIUS_TICKS = [100, 250, 500, 1000, 2500, 5000, 10000, 25000, 50000]
"""m, of logarithmic axes."""

LOSS_MARKERS = {
    "hunting": ("o", "hunting"),
    "divergence": ("^", "divergence"),
    "fold": ("s", "tread equilibrium ends in a fold"),
    "end": ("x", "equilibrium ends, a wheel lifts"),
    "none": ("2", "stable to the end of the range"),
}
"""Marker and legend of each way in which steady running ends."""


def plot_sweep(
    sweep: CurveSweep, ax: Axes | None = None, label: str | None = None, color: str | None = None
) -> control.ControlPlot:
    """Draw critical speed over radius; what ends steady running is told by the marker."""
    with style():
        ax = _axes(ax)
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
        return _drawn(ax)


def loss_handles(losses: Iterable[str]) -> list[Line2D]:
    """Return legend entries that explain the markers of the losses that occur."""
    present = set(losses)
    return [
        Line2D([], [], ls="", marker=marker, color="#333333", label=text, ms=5, mew=1.3)
        for loss, (marker, text) in LOSS_MARKERS.items()
        if loss in present
    ]


def plot_response(
    response: control.TimeResponseData, names: list[str], ax: Axes | None = None, **line: Any
) -> control.ControlPlot:
    """Draw some displacements of a simulation over time, in mm and mrad."""
    with style():
        ax = _axes(ax)
        for name in names:
            row = response.output_labels.index(name)
            ax.plot(response.time, 1e3 * response.outputs[row], label=name, **line)
        ax.set_xlabel("time (s)")
        if len(names) == 1:
            ax.set_ylabel(f"{names[0]} ({'mm' if names[0][0] in 'yz' else 'mrad'})")
        else:
            ax.set_ylabel("displacement (mm, mrad)")
            ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return _drawn(ax)
