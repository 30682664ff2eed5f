"""Drawings of loci: the plane of the eigenvalues, and damping ratio over the parameter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import control
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from design.style import NEUTRAL, STABLE, UNSTABLE, axes_or_new, drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.stability.locus import Locus

Array = NDArray[np.float64]

_DARK = "#333333"


def plot_locus(locus: Locus, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the loci from the lowest value to the highest, the least damped mode and critical points.

    Eigenvalues are shown in the upper half plane, around the least damped mode; a root locus in
    discrete time within its unit circle.
    """
    discrete = bool(locus.dt)
    with style():
        ax = axes_or_new(ax, (5.8, 5.8) if discrete else (6.8, 5.0))
        marked = locus.loci[:, locus.least_damped]
        for k in range(locus.loci.shape[1]):
            mode, chosen = locus.loci[:, k], k == locus.least_damped
            width, color = (2.4, STABLE) if chosen else (1.2, NEUTRAL)
            label = "least damped mode" if chosen else None
            ax.plot(mode.real, mode.imag, color=color, lw=width, label=label, zorder=2 + chosen)
            unstable = np.where(locus.growth[:, k] > 0.0, 1.0, np.nan)
            ax.plot(
                mode.real * unstable, mode.imag * unstable, color=UNSTABLE, lw=width, zorder=2 + chosen
            )
            if not chosen:
                ax.plot(mode.real[-1], mode.imag[-1], "o", color=NEUTRAL, ms=3)
        _round_values(locus, marked, ax)
        _open_loop(locus, ax)
        if discrete:
            _unit_circle(ax)
        else:
            _half_plane(locus, ax)
        _critical(locus, ax)
        name = f"{locus.sysname}, {locus.condition}" if locus.condition else str(locus.sysname)
        ax.set_title(
            f"{name}:\n{locus.parameter} {locus.written(locus.values[0])} to "
            f"{locus.written(locus.values[-1])}"
        )
        return drawn_on(ax)


def _round_values(locus: Locus, marked: NDArray[np.complex128], ax: Axes) -> None:
    """Write some four to eight round values of the parameter beside the least damped mode."""
    low, high = float(locus.values[0]), float(locus.values[-1])
    ticks = np.asarray(MaxNLocator(nbins=8, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    unit = f" {locus.unit}" if locus.unit not in ("", "1") else ""
    left, bottom = math.inf, math.inf  # a label is left out if it would lie on the previous one
    span = 2.0 if locus.dt else max(float(np.ptp(marked.real)), float(np.ptp(marked.imag)), 1e-300)
    for value in ticks[(ticks >= low) & (ticks <= high)]:
        x, y = (float(np.interp(value, locus.values, part)) for part in (marked.real, marked.imag))
        ax.plot(x, y, ".", color=_DARK, ms=4)
        if math.hypot(x - left, y - bottom) > 0.04 * span or left == math.inf:
            ax.annotate(
                f"{value:g}{unit}", (x, y), xytext=(6, -3), textcoords="offset points", fontsize=7.5
            )
            left, bottom = x, y


def _open_loop(locus: Locus, ax: Axes) -> None:
    """Mark poles and zeros of a root locus's open loop."""
    if locus.sys is None:
        return
    ax.plot(locus.poles.real, locus.poles.imag, "x", color=_DARK, ms=5, mew=1.2, label="open loop pole")
    if locus.zeros.size:
        zeros = locus.zeros
        ax.plot(zeros.real, zeros.imag, "o", color=_DARK, mfc="none", ms=5, mew=1.0, label="zero")


def _half_plane(locus: Locus, ax: Axes) -> None:
    ax.axvline(0.0, color=_DARK, lw=1.0)
    across, up = locus.window
    ax.set_xlim(across)
    ax.set_ylim(up)
    ax.set_xlabel("real part (1/s)")
    ax.set_ylabel("imaginary part (rad/s)")


def _unit_circle(ax: Axes) -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 361)
    ax.plot(np.cos(angle), np.sin(angle), color=_DARK, lw=1.0)
    ax.set_xlim(-1.15, 1.25)
    ax.set_ylim(-1.2, 1.2)
    ax.set_aspect("equal")
    ax.set_xlabel("real part (1)")
    ax.set_ylabel("imaginary part (1)")


def _critical(locus: Locus, ax: Axes) -> None:
    for point in locus.critical_points:
        at = np.exp(point.eigenvalue * (locus.period or 0.0)) if locus.dt else point.eigenvalue
        ax.plot(
            at.real,
            at.imag,
            "o",
            color=UNSTABLE if point.stability == "lost" else STABLE,
            ms=9,
            mfc="white",
            mew=2,
            label=critical_label(locus, point.value, point.stability),
        )
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)


def critical_label(locus: Locus, value: float, stability: str) -> str:
    """Return the legend of a critical point."""
    if locus.parameter == "speed" and stability == "lost":
        return f"critical speed {value:.1f} m/s"
    return f"stability {stability} at {locus.written(value)}"


def plot_damping(locus: Locus) -> control.ControlPlot:
    """Draw damping ratio and frequency over the parameter, critical points marked.

    Oscillating modes are shown up to some multiple of the frequency of the least damped one.
    """
    with style():
        figure, axes = plt.subplots(2, 1, figsize=(6.8, 6.0), sharex=True)
        upper, lower = axes
        k = locus.least_damped
        for column in locus.beside_least_damped:
            visible = np.where(locus.eigenvalues[:, column].imag > 0.0, 1.0, np.nan)
            for ax, data in ((upper, locus.damping), (lower, locus.frequency)):
                ax.plot(locus.values, data[:, column] * visible, color=NEUTRAL, lw=1.2)
        unstable = np.where(locus.growth[:, k] > 0.0, 1.0, np.nan)
        for ax, data in ((upper, locus.damping), (lower, locus.frequency)):
            ax.plot(locus.values, data[:, k], color=STABLE, lw=2.4, label="least damped mode")
            ax.plot(locus.values, data[:, k] * unstable, color=UNSTABLE, lw=2.4)
        for point in locus.critical_points:
            color = UNSTABLE if point.stability == "lost" else STABLE
            label = critical_label(locus, point.value, point.stability)
            upper.plot(point.value, 0.0, "o", color=color, ms=9, mfc="white", mew=2, label=label)
            lower.plot(point.value, point.frequency, "o", color=color, ms=9, mfc="white", mew=2)
        upper.axhline(0.0, color=_DARK, lw=1.0)
        upper.set_ylabel("damping ratio (1)")
        lower.set_ylabel("frequency (Hz)")
        lower.set_ylim(0.0, None)
        unit = f" ({locus.unit})" if locus.unit else ""
        lower.set_xlabel(f"{locus.parameter}{unit}")
        upper.set_title(f"{locus.sysname}, {locus.condition}" if locus.condition else locus.sysname)
        figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        lines = np.empty((2, 1), dtype=object)
        lines[:, 0] = [list(ax.lines) for ax in axes]
        return control.ControlPlot(lines, axes[:, None], figure)
