"""The search along a branch of equilibria for speeds at which eigenvalues cross the imaginary axis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from design.loop.dynamics import Dynamics
from design.loop.sampled import continuous
from design.stability.crossings import Step, followed, located, root_of, upper
from design.stability.loss import CriticalSpeed, Loss
from design.stability.mode_shape import displacement_rows
from design.stability.samples import ALIKE, BranchLine, Sample
from design.stability.spectra import Complex
from railenv import checks
from railenv.equilibrium import Branch, Equilibrium, Point, SpeedPath, Stuck, find_equilibrium
from railenv.errors import EquilibriumError
from railenv.models import Model

_ROOT = 1e-8  # of a step: accuracy of a fold
_FIRST = 0.25  # of the first step: the first sample in it
_AT_ONCE = 16  # largest number of samples computed at once, which is faster than one by one
_REAL = 1e-3  # imaginary parts below this fraction of the largest count as zero at a fold
_CLOSED_LOOP_STEP = 0.06  # of the logarithm of the speed: controllers can have narrow unstable ranges
_LONGEST = 1.0  # largest step allowed
_CLOSE = 0.05  # of a step: crossings of the axis expected closer than this are all located
_SAME = 1e-7  # relative difference of speeds of one crossing


@dataclass(frozen=True)
class Search:
    """One search along a branch of equilibria."""

    model: Model
    line: BranchLine
    start: Equilibrium
    speed_range: tuple[float, float]

    @classmethod
    def of(
        cls,
        model: Model,
        radius: float,
        cant: float,
        speed_range: tuple[float, float],
        inputs: ArrayLike | None,
        longest_step: float | None,
        judged_by: Dynamics,
    ) -> Search:
        """Check the arguments, those of :func:`design.critical_speed`, and find the first equilibrium.

        Raises
        ------
        EquilibriumError
            If there is no equilibrium.
        """
        low, high = checks.speeds(speed_range)
        u = checks.vector("inputs", inputs, model.input_names)
        unit = SpeedPath.unit if judged_by.period is None else _CLOSED_LOOP_STEP
        if longest_step is not None:
            unit = checks.number("longest_step", longest_step, low=0.0, high=_LONGEST, open_low=True)
        start = find_equilibrium(model, speed=low, radius=radius, cant=cant, inputs=u)
        path = SpeedPath(checks.curvature(radius), start.cant, unit)
        line = BranchLine(Branch(model, path, u), path, judged_by, model.n_states)
        return cls(model, line, start, (low, high))

    def first_loss(self) -> CriticalSpeed:
        """Return the first loss of stability."""
        groups = self._groups()
        last = (first := next(groups))[0]
        if last.unstable.any():
            return self._result("unstable at start", last)
        try:
            for step in followed(self.line, chain([first], groups)):
                lost = self._first_lost(step)
                if not step.b.point.forward:
                    return self._at_fold(step, lost)
                if lost is not None:
                    return self._result(self._kind(*lost), *lost)
                last = step.b
        except Stuck:
            return self._result("end", last)
        return self._result("none", None)

    def pairs(self) -> tuple[CriticalSpeed, ...]:
        """Return the crossings of all complex pairs up to the end or the first turn of the branch."""
        found: list[CriticalSpeed] = []
        try:
            for step in followed(self.line, self._groups()):
                for sample, k in self._crossings(step, step.crossing):
                    if sample.point.forward and self._kind(sample, k) == "hunting":
                        here = self._result("hunting", sample, k)
                        if not any(_same(here, other) for other in found):
                            found.append(here)
                if not step.b.point.forward:
                    break
        except Stuck:
            pass  # the branch ends there
        return tuple(replace(each, sampled=self._sampled()) for each in found)

    def _groups(self) -> Iterator[list[Sample]]:
        """Yield samples along the branch, in groups.

        The first step, which cannot be checked against a previous one, is short. An error at the end of
        the branch is raised after the samples before it are checked.
        """
        branch, (low, high) = self.line.branch, self.speed_range
        points = branch.points(branch.start(self.start.state, math.log(low)), math.log(high))
        group, end = self._gathered(points, _AT_ONCE)
        if len(group) > 1:
            with suppress(Stuck):
                group.insert(1, branch.between(group[0], group[1], _FIRST))
        while group:
            for samples in self._sampled_at(group):
                last = samples[-1]
                yield samples
            if end is not None:
                break
            group, end = self._gathered(points, _until_crossing(last))
        if end is not None:
            raise end

    def _sampled_at(self, points: list[Point]) -> Iterator[list[Sample]]:
        """Yield the samples at points, one by one if not all of them have a linear system.

        An error is then raised after the samples before it are checked.
        """
        try:
            group = self.line.samples(points)
        except (EquilibriumError, np.linalg.LinAlgError):
            for point in points:
                yield self.line.samples([point])
        else:
            yield group

    def _gathered(self, points: Iterator[Point], most: int) -> tuple[list[Point], Stuck | None]:
        """Return some more points, up to one beyond a fold, and the reason if they ended."""
        group: list[Point] = []
        try:
            for point in islice(points, most):
                group.append(point)
                if not point.forward:
                    break
        except Stuck as end:
            return group, end
        return group, None

    def _crossings(self, step: Step, modes: NDArray[np.bool_]) -> list[tuple[Sample, int]]:
        """Locate in order where some modes cross the axis within a step; one for each pair."""
        at = [located(self.line, step, k) for k in upper(step, modes)]
        return sorted(at, key=lambda found: _way(step, found[0].point))

    def _first_lost(self, step: Step) -> tuple[Sample, int] | None:
        """Locate where the first mode becomes unstable in a step, if one does."""
        if not step.crossing.any():
            return None
        lost = {k: root_of(step, k) for k in upper(step, step.crossing & ~step.a.unstable)}
        if not lost:
            return None
        close = [k for k, root in lost.items() if root < min(lost.values()) + _CLOSE]
        at = [located(self.line, step, k) for k in close]
        return min(at, key=lambda found: _way(step, found[0].point))

    def _at_fold(self, step: Step, lost: tuple[Sample, int] | None) -> CriticalSpeed:
        """Distinguish a loss of stability, in a step that turns back, from the fold in it.

        A real eigenvalue crosses zero at a fold too.
        """
        a, b = step.a.point, step.b.point

        def forward(t: float) -> float:
            at = self.line.branch.between(a, b, t) if 0.0 < t < 1.0 else (b if t else a)
            return float(at.tangent[-1])

        turn = float(optimize.brentq(forward, 0.0, 1.0, xtol=_ROOT, rtol=_ROOT))
        fold = self.line.branch.between(a, b, turn)
        if lost is not None:
            sample, k = lost
            real = abs(sample.values[k].imag) < _REAL * float(np.abs(sample.values).max())
            if not real and _way(step, sample.point) < _way(step, fold):
                return self._result(self._kind(*lost), *lost)
        return self._result("fold", self.line.samples([fold])[0])

    def _kind(self, sample: Sample, k: int) -> Loss:
        eigenvalues = self._eigenvalues(sample)
        oscillates = abs(eigenvalues[k].imag) > ALIKE * float(np.abs(eigenvalues).max())
        return "hunting" if oscillates else "divergence"

    def _eigenvalues(self, sample: Sample) -> Complex:
        """Return the eigenvalues in continuous time, 1/s."""
        period = self.line.dynamics.period
        return sample.values if period is None else continuous(sample.values, period)

    def _sampled(self) -> NDArray[np.float64]:
        return np.unique(self.line.speeds)

    def _result(self, loss: Loss, sample: Sample | None, k: int | None = None) -> CriticalSpeed:
        """Return the result; ``k`` is the critical mode, the least damped one if None."""
        found = CriticalSpeed(
            loss=loss,
            speed=None,
            frequency=None,
            state=None,
            eigenvalue=None,
            mode=None,
            multiplicity=0,
            growth_slope=None,
            unstable=0,
            speed_range=self.speed_range,
            sampled=self._sampled(),
            radius=self.start.radius,
            cant=self.start.cant,
            model_name=self.model.name,
            state_names=self.model.state_names,
            inputs=self.start.inputs,
            period=self.line.dynamics.period,
            _model=self.model,
        )
        return found if sample is None else self._with_mode(found, sample, k)

    def _with_mode(self, found: CriticalSpeed, sample: Sample, k: int | None) -> CriticalSpeed:
        """Add the critical mode of a sample."""
        eigenvalues = self._eigenvalues(sample)
        if k is None:
            k = int(np.argmax(np.where(eigenvalues.imag >= 0.0, sample.growth, -np.inf)))
        critical = complex(eigenvalues[k])
        vector = sample.spectrum.vector(k)[: self.model.n_states]
        if critical.imag < 0.0:  # of a pair, the eigenvalue in the upper half plane
            critical, vector = critical.conjugate(), vector.conj()
        shape = vector[displacement_rows(self.model)]
        near = np.abs(eigenvalues - critical) < ALIKE * float(np.abs(eigenvalues).max())
        others = ~(
            near | (np.abs(eigenvalues - critical.conjugate()) < ALIKE * np.abs(eigenvalues).max())
        )
        crosses = found.loss in ("hunting", "divergence")
        oscillates = found.loss in ("hunting", "unstable at start")
        ahead = sample.point.tangent[-1] * sample.point.scale[-1] * math.exp(sample.point.s)
        return replace(
            found,
            speed=None if found.loss == "unstable at start" else math.exp(sample.point.s),
            frequency=(abs(critical.imag) / (2.0 * math.pi) or None) if oscillates else None,
            state=sample.point.state,
            eigenvalue=critical,
            mode=vector / shape[np.argmax(np.abs(shape))],
            multiplicity=int(near.sum()),
            growth_slope=float(sample.growth_rates[k] / ahead) if crosses else None,
            unstable=int((sample.unstable & others).sum()),
        )


def _until_crossing(sample: Sample) -> int:
    """Return the number of steps to take at once, before a mode is about to cross the axis."""
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = -sample.growth / sample.growth_rates
    nearest = float(np.min(distances, where=distances > 0.0, initial=_AT_ONCE))
    return min(2 + int(nearest), _AT_ONCE)


def _way(step: Step, point: Point) -> float:
    """Return the position of a point as a fraction of the way from a step's start to its end."""
    a, b = step.a.point, step.b.point
    chord = (b.position - a.position) / a.scale
    return float(chord @ ((point.position - a.position) / a.scale) / (chord @ chord))


def _same(one: CriticalSpeed, other: CriticalSpeed) -> bool:
    """Return whether two crossings are the same one of a multiple pair."""
    assert one.speed is not None
    assert other.speed is not None
    assert one.eigenvalue is not None
    assert other.eigenvalue is not None
    near = abs(one.speed - other.speed) < _SAME * one.speed
    return near and abs(one.eigenvalue - other.eigenvalue) < _SAME * abs(one.eigenvalue)
