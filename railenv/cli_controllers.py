"""``railenv evaluate`` and ``railenv tune``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railenv.cli_common import model_of, out, print_json, save
from railenv.cli_options import (
    JsonOption,
    ModelOption,
    PlotOption,
    SetOption,
    VehicleOption,
)


def evaluate(
    controllers: Annotated[
        list[str] | None,
        typer.Argument(help="Shipped controllers or files; all shipped ones when left out."),
    ] = None,
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    changes: SetOption = None,
    quick: Annotated[bool, typer.Option("--quick", help="Tangent track and one curve only.")] = False,
    store: Annotated[
        Path | None, typer.Option(help="JSON file to keep evaluations in, and to go on from.")
    ] = None,
    leaderboard: Annotated[bool, typer.Option("--leaderboard", help="Print a Markdown table.")] = False,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how fast a vehicle runs with each controller: linear, nonlinear, robust, on curves."""
    import agents
    from railenv import cli_evaluate

    names = controllers or agents.shipped_names()
    built = model_of(model, vehicle, changes)
    quiet = as_json or leaderboard
    done = cli_evaluate.evaluate(names, built, quick=quick, store=store, show_progress=not quiet)
    if as_json:
        print_json([evaluation.summary() for evaluation in done])
    elif leaderboard:
        from agents.evaluation.leaderboard import markdown

        print(markdown(done), end="")
    else:
        out.print(cli_evaluate.table(done))
    if plot:
        from agents.evaluation.evaluation_plots import plot_comparison
        from agents.evaluation.leaderboard import ordered

        save(plot_comparison(ordered(done)), plot, as_json)


def tune(
    kind: Annotated[str, typer.Argument(help="passive, yaw-rate, lqg, output-feedback, lqr, ...")],
    file: Annotated[Path, typer.Option("--out", help="File to write the controller to (npz).")],
    vehicle: VehicleOption = "HIGH_SPEED_COACH",
    model: ModelOption = "bogie",
    changes: SetOption = None,
) -> None:
    """Design and tune a controller for a vehicle, as the shipped ones were for the coach."""
    from railenv import cli_evaluate

    cli_evaluate.tune(kind, model_of(model, vehicle, changes), file, out)
