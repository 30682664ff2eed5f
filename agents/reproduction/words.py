"""The words of the section on controllers about their evaluations."""

from __future__ import annotations

from collections.abc import Sequence

from agents.evaluation.evaluation import Evaluation, written
from agents.evaluation.leaderboard import push
from agents.evaluation.nonlinear import OFFSET
from agents.reproduction.computations import CASE
from railenv import Equipped

PASSIVE = "passive"
"""The vehicle alone, with which all others are compared."""

_READINGS = ("linear", "nonlinear", "robust")


def passive(found: Sequence[Evaluation]) -> Evaluation:
    """Return the evaluation of the vehicle alone."""
    return next(each for each in found if each.controller == PASSIVE)


def paragraphs(found: Sequence[Evaluation], vehicle: Equipped) -> list[str]:
    """Return the comparison, and the results of controllers that read sensors."""
    actuator = vehicle.actuator
    told = [
        f"The same questions about the {CASE.title}, now with an actuated yaw damper between "
        f"frame and body: at most {1e-3 * actuator.limit:g} kN m, a lag of {actuator.bandwidth:g} Hz "
        f"and a delay of {1e3 * actuator.delay:g} ms. The controllers are those that the package "
        "ships. The treads are hollow: the contact angle moves with the shift, the faster the higher "
        "the conicity is, as on wheels in service.",
        "Linear is the critical speed of the sampled closed loop. Nonlinear is the speed up to "
        f"which an offset of {1e3 * OFFSET:g} mm of all bodies dies out, or that at which established "
        "hunting stops when the vehicle slows down; the lower counts, and the linear one if it is "
        "lower still. Robust is the speed up to which the loop is stable with the wheels and rails of "
        f"service ({found[0].robust_over}).",
    ]
    measurable = [e for e in found if e.observation == "sensors" and e.controller != PASSIVE]
    if measurable:
        highest = "; ".join(_highest(measurable, reading) for reading in _READINGS)
        told.append(
            f"The highest of those that read only what a train can measure: {highest}. Without "
            f"control: {_own(found)}."
        )
    return told


def _highest(found: Sequence[Evaluation], reading: str) -> str:
    top = found[0].plan.speed_range[1]
    best = max(found, key=lambda e: getattr(e, reading) or 0.0)
    value = written(getattr(best, reading), top)
    # all that print the same, since smaller differences mean nothing
    names = [e.controller for e in found if written(getattr(e, reading), top) == value]
    return f"{reading} {value} m/s ({', '.join(names)})"


def _own(found: Sequence[Evaluation]) -> str:
    alone = passive(found)
    top = alone.plan.speed_range[1]
    return ", ".join(f"{r} {written(getattr(alone, r), top)} m/s" for r in _READINGS)


def caption_of_pushes(found: Sequence[Evaluation]) -> str:
    """Return the caption of the table of pushes."""
    return f"How far each controller moves the critical speeds, m/s. {_marks(found)}"


def caption_of_leaderboard(found: Sequence[Evaluation]) -> str:
    """Return the caption of the leaderboard."""
    return f"The critical speeds themselves, m/s. {_marks(found)}"


def _marks(found: Sequence[Evaluation]) -> str:
    low, high = found[0].plan.speed_range
    return (
        f"\u201cfailed\u201d: already at {low:g} m/s the loop is unstable, or hunting goes on; "
        f"\u201c>\u201d: stable up to {high:g} m/s, the highest speed tried."
    )


def push_columns(evaluation: Evaluation) -> tuple[str, ...]:
    """Return the headings of the table of pushes."""
    curves = (f"{curve.name}, linear / nonlinear" for curve in evaluation.curves[1:])
    return ("controller", "reads", "linear", "nonlinear", f"robust ({evaluation.robust_over})", *curves)


def pushes(found: Sequence[Evaluation]) -> list[tuple[str, ...]]:
    """Return the shifts of the critical speeds, a row for each controller but the passive one."""
    alone = passive(found)
    return [_pushes(each, alone) for each in found if each is not alone]


def _pushes(each: Evaluation, alone: Evaluation) -> tuple[str, ...]:
    top = each.plan.speed_range[1]
    curves = (
        f"{push(one.linear, without.linear, top)} / {push(one.nonlinear, without.nonlinear, top)}"
        for one, without in zip(each.curves[1:], alone.curves[1:], strict=True)
    )
    moved = (push(getattr(each, r), getattr(alone, r), top) for r in _READINGS)
    return (each.controller, each.observation, *moved, *curves)
