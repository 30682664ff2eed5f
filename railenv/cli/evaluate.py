"""``railenv evaluate``: how fast a vehicle runs with each controller."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from railenv.cli.common import model_of, out, print_json, save
from railenv.cli.controllers import controllers as controllers_named
from railenv.cli.options import ControlledVehicleOptions, JsonOption, PlotOption, SetOption, with_groups
from railenv.models import Model

if TYPE_CHECKING:
    import agents


@with_groups
def evaluate(
    *,
    controllers: Annotated[
        list[str] | None,
        typer.Argument(help="Shipped controllers or files; all shipped ones when left out."),
    ] = None,
    plant: ControlledVehicleOptions,
    changes: SetOption = None,
    problem: Annotated[
        str | None, typer.Option(help="Rate on a problem, by name, beside its passive dampers.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Tangent track and one curve only.")] = False,
    store: Annotated[
        Path | None,
        typer.Option(help="JSON file that keeps evaluations; finished ones are read from it."),
    ] = None,
    leaderboard: Annotated[bool, typer.Option("--leaderboard", help="Print a Markdown table.")] = False,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how fast a vehicle runs with each controller: linear, nonlinear, robust, on curves.

    With --problem the vehicle is that of the problem, and controllers are rated on everything it asks
    for, beside the vehicle without yaw dampers and with its best passive ones.
    """
    import agents

    if problem is not None:
        _rate(problem, controllers, leaderboard=leaderboard, plot=plot, as_json=as_json)
        return
    names = controllers or agents.shipped_names()
    built = model_of(plant, changes)
    quiet = as_json or leaderboard
    done = evaluated(names, built, quick=quick, store=store, show_progress=not quiet)
    if as_json:
        print_json([evaluation.summary() for evaluation in done])
    elif leaderboard:
        from agents.evaluation.leaderboard import markdown

        print(markdown(done), end="")
    else:
        out.print(table(done))
    if plot:
        from agents.evaluation.evaluation_plots import plot_comparison
        from agents.evaluation.leaderboard import ordered

        save(plot_comparison(ordered(done)), plot, as_json)


def _rate(
    name: str, controllers: Sequence[str] | None, *, leaderboard: bool, plot: Path | None, as_json: bool
) -> None:
    """Rate controllers on a problem, beside its passive references."""
    import agents
    from agents import problems
    from agents.problems.rating_plots import plot_ratings
    from agents.problems.table import COLUMNS, markdown, row

    todo = problems.problem(name)
    chosen = agents.shipped_names(name) if controllers is None else controllers
    loaded = controllers_named([kind for kind in chosen if kind != "passive"], name)
    done = []
    with Console(stderr=True).status("rating") as status:
        for damped in (False, True):
            status.update(f"rating the passive vehicle of {name}")
            done.append(problems.rate_passive(todo, damped=damped))
        for called, controller in loaded.items():
            status.update(f"rating {called} on {name}")
            done.append(problems.rate(controller, todo, name=called))
    if as_json:
        print_json([rating.summary() for rating in done])
    elif leaderboard:
        print(markdown(done), end="")
    else:
        shown = Table(title=f"{name}: {todo.asks}", padding=(0, 0))
        for title in ("", *(rating.controller for rating in done)):
            shown.add_column(title, justify="left" if not title else "right")
        for heading, *cells in zip(COLUMNS[1:], *(row(rating)[1:] for rating in done), strict=True):
            shown.add_row(heading, *cells)
        out.print(shown)
    if plot:
        save(plot_ratings(done), plot, as_json)


def evaluated(
    names: Sequence[str], model: Model, *, quick: bool, store: Path | None, show_progress: bool
) -> list[agents.Evaluation]:
    """Evaluate controllers; finished ones are kept in ``store`` and taken from there."""
    import agents
    from agents.evaluation.evaluation import Plan, load_evaluations, save_evaluations

    plan = Plan.quick() if quick else Plan()
    equipped = agents.equipped(model)
    known = {}
    if store is not None and store.exists():
        name = equipped.vehicle_name
        same = [e for e in load_evaluations(store) if e.plan == plan and e.vehicle == name]
        known = {e.controller: e for e in same}
    done: list[agents.Evaluation] = []
    for name, controller in controllers_named(names).items():
        kept = known.get(name)
        if kept is not None and dict(kept.about) == dict(getattr(controller, "about", {})):
            done.append(kept)
            continue
        done.append(agents.evaluate(controller, equipped, name=name, plan=plan, progress=show_progress))
        if store is not None:
            rest = [e for n, e in known.items() if n not in {d.controller for d in done}]
            save_evaluations([*done, *rest], store)
    return done


def table(evaluations: Sequence[agents.Evaluation]) -> Table:
    """Return the comparison as a table."""
    from agents.evaluation.leaderboard import columns, row

    shown = Table(title=f"{evaluations[0].vehicle}: critical speeds in m/s", padding=(0, 0))
    for title in columns(evaluations[0]):
        named = title == "controller"
        shown.add_column(title, justify="left" if named else "right", no_wrap=named)
    for evaluation in evaluations:
        shown.add_row(*row(evaluation))
    return shown
