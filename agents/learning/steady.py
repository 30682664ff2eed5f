"""Policies that do not respond to steady readings: inputs with weights, and those that follow.

The steady part of a reading on a curve passes all its filters unchanged, and must cancel: the weight of
the slowest filter of a reading is minus the sum of its other weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from agents.controllers.memory import BY_SPEED, Memory

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cancelled:
    """Inputs of a policy in which steady readings cancel.

    Attributes
    ----------
    free : ndarray of int
        Inputs with their own weights.
    matrix : ndarray, shape (n_inputs, free)
        Matrix from the inputs to the values that those weights multiply.
    """

    free: NDArray[np.intp]
    matrix: Array


def cancelled(memory: Memory, *, even: bool = False, commands: bool = True, told: int = 0) -> Cancelled:
    """Return the inputs of a policy with weights, such that steady readings cancel.

    Parameters
    ----------
    memory : Memory
    even : bool
        Whether inputs unchanged by the mirror, such as the speed, are read too.
    commands : bool
        Whether the policy's own commands are read.
    told : int
        Number of inputs after those of readings and memory, which are all read.
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
            if own:  # the slowest filter cancels the steady part of the others
                matrix[own[0], [direct, *own[1:]]] = -1.0
    free = np.concatenate([np.flatnonzero(used), len(used) + np.arange(told)])
    return Cancelled(free, block_diag(matrix, np.eye(told))[:, free])
