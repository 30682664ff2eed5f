"""What all programs are judged by: the same task, and the same 20 episodes of it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import railenv  # noqa: F401  (registers the environments)

ID = "railenv/Bogie-v1"
KEYWORDS: dict[str, Any] = {
    "observation": "sensors",
    "history": 3,
    "speed_range": (100.0, 140.0),  # m/s; the bogie hunts from 114
    "tangent_share": 1.0,
    "duration": 2.0,
    "control_period": 0.01,
}
EPISODES, FIRST_SEED = 20, 1000

Act = Callable[[np.ndarray], Any]


def mean_return(act: Act) -> float:
    """Return the mean return of a deterministic policy over the episodes."""
    env = gymnasium.make(ID, **KEYWORDS)
    total = 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + EPISODES):
        observation, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            action = np.asarray(act(observation), dtype=np.float32).reshape(env.action_space.shape)
            action = np.clip(action, env.action_space.low, env.action_space.high)
            observation, reward, terminated, truncated, _ = env.step(action)
            total += reward
            ended = terminated or truncated
    return total / EPISODES


class Clock:
    """Seconds since it was made."""

    def __init__(self) -> None:
        self._start = time.perf_counter()

    @property
    def seconds(self) -> float:
        return round(time.perf_counter() - self._start, 1)


def report(ran: str, **values: Any) -> None:
    """Print the result as the last line, for who runs the program."""
    if "before" in values:
        values["improved"] = bool(values["after"] > values["before"])
        values |= {name: round(float(values[name]), 1) for name in ("before", "after")}
    print("result: " + json.dumps({"ran": ran, **values}), flush=True)
