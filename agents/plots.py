"""How controllers and their evaluations are drawn, in the style of :mod:`design.plots`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import control
import matplotlib.pyplot as plt
import numpy as np

from agents.controller import Controller, equipped
from agents.nonlinear import OFFSET, Place, amplitudes
from agents.rollout import Case, Rollout
from design.plots import NEUTRAL, SERIES, STABLE, UNSTABLE, style
from railenv import Bogie, DualWheelset, Equipped

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from agents.evaluation import Evaluation

_READINGS = (
    ("linear", "linear (small motions)", SERIES[0]),
    ("nonlinear", "nonlinear (9 mm offset, and ramp down)", SERIES[1]),
)


def _drawn(ax: Axes) -> control.ControlPlot:
    return control.ControlPlot(np.array(ax.lines, dtype=object), ax, ax.figure)


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
        return _drawn(ax)


def plot_comparison(evaluations: Sequence[Evaluation], ax: Axes | None = None) -> control.ControlPlot:
    """Draw linear, nonlinear and robust critical speeds of several controllers side by side."""
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(1.6 + 1.15 * len(evaluations), 4.4))[1]
        top = evaluations[0].plan.speed_range[1]
        low, high = evaluations[0].plan.conicity
        rows = [*_READINGS, ("robust", f"robust (conicity {low:g} to {high:g})", SERIES[2])]
        for k, (reading, label, color) in enumerate(rows):
            values = [getattr(evaluation, reading) for evaluation in evaluations]
            _bars(ax, values, 0.26, (k - 1) * 0.28, label, color, top)
        names = [e.controller.replace(" ", "\n", 1) for e in evaluations]
        _finish(ax, names, f"Critical speeds of {evaluations[0].vehicle}, tangent track", top)
        return _drawn(ax)


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


def plot_histories(
    controllers: Mapping[str, Controller | None],
    model: Bogie | DualWheelset | Equipped,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    offset: float = OFFSET,
    duration: float = 5.0,
) -> control.ControlPlot:
    """Draw the motion of the leading wheelset and the moment, with each of some controllers.

    Parameters
    ----------
    controllers : mapping of str to (Controller or None)
        None is the vehicle alone.
    model : Bogie, DualWheelset or Equipped
    speed, radius, cant : float
        m/s, m, rad.
    offset : float
        m, lateral, of all bodies at the start.
    duration : float
        s.
    """
    vehicle = equipped(model)
    moment = next(name for name in vehicle.state_names if name.startswith("T_"))
    with style():
        figure, (above, below) = plt.subplots(2, 1, figsize=(7.0, 5.0), sharex=True)
        for k, (name, controller) in enumerate(controllers.items()):
            rollout = Rollout(vehicle, controller, [Case(speed, radius, cant, offset)])
            motion = rollout.run(duration, ("y_w1", moment))
            color = NEUTRAL if controller is None else SERIES[k % len(SERIES)]
            above.plot(motion.time, 1e3 * motion["y_w1"][:, 0], color=color, label=name, lw=1.4)
            limited = np.clip(motion[moment][:, 0], -vehicle.actuator.limit, vehicle.actuator.limit)
            below.plot(motion.time, 1e-3 * limited, color=color, lw=1.2)
        above.set_ylabel("y_w1 (mm)")
        below.set_ylabel("moment (kN m)")
        below.set_xlabel("time (s)")
        above.set_title(f"{vehicle.plant.vehicle.name} at {speed:g} m/s from {1e3 * offset:g} mm off")
        above.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes = np.array([above, below], dtype=object)
        return control.ControlPlot(np.array([*above.lines, *below.lines], dtype=object), axes, figure)


def plot_closed_loop_diagram(
    controller: Controller | None,
    model: Bogie | DualWheelset | Equipped,
    speeds: Sequence[float],
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    offsets: Sequence[float] = (1e-4, 2e-3, OFFSET),
    ax: Axes | None = None,
) -> control.ControlPlot:
    """Draw what lateral offsets of all bodies settle at, over speed: a simulated bifurcation diagram.

    Parameters
    ----------
    controller : Controller or None
    model : Bogie, DualWheelset or Equipped
    speeds : sequence of float
        m/s.
    radius, cant : float
        m, rad.
    offsets : sequence of float
        m, at the start.
    ax : Axes, optional
    """
    vehicle = equipped(model)
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(6.8, 4.2))[1]
        for offset, marker in zip(offsets, "o^s", strict=False):
            left = 1e3 * amplitudes(
                vehicle, controller, Place(radius, cant), list(speeds), offset=offset, duration=12.0
            )
            quiet = left < 1.0
            x = np.asarray(speeds)
            plain: dict[str, Any] = {"ls": "", "marker": marker, "ms": 4.5, "mfc": "white"}
            ax.plot(x[quiet], left[quiet], color=STABLE, **plain)
            ax.plot(x[~quiet], left[~quiet], color=UNSTABLE, **plain)
            ax.plot([], [], color="#333333", label=f"from {1e3 * offset:g} mm off", **plain)
        ax.set_ylim(-0.5, max(2.0, ax.get_ylim()[1]))
        ax.set_xlabel("speed (m/s)")
        ax.set_ylabel("amplitude of y_w1 after 12 s (mm)")
        ax.set_title("passive" if controller is None else controller.name)
        ax.legend(loc="upper left")
        return _drawn(ax)


def plot_damping(
    controllers: Mapping[str, Any],
    model: Bogie | DualWheelset | Equipped,
    speeds: Sequence[float],
    ax: Axes | None = None,
) -> control.ControlPlot:
    """Draw the growth rate of the least stable mode over speed, with each of some controllers."""
    import design

    vehicle = equipped(model)
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(6.8, 4.2))[1]
        for k, (name, controller) in enumerate(controllers.items()):
            locus = design.speed_locus(vehicle, speeds, controller=controller)
            worst = locus.loci.real.max(axis=1)
            color = NEUTRAL if controller is None else SERIES[k % len(SERIES)]
            ax.plot(locus.speeds, worst, color=color, label=name)
        ax.axhline(0.0, color="#333333", lw=1.0)
        ax.set_xlabel("speed (m/s)")
        ax.set_ylabel("growth rate of the least stable mode (1/s)")
        ax.set_title(vehicle.plant.vehicle.name)
        ax.legend(loc="best")
        return _drawn(ax)
