"""The continuation of a branch of periodic motions, with changes of stability and its end."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from design.cycles.cycle import GOES_ON, Cycle, CycleBranch, CycleError, SpecialPoint, value_of
from design.cycles.ends import (
    GONE,
    SMALLEST_STEP,
    Ending,
    ending_at,
    hopf_end,
    joins,
    passed,
    stuck,
)
from design.cycles.locate import special_points
from design.cycles.periodic import NoCycle, PeriodicProblem, Solution, half_peak_to_peak
from design.cycles.points import cycle_from, position, solve_at
from design.cycles.shooting import Setting, Shooting, displacement, steps_for, swings_of
from design.cycles.starts import Start, hopf_start, switch_start
from design.stability.loss import CriticalSpeed
from railenv.threads import one_blas_thread

Array = NDArray[np.float64]
Limits = tuple[float, float]

_FIRST_AMPLITUDES = (
    0.1,
    0.03,
    0.3,
    1.0,
)  # of the model's scale, tried in turn at a branch's start
_FIRST_STEP = 0.05
_LARGEST_MISS = 0.3  # of the step, between the prediction along the tangent and the branch
_FARTHEST_TURN, _CORNER = 0.7, 5e-3  # cosine of the tangent's turn in a step; shorter steps may
_STRAIGHT = 0.95  # turn at a branch point
_GENTLE = 0.5  # turn of the tangent in a step (rad) up to which the prediction follows the curvature
_GROWTH, _FEW_STEPS = 1.5, 4  # of the step, after a corrector with so few Newton steps
_FINEST = 4  # times the steps of the first period, with which a branch may go on
_COARSE = 1.25  # times the first step in time, above which a period gets more steps


class CycleContinuation:
    """One branch during its continuation."""

    def __init__(
        self, setting: Setting, limits: Limits, longest_step: float, shooting: Shooting
    ) -> None:
        self.setting = setting
        self.limits = limits
        self.longest_step = longest_step
        self.shooting = shooting
        self.hopf: CriticalSpeed | None = None
        self.step = min(_FIRST_STEP, longest_step)
        self.cycles: list[Cycle] = []
        self.special: list[SpecialPoint] = []
        self.ending: Ending | None = None
        self._problem: PeriodicProblem
        self._n = setting.model.n_states

    @classmethod
    def from_hopf(
        cls,
        setting: Setting,
        hopf: CriticalSpeed,
        limits: Limits,
        longest_step: float,
        steps: int | None,
    ) -> CycleContinuation:
        """Start at a Hopf point, with a motion of small amplitude along its mode."""
        assert hopf.speed is not None
        assert hopf.state is not None
        assert hopf.frequency is not None
        shooting = Shooting(setting, 1)
        shooting.steps = steps or steps_for(shooting, hopf.state, 1.0 / hopf.frequency, hopf.speed)
        self = cls(setting, limits, longest_step, shooting)
        self.hopf = hopf
        self._leave(hopf_start(shooting, hopf), 1)
        return self

    @classmethod
    def from_switch(
        cls,
        setting: Setting,
        point: SpecialPoint,
        side: Literal[1, -1],
        limits: Limits,
        longest_step: float,
    ) -> CycleContinuation:
        """Start on the other branch through a special point, to one side of it."""
        shooting = Shooting(setting, len(point.cycle.states) - 1)
        start = switch_start(shooting, point)
        shooting.steps = len(start.motion) - 1
        self = cls(setting, limits, longest_step, shooting)
        self._leave(start, side)
        return self

    @classmethod
    def from_cycle(
        cls,
        setting: Setting,
        start: Cycle,
        direction: Literal[1, -1],
        limits: Limits,
        longest_step: float,
        steps: int | None,
    ) -> CycleContinuation:
        """Start from a periodic motion, towards larger or smaller values of the parameter."""
        value = value_of(setting, start)
        shooting = Shooting(setting, 1)
        swings = swings_of(start.states, setting.model.scale)
        shooting.steps = steps or swings * steps_for(
            shooting, start.states[0], start.period / swings, value
        )
        self = cls(setting, limits, longest_step, shooting)
        self._problem = PeriodicProblem(shooting, start.states, value)
        self.cycles.append(solve_at(self._problem, start, value, direction))
        return self

    @classmethod
    def resumed(cls, branch: CycleBranch, limits: Limits, longest_step: float) -> CycleContinuation:
        """Continue where a branch ended."""
        last = branch.cycles[-1]
        shooting = Shooting(branch.setting, len(last.states) - 1)
        self = cls(branch.setting, limits, longest_step, shooting)
        self.hopf, self.step = branch.hopf, branch.step
        self.cycles, self.special = list(branch.cycles), list(branch.special)
        self._problem = PeriodicProblem(shooting, last.states, last.value)
        return self

    def run(self, points: int, progress: bool) -> CycleBranch:
        """Follow the branch until it has enough points, leaves the limits, or ends."""
        self.ending, ended = None, Ending(f"{points} points were computed; {GOES_ON}", True)
        try:
            with one_blas_thread(), _shown(progress, self, points) as update:
                while len(self.cycles) < points and self.ending is None:
                    self.ending = self._advance()
                    update()
        except KeyboardInterrupt:
            ended = Ending(f"interrupted; {GOES_ON}", False)
        ended = self.ending or ended
        return CycleBranch(
            tuple(self.cycles),
            tuple(self.special),
            ended.text,
            ended.complete,
            self.hopf,
            self.setting,
            self.step,
        )

    def _leave(self, start: Start, side: Literal[1, -1]) -> None:
        """Put the first point on the branch that leaves a motion or an equilibrium."""
        along = side * start.direction
        for amplitude in _FIRST_AMPLITUDES:
            motion = start.motion + amplitude * along
            self._problem = PeriodicProblem(self.shooting, motion, start.value)
            scale = self._problem.scale(half_peak_to_peak(motion), start.period, start.value)
            normal = np.concatenate([along[0], [0.0, 0.0]]) / scale
            guess = np.concatenate([motion[0], [start.period, start.value]])
            try:
                found = self._problem.solve(guess, normal / np.linalg.norm(normal), scale)
            except NoCycle:
                continue
            if start.left_by(found.states):
                self.cycles.append(cycle_from(self._problem, found))
                return
        raise CycleError(
            f"{self.setting.model.name} has no limit cycle near its {start.kind} point at "
            f"{start.value:.6g} that Newton's method finds; give steps_per_period more than "
            f"{self.shooting.steps}, or start from a simulated limit cycle"
        )

    # ------------------------------------------------------------------------------ steps

    def _advance(self) -> Ending | None:
        """Add the next point; return the reason if the branch ends there."""
        last, first = self.cycles[-1], self.cycles[0]
        longest = _COARSE * first.period / (len(first.states) - 1)
        if last.period > longest * self.shooting.steps:
            self.shooting.steps = math.ceil(_COARSE * last.period / longest)
        self._problem.set_reference(last.states, last.value)
        last = replace(last, tangent=self._problem.in_phase(last.tangent, last.scale))
        found = self._next(last)
        if found is None:
            if self._refined(last, first):
                return None
            return stuck(self.setting, self.cycles, self.shooting.steps)
        if found.newton_steps <= _FEW_STEPS:
            self.step = min(_GROWTH * self.step, self.longest_step)
        new = cycle_from(self._problem, found)
        what = passed(self.setting, last, new) if len(self.cycles) > 1 else None
        if what == "equilibrium":
            return self._shrunk(last, new)
        if what is not None:
            return joins(self.setting, what, last, new)
        low, high = self.limits
        if not low <= new.value <= high and new.tangent[-1] * (new.value - (low + high) / 2.0) > 0.0:
            return self._last(last, new, low if new.value < low else high)
        self._add(last, new)
        smallest = GONE * min(_FIRST_AMPLITUDES[0], displacement(self.setting.model, first.amplitudes))
        if displacement(self.setting.model, new.amplitudes) < smallest and len(self.cycles) > 2:
            return self._shrunk(last, new)
        return ending_at(self.setting, self.cycles, self.shooting.steps)

    def _next(self, last: Cycle) -> Solution | None:
        """Return the next motion; None if no step succeeds."""
        z, bend = position(last), self._bend(last)
        while True:
            straight = z + self.step * last.tangent * last.scale
            guess = straight + 0.5 * self.step**2 * bend * last.scale
            try:
                guess = self._problem.improved(guess, last.tangent, last.scale)
                self._check_miss(straight, guess, last)  # before derivatives, which take long
                found = self._problem.solve(guess, last.tangent, last.scale)
                self._check_miss(straight, found.z, last)
                if not self._jumped(last, found):
                    return found
            except NoCycle:
                pass
            self.step /= 2.0
            if self.step < SMALLEST_STEP:
                return None

    def _refined(self, last: Cycle, first: Cycle) -> bool:
        """Continue from the last motion with shorter time steps, which corners may require."""
        if self.shooting.steps >= _FINEST * (len(first.states) - 1):
            return False
        self.shooting.steps *= 2
        try:
            found = self._problem.solve(position(last), last.tangent, last.scale)
        except NoCycle:
            return False
        self.cycles[-1] = cycle_from(self._problem, found)
        self.step = _FIRST_STEP * self.longest_step
        return True

    def _add(self, last: Cycle, new: Cycle) -> None:
        self.special.extend(special_points(self._problem, last, new, len(self.cycles)))
        self.cycles.append(new)

    def _shrunk(self, last: Cycle, new: Cycle) -> Ending:
        """End at the Hopf point between two motions, or near the smaller one."""
        point = hopf_end(self.shooting, last, new, len(self.cycles))
        if point is None:
            near = min(last, new, key=lambda c: displacement(self.setting.model, c.amplitudes)).value
            return Ending(f"the amplitude goes to zero near {self.setting.parameter} {near:.6g}", False)
        self.special.append(point)
        at = f"{self.setting.parameter} {point.value:.6g}"
        return Ending(f"the branch shrinks to a Hopf point at {at}", True)

    def _check_miss(self, predicted: Array, z: Array, last: Cycle) -> None:
        """Raise NoCycle if a motion is too far from the prediction along the tangent."""
        miss = float(np.linalg.norm((z - predicted) / last.scale))
        if not miss <= _LARGEST_MISS * self.step:
            raise NoCycle

    def _jumped(self, last: Cycle, found: Solution) -> bool:
        """Return whether a step seems to have crossed to another part of the branch, past a sharp fold.

        The tangent then turns far; if it points back, the orientation changes as well, which does not
        happen at folds or corners.
        """
        tangent = found.tangent * found.scale / last.scale
        turn = float(tangent @ last.tangent / np.linalg.norm(tangent))
        reverses = found.orientation * last.orientation < 0 and turn < _STRAIGHT
        return reverses or (turn < _FARTHEST_TURN and self.step > _CORNER)

    def _bend(self, last: Cycle) -> Array:
        """Return the curvature of the branch at the last point, zero at a kink."""
        if len(self.cycles) < 2:
            return np.zeros_like(last.tangent)
        before = self.cycles[-2]
        length = float(np.linalg.norm((position(last) - position(before)) / last.scale))
        tangent = self._problem.in_phase(before.tangent * before.scale / last.scale, last.scale)
        bend = (last.tangent - tangent) / length
        gentle = float(np.linalg.norm(bend)) * self.step < _GENTLE
        return bend if gentle else np.zeros_like(bend)

    def _last(self, last: Cycle, new: Cycle, value: float) -> Ending:
        """Put the last point on the end of the range."""
        direction: Literal[1, -1] = 1 if new.tangent[-1] > 0.0 else -1
        name = self.setting.parameter
        if last.value != value and (last.value - value) * (new.value - value) < 0.0:
            try:
                new = solve_at(self._problem, last, value, direction, towards=new)
            except CycleError:  # the results so far stay
                end = f"on the end of the range, {value:g}, none is found"
                return Ending(f"{name} {last.value:.6g} is reached; {end}", False)
            self._add(last, new)
        return Ending(f"the end of the range, {name} {value:g}, is reached", True)


@contextmanager
def _shown(progress: bool, run: CycleContinuation, points: int) -> Iterator[Callable[[], None]]:
    """Show the progress of a branch."""
    if not progress:
        yield lambda: None
        return
    from rich.progress import Progress

    with Progress(transient=True) as bar:
        name = run.setting.parameter
        task = bar.add_task(f"limit cycles, {run.setting.model.name}", total=points)

        def update() -> None:
            text = f"limit cycles, {run.setting.model.name}, {name} {run.cycles[-1].value:.5g}"
            bar.update(task, completed=len(run.cycles), description=text)

        yield update
