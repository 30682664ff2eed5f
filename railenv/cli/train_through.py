"""``railenv train-through``: training policies by the gradient of rollouts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from railenv.cli.common import model_of, out, print_json, save
from railenv.cli.options import ControlledVehicleOptions, JsonOption, PlotOption, SetOption, with_groups


@with_groups
def train_through(
    *,
    file: Annotated[Path, typer.Option("--out", help="File to write the policy to (npz).")],
    evaluations: Annotated[int, typer.Option(help="Most runs of all exercises.")] = 300,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
    problem: Annotated[
        str | None, typer.Option(help="Problem of railenv evaluate, in place of a vehicle.")
    ] = None,
    identifier: Annotated[
        Path | None,
        typer.Option(help="Adaptive LQG (npz) whose estimates the policy is told, so that it adapts."),
    ] = None,
    plot: PlotOption = None,
    plant: ControlledVehicleOptions,
    changes: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Train a policy from random weights by the exact gradient of its rollouts."""
    import agents
    from agents import problems

    model = model_of(plant, changes) if problem is None else problems.problem(problem).model()
    bar = Console(stderr=True).is_terminal
    equipped = agents.equipped(model)
    told = None if identifier is None else agents.AdaptiveLQG.load(identifier)
    done = agents.train_through(
        equipped, identifier=told, evaluations=evaluations, seed=seed, progress=bar
    )
    done.policy.save(file)
    if plot is not None:
        save(done.plot(), plot, as_json)
    if as_json:
        found = {"file": str(file), "steps": done.steps, "judged": done.judged.tolist()}
        print_json(found)
        return
    out.print(str(done), highlight=False, soft_wrap=True)
    out.print(f"wrote {file}", markup=False, highlight=False, soft_wrap=True)
