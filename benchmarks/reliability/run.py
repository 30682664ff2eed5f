"""Measure what docs/reliability.md says: ``python -m benchmarks.reliability.run``.

Writes docs/reliability.json, of which ``python docs/make_reliability.py`` makes the page.
Ends with status 1 if anything failed.
"""

from __future__ import annotations

import dataclasses
import json
import platform
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import hypothesis
import numba
import numpy as np
import typer
from rich.console import Console

import railenv
from benchmarks.reliability import (
    agent_areas,
    command_areas,
    damage,
    fuzz,
    physics_areas,
    sensitivity,
    soak,
)
from benchmarks.reliability.fuzz import Area, Tally

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
AREAS: tuple[Area, ...] = (*physics_areas.AREAS, *agent_areas.AREAS, *command_areas.AREAS)

_LENGTHS, _CHANGES = 10_000, 2000  # of damaged files: every length of small ones, random changes


def fuzzed(share: float) -> Iterator[tuple[str, Tally]]:
    """Run every area over a share of its examples."""
    for area in AREAS:
        yield area.name, fuzz.run(area, max(1, round(share * area.count)))


def damages(share: float) -> Iterator[tuple[str, Tally]]:
    """Damage every kind of file."""
    lengths, changes = max(1, round(share * _LENGTHS)), max(1, round(share * _CHANGES))
    for kind in damage.kinds(DOCS / "leaderboard.json"):
        yield kind.name, damage.run(kind, lengths, changes)


def main(
    out: Annotated[Path, typer.Option(help="File to write to.")] = DOCS / "reliability.json",
    share: Annotated[float, typer.Option(help="Share of examples and of the hour to run.")] = 1.0,
) -> None:
    """Fuzz, damage files, run for hours and measure sensitivities."""
    console = Console()
    warnings.simplefilter("ignore", hypothesis.errors.HypothesisWarning)
    failed = 0
    data: dict[str, Any] = {
        "circumstances": {
            "railenv": railenv.__version__,
            "Python": platform.python_version(),
            "NumPy": np.__version__,
            "Numba": numba.__version__,
            "hypothesis": hypothesis.__version__,
        }
    }
    for part, made in (("fuzz", fuzzed(share)), ("damage", damages(share))):
        rows = []
        start = time.process_time()
        for name, tally in made:
            console.print(f"{part}: {name}: {dict(tally.outcomes)}", highlight=False, markup=False)
            for where, example in tally.failures.items():
                console.print(f"  FAILED {where}: {example}", highlight=False, markup=False)
            failed += len(tally.failures)
            rows.append({"name": name, "outcomes": dict(sorted(tally.outcomes.items()))})
        data[part] = rows
        data[f"{part}_seconds"] = round(time.process_time() - start, 1)
    data["sensitivity"] = []
    measured = [*sensitivity.rows(), sensitivity.reference()] if share == 1.0 else []
    for row in measured:
        console.print(str(row), highlight=False)
        data["sensitivity"].append(dataclasses.asdict(row))
    data["periods"] = [dataclasses.asdict(row) for row in sensitivity.period_rows()]
    data["soak"] = []
    for run in (soak.single, soak.vector):
        found = run(share * soak.HOUR)
        console.print(str(found), highlight=False)
        data["soak"].append(dataclasses.asdict(found))
    out.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    console.print(f"wrote {out}; {failed} failures", highlight=False)
    if failed:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
