"""Rate passive vehicles and controllers on all problems: ``python -m benchmarks.problems.run``.

Writes docs/problems.json after every rating and leaves out what is there already, so that it can be
interrupted and goes on where it was. ``docs/make_problems.py`` makes the page of it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

import agents
import design
from agents.learning.designs import PROBLEM_DESIGNS
from agents.problems import PROBLEMS, Problem, Rating, rate, rate_passive
from railenv import checks
from railenv.files import write_whole

OUT = Path(__file__).resolve().parents[2] / "docs" / "problems.json"
PASSIVE = ("no yaw damper", "best passive damper")
BEYOND = 1.25
"""Times the robust critical speed of the best passive damper: where we look what can be held."""


def rated(problem: Problem) -> Mapping[str, Callable[[], Rating]]:
    """Return what makes each rating of a problem, by what it is called."""
    bare, damped = PASSIVE
    makers = {
        bare: partial(rate_passive, problem, damped=False, name=bare),
        damped: partial(rate_passive, problem, damped=True, name=damped),
    }
    for kind in PROBLEM_DESIGNS.get(problem.name, {}):
        if kind != "passive":
            makers[kind] = partial(_controlled, problem, kind)
    return makers


def _controlled(problem: Problem, kind: str) -> Rating:
    """Rate a controller: the shipped one, or else one that is designed now."""
    if kind in agents.shipped_names(problem.name):
        controller: agents.Controller = agents.shipped(kind, problem.name)
    else:
        controller = PROBLEM_DESIGNS[problem.name][kind](problem.model())
    return rate(controller, problem, name=kind)


def recoverable(problem: Problem, passive: float) -> list[dict[str, Any]]:
    """Return what actuators can bring back beyond the best passive damper, on worn wheels."""
    model = problem.model()
    ends = {name: limits[1] for name, limits in problem.ranges.items()}
    found = design.recoverable_amplitudes(model.replace(**ends), speed=BEYOND * passive)
    return [
        {"speed": BEYOND * passive, "vehicle": ends, "growth": m.growth, "frequency": m.frequency,
         "body": m.body, "amplitude": m.amplitude}
        for m in found
    ]  # fmt: skip


def stored() -> dict[str, Any]:
    """Return what is there: for each problem, ratings by name and what can be brought back."""
    return json.loads(OUT.read_text(encoding="utf-8")) if OUT.is_file() else {}


def main(
    problem: Annotated[
        list[str] | None, typer.Option(help="Names; all problems when left out.")
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Rate what is there already anew.")] = False,
) -> None:
    """Rate what is missing."""
    names = [p.name for p in PROBLEMS]
    checks.known("problem", problem or [], names)
    console = Console(highlight=False, markup=False, soft_wrap=True)
    kept = stored()
    for one in PROBLEMS:
        if problem and one.name not in problem:
            continue
        row = kept.setdefault(one.name, {"ratings": {}, "recoverable": []})
        for called, make in rated(one).items():
            if called in row["ratings"] and not again:
                continue
            found = make()
            row["ratings"][called] = found.summary()
            console.print(f"{found}")
            _write(kept, names)
        best = row["ratings"][PASSIVE[1]]["robust"]
        if best is not None and (again or not row["recoverable"]):
            row["recoverable"] = recoverable(one, best)
            _write(kept, names)


def _write(kept: dict[str, Any], names: list[str]) -> None:
    ordered = {name: kept[name] for name in names if name in kept}
    write_whole(OUT, json.dumps(ordered, indent=1) + "\n")


if __name__ == "__main__":
    typer.run(main)
