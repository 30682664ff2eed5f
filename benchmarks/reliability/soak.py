"""Long runs of environments: memory must not grow, and nothing may fail."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

HOUR = 3600.0
"""s of running of each vehicle."""

VEHICLES = 16

_PERIOD = 0.005  # s
_SETTINGS: dict[str, Any] = {
    "observation": "sensors",
    "history": 2,
    "track": "curve",
    "irregularity": "low",
    "irregularity_factor": (0.0, 3.0),
    "randomize": {"conicity": (0.05, 0.3), "friction": (0.15, 0.5)},
    "speed_range": (40.0, 140.0),
    "duration": 20.0,
}
_MIB = 2.0**20
_SAMPLES = 20


@dataclass(frozen=True)
class Soak:
    """What a long run gave.

    Attributes
    ----------
    what : str
    simulated : float
        s of running, of all vehicles together.
    episodes, derailed : int
    first, settled, last, highest : float
        MiB of resident memory at the start, after a tenth of the run, at its end, and the highest
        after that tenth.
    processor : float
        s of processor time.
    """

    what: str
    simulated: float
    episodes: int
    derailed: int
    first: float
    settled: float
    last: float
    highest: float
    processor: float

    @property
    def growth(self) -> float:
        """MiB by which the memory grew after the first tenth."""
        return self.last - self.settled


def resident() -> float:
    """Return the resident memory of this process, MiB (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / _MIB


def single(duration: float) -> Soak:
    """Run one vehicle for a time (s), with random actions, from episode to episode."""
    env: Any = gymnasium.make("railenv/Bogie-v1", disable_env_checker=True, **_SETTINGS).unwrapped
    rng = np.random.default_rng(1)
    env.reset(seed=1)
    episodes = derailed = 0

    def advance() -> None:
        nonlocal episodes, derailed
        action = rng.uniform(-1.0, 1.0, 1).astype(np.float32)
        observation, reward, terminated, truncated, _ = env.step(action)
        if not (np.isfinite(reward) and np.isfinite(observation).all()):
            raise FloatingPointError(f"reward {reward}, observation {observation}")
        if terminated or truncated:
            episodes, derailed = episodes + 1, derailed + terminated
            env.reset()

    first, memory, processor = _watched(advance, round(duration / _PERIOD))
    return _soak("one environment", duration, (episodes, derailed), first, memory, processor)


def vector(duration: float) -> Soak:
    """Run several vehicles side by side for a time (s) each."""
    envs: Any = gymnasium.make_vec("railenv/Bogie-v1", num_envs=VEHICLES, **_SETTINGS)
    rng = np.random.default_rng(2)
    envs.reset(seed=2)
    episodes = derailed = 0

    def advance() -> None:
        nonlocal episodes, derailed
        action = rng.uniform(-1.0, 1.0, (VEHICLES, 1)).astype(np.float32)
        observations, rewards, terminated, truncated, _ = envs.step(action)
        if not (np.isfinite(rewards).all() and np.isfinite(observations).all()):
            raise FloatingPointError(f"rewards {rewards}, observations {observations}")
        episodes += int((terminated | truncated).sum())
        derailed += int(terminated.sum())

    first, memory, processor = _watched(advance, round(duration / _PERIOD))
    what = f"vector environment of {VEHICLES}"
    return _soak(what, VEHICLES * duration, (episodes, derailed), first, memory, processor)


def _watched(advance: Callable[[], None], steps: int) -> tuple[float, list[float], float]:
    """Advance so often; returns memory at the start and now and then, and processor time."""
    first, start = resident(), time.process_time()
    memory = []
    marks = set(np.linspace(steps // 10, steps, _SAMPLES).astype(int).tolist())
    for step in range(1, steps + 1):
        advance()
        if step in marks:
            memory.append(resident())
    return first, memory, time.process_time() - start


def _soak(
    what: str,
    simulated: float,
    counts: tuple[int, int],
    first: float,
    memory: list[float],
    processor: float,
) -> Soak:
    return Soak(what, simulated, *counts, first, memory[0], memory[-1], max(memory), processor)
