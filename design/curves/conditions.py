"""The equation that makes a motion critical: a singular matrix, or a pair on its limit."""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from design.curves.bordering import Bordered, Pair, bordered, null_vectors, pair_near
from design.curves.motions import Local, Motion, Periodic, second

Array = NDArray[np.float64]


class Condition(Protocol):
    """A condition: a function that is zero along a curve."""

    def row(self, local: Local) -> tuple[float, Array]:
        """Return its value and its derivatives by all unknowns."""

    def settle(self, local: Local) -> None:
        """Refer it to a new motion."""


class Singular:
    """A real eigenvalue is critical: 0 of an equilibrium, 1 or -1 of a period.

    Parameters
    ----------
    motion : Motion
    multiplier : {1, -1}
        The critical multiplier of a periodic motion; an equilibrium needs 1.
    """

    def __init__(self, motion: Motion, multiplier: Literal[1, -1] = 1) -> None:
        self._motion = motion
        self._multiplier = multiplier
        self._borders: tuple[Array, Array] | None = None

    def matrix(self, local: Local) -> Array:
        """Return the matrix that is singular."""
        n = self._motion.n
        if not isinstance(self._motion, Periodic):
            return local.map[:, :n]
        moved = local.map[:, :n] - self._multiplier * np.eye(n)
        if self._multiplier < 0:
            return moved
        # with the period as an unknown and the phase held, only a fold is singular
        return np.block([[moved, local.map[:, n : n + 1]], [local.phase, 0.0]])

    def solved(self, local: Local) -> Bordered:
        """Return the null vectors, and the scalar that is zero where the matrix is singular."""
        A = self.matrix(local)
        left, right = self._borders or null_vectors(A)
        return bordered(A, left, right)

    def direction(self, right: Array) -> Array:
        """Return a right null vector as a direction of the inner unknowns."""
        return np.append(right, np.zeros(self._motion.inner - len(right)))

    def row(self, local: Local) -> tuple[float, Array]:
        """Return its value and its derivatives by all unknowns."""
        found = self.solved(local)
        bent = second(self._motion, local, self.direction(found.right))
        return found.value, -found.left[: self._motion.n] @ bent

    def settle(self, local: Local) -> None:
        """Border the matrix by its null vectors at a new motion."""
        found = self.solved(local)
        right, left = (v / np.linalg.norm(v) for v in (found.right, found.left))
        self._borders = left, right


class OnLimit:
    """A pair of eigenvalues is critical: on the imaginary axis, or on the unit circle.

    Its sum is zero for an equilibrium, its product 1 for a period. The same holds for two real ones
    beyond the point where the pair meets, without any singularity.

    Parameters
    ----------
    motion : Motion
    eigenvalue : complex
        One of the pair.
    """

    def __init__(self, motion: Motion, eigenvalue: complex) -> None:
        self._motion = motion
        self._near = 2.0 * eigenvalue.real, abs(eigenvalue) ** 2

    def pair(self, local: Local) -> Pair:
        """Return the pair."""
        return pair_near(local.map[:, : self._motion.n], *self._near)

    def row(self, local: Local) -> tuple[float, Array]:
        """Return its value and its derivatives by all unknowns."""
        pair = self.pair(local)
        if isinstance(self._motion, Periodic):
            value, left = pair.product - 1.0, pair.of_product()
        else:
            value, left = pair.sum, pair.of_sum()
        none = np.zeros(self._motion.inner - self._motion.n)
        bent = [second(self._motion, local, np.append(r, none)) for r in pair.right.T]
        return value, np.asarray(sum(l @ b for l, b in zip(left.T, bent, strict=True)))

    def settle(self, local: Local) -> None:
        """Refer to the pair of a new motion."""
        pair = self.pair(local)
        self._near = pair.sum, pair.product
