"""Learning: a million steps of PPO on the sensors, and the environment's share of the time.

Some rollouts of the shipped recipe are run, with resets and updates, and their time taken for a million
steps. Evaluations and checkpoints are left out.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import time
from collections.abc import Iterator
from typing import Any

from agents.learning.recipe import Evaluation, recipe
from benchmarks.table import Row, with_unit

ENVIRONMENT = "railenv/Bogie-v1"
ROLLOUTS = 8
LONGEST = 300.0  # s, for a million steps
LARGEST_SHARE = 0.25


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    if importlib.util.find_spec("stable_baselines3") is None:
        yield Row("a million steps of PPO", "stable-baselines3 is not installed", "", "")
        return
    from agents.learning.trainer import Trainer

    made = dataclasses.replace(
        recipe("ppo", ENVIRONMENT),
        evaluation=Evaluation(every=0, episodes=1),
        checkpoint_every=0,
    )
    trainer = Trainer(made, None, None)
    rollout = made.n_envs * made.hyperparameters["n_steps"]
    trainer.run(rollout, progress=False)  # compiles and warms up
    spent = _timed(trainer.env.hunting.vector_env)
    start = time.perf_counter()
    trainer.run((1 + ROLLOUTS) * rollout, progress=False)
    elapsed = time.perf_counter() - start
    million = elapsed * 1e6 / (ROLLOUTS * rollout)
    share = spent[0] / elapsed
    what = f"PPO on the sensors of {ENVIRONMENT}"
    yield Row(
        f"{what}, a million steps",
        million,
        "s",
        f"from {ROLLOUTS} rollouts of {rollout} steps",
        f"{made.n_envs} environments, the whole vehicle drawn anew in each episode; a step of one, "
        f"{with_unit(spent[0] / (ROLLOUTS * rollout), 'µs')}",
        required=f"at most {LONGEST:g} s",
        holds=million <= LONGEST,
    )
    yield Row(
        f"{what}, share of the environment",
        100.0 * share,
        "%",
        f"of {ROLLOUTS} rollouts with their updates",
        "steps and resets",
        required=f"at most {LARGEST_SHARE:.0%}",
        holds=share <= LARGEST_SHARE,
    )


def _timed(vector_env: Any) -> list[float]:
    """Measure the time that an environment's steps take, resets included."""
    spent, step = [0.0], vector_env.step

    def timed(actions: Any) -> Any:
        start = time.perf_counter()
        result = step(actions)
        spent[0] += time.perf_counter() - start
        return result

    vector_env.step = timed
    return spent
