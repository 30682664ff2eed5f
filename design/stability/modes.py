"""Eigenvalues and eigenvectors at values of a parameter, followed from one value to the next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

_SHAPE_WEIGHT = 0.5  # weight of a change of mode shape against a relative change of eigenvalue


class Modes(NamedTuple):
    """Modes of a linear system.

    Attributes
    ----------
    eigenvalues : ndarray of complex, shape (n_modes,)
        1/s, also of a system in discrete time.
    vectors : ndarray of complex, shape (n_states, n_modes)
    state : ndarray, shape (n,)
        Equilibrium of the linearisation; empty if there is none.
    """

    eigenvalues: Complex
    vectors: Complex
    state: NDArray[np.float64]

    @property
    def growth(self) -> float:
        """Largest real part, 1/s."""
        return float(self.eigenvalues.real.max())

    @property
    def least_damped(self) -> int:
        """Column of the largest real part; for a complex pair, the one in the upper half plane."""
        upper = np.where(self.eigenvalues.imag >= 0.0, self.eigenvalues.real, -np.inf)
        return int(np.argmax(upper))

    def reordered(self, order: NDArray[np.intp]) -> Modes:
        """Return the modes in another order."""
        return Modes(self.eigenvalues[order], self.vectors[:, order], self.state)


def follow(modes: Sequence[Modes], period: float | None = None) -> list[Modes]:
    """Put modes in the order of the previous ones, by extrapolated eigenvalue and by shape.

    Parameters
    ----------
    modes : sequence of Modes
        Modes at neighbouring values of a parameter.
    period : float, optional
        Period (s) of a system in discrete time, where imaginary parts are equal modulo 2 pi / period.
    """
    from scipy.optimize import linear_sum_assignment

    followed = [modes[0]]
    before = np.zeros_like(modes[0].eigenvalues)  # the last change
    for found in modes[1:]:
        last = followed[-1]
        predicted = last.eigenvalues + before
        gap = _wrapped(found.eigenvalues - predicted[:, None], period)
        size = np.abs(predicted)[:, None] + np.abs(found.eigenvalues) + 1e-12
        likeness = np.abs(last.vectors.conj().T @ found.vectors)
        _, order = linear_sum_assignment(np.abs(gap) / size + _SHAPE_WEIGHT * (1.0 - likeness))
        followed.append(found.reordered(order))
        before = _wrapped(followed[-1].eigenvalues - last.eigenvalues, period)
    return followed


def _wrapped(change: Complex, period: float | None) -> Complex:
    """Return changes of eigenvalues with imaginary parts of at most pi / period."""
    if period is None:
        return change
    cycle = 2.0 * math.pi / period
    return change - 1j * cycle * np.round(change.imag / cycle)
