"""Linear systems sampled along a line: their eigenvalues, and the rates at which these change.

The line is a branch of equilibria over speed. The rates are exact but for the derivative of the matrix
along the line, which is a difference over a tiny step: of a mode they are that derivative between its
left and right eigenvectors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from design.loop.dynamics import Dynamics
from railenv.equilibrium import Branch, Point, SpeedPath

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

ALIKE = 1e-6
"""Eigenvalues that differ by less than this fraction of the largest count as one."""

_TINY_STEP = 1e-4  # units of arclength, over which the matrix is differentiated
_FORGOTTEN = 1e-2  # multipliers smaller than this count as this: what a map forgets in a period
_ROUNDING = 1e-8  # of the largest eigenvalue: what its neighbours may be wrong by
_ZERO = 1e-9  # growth rates below this, times the root of the largest derivative, are rounding error


@dataclass(frozen=True)
class Sample:
    """Modes of a linear system at a point of the line.

    Attributes
    ----------
    point : Point
    values, rates : ndarray of complex, shape (n_modes,)
        Eigenvalues of the matrix (of a system in discrete time, multipliers), and their derivatives
        with respect to the arclength along the line.
    growth, growth_rates : ndarray, shape (n_modes,)
        Growth rates (1/s), and their derivatives.
    vectors : ndarray of complex, shape (n, n_modes)
    zero : float
        Growth rate (1/s) up to which a mode does not count as unstable, within rounding.
    rounding : float
        1/s, how wrong a growth rate may be.
    """

    point: Point
    values: Complex
    rates: Complex
    growth: Array
    growth_rates: Array
    vectors: Complex
    zero: float
    rounding: float

    @property
    def unstable(self) -> NDArray[np.bool_]:
        """Which modes grow."""
        return self.growth > self.zero

    @property
    def speed(self) -> float:
        """m/s."""
        return math.exp(self.point.s)


@dataclass(frozen=True)
class BranchLine:
    """A branch of equilibria over speed, sampled.

    Attributes
    ----------
    branch : Branch
    path : SpeedPath
    dynamics : Dynamics
    n_states : int
    speeds : list of float
        All speeds sampled so far, m/s.
    """

    branch: Branch
    path: SpeedPath
    dynamics: Dynamics
    n_states: int
    speeds: list[float] = field(default_factory=list)

    def sample(self, point: Point) -> Sample:
        """Return the modes at a point of the branch."""
        dynamics, path = self.dynamics, self.path
        matrix = dynamics.matrix_at(point, path.at(point.s))
        beyond = self.branch.ahead(point, _TINY_STEP)
        change = (dynamics.matrix_at(beyond, path.at(beyond.s)) - matrix) / _TINY_STEP
        values, rates, vectors = eigenvalues_with_rates(matrix, change)
        growth, growth_rates = self.growing(values, rates)
        self.speeds.append(math.exp(point.s))
        size = float(np.abs(point.jacobian[:, : self.n_states]).max())
        largest = float(np.abs(growth).max())
        return Sample(
            point, values, rates, growth, growth_rates, vectors,
            zero=_ZERO * max(size, 1.0) ** 0.5,
            rounding=_ROUNDING * largest,
        )  # fmt: skip

    def between(self, a: Sample, b: Sample, fraction: float) -> Sample:
        """Return the modes at a fraction of the way from a to b.

        Raises
        ------
        Stuck
            If there is no such point.
        """
        return self.sample(self.branch.between(a.point, b.point, fraction))

    def paces(self, a: Sample, b: Sample) -> tuple[float, float]:
        """Return the arclength per fraction of the way from a to b, at both."""
        return self.branch.paces(a.point, b.point)

    def growing(self, values: Complex, rates: Complex) -> tuple[Array, Array]:
        """Return the growth rates (1/s) of eigenvalues of the matrix, and how fast they change."""
        period = self.dynamics.period
        if period is None:
            return values.real, rates.real
        size = np.abs(values)
        held = np.maximum(size, _FORGOTTEN)
        change = np.where(size > _FORGOTTEN, (rates * values.conj()).real / held**2, 0.0)
        return np.log(held) / period, change / period


def eigenvalues_with_rates(matrix: Array, change: Array) -> tuple[Complex, Complex, Complex]:
    """Return a matrix's eigenvalues, their derivatives as it changes, and right eigenvectors.

    Of equal eigenvalues with eigenvectors of their own, whose vectors are any of a plane, the
    derivatives are those of the plane.
    """
    real, imaginary, left, right, info = lapack.dgeev(matrix)
    if info:
        raise np.linalg.LinAlgError("Eigenvalues did not converge")
    values = real + 1j * imaginary
    pairs = np.flatnonzero(imaginary > 0.0)
    v, w = (_unpacked(packed, pairs) for packed in (right, left))
    moved = change @ v
    across = np.einsum("ij,ij->j", w.conj(), v)
    with np.errstate(all="ignore"):
        rates = np.einsum("ij,ij->j", w.conj(), moved) / across
    for plane in _planes(values):
        projected = w[:, plane].conj().T
        rates[plane] = _of_plane(projected @ v[:, plane], projected @ moved[:, plane])
    return values, np.nan_to_num(rates, nan=0.0, posinf=0.0, neginf=0.0), v


def _unpacked(packed: Array, pairs: NDArray[np.intp]) -> Complex:
    """Return eigenvectors of LAPACK, which puts real and imaginary parts of pairs side by side."""
    vectors = packed.astype(complex)
    vectors[:, pairs] += 1j * packed[:, pairs + 1]
    vectors[:, pairs + 1] = vectors[:, pairs].conj()
    return vectors


def _planes(values: Complex) -> list[NDArray[np.intp]]:
    """Return groups of equal eigenvalues."""
    near = np.abs(values[:, None] - values) < ALIKE * float(np.abs(values).max(initial=1e-300))
    if int(near.sum()) == len(values):
        return []
    groups = {tuple(np.flatnonzero(row)) for row in near if row.sum() > 1}
    return [np.array(group) for group in groups]


def _of_plane(overlap: Complex, moved: Complex) -> Complex:
    try:
        return np.linalg.eigvals(np.linalg.solve(overlap, moved)).astype(complex)
    except np.linalg.LinAlgError:
        return np.zeros(len(overlap), dtype=complex)
