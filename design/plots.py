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
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator, ScalarFormatter
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.critical_speed import CriticalSpeed
    from design.locus import SpeedLocus
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
    with style():
        ax = _axes(ax)
        if result.mode is None:
            ax.text(0.5, 0.5, str(result), ha="center", transform=ax.transAxes)
            return _drawn(ax)
        n = len(result.state_names) // 2
        shape = result.mode[:n]
        magnitude, phase = np.abs(shape), np.degrees(np.angle(shape))
        ax.bar(range(n), magnitude, color=STABLE, width=0.7)
        for i in np.flatnonzero(magnitude > 1e-3):
            ax.text(float(i), magnitude[i] + 0.02, f"{phase[i] + 0.0:.0f}°", ha="center", fontsize=8)
        ax.set_xticks(range(n), result.state_names[:n], rotation=45, ha="right")
        ax.set_ylim(0.0, 1.15)
        ax.set_ylabel("magnitude (m and rad, largest = 1)")
        ax.set_title(f"{result.model_name}: {result}")
        ax.grid(axis="x", visible=False)
        return _drawn(ax)


def plot_locus(locus: SpeedLocus, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the oscillating modes in the upper half plane, from the lowest speed to the highest."""
    with style():
        ax = _axes(ax, (6.8, 5.0))
        marked = locus.loci[:, locus.least_damped]
        for k in range(locus.loci.shape[1]):
            if k == locus.least_damped:
                continue
            mode = locus.loci[:, k]
            ax.plot(mode.real, mode.imag, color=NEUTRAL, lw=1.2)
            ax.plot(mode.real[-1], mode.imag[-1], "o", color=NEUTRAL, ms=3)
        ax.plot(marked.real, marked.imag, color=STABLE, lw=2.4, label="least damped mode")
        unstable = np.where(marked.real > 0.0, 1.0, np.nan)
        ax.plot(marked.real * unstable, marked.imag * unstable, color=UNSTABLE, lw=2.4)
        for v in _round_speeds(locus.speeds):
            x, y = (np.interp(v, locus.speeds, part) for part in (marked.real, marked.imag))
            ax.plot(x, y, ".", color="#333333", ms=4)
            ax.annotate(f"{v:g} m/s", (x, y), xytext=(6, -3), textcoords="offset points", fontsize=7.5)
        ax.axvline(0.0, color="#333333", lw=1.0)
        critical = locus.critical
        if critical.speed is not None and critical.eigenvalue is not None:
            ax.plot(
                critical.eigenvalue.real,
                critical.eigenvalue.imag,
                "o",
                color=UNSTABLE,
                ms=9,
                mfc="white",
                mew=2,
                label=f"critical speed {critical.speed:.1f} m/s",
            )
        top = 1.25 * float(marked.imag.max())
        left = 1.6 * min(float(marked.real.min()), -0.15 * top)
        ax.set_xlim(left, max(0.15 * top, 1.5 * float(marked.real.max())))
        ax.set_ylim(-0.03 * top, top)
        ax.set_xlabel("real part (1/s)")
        ax.set_ylabel("imaginary part (rad/s)")
        ax.set_title(
            f"{locus.sysname}, {_curve(locus.radius, locus.cant)}: "
            f"{locus.speeds[0]:g} to {locus.speeds[-1]:g} m/s"
        )
        ax.legend(loc="upper left")
        return _drawn(ax)


def _round_speeds(speeds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return some four to eight round speeds within a range."""
    ticks = MaxNLocator(nbins=8, steps=[1, 2, 2.5, 5, 10]).tick_values(speeds[0], speeds[-1])
    return ticks[(ticks >= speeds[0]) & (ticks <= speeds[-1])]


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
