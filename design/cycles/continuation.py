"""Follows a branch of periodic motions, finds where its stability changes, and says why it ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from design.cycles.cycle import Cycle, CycleBranch, CycleError, Kind, SpecialPoint, value_of
from design.cycles.periodic import NoCycle, PeriodicProblem, Solution, half_peak_to_peak
from design.cycles.shooting import Setting, Shooting, steps_for
from design.stability.loss import CriticalSpeed

Array = NDArray[np.float64]
Limits = tuple[float, float]

_SAME_MODE = 1e-3  # of an eigenvalue: those of tables jump a little where their cells meet
_FIRST_AMPLITUDES = (0.1, 0.03, 0.3, 1.0)  # of the model's scale, tried in turn at a Hopf point
_FIRST_STEP = 0.05
_SMALLEST_STEP = 1e-5
_LARGEST_MISS = 0.3  # of the step, between the prediction along the tangent and the branch
_FARTHEST_TURN, _CORNER = 0.7, 5e-3  # cosine of the tangent's turn in a step; shorter steps may
_STRAIGHT = 0.95  # turn at a branch point
_GENTLE = 0.5  # turn of the tangent in a step (rad) up to which the prediction follows the curvature
_GROWTH, _FEW_STEPS = 1.5, 4  # of the step, after a corrector of so few Newton steps
_STANDING, _LOOKED_BACK = 2e-3, 12  # change of the parameter (units) over so many points ...
_RUN_AWAY = 0.05  # ... while the period grows by this fraction
_INACCURATE = 0.5  # error of the trivial multiplier
_COARSE = 1.25  # times the first step in time, above which a period gets more steps
_GONE = 0.3  # of the first amplitude
_LOCATED = 1e-5  # of the step in which a special point lies
_ON_CIRCLE = 1e-2  # a located multiplier's distance from the unit circle; a collision is farther
_REAL = 1e-6  # imaginary parts below this count as none
_MIRRORED = 1e-3  # of the amplitude


class CycleContinuation:
    """One branch while it is being followed."""

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
        value, period = hopf.speed, 1.0 / hopf.frequency
        shooting = Shooting(setting, 1)
        shooting.steps = steps or steps_for(shooting, hopf.state, period, value)
        self = cls(setting, limits, longest_step, shooting)
        self.hopf = hopf
        mode = -1j * hopf_mode(shooting, hopf)  # starts where displacements are zero, off the flange
        turn = np.exp(2j * np.pi * np.linspace(0.0, 1.0, shooting.steps + 1))
        for amplitude in _FIRST_AMPLITUDES:
            motion = hopf.state + amplitude * (turn[:, None] * mode).real
            self._problem = PeriodicProblem(shooting, motion, value)
            scale = self._problem.scale(half_peak_to_peak(motion), period, value)
            normal = np.concatenate([mode.real, [0.0, 0.0]]) / scale
            guess = np.concatenate([motion[0], [period, value]])
            try:
                found = self._problem.solve(guess, normal / np.linalg.norm(normal), scale)
            except NoCycle:
                continue
            self.cycles.append(self._cycle(found))
            return self
        raise CycleError(
            f"{setting.model.name} has no limit cycle of small amplitude near its Hopf point at "
            f"{value:.6g} m/s that Newton's method finds; give steps_per_period more than "
            f"{shooting.steps}, or start from a simulated limit cycle"
        )

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
        shooting.steps = steps or steps_for(shooting, start.states[0], start.period, value)
        self = cls(setting, limits, longest_step, shooting)
        self.cycles.append(self._cycle(solve_at(self._start(start, value), start, value, direction)))
        return self

    def _start(self, start: Cycle, value: float) -> PeriodicProblem:
        self._problem = PeriodicProblem(self.shooting, start.states, value)
        return self._problem

    @classmethod
    def resumed(cls, branch: CycleBranch, limits: Limits, longest_step: float) -> CycleContinuation:
        """Go on where a branch ended."""
        last = branch.cycles[-1]
        shooting = Shooting(branch.setting, len(last.states) - 1)
        self = cls(branch.setting, limits, longest_step, shooting)
        self.hopf, self.step = branch.hopf, branch.step
        self.cycles, self.special = list(branch.cycles), list(branch.special)
        self._problem = PeriodicProblem(shooting, last.states, last.value)
        return self

    def run(self, points: int, progress: bool) -> CycleBranch:
        """Follow the branch until it has so many points, leaves the limits, or ends."""
        ended, complete = f"{points} points were computed; resume goes on", True
        try:
            with _shown(progress, self, points) as update:
                while len(self.cycles) < points:
                    outcome = self._advance()
                    update()
                    if outcome is not None:
                        ended, complete = outcome
                        break
        except KeyboardInterrupt:
            ended, complete = "interrupted; resume goes on", False
        return CycleBranch(
            tuple(self.cycles),
            tuple(self.special),
            ended,
            complete,
            self.hopf,
            self.setting,
            self.step,
        )

    # ------------------------------------------------------------------------------ steps

    def _advance(self) -> tuple[str, bool] | None:
        """Add the next point; return why the branch ends there and whether it was meant to, if so."""
        last, first = self.cycles[-1], self.cycles[0]
        longest = _COARSE * first.period / (len(first.states) - 1)
        if last.period > longest * self.shooting.steps:
            self.shooting.steps = math.ceil(_COARSE * last.period / longest)
        self._problem.set_reference(last.states, last.value)
        last = replace(last, tangent=self._problem.in_phase(last.tangent, last.scale))
        z, bend = position(last), self._bend(last)
        while True:
            straight = z + self.step * last.tangent * last.scale
            guess = straight + 0.5 * self.step**2 * bend * last.scale
            try:
                guess = self._problem.improved(guess, last.tangent, last.scale)
                self._check_miss(straight, guess, last)  # before derivatives, which take long
                found = self._problem.solve(guess, last.tangent, last.scale)
                self._check_miss(straight, found.z, last)
                if self._jumped(last, found):
                    raise NoCycle
                break
            except NoCycle:
                self.step /= 2.0
                if self.step < _SMALLEST_STEP:
                    return self._stuck(last), False
        if found.newton_steps <= _FEW_STEPS:
            self.step = min(_GROWTH * self.step, self.longest_step)
        low, high = self.limits
        new = self._cycle(found)
        if not low <= new.value <= high and new.tangent[-1] * (new.value - (low + high) / 2.0) > 0.0:
            return self._last(last, new, low if new.value < low else high)
        self._look_between(last, new)
        self.cycles.append(new)
        return self._end(new)

    def _check_miss(self, predicted: Array, z: Array, last: Cycle) -> None:
        """Raise NoCycle where a motion is too far from the prediction along the tangent."""
        miss = float(np.linalg.norm((z - predicted) / last.scale))
        if not miss <= _LARGEST_MISS * self.step:
            raise NoCycle

    def _jumped(self, last: Cycle, found: Solution) -> bool:
        """Whether a step seems to have crossed to another part of the branch, past a sharp fold.

        The tangent then turns far; where it points back, the orientation changes as well, which no fold
        and no corner does.
        """
        tangent = found.tangent * found.scale / last.scale
        turn = float(tangent @ last.tangent / np.linalg.norm(tangent))
        reverses = found.orientation * last.orientation < 0 and turn < _STRAIGHT
        return reverses or (turn < _FARTHEST_TURN and self.step > _CORNER)

    def _bend(self, last: Cycle) -> Array:
        """Return the curvature of the branch at the last point, zero where it has a kink there."""
        if len(self.cycles) < 2:
            return np.zeros_like(last.tangent)
        before = self.cycles[-2]
        length = float(np.linalg.norm((position(last) - position(before)) / last.scale))
        tangent = self._problem.in_phase(before.tangent * before.scale / last.scale, last.scale)
        bend = (last.tangent - tangent) / length
        gentle = float(np.linalg.norm(bend)) * self.step < _GENTLE
        return bend if gentle else np.zeros_like(bend)

    def _last(self, last: Cycle, new: Cycle, value: float) -> tuple[str, bool]:
        """Put the last point on the end of the range."""
        direction: Literal[1, -1] = 1 if new.tangent[-1] > 0.0 else -1
        if last.value != value and (last.value - value) * (new.value - value) < 0.0:
            try:
                new = self._cycle(solve_at(self._problem, last, value, direction, towards=new))
            except CycleError:  # what was found stays
                reached = f"{self.setting.parameter} {last.value:.6g}"
                return f"{reached} is reached; on the end of the range, {value:g}, none is found", False
            self._look_between(last, new)
            self.cycles.append(new)
        return f"the end of the range, {self.setting.parameter} {value:g}, is reached", True

    def _end(self, new: Cycle) -> tuple[str, bool] | None:
        first, recent = self.cycles[0], self.cycles[-_LOOKED_BACK:]
        values = np.array([c.value for c in recent])
        standing = np.ptp(values) < _STANDING * self.setting.unit_at(new.value)
        growth = math.log(new.period / recent[0].period)
        size = self.setting.model.scale + new.amplitudes
        swelling = float(np.max(np.abs(new.amplitudes - recent[0].amplitudes) / size))
        grown = growth > max(_RUN_AWAY, 4.0 * swelling)
        if len(recent) == _LOOKED_BACK and standing and grown:
            return (
                f"the period runs away at {self.setting.parameter} {new.value:.6g}, where it is "
                f"{new.period:.4g} s: the motion approaches an equilibrium that it leaves ever later "
                "(a homoclinic orbit). Look for one there, on the flange for instance",
                False,
            )
        if new.trivial_error > _INACCURATE:
            return (
                f"the motion at {self.setting.parameter} {new.value:.6g} is too unstable to be "
                f"integrated over a period of {new.period:.4g} s (the trivial multiplier is wrong by "
                f"{new.trivial_error:.2g}). Give more steps_per_period than {self.shooting.steps}",
                False,
            )
        scale = self.setting.model.scale
        smallest = _GONE * min(_FIRST_AMPLITUDES[0], float(np.max(first.amplitudes / scale)))
        if np.max(new.amplitudes / scale) < smallest and len(self.cycles) > 2:
            return f"the amplitude goes to zero, a Hopf point, near {new.value:.6g}", True
        return None

    def _stuck(self, last: Cycle) -> str:
        return (
            f"no step down to {_SMALLEST_STEP:g} of arclength leads on from {self.setting.parameter} "
            f"{last.value:.6g}; the equations may jump there, as where a wheel lifts. Try more "
            f"steps_per_period than {self.shooting.steps}, or a simulated limit cycle beyond"
        )

    # --------------------------------------------------------------------- special points

    def _look_between(self, p: Cycle, q: Cycle) -> None:
        """Locate the special points between two neighbouring points."""
        fold = p.tangent[-1] * q.tangent[-1] < 0.0
        if fold:
            self._locate(p, q, lambda c: float(c.tangent[-1]), "fold")
        if p.orientation * q.orientation < 0:
            kind: Kind = "symmetry breaking" if mirrored(p) else "branch point"
            self._locate(p, q, lambda c: nearest_one(c) - 1.0, kind)
        counts = [_outside(_off_positive(c)) for c in (p, q)]
        crossed = fold or p.orientation * q.orientation < 0
        met = not crossed and _outside(p.multipliers) == _outside(q.multipliers)
        if counts[0] != counts[1] and not met:  # a pair that meets on the real axis crosses no circle
            k = min(counts)
            self._locate(p, q, lambda c: _log_modulus(c, k), None)

    def _locate(self, p: Cycle, q: Cycle, test: Callable[[Cycle], float], kind: Kind | None) -> None:
        """Find the zero of a test function between two points; without a sign change, no point."""
        found: dict[float, Cycle] = {0.0: p, 1.0: q}

        def along(fraction: float) -> float:
            if fraction not in found:
                found[fraction] = self._between(p, q, fraction)
            return test(found[fraction])

        try:
            if along(0.0) * along(1.0) > 0.0:
                return
            root = float(optimize.brentq(along, 0.0, 1.0, xtol=_LOCATED, rtol=_LOCATED))
            cycle = found[root] if root in found else self._between(p, q, root)
        except NoCycle:
            return
        if kind in ("fold", "symmetry breaking", "branch point"):
            multiplier = complex(nearest_one(cycle))
        else:
            off = _off_positive(cycle)
            multiplier = complex(off[np.argmin(np.abs(np.abs(off) - 1.0))]) if off.size else 0j
            if abs(abs(multiplier) - 1.0) > _ON_CIRCLE:
                return  # two multipliers collided outside the circle; stability did not change
            kind = "period doubling" if abs(multiplier.imag) < _REAL else "torus"
        assert kind is not None
        # at a fold the parameter is stationary, so its error is of second order in the step's
        slope = max(abs(float(cycle.tangent[-1])), _LOCATED) * float(cycle.scale[-1])
        length = float(np.linalg.norm((position(q) - position(p)) / p.scale))
        self.special.append(SpecialPoint(kind, cycle, multiplier, slope * length * _LOCATED))

    def _between(self, p: Cycle, q: Cycle, fraction: float) -> Cycle:
        """Return the motion of the branch at a fraction of the way, guessed by Hermite's cubic."""
        way = position(q) - position(p)
        chord = way / p.scale
        length = float(np.linalg.norm(chord))
        t = fraction
        start, end = length * p.tangent * p.scale, length * q.tangent * q.scale
        guess = position(p) + (3 * t**2 - 2 * t**3) * way
        guess += (t - 2 * t**2 + t**3) * start + (t**3 - t**2) * end
        plane = (chord / length, p.scale)
        return self._cycle(self._problem.solve(self._problem.improved(guess, *plane), *plane))

    def _cycle(self, found: Solution) -> Cycle:
        n, value = self._n, float(found.z[self._n + 1])
        multipliers, error = floquet(self._problem, found)
        speed, curvature, cant = self.setting.conditions(value)
        return Cycle(
            speed=speed,
            curvature=curvature,
            cant=cant,
            value=value,
            period=float(found.z[n]),
            states=found.states,
            amplitudes=half_peak_to_peak(found.states),
            multipliers=multipliers,
            trivial_error=error,
            tangent=found.tangent,
            scale=found.scale,
            orientation=found.orientation,
            state_names=self.setting.model.state_names,
        )


def position(cycle: Cycle) -> Array:
    """Return state at the start, period and parameter in one vector."""
    return np.concatenate([cycle.states[0], [cycle.period, cycle.value]])


def solve_at(
    problem: PeriodicProblem,
    start: Cycle,
    value: float,
    direction: Literal[1, -1],
    towards: Cycle | None = None,
) -> Solution:
    """Find the motion at a value of the parameter, near one motion or between two.

    Raises
    ------
    CycleError
        If Newton's method does not converge.
    """
    guess = np.concatenate([start.states[0], [start.period, value]])
    if towards is not None:
        fraction = (value - start.value) / (towards.value - start.value)
        guess = position(start) + fraction * (position(towards) - position(start))
    scale = problem.scale(start.amplitudes, start.period, value)
    normal = np.zeros(len(guess))
    normal[-1] = direction
    try:
        return problem.solve(guess, normal, scale)
    except NoCycle:
        raise CycleError(
            f"no limit cycle at {problem.shooting.setting.parameter} {value:.6g} near the motion "
            "given; simulate longer, or start from another speed"
        ) from None


def hopf_mode(shooting: Shooting, hopf: CriticalSpeed) -> NDArray[np.complex128]:
    """Return the critical mode, its largest displacement 1 in units of the model's scale.

    Where the model has uncoupled, identical parts (the two wheelsets of the dual wheelset), the
    eigenvalue
    is multiple and its modes are not unique: all such parts then move in phase with equal amplitude.
    """
    assert hopf.mode is not None
    assert hopf.state is not None
    assert hopf.eigenvalue is not None
    model = shooting.setting.model
    A, _ = model.jacobian(
        hopf.state,
        shooting.setting.inputs,
        speed=float(hopf.speed or 0.0),
        curvature=shooting.setting.curvature,
        cant=shooting.setting.cant,
    )
    mode = np.zeros(model.n_states, dtype=complex)
    everything = np.tile(np.arange(model.n_states, dtype=float), (2, 1))
    everything[1] += model.scale  # every part moves
    for part in shooting.parts(everything):
        values, vectors = np.linalg.eig(A[np.ix_(part, part)])
        k = int(np.argmin(np.abs(values - hopf.eigenvalue)))
        if abs(values[k] - hopf.eigenvalue) > _SAME_MODE * abs(hopf.eigenvalue):
            continue
        shape = vectors[:, k] / model.scale[part]
        largest = np.argmax(np.abs(shape[: max(len(shape) // 2, 1)]))
        mode[part] = vectors[:, k] / shape[largest]
    return mode


def floquet(problem: PeriodicProblem, found: Solution) -> tuple[NDArray[np.complex128], float]:
    """Return the multipliers without the trivial ones, the largest first, and the latter's error.

    The direction of motion (of each uncoupled part) is split off by an orthogonal change of
    coordinates, so that a multiplier which passes 1 at a fold is never taken for the trivial one.
    """
    n = problem.n
    scale = found.scale[:n]
    slope = problem.shooting.slope(found.z[:n], float(found.z[n + 1])) / scale
    directions = np.zeros((n, len(problem.parts)))
    for column, part in zip(directions.T, problem.parts, strict=True):
        column[part] = slope[part] / np.linalg.norm(slope[part])
    scaled = found.monodromy * scale / scale[:, None]
    basis, _ = np.linalg.qr(directions, mode="complete")
    turned = basis.T @ scaled @ basis
    k = len(problem.parts)
    multipliers = np.linalg.eigvals(turned[k:, k:]).astype(complex)
    error = float(np.linalg.norm(scaled @ directions - directions, axis=0).max())
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")], error


def nearest_one(cycle: Cycle) -> float:
    """Return the real multiplier nearest to 1, or infinity where there is none."""
    real = cycle.multipliers[np.abs(cycle.multipliers.imag) < _REAL].real
    return float(real[np.argmin(np.abs(real - 1.0))]) if real.size else math.inf


def mirrored(cycle: Cycle) -> bool:
    """Whether every state repeats itself, or its negative, after half a period."""
    half = (len(cycle.states) - 1) / 2.0
    at = np.arange(len(cycle.states))
    size = cycle.amplitudes + 1e-9 * np.abs(cycle.states).max()
    for name in range(cycle.states.shape[1]):
        column = cycle.states[:, name]
        later = np.interp((at + half) % (len(at) - 1), at, column)
        difference = min(np.abs(later - column).max(), np.abs(later + column).max())
        if difference > _MIRRORED * size[name] and size[name] > _MIRRORED * cycle.scale[name]:
            return False
    return True


def _off_positive(cycle: Cycle) -> NDArray[np.complex128]:
    mu = cycle.multipliers
    return mu[(np.abs(mu.imag) >= _REAL) | (mu.real < 0.0)]


def _outside(multipliers: NDArray[np.complex128]) -> int:
    """Return how many multipliers lie outside the unit circle."""
    return int(np.count_nonzero(np.abs(multipliers) > 1.0))


def _log_modulus(cycle: Cycle, k: int) -> float:
    off = _off_positive(cycle)
    return math.log(max(float(np.abs(off[k])), 1e-300)) if off.size > k else -1.0


@contextmanager
def _shown(progress: bool, run: CycleContinuation, points: int) -> Iterator[Callable[[], None]]:
    """Show how far a branch has come."""
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
