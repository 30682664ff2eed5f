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
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
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
    onsets,
    physics_areas,
    sensitivity,
    soak,
)
from benchmarks.reliability.fuzz import Area, Tally

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"
AREAS: tuple[Area, ...] = (*physics_areas.AREAS, *agent_areas.AREAS, *command_areas.AREAS)


@dataclass(frozen=True)
class Job:
    """Something to measure; ``run`` returns plain data."""

    part: str
    name: str
    run: Callable[[], dict[str, Any]]


_LENGTHS, _CHANGES = 10_000, 2000  # of damaged files: every length of small ones, random changes


def fuzzed(share: float, seed: int) -> Iterator[Job]:
    """Name every area, and run it over a share of its examples."""
    for area in AREAS:
        count = max(1, round(share * area.count))
        yield Job("fuzz", area.name, partial(_tallied, partial(fuzz.run, area, count, seed)))


def damages(share: float) -> Iterator[Job]:
    """Name every kind of file, and damage it."""
    lengths, changes = max(1, round(share * _LENGTHS)), max(1, round(share * _CHANGES))
    for kind in damage.kinds(DOCS / "leaderboard.json"):
        run = partial(damage.run, kind, lengths, changes)
        yield Job("damage", kind.name, partial(_tallied, run))


def measurements(share: float) -> Iterator[Job]:
    """Name every sensitivity and long run, and measure it."""
    for what, row in sensitivity.rows():
        yield Job("sensitivity", what, partial(_plain, row))
    for period in sensitivity.PERIODS:
        name = f"{1e3 * period:g} ms"
        yield Job("periods", name, partial(_plain, partial(sensitivity.period_row, period)))
    for name, soaked in (("one environment", soak.single), ("vector environment", soak.vector)):
        yield Job("soak", name, partial(_plain, partial(soaked, share * soak.HOUR)))


def hunting(share: float) -> Iterator[Job]:
    """Name every kind of contact, and judge nonlinear critical speeds of random vehicles with it."""
    count = max(1, round(share * onsets.VEHICLES / len(onsets.KINDS)))
    for kind in onsets.KINDS:
        yield Job("onsets", kind, partial(onsets.run, kind, count))


def _tallied(run: Callable[[], Tally]) -> dict[str, Any]:
    tally = run()
    return {"outcomes": dict(sorted(tally.outcomes.items())), "failures": tally.failures}


def _plain(measure: Callable[[], Any]) -> dict[str, Any]:
    return dataclasses.asdict(measure())


def main(
    out: Annotated[Path, typer.Option(help="File to write to.")] = DOCS / "reliability.json",
    share: Annotated[float, typer.Option(help="Share of examples and of the hour to run.")] = 1.0,
    seed: Annotated[int, typer.Option(help="Of the random examples.")] = 0,
    only: Annotated[
        list[str] | None,
        typer.Option(help="Measure only these, by part or name, and keep the rest of the file."),
    ] = None,
) -> None:
    """Fuzz, damage files, run for hours and measure sensitivities."""
    console = Console(highlight=False, markup=False, soft_wrap=True)
    warnings.simplefilter("ignore", hypothesis.errors.HypothesisWarning)
    kept = json.loads(out.read_text(encoding="utf-8"))["measured"] if only else []
    measured: list[dict[str, Any]] = []
    jobs = (*fuzzed(share, seed), *damages(share), *hunting(share), *measurements(share))
    for job in jobs:
        if only and not {job.part, job.name} & set(only):
            measured += [row for row in kept if (row["part"], row["name"]) == (job.part, job.name)]
            continue
        start = time.process_time()
        result = job.run()
        seconds = round(time.process_time() - start, 1)
        measured.append({"part": job.part, "name": job.name, "seconds": seconds, **result})
        console.print(str(measured[-1]))
    failures = sum(len(row.get("failures", ())) for row in measured)
    content = {"circumstances": _circumstances(), "measured": measured}
    out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    console.print(f"wrote {out}; {failures} failures")
    if failures:
        raise typer.Exit(1)


def _circumstances() -> dict[str, str]:
    return {
        "railenv": railenv.__version__,
        "Python": platform.python_version(),
        "NumPy": np.__version__,
        "Numba": numba.__version__,
        "hypothesis": hypothesis.__version__,
    }


if __name__ == "__main__":
    typer.run(main)
