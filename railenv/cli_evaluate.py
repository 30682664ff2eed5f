"""What ``railenv evaluate`` and ``railenv tune`` compute and show."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from railenv.errors import ParameterError
from railenv.models import Model

if TYPE_CHECKING:
    import agents


def controllers(names: Sequence[str]) -> dict[str, agents.Controller]:
    """Return controllers by what they are called: shipped ones by name, others by their file's name.

    Files of the same name in several folders go by their whole paths.

    Raises
    ------
    ParameterError
        If one is neither a shipped controller nor a file that holds one.
    """
    import agents

    found: dict[str, agents.Controller] = {}
    stems = [Path(name).stem for name in names]
    for name, stem in zip(names, stems, strict=True):
        if name in agents.shipped_names():
            found[name] = agents.shipped(name)
        elif Path(name).exists():
            found[stem if stems.count(stem) == 1 else name] = agents.load(name)
        else:
            raise ParameterError(
                f"controller {name!r} is neither a file nor shipped; shipped are "
                f"{', '.join(agents.shipped_names())}"
            )
    return found


def evaluate(
    names: Sequence[str], model: Model, *, quick: bool, store: Path | None, show_progress: bool
) -> list[agents.Evaluation]:
    """Evaluate controllers; finished ones are kept in ``store`` and taken from there."""
    import agents
    from agents.evaluation.evaluation import Plan, load_evaluations, save_evaluations

    plan = Plan.quick() if quick else Plan()
    equipped = agents.equipped(model)  # type: ignore[arg-type]  # raises for other models
    known = {}
    if store is not None and store.exists():
        same = [
            e
            for e in load_evaluations(store)
            if e.plan == plan and e.vehicle == equipped.plant.vehicle.name
        ]
        known = {e.controller: e for e in same}
    done: list[agents.Evaluation] = []
    for name, controller in controllers(names).items():
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


def tune(kind: str, model: Model, out: Path, console: Console) -> None:
    """Design a controller of a kind as the shipped one was, and write it."""
    import agents
    from agents.learning.designs import DESIGNS
    from railenv import checks

    checks.known("kind of controller", [kind], list(DESIGNS))
    equipped = agents.equipped(model)  # type: ignore[arg-type]
    with console.status(f"designing {kind} for {equipped.plant.vehicle.name}"):
        controller = DESIGNS[kind](equipped)
    controller.save(out)
    console.print(f"wrote {out}", markup=False, highlight=False)
