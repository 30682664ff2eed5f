"""Modes sampled along a branch of equilibria over speed, and the rates at which they change.

The rates are exact but for the derivative of the matrix along the branch, which is a difference over a
tiny step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from design.loop.dynamics import Dynamics
from design.stability.spectra import Complex, Spectra, Spectrum
from railenv.equilibrium import Branch, Point, SpeedPath

Array = NDArray[np.float64]

ALIKE = 1e-6
"""Eigenvalues that differ by less than this fraction of the largest count as one."""

_TINY_STEP = 1e-5  # units of arclength, over which the matrix is differentiated
_FORGOTTEN = 1e-2  # multipliers smaller than this count as this: what a map forgets in a period
_ZERO = 1e-9  # growth rates below this, times the root of the largest derivative, are rounding error
_ROUNDING = 1e-10  # of the largest derivative: what differences of growth rates may be wrong by


class Sample(NamedTuple):
    """Modes of a linear system at a point of the branch.

    Attributes
    ----------
    point : Point
    spectrum : Spectrum
        Of the matrix (of a system in discrete time, the eigenvalues are multipliers), with derivatives
        with respect to the arclength along the branch.
    growth, growth_rates : ndarray, shape (n_modes,)
        Growth rates (1/s), and their derivatives.
    real, unstable, damped : ndarray of bool, shape (n_modes,)
        Which eigenvalues are real, which modes grow, and which die out within a cycle.
    zero : float
        Growth rate (1/s) up to which a mode does not count as unstable, within rounding.
    rounding : float
        1/s, what may be wrong with a difference of growth rates.
    """

    point: Point
    spectrum: Spectrum
    growth: Array
    growth_rates: Array
    real: NDArray[np.bool_]
    unstable: NDArray[np.bool_]
    damped: NDArray[np.bool_]
    zero: float
    rounding: float

    @property
    def values(self) -> Complex:
        """Eigenvalues of the matrix."""
        return self.spectrum.values

    @property
    def rates(self) -> Complex:
        """Their derivatives."""
        return self.spectrum.rates

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
    spectra : Spectra
    """

    branch: Branch
    path: SpeedPath
    dynamics: Dynamics
    n_states: int
    speeds: list[float] = field(default_factory=list)
    spectra: Spectra = field(default_factory=Spectra)

    def samples(self, points: Sequence[Point]) -> list[Sample]:
        """Return the modes at points of the branch."""
        at, matrix_at = self.path.at, self.dynamics.matrix_at
        matrices = [matrix_at(point, at(point.s)) for point in points]
        beyond = [self.branch.ahead(point, _TINY_STEP) for point in points]
        changes = [
            (matrix_at(point, at(point.s)) - matrix) / _TINY_STEP
            for point, matrix in zip(beyond, matrices, strict=True)
        ]
        found = self.spectra.of(matrices, changes)
        self.speeds.extend(math.exp(point.s) for point in points)
        values = np.array([spectrum.values for spectrum in found])
        growth, rates = self.growing(values, np.array([spectrum.rates for spectrum in found]))
        largest = np.maximum(np.abs(matrices).max(axis=(1, 2)), 1.0)
        zero = _ZERO * np.sqrt(largest)
        unstable = growth > zero[:, None]
        return [
            *map(
                Sample,
                points,
                found,
                growth,
                rates,
                values.imag == 0.0,
                unstable,
                growth < -self._frequencies(values),
                zero.tolist(),
                (_ROUNDING * largest).tolist(),
            )
        ]

    def _frequencies(self, values: Complex) -> Array:
        """Return the angular frequencies of eigenvalues of the matrix, rad/s."""
        period = self.dynamics.period
        return np.abs(values.imag if period is None else np.angle(values) / period)

    def between(self, a: Sample, b: Sample, fraction: float) -> Sample:
        """Return the modes at a fraction of the way from a to b.

        Raises
        ------
        Stuck
            If there is no such point.
        """
        return self.samples([self.branch.between(a.point, b.point, fraction)])[0]

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
