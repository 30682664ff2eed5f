"""Passages of a branch of limit cycles between two of its motions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from design.cycles.cycle import Cycle, CycleBranch

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Passage:
    """A passage of a value by a branch, between two of its motions."""

    amplitudes: Array
    middle: Array
    period: float
    stable: bool


def middle(cycle: Cycle) -> Array:
    """Return the distance of the middle of each state's swing from zero."""
    return np.asarray(np.abs(cycle.states.max(axis=0) + cycle.states.min(axis=0)) / 2.0)


def passages(branch: CycleBranch, value: float) -> Iterator[Passage]:
    """Yield a branch's passages of a value, by linear interpolation; stable if either neighbour is."""
    values = branch.value
    for i in np.flatnonzero((values[:-1] - value) * (values[1:] - value) <= 0.0):
        p, q = branch.cycles[i], branch.cycles[i + 1]
        t = 0.5 if p.value == q.value else (value - p.value) / (q.value - p.value)
        yield Passage(
            (1.0 - t) * p.amplitudes + t * q.amplitudes,
            (1.0 - t) * middle(p) + t * middle(q),
            (1.0 - t) * p.period + t * q.period,
            p.stable or q.stable,
        )
