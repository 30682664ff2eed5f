"""Branches of limit cycles: the start, and the continuation from it."""

from __future__ import annotations

import math
from functools import partial
from typing import Literal

from numpy.typing import ArrayLike

from design.cycles.continuation import CycleContinuation
from design.cycles.cycle import Array, Cycle, CycleBranch, CycleError, SpecialPoint
from design.cycles.shooting import Setting
from design.stability.critical_speed import SPEED_RANGE, critical_speed
from design.stability.loss import CriticalSpeed
from railenv import checks
from railenv.errors import ParameterError
from railenv.models import Model

ABOVE_HOPF = 1.2
"""Multiple of the Hopf speed up to which a branch is followed by default."""

_FAR_BELOW = 0.1  # of a range without stable running: where a search for its Hopf point starts


def cycle_branch(
    model: Model | None = None,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    inputs: ArrayLike | None = None,
    start: CriticalSpeed | Cycle | SpecialPoint | None = None,
    parameter: str = "speed",
    parameter_range: tuple[float, float] | None = None,
    direction: Literal[1, -1] = 1,
    points: int = 150,
    longest_step: float = 0.12,
    steps_per_period: int | None = None,
    resume: CycleBranch | None = None,
    progress: bool = False,
) -> CycleBranch:
    """Follow a branch of limit cycles through folds, with its stability.

    The unknowns of the pseudo-arclength continuation are the state at the start of the period, the
    period and the parameter; the period is integrated with exact derivatives. Points at which stability
    changes are located.

    Parameters
    ----------
    model : Model
        Model; may be left out with ``resume``.
    radius : float
        Curve radius, m; ``math.inf`` is tangent track, negative the other hand.
    cant : float
        Cant angle, rad.
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs; zero when left out.
    start : CriticalSpeed, Cycle or SpecialPoint, optional
        The Hopf point to start from (the first one of the range when left out, see
        :func:`design.hopf_points` for all); a periodic motion, for instance from
        :func:`design.simulated_cycle` or another branch; or a period doubling, symmetry breaking or
        branch point of another branch, which this one leaves there.
    parameter : str
        "speed", "curvature", "cant" or a parameter of the model. Parameters other than "speed" need a
        motion as ``start``, whose other running conditions are kept.
    parameter_range : (float, float), optional
        Range to follow. By default, for the speed (m/s), 3 to 1.2 times the Hopf speed; required for
        other parameters.
    direction : {1, -1}
        Whether the parameter first grows or falls from a Cycle; a Hopf point determines it. From a
        special point, the side to which the branch is left.
    points : int
        Largest number of points.
    longest_step : float
        Longest step of arclength: 1 is about a tenth of the speed, or a change of the motion as large
        as itself.
    steps_per_period : int, optional
        Runge-Kutta steps of a period; from the fastest mode, at least 400, when left out.
    resume : CycleBranch, optional
        Continue where this branch ended; only ``parameter_range``, ``points``, ``longest_step`` and
        ``progress`` are then read.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns what has been computed.

    Returns
    -------
    CycleBranch
        If the branch cannot be followed to the end of the range, ``ended`` says why.

    Raises
    ------
    CycleError
        If there is no Hopf point, or no cycle near it.
    EquilibriumError
        If there is no running equilibrium to start from.

    Examples
    --------
    >>> import design, railenv
    >>> branch = design.cycle_branch(railenv.CooperriderBogie(), parameter_range=(60.0, 70.0))
    >>> round(branch.nonlinear_critical_speed, 2)
    66.66
    """
    if resume is not None:
        run = CycleContinuation.resumed(resume, _range(parameter_range), longest_step)
        return run.run(points, progress)
    if model is None:
        raise ParameterError("model is None; only a resumed branch brings its own")
    u = checks.vector("inputs", inputs, model.input_names)
    if isinstance(start, Cycle | SpecialPoint):
        limits = _range(parameter_range)
        cycle = start if isinstance(start, Cycle) else start.cycle
        setting = _setting(model, parameter, cycle, u, limits)
        if isinstance(start, SpecialPoint):
            run = CycleContinuation.from_switch(setting, start, direction, limits, longest_step)
        else:
            run = CycleContinuation.from_cycle(
                setting, start, direction, limits, longest_step, steps_per_period
            )
        return run.run(points, progress)
    if parameter != "speed":
        raise ParameterError(
            f"parameter is {parameter!r} and start {start!r}; a branch in another parameter than the "
            "speed starts from a limit cycle: give start=design.simulated_cycle(...)"
        )
    given = None if parameter_range is None else _range(parameter_range)
    hopf = start or _first_hopf(model, radius, cant, u, given)
    setting = _setting_at(hopf, model, u)
    limits = given or (SPEED_RANGE[0], ABOVE_HOPF * setting.speed)
    run = CycleContinuation.from_hopf(setting, hopf, limits, longest_step, steps_per_period)
    return run.run(points, progress)


def _first_hopf(
    model: Model, radius: float, cant: float, inputs: Array, limits: tuple[float, float] | None
) -> CriticalSpeed:
    """Return the first Hopf point of the range, or the next one above or below it."""
    lowest, highest = SPEED_RANGE
    low, high = limits or SPEED_RANGE
    search = partial(critical_speed, model, radius=radius, cant=cant, inputs=inputs)
    found = search(speed_range=(low, max(high, highest)))
    for start in (lowest, _FAR_BELOW * low):
        if found.loss == "unstable at start" and start < low:
            found = search(speed_range=(start, low))
    return found


def _range(limits: tuple[float, float] | None) -> tuple[float, float]:
    if limits is None:
        raise ParameterError("parameter_range is None; give the range in which to follow the branch")
    low, high = (checks.number("parameter_range", v) for v in limits)
    if not low < high:
        raise ParameterError(f"parameter_range is {limits}; the lower end must be below the higher")
    return low, high


def _setting(
    model: Model, parameter: str, start: Cycle, inputs: Array, limits: tuple[float, float]
) -> Setting:
    """Return the setting of a branch from a motion; the model must allow both ends of its range."""
    unit = None if parameter == "speed" else (limits[1] - limits[0]) / 10.0
    setting = Setting(model, parameter, start.speed, start.curvature, start.cant, inputs, unit)
    for value in limits:
        changed = setting.model_at(value)  # raises if the model does not allow the value
        changed.check_conditions(*setting.conditions(value))
    return setting


def _setting_at(hopf: CriticalSpeed, model: Model, inputs: Array) -> Setting:
    """Return the setting of a branch over speed from a Hopf point, if it is one."""
    if hopf.loss != "hunting" or hopf.speed is None:
        raise CycleError(
            f"{model.name} has no Hopf point to start from: {hopf}. Change the curve or the vehicle, "
            "or start from a simulated limit cycle (start=design.simulated_cycle(...))"
        )
    return Setting(model, "speed", hopf.speed, checks.curvature(hopf.radius), hopf.cant, inputs)
