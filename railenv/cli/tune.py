"""``railenv tune``: controllers designed as the shipped ones were."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from railenv import checks
from railenv.cli.common import model_of, out
from railenv.cli.options import ControlledVehicleOptions, SetOption, with_groups
from railenv.models import Model


@with_groups
def tune(
    *,
    kind: Annotated[str, typer.Argument(help="passive, yaw-rate, lqg, h-infinity, lqr, ...")],
    file: Annotated[Path, typer.Option("--out", help="File to write the controller to (npz).")],
    problem: Annotated[
        str | None, typer.Option(help="Problem of railenv evaluate, in place of a vehicle.")
    ] = None,
    plant: ControlledVehicleOptions,
    changes: SetOption = None,
) -> None:
    """Design and tune a controller for a vehicle or a problem, as the shipped ones were."""
    if problem is None:
        _tune(kind, None, model_of(plant, changes), file, out)
    else:
        from agents import problems

        _tune(kind, problem, problems.problem(problem).model(), file, out)


def _tune(kind: str, problem: str | None, model: Model, out: Path, console: Console) -> None:
    """Design a controller of a kind as the shipped one was, and write it."""
    import agents
    from agents.learning.designs import DESIGNS, PROBLEM_DESIGNS

    designs = DESIGNS if problem is None else PROBLEM_DESIGNS.get(problem, {})
    checks.known("kind of controller", [kind], list(designs))
    equipped = agents.equipped(model)
    with console.status(f"designing {kind} for {problem or equipped.vehicle_name}"):
        controller = designs[kind](equipped)
    controller.save(out)
    console.print(f"wrote {out}", markup=False, highlight=False)
