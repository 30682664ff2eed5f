"""Policies that add nothing to steady readings: which inputs have weights, and which follow from them.

What a curve adds to a reading passes all its filters alike, and together they must not see it: the
weight of the slowest filter of a reading is minus the sum of its other weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.controllers.memory import BY_SPEED, Memory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cancelled:
    """Inputs of a policy in which steady readings cancel.

    Attributes
    ----------
    free : ndarray of int
        Inputs with weights of their own.
    matrix : ndarray, shape (n_inputs, free)
        Inputs times it are what those weights multiply.
    """

    free: NDArray[np.intp]
    matrix: Array


def cancelled(memory: Memory, *, even: bool = False, commands: bool = True) -> Cancelled:
    """Return which inputs of a policy have weights, and how steady readings cancel in them.

    Parameters
    ----------
    memory : Memory
    even : bool
        Whether what the mirror leaves as it is, such as the speed, is read too.
    commands : bool
        Whether the policy's own commands are read.
    """
    signs, width = memory.signs, len(memory.readings)
    names = [*(reading.name for reading in memory.readings), *memory.names]
    steady = np.array([reading.name == "cant_deficiency" for reading in memory.readings])
    used = (signs < 0.0) | even
    used[:width] &= ~steady  # steady on a curve, it must not command anything
    if not commands:
        used &= ~np.array([name.startswith(memory.commands) for name in names])
    matrix = np.diag(used.astype(float))
    for reading in (names[i] for i in memory.filtered):
        for end in ("", BY_SPEED) if memory.settings.schedule else ("",):
            own = [
                k
                for k, name in enumerate(names)
                if name.startswith(f"{reading} below") and name.endswith("Hz" + end)
            ]
            direct = names.index(reading + end)
            used[own[0] if own else direct] = False
            if own:  # the slowest filter takes out what the others have of a steady reading
                matrix[own[0], [direct, *own[1:]]] = -1.0
    free = np.flatnonzero(used)
    return Cancelled(free, matrix[:, free])
