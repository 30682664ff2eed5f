"""Train through the simulator with some seeds: ``python -m benchmarks.through.run``.

The vehicle is that of the problem bogie-secondary-v1. Writes docs/through.json after every seed and
leaves out seeds that are there already, so that it can be interrupted and goes on where it was.
``docs/make_through.py`` makes table and picture of it.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

import agents
import design
from agents import problems
from agents.controllers.service import CONICITY, CREEP_FACTOR
from railenv.files import write_whole

OUT = Path(__file__).resolve().parents[2] / "docs" / "through.json"
ALGORITHM = "through the simulator"
_BOX = {"conicity": CONICITY, "creep_factor": CREEP_FACTOR}


@dataclass(frozen=True)
class Run:
    """A training run and what its policy reaches.

    Attributes
    ----------
    algorithm : str
    seed : int
    steps : int
        Environment steps of the training.
    seconds : float
        Of the processor, judging included.
    curve : list of (int, float)
        Steps and robust critical speed (m/s) of the policies judged.
    chosen : int
        Steps after which the policy that is kept was.
    robust, linear : float
        m/s: robust critical speed of the policy that is kept, searched with more vehicles, and its
        critical speed with the nominal vehicle.
    worst : dict
        The vehicle that sets the robust one.
    frequency : float or None
        Hz, of the mode that becomes unstable there.
    """

    algorithm: str
    seed: int
    steps: int
    seconds: float
    curve: list[tuple[int, float]]
    chosen: int
    robust: float
    linear: float
    worst: dict[str, float]
    frequency: float | None


def trained(seed: int) -> Run:
    """Train with a seed, and measure."""
    model = agents.equipped(problems.problem("bogie-secondary-v1").model())
    start = time.process_time()
    done = agents.train_through(model, seed=seed, progress=Console(stderr=True).is_terminal)
    seconds = time.process_time() - start
    found = design.robust_critical_speed(model, done.policy, _BOX)
    nominal = design.critical_speed(model, controller=done.policy, speed_range=(20.0, 400.0))
    best = int(done.judged[:, 2].argmax())
    return Run(
        algorithm=ALGORITHM,
        seed=seed,
        steps=done.steps,
        seconds=round(seconds, 1),
        curve=[(int(steps), round(robust, 2)) for _, steps, robust in done.judged.tolist()],
        chosen=int(done.judged[best, 1]),
        robust=round(found.speed or 0.0, 2),
        linear=round(nominal.speed or 0.0, 2),
        worst={name: round(value, 4) for name, value in found.worst.items()},
        frequency=None if found.result is None else found.result.frequency,
    )


def stored() -> list[dict[str, Any]]:
    """Return the runs that are there."""
    return json.loads(OUT.read_text(encoding="utf-8")) if OUT.is_file() else []


def main(
    seeds: Annotated[int, typer.Option(help="Number of seeds.")] = 5,
    again: Annotated[bool, typer.Option("--again", help="Run what is there already anew.")] = False,
) -> None:
    """Train what is missing."""
    console = Console(highlight=False, markup=False, soft_wrap=True)
    kept = [] if again else stored()
    for seed in sorted(set(range(seeds)) - {row["seed"] for row in kept}):
        run = trained(seed)
        kept = sorted([*kept, asdict(run)], key=lambda row: row["seed"])
        write_whole(OUT, "[\n" + ",\n".join(json.dumps(row) for row in kept) + "\n]\n")
        console.print(f"seed {seed}: {run.robust} m/s, {run.steps} steps, {run.seconds} s")


if __name__ == "__main__":
    typer.run(main)
