"""Scalars that are zero where a matrix is singular or a pair of its eigenvalues is critical.

Both are smooth even where eigenvalues are not, such as where two of them meet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SMALL = 1e-6  # of the largest magnitude: resolution of eigenvalues near zero
_REAL = 1e-9  # of the largest magnitude: imaginary parts below count as none


class NoPoint(Exception):
    """No point of a curve was found in a search."""


@dataclass(frozen=True)
class Bordered:
    """Solutions of a bordered matrix [[A, left], [right, 0]].

    Attributes
    ----------
    value : float
        Zero where A is singular.
    right, left : ndarray, shape (n,)
        Right and left null vectors of A there; the derivative of ``value`` is -left . dA . right.
    """

    value: float
    right: Array
    left: Array


def bordered(A: Array, left: Array, right: Array) -> Bordered:
    """Solve the bordered systems of a matrix.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    left, right : ndarray, shape (n,)
        Borders: vectors near the null vectors.
    """
    n = len(A)
    matrix = np.zeros((n + 1, n + 1))
    matrix[:n, :n], matrix[:n, n], matrix[n, :n] = A, left, right
    if not np.isfinite(matrix).all():
        raise NoPoint
    last = np.append(np.zeros(n), 1.0)
    try:
        found, transposed = np.linalg.solve(matrix, last), np.linalg.solve(matrix.T, last)
    except np.linalg.LinAlgError:
        raise NoPoint from None
    return Bordered(float(found[n]), found[:n], transposed[:n])


def null_vectors(A: Array) -> tuple[Array, Array]:
    """Return the left and right singular vectors of the smallest singular value."""
    u, _, vt = np.linalg.svd(A)
    return u[:, -1], vt[-1]


@dataclass(frozen=True)
class Pair:
    """Two eigenvalues of a matrix with their invariant subspace.

    Attributes
    ----------
    block : ndarray, shape (2, 2)
        The matrix within the subspace.
    right, left : ndarray, shape (n, 2)
        Bases of the right and the left subspace, ``left.T @ right`` being the identity.
    """

    block: Array
    right: Array
    left: Array

    @property
    def sum(self) -> float:
        """Sum of the two eigenvalues."""
        return float(np.trace(self.block))

    @property
    def product(self) -> float:
        """Product of the two eigenvalues."""
        return float(np.linalg.det(self.block))

    @property
    def eigenvalues(self) -> Complex:
        """The two eigenvalues."""
        return np.asarray(np.linalg.eigvals(self.block).astype(complex))

    def of_sum(self) -> Array:
        """Return vectors l_k so that the sum changes by the sum over k of l_k . dA . right_k."""
        return self.left

    def of_product(self) -> Array:
        """Return the same for the product."""
        (a, b), (c, d) = self.block
        return np.asarray(self.left @ np.array([[d, -c], [-b, a]]))


def pair_near(A: Array, total: float, product: float) -> Pair:
    """Return the pair of eigenvalues whose sum and product are nearest to given ones.

    Raises
    ------
    NoPoint
        If the pair cannot be distinguished from the others.
    """
    if not np.isfinite(A).all():
        raise NoPoint
    values = np.linalg.eigvals(A).astype(complex)
    chosen_two = _nearest_pair(values, total, product)
    two = values[chosen_two]
    apart = np.abs(np.delete(values, chosen_two)[:, None] - two).min(initial=np.inf)

    def chosen(v: complex) -> bool:
        return bool(np.abs(v - two).min() < 0.5 * apart)

    right, left = (_subspace(matrix, chosen) for matrix in (A, A.T))
    try:
        left = left @ np.linalg.inv(right.T @ left)
    except np.linalg.LinAlgError:
        raise NoPoint from None
    return Pair(left.T @ A @ right, right, left)


def _nearest_pair(values: Complex, total: float, product: float) -> list[int]:
    """Return the indices of the two eigenvalues, real or conjugate, nearest to a sum and a product."""
    real = np.abs(values.imag) <= _REAL * np.abs(values).max()
    couples = [list(c) for c in combinations(np.flatnonzero(real).tolist(), 2)]
    for i in np.flatnonzero(~real & (values.imag > 0.0)).tolist():
        couples.append([i, int(np.argmin(np.abs(values - values[i].conj())))])
    if not couples:
        raise NoPoint
    size = max(np.sqrt(abs(product)), abs(total), _SMALL * float(np.abs(values).max()), 1e-150)

    def distance(couple: list[int]) -> float:
        a, b = values[couple]
        return float(abs((a + b).real - total) / size + abs((a * b).real - product) / size**2)

    return min(couples, key=distance)


def _subspace(A: Array, chosen: Callable[[complex], bool]) -> Array:
    """Return an orthonormal real basis of the invariant subspace of two chosen eigenvalues."""
    try:
        _, vectors, count = linalg.schur(A, output="complex", sort=chosen)
    except linalg.LinAlgError:
        raise NoPoint from None
    if count != 2:
        raise NoPoint
    both = np.hstack([vectors[:, :2].real, vectors[:, :2].imag])
    return np.asarray(np.linalg.svd(both)[0][:, :2])
