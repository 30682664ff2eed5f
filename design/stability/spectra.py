"""Eigenvalues of changing matrices, and their derivatives."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_WORTH_IT = 40  # number of states above which a search for parts saves time
_COUPLED = 4.0 * float(np.finfo(float).eps)  # of a balanced matrix's norm: smaller entries are rounding


class Spectrum(NamedTuple):
    """Eigenvalues of a real matrix, their derivatives, and right eigenvectors.

    Attributes
    ----------
    values, rates : ndarray of complex, shape (n,)
        In a pair, the eigenvalue in the upper half plane comes just before the other.
    packed : ndarray, shape (n, n)
        Vectors from LAPACK: for a pair, real and imaginary parts side by side.
    """

    values: Complex
    rates: Complex
    packed: Array

    def vector(self, k: int) -> Complex:
        """Return the right eigenvector of an eigenvalue."""
        side = int(np.sign(self.values[k].imag))
        if side == 0:
            return self.packed[:, k].astype(complex)
        first = k if side > 0 else k - 1
        return self.packed[:, first] + 1j * side * self.packed[:, first + 1]


class Spectra:
    """The computation of spectra of similar matrices.

    If some states do not move others, each part is solved separately. The parts are found at the first
    matrix, and again when they no longer hold; couplings below rounding error, which do not affect
    eigenvalues, are ignored.
    """

    def __init__(self) -> None:
        self._parts: list[Any] = []
        self._apart: NDArray[np.bool_] | None = None

    def of(self, matrices: list[Array], changes: list[Array]) -> list[Spectrum]:
        """Return the spectra of matrices, and their changes with the matrices.

        The derivative of an eigenvalue is that of the matrix between its left and right eigenvectors.
        Where two eigenvalues meet it does not exist, and the result is any finite number.

        Raises
        ------
        numpy.linalg.LinAlgError
            If a matrix has entries that are not finite.
        """
        if not np.isfinite(matrices).all():
            raise np.linalg.LinAlgError("Array must not contain infs or NaNs")
        real, imaginary, left, right = (
            np.array(part) for part in zip(*map(self._decomposed, matrices), strict=True)
        )
        both = np.array((np.array(changes) @ right, right))
        moved, still = between(left, both, imaginary > 0.0)
        with np.errstate(all="ignore"):
            rates = moved / still
        rates[~np.isfinite(rates)] = 0.0
        return [*map(Spectrum, real + 1j * imaginary, rates, right)]

    def _decomposed(self, matrix: Array) -> tuple[Array, Array, Array, Array]:
        """Return the eigenvalues, real and imaginary, and packed left and right eigenvectors."""
        n = len(matrix)
        parts = self._parts_of(matrix) if n >= _WORTH_IT else []
        if len(parts) < 2:
            return _solved(matrix)
        real, imaginary, left, right = np.empty(n), np.empty(n), np.zeros((n, n)), np.zeros((n, n))
        last = 0
        for own, cells in parts:
            at = slice(last, last + len(own))
            real[at], imaginary[at], left[own, at], right[own, at] = _solved(matrix[cells])
            last = at.stop
        return real, imaginary, left, right

    def _parts_of(self, matrix: Array) -> list[Any]:
        """Return the states of each part, and the cells of the matrix between them."""
        balanced, *_ = lapack.dgebal(matrix, scale=1, permute=0)
        size = np.abs(balanced)
        least = _COUPLED * float(np.sqrt(np.vdot(balanced, balanced)))
        if self._apart is None or bool((size[self._apart] > least).any()):
            from scipy.sparse.csgraph import connected_components

            count, label = connected_components(size > least, directed=False)
            self._apart = label[:, None] != label
            states = [np.flatnonzero(label == k) for k in range(count)]
            self._parts = [(own, np.ix_(own, own)) for own in states]
        return self._parts


def _solved(matrix: Array) -> tuple[Array, Array, Array, Array]:
    real, imaginary, left, right, info = lapack.dgeev(matrix)
    if info:
        raise np.linalg.LinAlgError("Eigenvalues did not converge")
    return real, imaginary, left, right


def between(left: Array, right: Array, first: NDArray[np.bool_]) -> Complex:
    """Return the products of conjugate left vectors with right ones, both packed as by LAPACK.

    With x + iy on the left and u + iv on the right they are x u + y v + i (x v - y u).

    Parameters
    ----------
    left, right : ndarray, shape (..., n, n)
    first : ndarray of bool, shape (..., n)
        Whether columns are the first of a pair.
    """
    along = (left * right).sum(axis=-2)
    across = left[..., :-1] * right[..., 1:]
    across -= left[..., 1:] * right[..., :-1]
    found = along.astype(complex)
    lead = first[..., :-1]
    pairs = along[..., :-1] + along[..., 1:] + 1j * across.sum(axis=-2)
    np.copyto(found[..., :-1], pairs, where=lead)
    np.copyto(found[..., 1:], pairs.conj(), where=lead)
    return found
