"""Search the readings of the print for the paper's speeds: ``python -m benchmarks.readings.run``.

Takes some minutes on two processors, prints its counts, and writes
``design/reproduction/data/readings.json``, of which the report makes a section.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console

from benchmarks.readings.axes import AXES, MODELS, Reading, model_of, readings
from benchmarks.readings.judged import DURATION, STEP, by_eigenvalues, by_simulation
from benchmarks.readings.letter import leaves_after
from design.reproduction import paper
from design.reproduction.readings import RESULTS, UNITS, results
from railenv import checks
from railenv.files import write_whole

Bools = NDArray[np.bool_]
Judge = Callable[..., tuple[Bools, Bools]]

BRACKETS = {"bogie": paper.BOGIE, "dual_wheelset": paper.DUAL_WHEELSET}
JUDGES: dict[str, Judge] = {"eigenvalues": by_eigenvalues, "simulation": by_simulation}


def search(judge: Judge, chosen: Sequence[Reading], console: Console) -> dict[str, Any]:
    """Count the readings of which a model, or both, are steady and hunt at the paper's speeds."""
    counts: dict[str, Any] = {"readings": len(chosen)}
    for unit, factor in UNITS.items():
        meets: dict[str, Bools] = {}
        for model in MODELS:
            meets[model] = bracket(judge, chosen, model, factor)
            console.print(f"  {unit}, {model}: {meets[model].sum()}")
        both = meets["bogie"] & meets["dual_wheelset"]
        counts[unit] = {**{m: int(found.sum()) for m, found in meets.items()}, "both": int(both.sum())}
        console.print(f"  {unit}, both: {both.sum()}")
    return counts


def bracket(judge: Judge, chosen: Sequence[Reading], model: str, factor: float) -> Bools:
    """Tell which readings of a model are steady at the paper's lower speed and hunt at the upper."""
    different = {reading.key(model): reading for reading in chosen}
    printed = BRACKETS[model]
    meets: set[tuple[object, ...]] = set()
    for contact in sorted({reading.contact for reading in chosen}):
        there = {k: r for k, r in different.items() if r.contact == contact}
        steady = judged(judge, there, model, printed.steady * factor)[0]
        left = {k: r for (k, r), still in zip(there.items(), steady, strict=True) if still}
        if left:
            hunts = judged(judge, left, model, printed.hunting * factor)[1]
            meets |= {k for k, does in zip(left, hunts, strict=True) if does}
    return np.array([reading.key(model) in meets for reading in chosen])


def judged(
    judge: Judge, some: dict[tuple[object, ...], Reading], model: str, speed: float
) -> tuple[Bools, Bools]:
    """Judge different readings of one contact at a speed on the curve of Figs 6 to 9."""
    models = [model_of(reading, model) for reading in some.values()]
    cant = [paper.CANT * reading.cant for reading in some.values()]
    return judge(models, speed, 1.0 / paper.RADIUS, cant)


def main(
    only: Annotated[
        list[str] | None, typer.Option(help="eigenvalues, simulation; both when left out.")
    ] = None,
) -> None:
    """Search by eigenvalues and by simulation, and write the counts after each."""
    checks.known("search", only or [], list(JUDGES))
    console = Console(highlight=False, soft_wrap=True)
    every = readings()
    found: dict[str, Any] = {
        "axes": {axis.words: [option.words for option in axis.options] for axis in AXES},
        "different": {model: len({r.key(model) for r in every}) for model in MODELS},
        "duration": DURATION,
        "step": STEP,
        "letter": leaves_after(),
    }
    console.print(f"to the letter, off the track after {found['letter']} s")
    for name in only or JUDGES:
        start = time.perf_counter()
        console.print(f"{len(every)} readings by {name}")
        counts = search(JUDGES[name], every, console)
        console.print(f"  {time.perf_counter() - start:.0f} s")
        kept = results()["searches"] if RESULTS.is_file() else {}
        kept[name] = counts
        found["searches"] = {key: kept[key] for key in JUDGES if key in kept}
        RESULTS.parent.mkdir(exist_ok=True)
        write_whole(RESULTS, json.dumps(found, indent=1) + "\n")
    console.print(f"wrote {RESULTS}")


if __name__ == "__main__":
    typer.run(main)
