"""Timing on machines that are shared and noisy.

What is compared is timed in turns, so that a disturbance meets both sides alike.

- Short kernels are judged by their shortest time, in pieces of less than a millisecond, which end
  before the operating system gives the processor to another process.
- What takes milliseconds of one thread is judged by its shortest processor time, which leaves out
  the time that other processes have; the median of the elapsed time is shown beside it.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

Action = Callable[[], object]


class Times(NamedTuple):
    """Times of the repetitions of one action, s."""

    elapsed: list[float]
    processor: list[float]


class Timer:
    """Adds the time of calls of one action to its repetitions."""

    def __init__(self, action: Action) -> None:
        self.action = action
        self.times = Times([], [])

    def __call__(self) -> None:
        processor, start = time.process_time(), time.perf_counter()
        self.action()
        self.times.elapsed.append(time.perf_counter() - start)
        self.times.processor.append(time.process_time() - processor)


def repeated(action: Action, repetitions: int) -> Times:
    """Time one action, which has been called before."""
    timer = Timer(action)
    for _ in range(repetitions):
        timer()
    return timer.times


def interleaved(actions: Sequence[Action], repetitions: int) -> list[Times]:
    """Time actions in turns, after one call of each that is not timed."""
    for action in actions:
        action()
    timers = [Timer(action) for action in actions]
    for _ in range(repetitions):
        for timer in timers:
            timer()
    return [timer.times for timer in timers]


def shortest(actions: Sequence[Action], repetitions: int) -> list[float]:
    """Return the shortest elapsed time of each action, s."""
    return [min(times.elapsed) for times in interleaved(actions, repetitions)]


def processor_times(actions: Sequence[Action], repetitions: int) -> list[tuple[float, float]]:
    """Return the shortest processor time and the median elapsed time of each action, s."""
    return [
        (min(times.processor), statistics.median(times.elapsed))
        for times in interleaved(actions, repetitions)
    ]


def processor_share(duration: float = 0.3) -> float:
    """Share of one processor that a busy loop gets for a while (s): 1 on an idle machine."""
    processor, start = time.process_time(), time.perf_counter()
    while (elapsed := time.perf_counter() - start) < duration:
        pass
    return (time.process_time() - processor) / elapsed
