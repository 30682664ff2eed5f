"""Computations of the section on controllers: functions of plain inputs whose results are kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from agents.controllers.controller import equipped
from agents.controllers.files import ControllerFile
from agents.controllers.load import Loaded, controller_of
from agents.evaluation.diagram import closed_loop_diagram
from agents.evaluation.evaluating import evaluate
from agents.evaluation.evaluation import Plan
from agents.evaluation.growth import linear_growth_rates
from design.reproduction.cases import Case
from design.stability.critical_speed import critical_speed
from railenv import HIGH_SPEED_COACH_HOLLOW, Bogie

CASE = Case("bogie", HIGH_SPEED_COACH_HOLLOW)
"""The vehicle of the shipped controllers."""

SPEED_RANGE = (20.0, 400.0)
"""Range of the search for critical speeds of closed loops, m/s."""


def plain(controller: Loaded) -> dict[str, Any]:
    """Return a controller as plain data and arrays."""
    content = controller.to_file()
    return {"kind": content.kind, "header": content.header, "arrays": content.arrays}


def _made(name: str, content: Mapping[str, Any]) -> Loaded:
    return controller_of(ControllerFile(**content), f"the controller {name}")


def evaluation(
    model: Bogie, name: str, controller: Mapping[str, Any], plan: Mapping[str, Any]
) -> dict[str, Any]:
    """Evaluate a controller by a plan; return the summary of the evaluation."""
    found = evaluate(_made(name, controller), model, name=name, plan=Plan(**plan))
    return found.summary()


def diagram(
    model: Bogie,
    name: str,
    controller: Mapping[str, Any],
    speeds: Sequence[float],
    duration: float,
) -> dict[str, Any]:
    """Simulate the bifurcation diagram of a closed loop on tangent track."""
    made = _made(name, controller)
    found = closed_loop_diagram(made, model, speeds, name=name, duration=duration)
    return dict(vars(found))


def growth(
    model: Bogie, name: str, controller: Mapping[str, Any], speeds: Sequence[float]
) -> dict[str, Any]:
    """Find the growth rates of the least stable mode of the linear closed loop, in 1/s."""
    rates = linear_growth_rates(equipped(model), _made(name, controller), speeds)
    return {"speeds": list(speeds), "rates": rates}


def critical(model: Bogie, name: str, controller: Mapping[str, Any]) -> dict[str, float | None]:
    """Find the linear critical speed of the sampled closed loop on tangent track.

    Returns
    -------
    dict
        speed (m/s) and frequency (Hz) at which it loses stability, both None if it does not.
    """
    made = _made(name, controller)
    found = critical_speed(equipped(model), controller=made, speed_range=SPEED_RANGE)
    return {"speed": found.speed, "frequency": found.frequency}
