"""Stability maps in parallel: cost of a cell, a task and the start of workers; writes docs/scaling.md.

    python -m benchmarks.scaling [docs/scaling.md]

Processor times of cells are taken in the workers.
"""

from __future__ import annotations

import math
import os
import platform
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import joblib
import numpy as np
from joblib.externals.loky import get_reusable_executor

import design
import railenv
from benchmarks.table import Row, number, with_unit
from benchmarks.timing import processor_share
from design.cycles.places import Place
from design.studies.map_cells import Cell, CellFunction
from design.studies.store import Record

RADII = np.geomspace(500.0, 20_000.0, 40)  # m
CONICITIES = np.linspace(0.05, 0.4, 40)
CANT = 0.05  # rad
BATCH = 8  # cells in a task, as in stability_map
WORKERS = (1, 2)
MORE_WORKERS = (4, 16, 64, 256)
REPETITIONS = 5  # of the map without work
LIMIT = 30.0  # s


@dataclass(frozen=True)
class Timed:
    """Computes cells and notes the processor time and the process of each."""

    function: CellFunction

    def __call__(self, cells: Sequence[Cell]) -> list[Record]:
        records = []
        for cell in cells:
            start = time.process_time()
            [record] = self.function([cell])
            taken = time.process_time() - start
            records.append(record | {"processor": taken, "process": os.getpid()})
        return records


@dataclass(frozen=True)
class Measured:
    """A map at one number of workers; s."""

    workers: int
    start: float
    elapsed: float
    cell: float
    total: float
    task: float


@dataclass(frozen=True)
class Idle:
    """Carries what a task of a map carries, and does nothing."""

    function: CellFunction

    def __call__(self, cells: Sequence[Cell]) -> list[Record]:
        return [{"loss": "hunting", "critical_speed": 1.0, "frequency": 1.0, "note": ""} for _ in cells]


def measure(workers: int) -> Measured:
    """Time the start of workers, empty tasks and the map."""
    get_reusable_executor(max_workers=2).shutdown(wait=True)
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    function = CellFunction(
        Place(model, np.inf, CANT),
        ("radius", "conicity"),
        "critical_speed",
        None,
        (3.0, 400.0),
        None,
        None,
    )
    cells = [(r, c) for r in RADII.tolist() for c in CONICITIES.tolist()]
    timed = Timed(function)
    begin = time.perf_counter()
    design.run_study(timed, cells[:workers], n_jobs=workers)  # imports, loads kernels
    start = time.perf_counter() - begin
    batches = [list(range(k, k + BATCH)) for k in range(0, len(cells), BATCH)]
    begin = time.perf_counter()
    found = design.run_study(timed, cells, batches=batches, n_jobs=workers)
    elapsed = time.perf_counter() - begin
    times = [r["processor"] for r in found.records if r is not None]
    tasks = []
    for _ in range(REPETITIONS):
        begin = time.process_time()
        design.run_study(Idle(function), cells, batches=batches, n_jobs=workers)
        tasks.append((time.process_time() - begin) / len(batches))
    return Measured(workers, start, elapsed, statistics.median(times), sum(times), min(tasks))


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    found = measure(2)
    yield Row(
        f"map of critical speeds, {RADII.size} radii x {CONICITIES.size} conicities, 2 processes",
        found.elapsed,
        "s",
        "elapsed, once, workers started",
        f"{with_unit(found.total, 's')} of processors, {with_unit(found.cell, 'ms')} a cell; "
        f"{with_unit(found.start, 's')} to start",
        required=f"at most {LIMIT:g} s",
        holds=found.elapsed <= LIMIT,
    )
    yield Row(
        "handing a task to one of 2 processes and its results back",
        found.task * 1e3,
        "ms",
        f"shortest of {REPETITIONS} maps without work",
        f"{number(found.cell * BATCH / found.task)} times less than the task's {BATCH} cells",
    )


def extrapolated(found: Measured, workers: int) -> float:
    """Elapsed time (s) with more workers: of the one with most tasks, or of handing them all out."""
    tasks = RADII.size * CONICITIES.size // BATCH
    return max(math.ceil(tasks / workers) * found.total / tasks, tasks * found.task)


def page(measured: Sequence[Measured], share: float) -> str:
    """Return the page."""
    one, last = measured[0], measured[-1]
    tasks = RADII.size * CONICITIES.size // BATCH
    lines = [
        f"| {m.workers} | {number(m.start)} | {number(m.task * 1e3)} | {number(m.cell * 1e3)} | "
        f"{number(m.total)} | {number(m.elapsed)} | {number(one.elapsed / m.elapsed)} |"
        for m in measured
    ]
    more = [f"| {n} | {number(extrapolated(last, n))} |" for n in MORE_WORKERS]
    text = (Path(__file__).with_name("scaling.template.md")).read_text(encoding="utf-8")
    values = {
        "circumstances": f"Python {platform.python_version()}, joblib {joblib.__version__}, "
        f"{os.cpu_count()} processors, of one of which a busy loop got {share:.0%}",
        "measured": "\n".join(lines),
        "more": "\n".join(more),
        "batch": str(BATCH),
        "tasks": str(tasks),
        "task": number(last.task * 1e3),
        "busy": number(last.cell * BATCH * 1e3),
        "most": f"{last.cell * BATCH / last.task:.0f}",
        "overhead": f"{last.task / (last.cell * BATCH):.1%}",
    }
    for name, value in values.items():
        text = text.replace("{{" + name + "}}", value)
    return text


if __name__ == "__main__":
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/scaling.md")
    before = processor_share()
    results = [measure(n) for n in WORKERS]
    path.write_text(page(results, min(before, processor_share())), encoding="utf-8")
