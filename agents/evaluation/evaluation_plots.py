"""Drawings of controllers and their evaluations, in the style of :mod:`design.style`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import control
import matplotlib.pyplot as plt
import numpy as np

from agents.evaluation.colors import INK
from agents.evaluation.nonlinear import OFFSET
from design.style import SERIES, UNSTABLE, drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from agents.evaluation.evaluation import CurveResult, Evaluation

_READINGS = (
    ("linear", "linear (small motions)", SERIES[0]),
    ("nonlinear", f"nonlinear ({1e3 * OFFSET:g} mm offset, and ramp down)", SERIES[1]),
)
_MARKERS = ("o", "s", "D")


def plot_evaluation(evaluation: Evaluation, ax: Axes | None = None) -> control.ControlPlot:
    """Draw linear and nonlinear critical speeds of a controller on each curve."""
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(6.8, 4.2))[1]
        top = evaluation.plan.speed_range[1]
        names = [curve.name for curve in evaluation.curves]
        for k, (reading, label, color) in enumerate(_READINGS):
            values = [getattr(curve, reading) for curve in evaluation.curves]
            _bars(ax, values, 0.38, (k - 0.5) * 0.4, label, color, top)
        for i, curve in enumerate(evaluation.curves):
            if curve.deficiency_limit is not None:
                ax.plot([i - 0.42, i + 0.42], [curve.deficiency_limit] * 2, color=UNSTABLE, lw=1.2)
        ax.plot([], [], color=UNSTABLE, lw=1.2, label="cant deficiency 150 mm")
        _finish(ax, names, f"{evaluation.controller} on {evaluation.vehicle}", top)
        return drawn_on(ax)


def plot_comparison(
    evaluations: Sequence[Evaluation], curve: int = 0, ax: Axes | None = None
) -> control.ControlPlot:
    """Draw the critical speeds on a curve with several controllers; dotted: without control.

    Parameters
    ----------
    evaluations : sequence of Evaluation
        Evaluations from top to bottom; all of one plan.
    curve : int
        Index of the curve in the plan; the robust critical speed is only known on the first.
    ax : Axes, optional
    """
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(6.8, 1.9 + 0.38 * len(evaluations)))[1]
        plan = evaluations[0].plan
        rows = list(_READINGS)
        if curve == 0:
            rows.append(("robust", f"robust ({evaluations[0].robust_over})", SERIES[2]))
        place = evaluations[0].curves[curve]
        seen: list[float | None] = [place.deficiency_limit]
        for k, (reading, label, color) in enumerate(rows):
            values = {
                e.controller: getattr(e if reading == "robust" else e.curves[curve], reading)
                for e in evaluations
            }
            passive = values.get("passive")
            if passive is not None:
                ax.axvline(passive, color=color, lw=1.1, ls=":", zorder=1)
            shift = 0.22 * (k - 0.5 * (len(rows) - 1))
            _dots(ax, list(values.values()), shift, color, _MARKERS[k], plan.speed_range)
            ax.plot([], [], ls="", marker=_MARKERS[k], color=color, ms=6, label=label)
            seen += values.values()
        low, high = plan.speed_range
        top = max((v for v in seen if v is not None), default=high)
        plain: dict[str, Any] = {"ls": "", "color": INK, "ms": 6}
        if None in seen[1:]:
            ax.plot([], [], marker="x", mew=1.6, label=f"failed at {low:g} m/s already", **plain)
        if top >= high * (1.0 - 1e-9):
            ax.plot([], [], marker=">", mfc="white", label=f"beyond {high:g} m/s", **plain)
        ax.plot([], [], ls=":", color=INK, lw=1.1, label="without control")
        if place.deficiency_limit is not None:
            text = "cant deficiency 150 mm"
            ax.axvline(place.deficiency_limit, color=UNSTABLE, lw=1.2, ls="--", label=text)
        names = [e.controller + (" (state)" if e.observation == "state" else "") for e in evaluations]
        ax.set_yticks(range(len(names)), names)
        ax.set_ylim(len(names) - 0.5, -0.5)
        ax.grid(axis="y", visible=False)
        for k in range(1, len(names)):
            ax.axhline(k - 0.5, color="#e3e6e8", lw=0.8, zorder=0)
        ax.set_xlim(0.0, 1.05 * top)
        ax.set_xlabel("critical speed (m/s)")
        ax.set_title(f"{evaluations[0].vehicle}, {_where(place)}")
        ax.legend(loc="upper center", bbox_to_anchor=(0.4, -0.18), ncols=2)
        return drawn_on(ax)


def _where(curve: CurveResult) -> str:
    return "tangent track" if math.isinf(curve.radius) else f"{curve.name}, cant {curve.cant:g} rad"


def _dots(
    ax: Axes,
    values: Sequence[float | None],
    shift: float,
    color: str,
    marker: str,
    speed_range: tuple[float, float],
) -> None:
    """Draw a reading of several controllers, one below the other."""
    low, high = speed_range
    for row, value in enumerate(values):
        if value is None:
            ax.plot(low, row + shift, "x", color=color, mew=1.6, ms=6)
        elif value >= high * (1.0 - 1e-9):
            ax.plot(high, row + shift, ">", color=color, mfc="white", mew=1.4, ms=6)
        else:
            ax.plot(value, row + shift, marker, color=color, ms=6)


def _bars(
    ax: Axes,
    values: Sequence[float | None],
    width: float,
    shift: float,
    label: str,
    color: str,
    top: float,
) -> None:
    heights = [0.0 if v is None else v for v in values]
    x = np.arange(len(values)) + shift
    ax.bar(x, heights, width, color=color, label=label)
    for position, value in zip(x, values, strict=True):
        text = "failed" if value is None else (f">{top:g}" if value >= top else f"{value:.0f}")
        ax.annotate(
            text,
            (float(position), value or 0.0),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            fontsize=7.5,
            rotation=90 if value is None else 0,
        )


def _finish(ax: Axes, names: Sequence[str], title: str, top: float) -> None:
    ax.set_xticks(range(len(names)), names)
    ax.set_ylabel("critical speed (m/s)")
    ax.set_ylim(0.0, 1.12 * ax.get_ylim()[1])
    ax.grid(axis="x", visible=False)
    ax.set_title(title)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=1)
