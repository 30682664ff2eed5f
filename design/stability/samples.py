"""Modes sampled along a line, and the rates at which they change; the branch of equilibria over speed.

Along the branch the rates are exact except for the derivative of the matrix, which is a difference over
a tiny step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from design.loop.dynamics import Dynamics
from design.stability.spectra import Complex, Spectra
from railenv.equilibrium import Branch, Point, SpeedPath

Array = NDArray[np.float64]

ALIKE = 1e-6
"""Eigenvalues that differ by less than this fraction of the largest count as one."""

_TINY_STEP = 1e-5  # units of arclength, over which the matrix is differentiated
_FORGOTTEN = 0.4  # smaller multipliers count as this: parts that a map forgets within some periods
_NOISE = 1e3 * float(np.finfo(float).eps)  # for a map: the possible effect of rounding
_ZERO = 1e-9  # growth rates below this, times the root of the largest derivative, are rounding error
_ROUNDING = 1e-10  # of the largest derivative: possible error of differences of growth rates


class Spectral(Protocol):
    """Eigenvalues of a matrix (multipliers of a system in discrete time), their rates and vectors."""

    @property
    def values(self) -> Complex:
        """Return the eigenvalues."""

    @property
    def rates(self) -> Complex:
        """Return their derivatives with respect to the arclength along the line."""

    def vector(self, k: int) -> Complex:
        """Return the right eigenvector of an eigenvalue."""


class Sample(NamedTuple):
    """Modes of a linear system at a place of the line along which it changes.

    Attributes
    ----------
    point : Point or float
        Point of a branch of equilibria, or value of a parameter.
    spectrum : Spectral
    growth, growth_rates : ndarray, shape (n_modes,)
        Growth rates (1/s), and their derivatives.
    real, unstable, damped : ndarray of bool, shape (n_modes,)
        Whether eigenvalues are real (or forgotten within some periods), modes grow, and modes die out
        within a cycle.
    zero : float
        Growth rate (1/s) up to which a mode does not count as unstable, within rounding.
    rounding : float
        Possible error of a difference of growth rates, 1/s.
    """

    point: Any
    spectrum: Spectral
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


class Line(Protocol):
    """Something along which a linear system changes."""

    @property
    def period(self) -> float | None:
        """Sampling period, s; None in continuous time."""

    def between(self, a: Sample, b: Sample, fraction: float) -> Sample:
        """Return the modes at a fraction of the way from a to b.

        Raises
        ------
        Stuck
            If there is no such place.
        """

    def paces(self, a: Sample, b: Sample) -> tuple[float, float]:
        """Return the arclength per fraction of the way from a to b, at both."""

    def reach(self, sample: Sample) -> float:
        """Return the change of a place per arclength, in the measure of :meth:`gap`."""

    def gap(self, a: Sample, b: Sample) -> float:
        """Return the relative distance of two places."""


def growing(
    values: Complex, rates: Complex, period: float | None, forgotten: float = _FORGOTTEN
) -> tuple[Array, Array]:
    """Return the growth rates (1/s) of eigenvalues or multipliers, and their rates of change."""
    if period is None:
        return values.real, rates.real
    size = np.abs(values)
    held = np.maximum(size, forgotten)
    change = np.where(size > forgotten, (rates * values.conj()).real / held**2, 0.0)
    return np.log(held) / period, change / period


def forgotten_within(matrix: Array) -> float:
    """Return the magnitude of a map's multipliers below which they are rounding.

    A shift register of n periods has the multiplier 0, n times; rounding errors of size e move these
    to magnitudes of ``e**(1 / n)``, where they change erratically from one map to the next. The longest
    register is found in the matrix, by its rows that only pass on another state.
    """
    single = (matrix != 0.0).sum(axis=1) == 1
    source = np.abs(matrix).argmax(axis=1)
    hands_on = single & (matrix[np.arange(len(matrix)), source] == 1.0)
    longest = 1
    for state in np.flatnonzero(hands_on):
        length, seen = 1, {int(state)}
        while hands_on[state] and int(source[state]) not in seen:
            state = source[state]
            seen.add(int(state))
            length += 1
        longest = max(longest, length)
    return max(_FORGOTTEN, _NOISE ** (1.0 / longest))


def samples_of(
    points: Sequence[Any],
    spectra: Sequence[Spectral],
    period: float | None,
    sizes: Array,
    forgotten: float = _FORGOTTEN,
) -> list[Sample]:
    """Return samples of spectra.

    Parameters
    ----------
    points : sequence
    spectra : sequence of Spectral
    period : float or None
        s.
    sizes : ndarray
        Sizes of the matrices: largest entries, or largest eigenvalues.
    forgotten : float
        Smaller multipliers count as this.
    """
    values = np.array([spectrum.values for spectrum in spectra])
    rates = np.array([spectrum.rates for spectrum in spectra])
    growth, growth_rates = growing(values, rates, period, forgotten)
    largest = np.maximum(sizes, 1.0)
    zero = _ZERO * np.sqrt(largest)
    # A controller that reads many past readings has as many modes there, which change erratically.
    lost = False if period is None else np.abs(values) <= forgotten
    frequencies = np.abs(values.imag if period is None else np.angle(values) / period)
    return [
        *map(
            Sample,
            points,
            spectra,
            growth,
            growth_rates,
            (values.imag == 0.0) | lost,
            growth > zero[:, None],
            growth < -frequencies,
            zero.tolist(),
            (_ROUNDING * largest).tolist(),
        )
    ]


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
        sizes = np.abs(matrices).max(axis=(1, 2))
        forgotten = _FORGOTTEN if self.period is None else forgotten_within(matrices[0])
        return samples_of(points, found, self.period, sizes, forgotten)

    @property
    def period(self) -> float | None:
        """Control period, s; None for a vehicle alone."""
        return self.dynamics.period

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

    def reach(self, sample: Sample) -> float:
        """Return the change of the logarithm of the speed per arclength."""
        return abs(float(sample.point.tangent[-1] * sample.point.scale[-1]))

    def gap(self, a: Sample, b: Sample) -> float:
        """Return the difference of the logarithms of the speeds."""
        return abs(float(b.point.s - a.point.s))
