"""``railenv tune``: controllers designed as the shipped ones."""

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
    kind: Annotated[str, typer.Argument(help="passive, yaw-rate, lqg, output-feedback, lqr, ...")],
    file: Annotated[Path, typer.Option("--out", help="File to write the controller to (npz).")],
    plant: ControlledVehicleOptions,
    changes: SetOption = None,
) -> None:
    """Design and tune a controller for a vehicle, as the shipped ones were for the coach."""
    _tune(kind, model_of(plant, changes), file, out)


def _tune(kind: str, model: Model, out: Path, console: Console) -> None:
    """Design a controller of a kind as the shipped one was, and write it."""
    import agents
    from agents.learning.designs import DESIGNS

    checks.known("kind of controller", [kind], list(DESIGNS))
    equipped = agents.equipped(model)
    with console.status(f"designing {kind} for {equipped.vehicle_name}"):
        controller = DESIGNS[kind](equipped)
    controller.save(out)
    console.print(f"wrote {out}", markup=False, highlight=False)
