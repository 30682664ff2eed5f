"""Eigenvalues followed along a line so closely that none crosses the imaginary axis unnoticed.

From one sample to the next every mode is matched, and its growth rate between them is the cubic with
the values and slopes of both. The accuracy of such cubics is estimated by continuing the previous one
over the step. If a mode, within some multiples of that error, may have reached the axis and gone back,
or crossed it more than once, the step is halved.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from design.stability.samples import Line, Sample, growing
from design.stability.spectra import Complex
from railenv.equilibrium import Stuck

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Places = NDArray[np.intp]

_DEEPEST = 12  # halvings of a step
_CAUTION = 20.0  # a mode may be off by this many times the error of the previous cubic,
_OF_DAMPED = 4.0  # one that dies out within a cycle, which is far from the axis, by so many times,
_LESS = 1.0 / 3.0  # and by so much less after every halving, as near crossings leave more of a trace
_OF_THE_LINE = 0.05  # of the error of a line: assumed error of a cubic without a previous one
_OF_SLOPE = 4.0 / 27.0  # largest distance of a cubic from zero between its ends, over its slope at one
_STRAIGHT = 0.1  # of the rise of a mode that crosses the axis: allowed error of its cubic
_ROOT = 1e-9  # of the logarithm of the speed, or of a range of values
_SEARCHES = 40

_POWERS = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [-3, -2, 3, -1], [2, 1, -2, 1]], dtype=float)
"""Coefficients of a cubic, lowest power first, of its value and slope at 0 and then at 1."""

_POLYGON = np.array([[1, 0, 0, 0], [1, 1 / 3, 0, 0], [0, 0, 1, -1 / 3], [0, 0, 1, 0]])
"""Its control polygon of the same: between 0 and 1 it stays within the heights of these points."""

_ON_GRID = np.linspace(0.0, 1.0, 9)[:, None] ** np.arange(4) @ _POWERS
"""Its values at some places between 0 and 1 of the same."""


class Step(NamedTuple):
    """Two neighbouring samples with their modes matched, in the order of the first.

    Attributes
    ----------
    a, b : Sample
    order : ndarray of int, shape (n_modes,)
        Index of the mode of b that each mode of a becomes.
    leaving, coming : float
        Arclength per fraction of the way, at a and at b.
    ends : ndarray, shape (4, n_modes)
        Growth rate of each mode (1/s) and its slope over the fraction of the way, at a and then at b.
    met : ndarray of bool, shape (n_modes,)
        Whether modes meet another: two real eigenvalues become a pair, or a pair two real ones.
    crossing : ndarray of bool, shape (n_modes,)
        Whether modes are stable at one end only.
    doubt : ndarray, shape (n_modes,)
        Possible error of the cubic between the ends, 1/s.
    """

    a: Sample
    b: Sample
    order: Places
    leaving: float
    coming: float
    ends: Array
    met: Bools
    crossing: Bools
    doubt: Array


def steps_between(line: Line, samples: Sequence[Sample], before: Step | None) -> list[Step]:
    """Match the modes of neighbouring samples; the previous step gives the accuracy of cubics."""
    _, spectra, *columns = zip(*samples, strict=True)
    growth, slopes, real, unstable = map(np.array, columns[:4])
    values = np.array([spectrum.values for spectrum in spectra])
    rates = np.array([spectrum.rates for spectrum in spectra])
    paces = [*map(line.paces, samples[:-1], samples[1:])]
    leaving, coming = np.array(paces).T[:, :, None]
    order = matched(values[:-1] + 0.5 * leaving * rates[:-1], values[1:] - 0.5 * coming * rates[1:])
    b = np.arange(1, len(samples))[:, None], order
    ends = np.array([growth[:-1], leaving * slopes[:-1], growth[b], coming * slopes[b]])
    ends = ends.transpose(1, 0, 2)
    met, crossing = real[:-1] != real[b], unstable[:-1] != unstable[b]
    start, leave, end, come = ends.transpose(1, 0, 2)
    rise = end - start
    doubt = _OF_THE_LINE * np.maximum(np.abs(rise - leave), np.abs(rise - come))
    first = 1 if before is None else 0
    earlier = [] if before is None else [before]
    if len(samples) - 1 > first:
        missed = _missed(
            np.array([*(s.order for s in earlier), *order[:-1]]),
            np.array([*(s.ends for s in earlier), *ends[:-1]]),
            np.array([*(s.met for s in earlier), *met[:-1]]),
            leaving[first:] / np.array([*([s.coming] for s in earlier), *coming[:-1]]),
            ends[first:],
        )
        doubt[first:] = np.where(np.isnan(missed), doubt[first:], missed)
    rounding = [max(one.rounding, two.rounding) for one, two in pairwise(samples)]
    doubt = np.maximum(doubt - np.array(rounding)[:, None], 0.0)
    return [
        Step(one, two, *each)
        for one, two, *each in zip(
            samples[:-1], samples[1:], order, *zip(*paces, strict=True), ends, met, crossing, doubt,
            strict=True,
        )
    ]  # fmt: skip


def _missed(order: Places, before: Array, met: Bools, ratio: Array, ends: Array) -> Array:
    """Return the errors of the cubics of steps, continued over the next ones, at the ends of these.

    They are NaN for modes that met another one, which cubics do not describe.
    """
    own = order.argsort(axis=1)[:, None]  # the step's mode of each mode of the sample at its end
    c0, c1, c2, c3 = (_POWERS @ np.take_along_axis(before, own, axis=2)).transpose(1, 0, 2)
    at = 1.0 + ratio
    value = c0 + at * (c1 + at * (c2 + at * c3))
    slope = ratio * (c1 + at * (2.0 * c2 + 3.0 * at * c3))
    found = np.maximum(np.abs(ends[:, 2] - value), _OF_SLOPE * np.abs(ends[:, 3] - slope))
    return np.where(np.take_along_axis(met, own[:, 0], axis=1), np.nan, found)


def sure(line: Line, steps: Sequence[Step], halvings: int) -> list[bool]:
    """Return for steps, halved so many times, whether no mode can have crossed the axis unnoticed."""
    polygon = _POLYGON @ np.array([step.ends for step in steps])
    less = _LESS**halvings
    caution = max(_OF_DAMPED * less, 1.0), max(_CAUTION * less, 1.0)
    margin = np.array([np.where(step.a.damped, *caution) * step.doubt for step in steps])
    zero = np.array([[max(step.a.zero, step.b.zero)] for step in steps])
    fine = (polygon.max(axis=1) + margin <= zero) | (polygon.min(axis=1) - margin > zero)
    met = np.array([step.met for step in steps])
    plain = fine.all(axis=1) & ~met.any(axis=1)
    return [
        quick or _sure(line, *each)
        for quick, *each in zip(plain.tolist(), steps, polygon, fine, strict=True)
    ]


def _sure(line: Line, step: Step, polygon: Array, fine: Bools) -> bool:
    """Return the same for one step, given which modes stay on one side of the axis."""
    rises = polygon[1:] - polygon[:-1]
    one_way = (rises >= 0.0).all(axis=0) | (rises <= 0.0).all(axis=0)
    steady = step.doubt < _STRAIGHT * np.abs(polygon[-1] - polygon[0])
    fine = np.where(step.crossing, one_way & steady & ~step.met, fine)
    return bool((fine | step.met).all()) and (not step.met.any() or _meet_away(line, step))


def _meet_away(line: Line, step: Step) -> bool:
    """Return whether modes that meet stay on one side of the axis.

    This follows from their mean and the square of their distance from it, which are smooth where they
    meet, unlike the two eigenvalues.
    """
    a, b, order, zero = step.a, step.b, step.order, max(step.a.zero, step.b.zero)
    own = order.argsort()
    first = np.flatnonzero(step.met)
    other = [own[_conjugate(b, order[i])] if a.real[i] else _conjugate(a, i) for i in first]
    if (step.crossing & step.met).any() or not step.met[other].all():
        return False
    mean, square = [], []
    for sample, pace, one, two in (
        (a, step.leaving, first, other),
        (b, step.coming, order[first], order[other]),
    ):
        half = (sample.values[one] - sample.values[two]) / 2.0
        slope = pace * (sample.rates[one] - sample.rates[two]) / 2.0
        mean += [(sample.values[one] + sample.values[two]) / 2.0]
        mean += [pace * (sample.rates[one] + sample.rates[two]) / 2.0]
        square += [half * half, 2.0 * half * slope]
    middle, away = _ON_GRID @ np.array(mean), np.sqrt(_ON_GRID @ np.array(square))
    both = np.concatenate([middle + away, middle - away])
    heights, _ = growing(both, np.zeros_like(both), line.period)
    return bool(((heights.max(axis=0) <= zero) | (heights.min(axis=0) > zero)).all())


def _conjugate(sample: Sample, k: np.intp) -> int:
    """Return the place of the conjugate of an eigenvalue."""
    return int(np.argmin(np.abs(sample.values - sample.values[k].conj())))


def matched(a: Complex, b: Complex) -> Places:
    """Return the index in each row of b that belongs to each number of a."""
    size = np.abs(a)[:, :, None] + (np.abs(b) + 1e-300)[:, None]
    gaps = np.abs(a[:, :, None] - b[:, None]) / size
    return np.array([linear_sum_assignment(gap)[1] for gap in gaps])


def followed(line: Line, groups: Iterable[Sequence[Sample]]) -> Iterator[Step]:
    """Yield steps between samples in order, halved until they are sure.

    A step that cannot be halved (because wheels lift, or after too many halvings) is taken as it is.

    Parameters
    ----------
    line : Line
    groups : iterable of sequences of Sample
        The samples in order; those of a group are checked at once.
    """
    before: Step | None = None
    reached: list[Sample] = []
    for group in groups:
        ahead = [*reached, *group]
        while len(ahead) > 1:
            steps = steps_between(line, ahead, before)
            passed = [*sure(line, steps, 0), False].index(False)
            for step in steps[:passed]:
                before = step
                yield step
            ahead = ahead[passed:]
            if len(ahead) > 1:
                for step in _halved(line, ahead[0], ahead[1], before):
                    before = step
                    yield step
                ahead = ahead[1:]
        reached = ahead


def _halved(line: Line, a: Sample, b: Sample, before: Step | None) -> Iterator[Step]:
    """Yield the parts of a step that is not sure, halved until they are."""
    ahead, depths = [b], [0]  # samples still to be reached, the nearest last
    while ahead:
        step = None
        if depths[-1] > 0:
            (step,) = steps_between(line, [a, ahead[-1]], before)
        if step is None or (depths[-1] < _DEEPEST and not sure(line, [step], depths[-1])[0]):
            try:
                middle = line.between(a, ahead[-1], 0.5)
            except Stuck:
                (step,) = steps_between(line, [a, ahead[-1]], before)
            else:
                depths += [depths.pop() + 1] * 2
                ahead.append(middle)
                continue
        yield step
        before, a = step, ahead.pop()
        depths.pop()


def upper(step: Step, modes: Bools) -> list[int]:
    """Return the indices of some modes of a step, one for each pair."""
    above = (step.a.values.imag >= 0.0) | (step.b.values[step.order].imag >= 0.0)
    return np.flatnonzero(modes & above).tolist()


def root_of(step: Step, mode: int) -> float:
    """Return the fraction of the way at which a mode is expected to cross the axis."""
    return _root(step.ends[:, mode])


def located(line: Line, step: Step, mode: int) -> tuple[Sample, int]:
    """Return the sample at which a mode crosses the axis within a step, and its place among the modes.

    The root of its cubic is sampled and the step shortened to it, until another root would lie within
    1e-9 of the speed, or of the range.
    """
    a, b, i, j = step.a, step.b, mode, int(step.order[mode])
    if a.growth[i] >= 0.0 and not a.unstable[i]:  # zero within rounding: the crossing is here
        return a, i
    up = bool(b.unstable[j])
    found = (a, i)
    for _ in range(_SEARCHES):
        leaving, coming = line.paces(a, b)
        at = _root([a.growth[i], leaving * a.growth_rates[i], b.growth[j], coming * b.growth_rates[j]])
        ends = np.array([a.values[i], leaving * a.rates[i], b.values[j], coming * b.rates[j]])
        expected = at ** np.arange(4) @ _POWERS @ ends
        middle = line.between(a, b, at)
        k = int(np.argmin(np.abs(middle.values - expected)))
        found = (middle, k)
        height, slope = float(middle.growth[k]), float(middle.growth_rates[k])
        if abs(height) * line.reach(middle) <= _ROOT * abs(slope) or line.gap(a, b) < _ROOT:
            break
        if (height > 0.0) == up:
            b, j = middle, k
        else:
            a, i = middle, k
    return found


def _root(ends: Iterable[float]) -> float:
    """Return the zero of a cubic whose ends differ in sign, by a bracketed Newton's method."""
    c0, c1, c2, c3 = (_POWERS @ np.array([*ends])).tolist()
    low, high = 0.0, 1.0
    at = c0 / -(c1 + c2 + c3)  # the zero of the line between the ends
    for _ in range(_SEARCHES):
        value = c0 + at * (c1 + at * (c2 + at * c3))
        if (value > 0.0) == (c0 > 0.0):
            low = at
        else:
            high = at
        slope = c1 + at * (2.0 * c2 + 3.0 * at * c3)
        following = at - value / slope if slope else low
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - at) < 1e-15:
            break
        at = following
    return at
