"""Reasons for the ends of branches of limit cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from design.cycles.cycle import Cycle, SpecialPoint
from design.cycles.multipliers import mirrored
from design.cycles.periodic import NoCycle
from design.cycles.shooting import Setting, Shooting, displacement

Array = NDArray[np.float64]
Passed = Literal["equilibrium", "half the period", "mirror image"]

SMALLEST_STEP = 1e-5
"""Smallest step of arclength; a branch that needs a smaller one ends."""

GONE = 0.3
"""Share of the first amplitude; smaller motions have shrunk to an equilibrium."""

_STANDING, _LOOKED_BACK = 2e-3, 12  # change of the parameter (units) over so many points ...
_RUN_AWAY = 0.05  # ... while the period grows by this fraction
_GROWN = (
    1.5  # of the first period, above which a branch that is stuck is likely near a homoclinic orbit
)
_INACCURATE = 0.5  # error of the trivial multiplier
_VERTICAL, _FILLED, _LARGE = 1e-6, 8, 30.0  # change (units), points, amplitude (of the model's scale)
_CLOSED, _FEWEST = (
    0.2,
    8,
)  # of a step: distance of a branch back at its start; points before
_SUBHARMONIC = 0.25  # of the amplitudes: a smaller first harmonic means a doubling period
_SAME_PHASE = 0.7  # cosine of the turn of the first harmonic in a step
_NEWTON_STEPS, _SECANT_STEPS, _CONVERGED = 20, 30, 1e-12


@dataclass(frozen=True)
class Ending:
    """The reason why a branch ends, and whether it was intended."""

    text: str
    complete: bool


def ending_at(setting: Setting, cycles: Sequence[Cycle], steps: int) -> Ending | None:
    """Return why a branch ends at its newest point; None if it goes on."""
    return (
        _vertical(setting, cycles)
        or _runs_away(setting, cycles)
        or _too_unstable(setting, cycles[-1], steps)
        or _closed(setting, cycles)
    )


def _vertical(setting: Setting, cycles: Sequence[Cycle]) -> Ending | None:
    """Return the ending for motions of every amplitude at one value, as in linear equations."""
    last = cycles[-1]
    largest = displacement(setting.model, last.amplitudes)
    if largest < _LARGE:
        return None
    unit = setting.unit_at(last.value)
    upright = [c for c in cycles if abs(c.value - last.value) < _VERTICAL * unit]
    smallest = min(displacement(setting.model, c.amplitudes) for c in upright)
    if len(upright) < min(_FILLED, len(cycles)) or 2.0 * smallest > largest:
        return None
    return Ending(
        f"the family is vertical: at {setting.parameter} {last.value:.6g} there are motions of every "
        f"amplitude, up to {largest:.3g} times the model's scale at least, as in equations that are "
        "linear there",
        False,
    )


def _runs_away(setting: Setting, cycles: Sequence[Cycle]) -> Ending | None:
    new, recent = cycles[-1], cycles[-_LOOKED_BACK:]
    values = np.array([c.value for c in recent])
    standing = np.ptp(values) < _STANDING * setting.unit_at(new.value)
    growth = math.log(new.period / recent[0].period)
    size = setting.model.scale + new.amplitudes
    swelling = float(np.max(np.abs(new.amplitudes - recent[0].amplitudes) / size))
    grown = growth > max(_RUN_AWAY, 4.0 * swelling)
    if len(recent) == _LOOKED_BACK and standing and grown:
        return Ending(
            f"the period runs away at {setting.parameter} {new.value:.6g}, where it is "
            f"{new.period:.4g} s: the motion approaches an equilibrium that it leaves ever later "
            "(a homoclinic orbit). Look for one there, on the flange for instance",
            False,
        )
    return None


def _too_unstable(setting: Setting, new: Cycle, steps: int) -> Ending | None:
    if new.trivial_error > _INACCURATE:
        return Ending(
            f"the motion at {setting.parameter} {new.value:.6g} is too unstable to be "
            f"integrated over a period of {new.period:.4g} s (the trivial multiplier is wrong by "
            f"{new.trivial_error:.2g}). Give more steps_per_period than {steps}",
            False,
        )
    return None


def _closed(setting: Setting, cycles: Sequence[Cycle]) -> Ending | None:
    """Return the ending for a branch whose start lies on its newest step."""
    if len(cycles) <= _FEWEST:
        return None
    first, p, q = (_coordinates(setting, c, cycles[-1]) for c in (cycles[0], *cycles[-2:]))
    way = q - p
    length = float(np.linalg.norm(way))
    share = float((first - p) @ way) / length**2
    off = float(np.linalg.norm(first - p - share * way))
    second = _coordinates(setting, cycles[1], cycles[-1])
    if 0.0 <= share <= 1.0 and off < _CLOSED * length and (second - first) @ way > 0.0:
        return Ending("the branch closes on itself: it is a loop", True)
    return None


def _coordinates(setting: Setting, cycle: Cycle, near: Cycle) -> Array:
    """Return coordinates that distinguish motions whatever their phase, in units of arclength."""
    sizes = cycle.amplitudes / (setting.model.scale + near.amplitudes)
    rest = [cycle.period / near.period, cycle.value / setting.unit_at(near.value)]
    return np.concatenate([sizes, rest])


def stuck(setting: Setting, cycles: Sequence[Cycle], steps: int) -> Ending:
    """Return the ending if no step succeeds."""
    last = cycles[-1]
    period = np.array([c.period for c in cycles])
    at = f"{setting.parameter} {last.value:.6g}"
    text = f"no step down to {SMALLEST_STEP:g} of arclength leads on from {at}"
    if last.period > _GROWN * period.min() and (np.diff(period[-_LOOKED_BACK:]) > 0.0).all():
        text += (
            f", where the period has grown from {period.min():.4g} s to {last.period:.4g} s and still "
            "grows: the motion likely approaches an equilibrium that it leaves ever later (a "
            f"homoclinic orbit), which no number of steps resolves (steps_per_period is {steps})"
        )
    else:
        text += (
            f" (period {last.period:.4g} s, trivial multiplier wrong by {last.trivial_error:.1g}). "
            "Equations with jumps or corners end branches so, and so do steps too long for the "
            f"motion: try more steps_per_period than {steps}, or a simulated limit cycle beyond"
        )
    return Ending(text, False)


# ---------------------------------------------------------------- equilibria and other branches


def passed(setting: Setting, last: Cycle, new: Cycle) -> Passed | None:
    """Return what a branch has passed in a step; None if nothing.

    Beyond an equilibrium lie the same motions at another phase, although the phase is held: it turns by
    half a period if the branch runs straight through the equilibrium, and less if it passes beside it.
    A branch of doubled period does the same where it joins the one of single period, and one of motions
    that are not their own mirror image continues with the mirror images where it joins symmetric ones.
    """
    scale = setting.model.scale
    before, after = (_first_harmonic(c) / scale for c in (last, new))
    sizes = [float(np.linalg.norm(h)) for h in (before, after)]
    if float(np.vdot(before, after).real) < _SAME_PHASE * sizes[0] * sizes[1]:
        near, size = min(((last, sizes[0]), (new, sizes[1])), key=lambda pair: pair[1])
        whole = float(np.linalg.norm(near.amplitudes / scale))
        return "equilibrium" if size > _SUBHARMONIC * whole else "half the period"
    middles = [c.states[:-1].mean(axis=0) / scale for c in (last, new)]
    turned = float(middles[0] @ middles[1]) < 0.0
    if turned and not (mirrored(last) or mirrored(new)):
        return "mirror image"
    return None


def _first_harmonic(cycle: Cycle) -> NDArray[np.complex128]:
    samples = cycle.states[:-1]
    turn = np.exp(-2j * math.pi * np.arange(len(samples)) / len(samples))
    return np.asarray((turn[:, None] * samples).mean(axis=0))


def joins(setting: Setting, what: Passed, last: Cycle, new: Cycle) -> Ending:
    """Return the ending of a branch that joins another, between two motions."""
    low, high = sorted((last.value, new.value))
    other = "one of half its period" if what == "half the period" else "one of symmetric motions"
    between = f"between {setting.parameter} {low:.6g} and {high:.6g}"
    return Ending(f"the branch joins {other} {between}", True)


def hopf_end(shooting: Shooting, last: Cycle, new: Cycle, after: int) -> SpecialPoint | None:
    """Return the Hopf point to which a branch shrinks, as a motion of zero amplitude.

    Parameters
    ----------
    shooting : Shooting
    last, new : Cycle
        The smallest motions, on this side of the equilibrium or on both.
    after : int
        Number of points before it.
    """
    setting = shooting.setting
    nearest = min(last, new, key=lambda c: displacement(setting.model, c.amplitudes))
    try:
        value, state, eigenvalues, change = _crossing(shooting, nearest)
    except NoCycle:
        return None
    k = int(np.argmin(np.abs(eigenvalues - 2j * math.pi / nearest.period)))
    omega = float(eigenvalues[k].imag)
    period = 2.0 * math.pi / omega
    others = np.delete(eigenvalues, int(np.argmin(np.abs(eigenvalues - eigenvalues[k].conjugate()))))
    multipliers = np.exp(others * period)
    speed, curvature, cant = setting.conditions(value)
    still = Cycle(
        speed=speed,
        curvature=curvature,
        cant=cant,
        value=value,
        period=period,
        states=np.tile(state, (len(nearest.states), 1)),
        amplitudes=np.zeros_like(state),
        multipliers=multipliers[np.argsort(-np.abs(multipliers), kind="stable")],
        trivial_error=0.0,
        tangent=nearest.tangent,
        scale=nearest.scale,
        orientation=nearest.orientation,
        state_names=nearest.state_names,
    )
    return SpecialPoint("Hopf", still, complex(np.exp(eigenvalues[k] * period)), change, after)


def _crossing(shooting: Shooting, near: Cycle) -> tuple[float, Array, NDArray[np.complex128], float]:
    """Return the value where the growth rate of the motion's mode is zero, by the secant method.

    Also return the equilibrium, all eigenvalues, and the last change of the value.
    """
    wanted = 2j * math.pi / near.period
    state = near.states[:-1].mean(axis=0)

    def at(value: float) -> tuple[float, Array, NDArray[np.complex128]]:
        x = _equilibrium(shooting, state, value)
        values = np.linalg.eigvals(shooting.jacobian(x, value)).astype(complex)
        return float(values[np.argmin(np.abs(values - wanted))].real), x, values

    unit = shooting.setting.unit_at(near.value)
    before, value = near.value + 1e-3 * unit, near.value
    rate, *_ = at(before)
    for _ in range(_SECANT_STEPS):
        here, state, eigenvalues = at(value)
        change = here * (value - before) / (here - rate) if here != rate else 0.0
        if abs(change) < _CONVERGED * unit or abs(here) < _CONVERGED * abs(wanted):
            return value, state, eigenvalues, abs(change)
        if not abs(change) < unit:
            break
        before, rate, value = value, here, value - change
    raise NoCycle


def _equilibrium(shooting: Shooting, state: Array, value: float) -> Array:
    scale = shooting.setting.model.scale
    x = state.copy()
    for _ in range(_NEWTON_STEPS):
        try:
            change = np.linalg.solve(shooting.jacobian(x, value), shooting.slope(x, value))
        except np.linalg.LinAlgError:
            raise NoCycle from None
        x -= change
        size = float(np.abs(change / scale).max())
        if size < 1e-10:
            return x
        if not size < 1e6:
            break
    raise NoCycle
