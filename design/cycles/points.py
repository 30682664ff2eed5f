"""Points of a branch: motions that Newton's method finds near others."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from design.cycles.cycle import Cycle, CycleError
from design.cycles.multipliers import floquet
from design.cycles.periodic import NoCycle, PeriodicProblem, Solution, half_peak_to_peak

Array = NDArray[np.float64]


def cycle_from(problem: PeriodicProblem, found: Solution) -> Cycle:
    """Return a solution as a motion with its stability."""
    setting = problem.shooting.setting
    period, value = (float(v) for v in found.z[problem.n :])
    multipliers, error = floquet(problem, found)
    speed, curvature, cant = setting.conditions(value)
    return Cycle(
        speed=speed,
        curvature=curvature,
        cant=cant,
        value=value,
        period=period,
        states=found.states,
        amplitudes=half_peak_to_peak(found.states),
        multipliers=multipliers,
        trivial_error=error,
        tangent=found.tangent,
        scale=found.scale,
        orientation=found.orientation,
        state_names=setting.model.state_names,
    )


def position(cycle: Cycle) -> Array:
    """Return state at the start, period and parameter in one vector."""
    return np.concatenate([cycle.states[0], [cycle.period, cycle.value]])


def between(problem: PeriodicProblem, p: Cycle, q: Cycle, fraction: float) -> Cycle:
    """Return the motion of the branch at a fraction of the way, guessed by Hermite's cubic.

    Raises
    ------
    NoCycle
        If Newton's method does not converge.
    """
    way = position(q) - position(p)
    chord = way / p.scale
    length = float(np.linalg.norm(chord))
    t = fraction
    start, end = length * p.tangent * p.scale, length * q.tangent * q.scale
    guess = position(p) + (3 * t**2 - 2 * t**3) * way
    guess += (t - 2 * t**2 + t**3) * start + (t**3 - t**2) * end
    plane = (chord / length, p.scale)
    return cycle_from(problem, problem.solve(problem.improved(guess, *plane), *plane))


def solve_at(
    problem: PeriodicProblem,
    start: Cycle,
    value: float,
    direction: Literal[1, -1],
    towards: Cycle | None = None,
) -> Cycle:
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
        return cycle_from(problem, problem.solve(guess, normal, scale))
    except NoCycle:
        raise CycleError(
            f"no limit cycle at {problem.shooting.setting.parameter} {value:.6g} near the motion "
            "given; simulate longer, or start from another speed"
        ) from None
