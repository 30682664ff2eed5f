"""Train every learning method on one problem: ``python -m benchmarks.methods.run``.

The problem is bogie-secondary-v1: one damper for all conicities and creep factors of service. Every
method has the same sensors and actuator, five seeds, and about the same time of one processor. Writes
docs/methods.json after every run and leaves out runs that are there already, so that it can be
interrupted and goes on where it was. ``docs/make_methods.py`` makes table and picture of it.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

import agents
import design
from agents import problems
from agents.controllers.scheduled import CONTROL_PERIOD
from agents.controllers.service import CONICITY, CREEP_FACTOR
from railenv import checks
from railenv.files import write_whole

OUT = Path(__file__).resolve().parents[2] / "docs" / "methods.json"
MODEL = agents.equipped(problems.problem("bogie-secondary-v1").model())
TASK = "railenv/BogieSensors-v1"
SPEEDS = (20.0, 127.0)
"""m/s, of the episodes: without control the worst vehicle has a mode of 20 Hz that grows from 128.7 m/s
on, and a moment on the frame hardly moves it."""

STEPS = {"ppo": 1_200_000, "sac": 220_000, "td3": 260_000}
EVALUATIONS = 20  # of the policy on the way
BOX = {"conicity": CONICITY, "creep_factor": CREEP_FACTOR}


@dataclass(frozen=True)
class Run:
    """A training run and what its policy reaches.

    Attributes
    ----------
    method : str
    seed : int
    steps : int
        Environment steps of the training.
    seconds : float
        Of the processor, on one thread, judging included.
    curve : list of (int, float)
        Steps and robust critical speed (m/s) of the policies judged, by vehicles of each method's own.
    robust, linear : float
        m/s: robust critical speed of the policy that is kept, searched over all vehicles, and its
        critical speed with the nominal vehicle.
    worst : dict
        The vehicle that sets the robust one.
    frequency : float or None
        Hz, of the mode that becomes unstable there.
    """

    method: str
    seed: int
    steps: int
    seconds: float
    curve: list[tuple[int, float]]
    robust: float
    linear: float
    worst: dict[str, float]
    frequency: float | None


@dataclass(frozen=True)
class _Trained:
    policy: agents.LearnedPolicy
    steps: int
    curve: list[tuple[int, float]]


def _through(seed: int) -> _Trained:
    done = agents.train_through(MODEL, seed=seed)
    return _Trained(
        done.policy, done.steps, [(int(steps), robust) for _, steps, robust in done.judged.tolist()]
    )


def _searched(seed: int) -> _Trained:
    base = agents.YawRateFeedback.design(MODEL, gain=5e4)
    done = agents.search_policy(MODEL, base, generations=36, judge_every=4, seed=seed)
    steps = round(done.episodes * agents.Lessons().duration / CONTROL_PERIOD)
    each = steps / len(done.mean)
    curve = [(round(turn * each), robust) for turn, robust, _ in done.judged.tolist()]
    return _Trained(done.policy, steps, curve)


def _by_returns(algorithm: str) -> Callable[[int], _Trained]:
    def trained(seed: int) -> _Trained:
        steps = STEPS[algorithm]
        changes = {
            "env_kwargs.vehicle": "HIGH_SPEED_COACH_HOLLOW",
            "env_kwargs.randomize": {name: list(ends) for name, ends in BOX.items()},
            "env_kwargs.speed_range": list(SPEEDS),
            "evaluation.every": steps // EVALUATIONS,
            "evaluation.criterion": "robust_critical_speed",
        }
        done = agents.train(algorithm, TASK, total_timesteps=steps, seed=seed, changes=changes)
        curve = [(e.timesteps, e.critical_speed) for e in done.evaluations]
        return _Trained(done.policy, int(done.last.about["timesteps"]), curve)

    return trained


METHODS: dict[str, Callable[[int], _Trained]] = {
    "through": _through,
    "ppo": _by_returns("ppo"),
    "sac": _by_returns("sac"),
    "td3": _by_returns("td3"),
    "search": _searched,
}


def trained(method: str, seed: int) -> Run:
    """Train with a seed, and measure."""
    start = time.process_time()
    done = METHODS[method](seed)
    seconds = time.process_time() - start
    found = design.robust_critical_speed(MODEL, done.policy, BOX)
    nominal = design.critical_speed(MODEL, controller=done.policy, speed_range=(20.0, 400.0))
    return Run(
        method=method,
        seed=seed,
        steps=done.steps,
        seconds=round(seconds, 1),
        curve=[(steps, round(robust, 2)) for steps, robust in done.curve],
        robust=round(found.speed or 0.0, 2),
        linear=round(nominal.speed or 0.0, 2),
        worst={name: round(value, 4) for name, value in found.worst.items()},
        frequency=None if found.result is None else found.result.frequency,
    )


def stored() -> list[dict[str, Any]]:
    """Return the runs that are there."""
    return json.loads(OUT.read_text(encoding="utf-8")) if OUT.is_file() else []


def _key(row: dict[str, Any]) -> tuple[int, int]:
    return list(METHODS).index(row["method"]), row["seed"]


def main(
    method: Annotated[
        list[str] | None, typer.Option(help="Of those compared; all if left out.")
    ] = None,
    seeds: Annotated[int, typer.Option(help="Number of seeds.")] = 5,
    again: Annotated[bool, typer.Option("--again", help="Run what is there already anew.")] = False,
) -> None:
    """Train what is missing."""
    checks.known("method", method or [], list(METHODS))
    console = Console(highlight=False, markup=False, soft_wrap=True)
    wanted = [(name, seed) for seed in range(seeds) for name in method or METHODS]
    kept = [row for row in stored() if not (again and (row["method"], row["seed"]) in wanted)]
    present = {(row["method"], row["seed"]) for row in kept}
    for name, seed in [run for run in wanted if run not in present]:
        run = trained(name, seed)
        kept = sorted([*kept, asdict(run)], key=_key)
        write_whole(OUT, "[\n" + ",\n".join(json.dumps(row) for row in kept) + "\n]\n")
        console.print(f"{name} seed {seed}: {run.robust} m/s, {run.steps} steps, {run.seconds} s")


if __name__ == "__main__":
    typer.run(main)
