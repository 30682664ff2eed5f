"""Threads: a vector environment on one and on two, on an idle machine and on a busy one.

Rates are of whole seconds, not of the shortest step: what a second thread costs on a busy machine is
waiting, which the shortest step does not show.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import gymnasium
import numpy as np

import railenv  # noqa: F401 - registers the environments
from benchmarks.table import Row, number

ENVIRONMENTS = 1024
STEPS, TURNS = 100, 25  # of one turn, some 0.1 s; turns of each number of threads
SMALLEST_GAIN = 1.0  # of a second thread, whatever else the machine does
_NAME = "railenv/Bogie-v1"
_BUSY = "while True: pass"


def rows() -> Iterator[Row]:
    """Measure everything of this module."""
    env: Any = gymnasium.make_vec(_NAME, ENVIRONMENTS, duration=1e6, speed_range=(60.0, 100.0))
    env.reset(seed=0)
    processors = os.cpu_count() or 1
    yield _row(env, "no other process of the benchmark")
    with _busy_processes(processors):
        yield _row(env, f"{processors} busy processes, as many as processors")


def _row(env: Any, beside: str) -> Row:
    one, two = (1e-6 * ENVIRONMENTS * STEPS / seconds for seconds in _turns(env, (1, 2)))
    return Row(
        f"vector environment of {_NAME}, {ENVIRONMENTS} environments, two threads, {beside}",
        two,
        "million steps/s",
        f"median of {TURNS} turns of {STEPS} steps",
        f"one thread, {number(one)}",
        two / one,
        f"at least {SMALLEST_GAIN:g}",
        two / one >= SMALLEST_GAIN,
    )


def _turns(env: Any, numbers: tuple[int, ...]) -> list[float]:
    """Return the median time of some steps for each number of threads, taken in turns, s."""
    actions = np.zeros(env.action_space.shape, env.action_space.dtype)
    times: dict[int, list[float]] = {n: [] for n in numbers}
    for _ in range(TURNS):
        for n in numbers:
            with threads(n):
                env.step(actions)
                start = time.perf_counter()
                for _ in range(STEPS):
                    env.step(actions)
                times[n].append(time.perf_counter() - start)
    return [statistics.median(times[n]) for n in numbers]


@contextmanager
def threads(n: int) -> Iterator[None]:
    """Let kernels use so many threads for a while."""
    name = "RAILENV_NUM_THREADS"
    before = os.environ.get(name)
    os.environ[name] = str(n)
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


@contextmanager
def _busy_processes(n: int) -> Iterator[None]:
    with ExitStack() as stack:
        for _ in range(n):
            process = subprocess.Popen([sys.executable, "-c", _BUSY])
            stack.callback(process.wait)
            stack.callback(process.kill)
        time.sleep(0.5)  # until they have started
        yield
