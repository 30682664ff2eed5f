"""Eigenvalues followed along a line, closely enough that none passes the imaginary axis unseen.

From one sample to the next every mode is matched, and its growth rate between them is the cubic that
has the values and slopes of both. How well such cubics hold is seen from the one before, continued over
the step. Where a mode, within some multiples of what that is wrong by, may have reached the axis and
gone back, or crossed it more than once, the step is halved.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from design.stability.samples import BranchLine, Complex, Sample
from railenv.equilibrium import Stuck

Array = NDArray[np.float64]

_FIRST = 0.25  # of the first step, which nothing before it can judge: the first sample in it
_DEEPEST = 12  # halvings of a step
_CAUTION = 20.0  # a mode may lie this many times further off than the cubic before was wrong by
_OF_THE_LINE = (
    0.05  # how wrong a cubic may be for a line through its ends: what is assumed of the first
)
_OF_SLOPE = 4.0 / 27.0  # how far from zero a cubic goes between its ends, of its slope at one
_STRAIGHT = 0.1  # of the rise of a mode that crosses the axis: how wrong its cubic may be
_ROOT = 1e-9  # of the logarithm of the speed
_SEARCHES = 40
_GRID = np.linspace(0.0, 1.0, 9)
_POWERS = _GRID[:, None] ** np.arange(4)


Numbers = TypeVar("Numbers", Array, Complex)


def hermite(start: Numbers, end: Numbers, leaving: Numbers, coming: Numbers) -> Numbers:
    """Return cubics with values and slopes at 0 and 1, lowest power first."""
    rise = end - start
    return np.array(
        [start, leaving, 3.0 * rise - 2.0 * leaving - coming, leaving + coming - 2.0 * rise]
    )


@dataclass(frozen=True)
class Step:
    """Two neighbouring samples with their modes matched, in the order of the first.

    Attributes
    ----------
    a, b : Sample
    order : ndarray of int
        Which mode of b each mode of a becomes.
    paces : (float, float)
        Arclength per fraction of the way, at a and at b.
    cubic : ndarray, shape (4, n_modes)
        Growth rate of each mode (1/s) as a polynomial of the fraction of the way, lowest power first.
    doubt : ndarray, shape (n_modes,)
        How wrong that may be, 1/s.
    """

    a: Sample
    b: Sample
    order: NDArray[np.intp]
    paces: tuple[float, float]
    cubic: Array
    doubt: Array

    @classmethod
    def between(cls, line: BranchLine, a: Sample, b: Sample, before: Step | None) -> Step:
        """Match the modes of two samples; the step before says how well cubics hold."""
        paces = line.paces(a, b)
        order = matched(a.values + 0.5 * paces[0] * a.rates, b.values - 0.5 * paces[1] * b.rates)
        start, end = a.growth, b.growth[order]
        leaving, coming = paces[0] * a.growth_rates, paces[1] * b.growth_rates[order]
        rise = end - start
        cubic = hermite(start, end, leaving, coming)
        bend = _OF_THE_LINE * np.maximum(np.abs(rise - leaving), np.abs(rise - coming))
        doubt = bend if before is None else before._misses(paces[0], end, coming, bend)
        return cls(a, b, order, paces, cubic, np.maximum(doubt - max(a.rounding, b.rounding), 0.0))

    def _misses(self, pace: float, end: Array, coming: Array, otherwise: Array) -> Array:
        """Return by how much the cubics of this step, continued, miss the ends of the next one."""
        ratio = pace / self.paces[1]
        at = 1.0 + ratio
        own = np.argsort(self.order)  # this step's mode of each mode of the sample between
        c0, c1, c2, c3 = self.cubic[:, own]
        value = c0 + at * (c1 + at * (c2 + at * c3))
        slope = ratio * (c1 + at * (2.0 * c2 + 3.0 * at * c3))
        missed = np.maximum(np.abs(end - value), _OF_SLOPE * np.abs(coming - slope))
        return np.where(self.met[own], otherwise, missed)

    @cached_property
    def met(self) -> NDArray[np.bool_]:
        """Which modes meet another: two real eigenvalues become a pair, or a pair two real ones."""
        return (self.a.values.imag == 0.0) != (self.b.values[self.order].imag == 0.0)

    @cached_property
    def crossing(self) -> NDArray[np.bool_]:
        """Which modes are stable at one end only."""
        return self.a.unstable != self.b.unstable[self.order]

    def sure(self, line: BranchLine) -> bool:
        """Whether no mode may have passed the axis unseen."""
        heights = _POWERS @ self.cubic
        highest, lowest = heights.max(axis=0), heights.min(axis=0)
        margin = _CAUTION * self.doubt
        zero = max(self.a.zero, self.b.zero)
        away = (highest + margin <= zero) | (lowest - margin > zero)
        rising = np.diff(heights, axis=0) > 0.0
        monotonic = rising.all(axis=0) | ~rising.any(axis=0)
        steady = self.doubt < _STRAIGHT * np.abs(heights[-1] - heights[0])
        fine = np.where(self.crossing, monotonic & steady, away)
        if self.met.any():
            fine = np.where(self.met, ~self.crossing & self._meet_away(line, zero), fine)
        return bool(fine.all())

    def _meet_away(self, line: BranchLine, zero: float) -> NDArray[np.bool_]:
        """Whether two modes that meet stay on one side of the axis, by their mean and their distance.

        These, and not the two eigenvalues, go smoothly through the place where they meet.
        """
        found = np.zeros(len(self.order), dtype=bool)
        own = np.argsort(self.order)
        for i in np.flatnonzero(self.met):
            if self.a.values[i].imag != 0.0:
                k = _conjugate(self.a.values, i)
            else:
                k = int(own[_conjugate(self.b.values, self.order[i])])
            ends = []
            for sample, pace, x, y in (
                (self.a, self.paces[0], i, k),
                (self.b, self.paces[1], self.order[i], self.order[k]),
            ):
                half = (sample.values[x] - sample.values[y]) / 2.0
                change = pace * (sample.rates[x] - sample.rates[y]) / 2.0
                mean = (sample.values[x] + sample.values[y]) / 2.0
                means = pace * (sample.rates[x] + sample.rates[y]) / 2.0
                ends.append((mean, half**2, means, 2.0 * half * change))
            mean = _POWERS @ hermite(ends[0][0], ends[1][0], ends[0][2], ends[1][2])
            apart = np.sqrt(_POWERS @ hermite(ends[0][1], ends[1][1], ends[0][3], ends[1][3]))
            both = np.array([mean + apart, mean - apart])
            heights, _ = line.growing(both, np.zeros_like(both))
            found[i] = self.met[k] and bool(heights.max() <= zero or heights.min() > zero)
        return found


def _conjugate(values: Complex, k: np.intp) -> int:
    """Return the place of the conjugate of an eigenvalue, beside which LAPACK puts it."""
    return int(k) + int(np.sign(values[k].imag))


def matched(a: Complex, b: Complex) -> NDArray[np.intp]:
    """Return which of b's numbers belongs to each of a's."""
    from scipy.optimize import linear_sum_assignment

    gap = np.abs(a[:, None] - b) / (np.abs(a)[:, None] + np.abs(b) + 1e-300)
    return np.asarray(linear_sum_assignment(gap)[1])


def followed(line: BranchLine, samples: Iterable[Sample]) -> Iterator[Step]:
    """Yield steps between samples in order, halved until they are sure.

    A step that cannot be halved (where wheels lift, or after too many halvings) is taken as it is.
    """
    before: Step | None = None
    for a, b in pairwise(samples):
        for step in _steps(line, a, b, before, 0):
            before = step
            yield step


def _steps(line: BranchLine, a: Sample, b: Sample, before: Step | None, depth: int) -> Iterator[Step]:
    step = Step.between(line, a, b, before)
    first = before is None and depth == 0
    if depth < _DEEPEST and (first or not step.sure(line)):
        try:
            middle = line.between(a, b, _FIRST if first else 0.5)
        except Stuck:
            yield step
            return
        for step in _steps(line, a, middle, before, depth + 1):
            before = step
            yield step
        yield from _steps(line, middle, b, before, depth + 1)
    else:
        yield step


def located(line: BranchLine, step: Step, mode: int) -> tuple[Sample, int]:
    """Return the sample at which a mode crosses the axis within a step, and its place among the modes.

    The root of the cubic is sampled, until the step from the last root is within 1e-9 of the speed.
    """
    a, b, i, j = step.a, step.b, mode, int(step.order[mode])
    if a.growth[i] >= 0.0 and not a.unstable[i]:  # within rounding of zero: it is left here
        return a, i
    up = bool(b.unstable[j])
    best = (a, i)
    for _ in range(_SEARCHES):
        paces = line.paces(a, b)
        value, root = _root(a, i, b, j, paces)
        middle = line.between(a, b, root)
        k = int(np.argmin(np.abs(middle.values - value)))
        best = (middle, k)
        height, slope = float(middle.growth[k]), float(middle.growth_rates[k])
        reach = abs(middle.point.tangent[-1]) * middle.point.scale[-1]
        if slope != 0.0 and abs(height / slope) * reach < _ROOT:
            break
        if abs(b.point.s - a.point.s) < _ROOT:
            break
        if (height > 0.0) == up:
            b, j = middle, k
        else:
            a, i = middle, k
    return best


def _root(a: Sample, i: int, b: Sample, j: int, paces: tuple[float, float]) -> tuple[complex, float]:
    """Return the eigenvalue expected where the growth rate crosses zero, and where on the way."""
    cubic = hermite(
        a.growth[i], b.growth[j], paces[0] * a.growth_rates[i], paces[1] * b.growth_rates[j]
    )
    roots = np.roots(cubic[::-1])
    inside = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0) & (roots.real < 1.0)].real
    share = a.growth[i] / (a.growth[i] - b.growth[j])
    t = float(inside[np.argmin(np.abs(inside - share))]) if inside.size else float(share)
    value = hermite(a.values[i], b.values[j], paces[0] * a.rates[i], paces[1] * b.rates[j])
    return complex(np.polyval(value[::-1], t)), t
