"""Data sets of an environment for offline learning, in the format of Minari (extra ``offline``).

``python -m examples.offline_datasets`` writes four of them to ``datasets/``: random commands, a shipped
controller ("expert"), the same with a part of its command and noise ("mediocre"), and all three mixed.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import minari
import numpy as np

import agents
import railenv

ENV = {
    "speed_range": (100.0, 140.0),  # m/s; the bogie hunts from 114
    "tangent_share": 1.0,
    "history": 3,
    "duration": 4.0,
}
SHARE, NOISE = 0.3, 0.3  # of the mediocre policy, as shares of the limit

Policy = Callable[[np.ndarray, np.random.Generator], np.ndarray]
Loaded = agents.ScheduledController | agents.LearnedPolicy


@dataclass(frozen=True)
class Behaviour:
    """Who acts in some episodes: ``share`` of a controller's command, and noise.

    Without a controller the commands are random over their whole range.
    """

    name: str
    share: float = 0.0
    noise: float = 0.0


RANDOM, MEDIOCRE, EXPERT = (
    Behaviour("random"),
    Behaviour("mediocre", SHARE, NOISE),
    Behaviour("expert", 1.0),
)
DATASETS = {
    "random": (RANDOM,),
    "mediocre": (MEDIOCRE,),
    "expert": (EXPERT,),
    "mixed": (RANDOM, MEDIOCRE, EXPERT),
}


def controller_named(name: str) -> Loaded:
    """Return a shipped controller, or the one in a file."""
    return agents.load(name) if name.endswith(".npz") else agents.shipped(name)


def make_env(id: str, controller: Loaded) -> gymnasium.Env:
    """Return the environment with the observation and the period of a controller.

    Raises
    ------
    ValueError
        If the controller is for another vehicle.
    """
    kind = {"observation": controller.observation, "control_period": controller.period}
    env = gymnasium.make(id, **ENV, **kind)
    fleet = env.unwrapped.fleet
    there = tuple(fleet.observation_table), tuple(fleet.model.command_names)
    if there != (tuple(controller.readings), tuple(controller.commands)):
        raise ValueError(f"{controller.name} is for another vehicle than that of {id}")
    return env


def policy_of(behaviour: Behaviour, controller: Loaded) -> Policy:
    """Return how a behaviour acts; the controller reads the latest of the stacked observations."""
    width, count = len(controller.readings), len(controller.commands)

    def act(observation: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        if behaviour.share == 0.0:
            return rng.uniform(-1.0, 1.0, count)
        command = behaviour.share * controller.act(observation[:width])
        return np.clip(command + behaviour.noise * rng.standard_normal(count), -1.0, 1.0)

    return act


def record(
    env: gymnasium.Env, controller: Loaded, behaviours: Sequence[Behaviour], episodes: int, seed: int
) -> float:
    """Run episodes, the behaviours in turn, and return their mean return."""
    total = 0.0
    for k in range(episodes):
        act = policy_of(behaviours[k % len(behaviours)], controller)
        rng = np.random.default_rng((seed, k))
        observation, _ = env.reset(seed=seed + k)
        controller.reset()
        ended = False
        while not ended:
            action = act(observation, rng).astype(np.float32)
            observation, reward, terminated, truncated, _ = env.step(action)
            total += reward
            ended = terminated or truncated
    return total / episodes


def make_datasets(id: str, controller: Loaded, episodes: int, seed: int = 0) -> dict[str, float]:
    """Write the data sets to Minari's folder, and return the mean return of each.

    Their names are ``railenv/bogie/expert-v0`` and the like. All have the same episodes: track, speed
    and start depend on the seed alone. Data sets of the same names are replaced.
    """
    kind = id.rpartition("/")[2].rpartition("-")[0].lower()
    collectors = {
        name: minari.DataCollector(make_env(id, controller), record_infos=True) for name in DATASETS
    }
    returns = {
        name: record(collectors[name], controller, behaviours, episodes, seed)
        for name, behaviours in DATASETS.items()
    }
    for name, collector in collectors.items():
        full = f"railenv/{kind}/{name}-v0"
        if full in minari.list_local_datasets():
            minari.delete_dataset(full)
        collector.create_dataset(
            full,
            algorithm_name=f"{controller.name}: {', '.join(b.name for b in DATASETS[name])}",
            ref_min_score=returns["random"],
            ref_max_score=returns["expert"],
            description=f"{id}, {episodes} episodes; {', '.join(f'{k}={v}' for k, v in ENV.items())}",
            author="the railenv authors",
            requirements=[f"railenv=={railenv.__version__}"],
        )
        collector.close()
    return returns


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--id", default="railenv/Bogie-v1", help="of the environment")
    parser.add_argument("--controller", default="output-feedback", help="shipped one, or a file (.npz)")
    parser.add_argument("--episodes", type=int, default=60, help="of each data set")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("datasets"), help="folder")
    given = parser.parse_args()
    os.environ["MINARI_DATASETS_PATH"] = str(given.out.resolve())  # the only way to tell Minari
    returns = make_datasets(given.id, controller_named(given.controller), given.episodes, given.seed)
    for name, value in returns.items():
        print(f"{name:9s} mean return {value:7.1f}")


if __name__ == "__main__":
    main()
