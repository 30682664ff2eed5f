"""Train the shipped recipes in the registered tasks: ``python -m benchmarks.baselines.run``.

Every run is a task, an algorithm and a seed, on one thread; as many go side by side as there are
processors. Writes docs/baselines.json after every run and leaves out runs that are there already, so
that it can be interrupted and goes on where it was. ``docs/make_baselines.py`` makes the page of it.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, get_args

import joblib
import typer
from rich.console import Console

import agents
from agents.evaluation.returns import episode_returns
from agents.learning.recipe import Algorithm
from benchmarks.tasks.classical import TEST, TEST_EPISODES
from railenv import checks
from railenv.files import write_whole
from railenv.tasks import TASKS
from railenv.threads import usable_threads

OUT = Path(__file__).resolve().parents[2] / "docs" / "baselines.json"


@dataclass(frozen=True)
class Run:
    """A training run and what its policy earns.

    Attributes
    ----------
    task, algorithm : str
    seed : int
    steps : int
        Environment steps of the training.
    seconds : float
        Of the processor, on one thread, evaluations included.
    curve : list of (int, float, float)
        Steps, mean return and linear critical speed (m/s) at the evaluations.
    chosen : int
        Steps after which the policy that is kept was.
    mean, derailed : float
        Mean return and share of derailments in the test episodes, those of docs/tasks.json.
    critical_speed : float
        m/s, of the policy that is kept.
    """

    task: str
    algorithm: str
    seed: int
    steps: int
    seconds: float
    curve: list[tuple[int, float, float]]
    chosen: int
    mean: float
    derailed: float
    critical_speed: float


def trained(task: str, algorithm: str, seed: int) -> Run:
    """Train and test."""
    start = time.process_time()
    done = agents.train(algorithm, task, seed=seed)
    seconds = time.process_time() - start
    found = episode_returns(task, done.policy, episodes=TEST_EPISODES, seed=TEST)
    return Run(
        task=task,
        algorithm=algorithm,
        seed=seed,
        steps=int(done.last.about["timesteps"]),
        seconds=round(seconds, 1),
        curve=[
            (e.timesteps, round(e.mean_return, 2), round(e.critical_speed, 2)) for e in done.evaluations
        ],
        chosen=int(done.policy.about["timesteps"]),
        mean=round(found.mean, 2),
        derailed=float(found.derailed.mean()),
        critical_speed=round(float(done.policy.about["critical_speed"]), 2),
    )


def stored() -> list[dict[str, Any]]:
    """Return the runs that are there."""
    return json.loads(OUT.read_text(encoding="utf-8")) if OUT.is_file() else []


def _key(row: dict[str, Any]) -> tuple[int, str, int]:
    return [task.id for task in TASKS].index(row["task"]), row["algorithm"], row["seed"]


def main(
    task: Annotated[list[str] | None, typer.Option(help="Ids; all tasks when left out.")] = None,
    algorithm: Annotated[list[str] | None, typer.Option(help="ppo, sac, td3, tqc.")] = None,
    seeds: Annotated[int, typer.Option(help="Number of seeds.")] = 5,
    again: Annotated[bool, typer.Option("--again", help="Run what is there already anew.")] = False,
) -> None:
    """Train what is missing."""
    ids, kinds = [t.id for t in TASKS], list(get_args(Algorithm))
    checks.known("task", task or [], ids)
    checks.known("algorithm", algorithm or [], kinds)
    console = Console(highlight=False, markup=False, soft_wrap=True)
    wanted = [(t, a, s) for t in task or ids for a in algorithm or kinds for s in range(seeds)]
    kept = [r for r in stored() if not (again and (r["task"], r["algorithm"], r["seed"]) in wanted)]
    present = {(row["task"], row["algorithm"], row["seed"]) for row in kept}
    missing = [run for run in wanted if run not in present]
    jobs = (joblib.delayed(trained)(*run) for run in missing)
    for run in joblib.Parallel(n_jobs=usable_threads(), return_as="generator_unordered")(jobs):
        kept.append(asdict(run))
        kept.sort(key=_key)
        rows = ",\n".join(json.dumps(row) for row in kept)
        write_whole(OUT, f"[\n{rows}\n]\n")
        console.print(
            f"{run.task} {run.algorithm} seed {run.seed}: return {run.mean}, "
            f"{run.critical_speed} m/s, {run.seconds} s"
        )


if __name__ == "__main__":
    typer.run(main)
