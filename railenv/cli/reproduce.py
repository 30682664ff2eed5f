"""``railenv reproduce``: the report of the reproduction."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from railenv.cli.common import err, out
from railenv.errors import ParameterError

_STYLES = {"agrees": "green", "differs": "red", "open": "dim"}
_MARKS = {"agrees": "+", "differs": "-", "open": "?"}


def reproduce(
    directory: Annotated[Path, typer.Option("--out", help="Directory to write to.")] = Path("results"),
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Coarse diagrams and limit cycles; controllers on tangent track only."
        ),
    ] = False,
    first_page: Annotated[
        bool,
        typer.Option("--first-page", help="Only the results that take seconds."),
    ] = False,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", min=1, help="Processes; by default one for each processor."),
    ] = None,
    fresh: Annotated[
        bool,
        typer.Option("--fresh", help="Compute everything again; otherwise earlier results are kept."),
    ] = False,
) -> None:
    """Show what the package does, and recompute every result of the paper beside its claims."""
    from design.reproduction import Interrupted

    try:
        run(directory, out, err, quick=quick, first=first_page, fresh=fresh, jobs=jobs)
    except Interrupted as stopped:
        err.print(str(stopped), highlight=False, soft_wrap=True)
        raise typer.Exit(130) from None


def run(
    directory: Path,
    console: Console,
    progress: Console,
    *,
    quick: bool,
    first: bool,
    fresh: bool,
    jobs: int | None,
) -> None:
    """Write the report, and print its first page."""
    import matplotlib as mpl

    mpl.use("Agg")
    from agents.evaluation.evaluation import Plan
    from agents.reproduction import HopfPush, Overview
    from design.reproduction import FULL, QUICK, first_page, reproduce, whole_report
    from design.reproduction.sections.claims import Claims
    from design.reproduction.sections.critical_speeds import CriticalSpeeds

    if first and quick:
        raise ParameterError("--first-page and --quick are both given; the first page has one form")
    settings = QUICK if quick else FULL
    if first:  # coarse limit cycles will do
        sections = first_page(settings, [Overview(QUICK)])
    else:
        plan = Plan()
        if quick:
            short = Plan.quick()
            plan = dataclasses.replace(short, curves=short.curves[:1], delays=())
        sections = whole_report(settings, [HopfPush(settings, plan)], [Overview(settings)])
    report = reproduce(
        sections,
        directory,
        note=_note(quick, first),
        fresh=fresh,
        jobs=jobs or processors(),
        console=progress,
    )
    for section in sections:
        if isinstance(section, Overview):
            show_overview(section, report.data, console)
        if isinstance(section, Claims):
            console.print(claims_table(section.claims(report.data)))
        if isinstance(section, CriticalSpeeds):
            console.print(speeds_table(section.rows(report.data)))
    counts = f"{report.computed} computations, {report.kept} kept from before"
    console.print(f"wrote {report.path} ({counts}), with figures and data beside it", highlight=False)


def processors() -> int:
    """Return the number of processors that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)  # not on every system
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def _note(quick: bool, first: bool) -> str:
    if first:
        return "First page only; railenv reproduce computes the whole report."
    if quick:
        return (
            "Quick form: coarse diagrams and limit cycles, controllers on tangent track only; railenv "
            "reproduce computes the whole report."
        )
    return "Whole report."


def show_overview(section: Any, data: Any, console: Console) -> None:
    """Print what the package does: a coach's critical speeds, with and without controllers."""
    from agents.reproduction.overview import CAPTION, HEADINGS

    console.rule(f"[bold]{section.title}")
    for sentence in section.sentences(data):
        console.print(sentence, highlight=False)
        console.print()
    table = Table(box=box.SIMPLE, padding=(0, 1), pad_edge=False, caption=CAPTION)
    for i, heading in enumerate(HEADINGS):
        table.add_column(heading, justify="right" if i > 1 else "left")
    for row in section.rows(data):
        table.add_row(*row)
    console.print(table)


def claims_table(claims: Sequence[Any]) -> Table:
    """Return the claims, without the reasons, for a terminal of 80 columns."""
    table = Table(
        title="What the paper claims, and what the equations give",
        box=box.SIMPLE,
        padding=(0, 1),
        pad_edge=False,
        caption="+ agrees, - differs, ? cannot be decided; the report says why",
    )
    table.add_column("claim", ratio=4)
    for name in claims[0].findings:
        table.add_column(name.replace("_PRINTED", "_\nPRINTED").replace("_SPEED", "_\nSPEED"), ratio=3)
    for claim in claims:
        cells = [
            f"[{_STYLES[f.verdict]}]{_MARKS[f.verdict]}[/] {f.text}" for f in claim.findings.values()
        ]
        table.add_row(f"{claim.short} [dim]({claim.source})[/]", *cells)
    return table


def speeds_table(rows: Sequence[Sequence[str]]) -> Table:
    """Return the critical speeds."""
    from design.reproduction.sections.critical_speeds import CAPTION, HEADINGS, TITLE

    table = Table(title=TITLE, box=box.SIMPLE, padding=(0, 1), pad_edge=False, caption=CAPTION)
    for i, heading in enumerate(HEADINGS):
        table.add_column(heading, justify="right" if i else "left", no_wrap=i > 0)
    for row in rows:
        table.add_row(*row)
    return table
