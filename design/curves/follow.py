"""Curves of bifurcations: where one starts, and how far it is followed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.curves import systems
from design.curves.curve import BifurcationCurve, CurveKind
from design.curves.mirror import mirror_signs
from design.curves.plane import Plane, Range
from design.curves.run import Run
from design.curves.systems import System
from design.cycles.cycle import Cycle, SpecialPoint
from design.cycles.shooting import Shooting
from design.stability.loss import CriticalSpeed, HopfPoint
from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.models import Model

Array = NDArray[np.float64]
Start = CriticalSpeed | HopfPoint | SpecialPoint


def bifurcation_curve(
    model: Model,
    start: Start,
    parameters: Mapping[str, Range],
    *,
    inputs: ArrayLike | None = None,
    points: int = 100,
    longest_step: float = 0.25,
    progress: bool = False,
) -> BifurcationCurve:
    """Follow a bifurcation over two parameters, through turning points, with its special points.

    Equilibria or periodic motions, with the condition that makes them critical as a further equation
    (minimally extended systems of bordered matrices), are followed by pseudo-arclength continuation
    from the start to both sides.

    Parameters
    ----------
    model : Model
        With the parameters that the start was found with.
    start : CriticalSpeed, HopfPoint or SpecialPoint
        Where to start. Hunting gives a curve of Hopf points, a fold in which steady running ends one of
        folds of equilibria; a special point of a branch of limit cycles a curve of its own kind.
    parameters : mapping of str to (float, float)
        The two parameters, each with the range in which the curve is followed: "speed" (m/s),
        "curvature" (1/m), "cant" (rad), or a parameter of the model. Other running conditions are those
        of the start.
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs of periodic motions, zero when left out; a critical speed brings its own.
    points : int
        Most points on either side of the start.
    longest_step : float
        Of arclength: 1 is a tenth of the range of a parameter, or a change of the motion as large as
        itself.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns what has been computed.

    Returns
    -------
    BifurcationCurve

    Raises
    ------
    CurveError
        If no curve is found at the start.
    ParameterError
        If the start is none that a curve can be followed from, or the model does not allow the ranges.

    Examples
    --------
    >>> import design, railenv
    >>> bogie = railenv.CooperriderBogie()
    >>> hopf = design.critical_speed(bogie)
    >>> curve = design.bifurcation_curve(bogie, hopf, {"conicity": (0.04, 0.06), "speed": (50.0, 90.0)})
    >>> [round(v, 2) for v in curve.at("conicity", 0.05)]
    [68.64]
    """
    points = checks.whole("points", points)
    longest_step = checks.number("longest_step", longest_step, low=0.0, open_low=True)
    if isinstance(start, HopfPoint):
        start = start.critical
    if isinstance(start, CriticalSpeed):
        run = _from_equilibrium(model, start, parameters, inputs, longest_step)
    elif isinstance(start, SpecialPoint):
        run = _from_cycle(model, start, parameters, inputs, longest_step)
    else:
        raise ParameterError(
            f"start is {shown(start)}; it must be a CriticalSpeed, a HopfPoint or a special point of a "
            "branch of limit cycles"
        )
    return run.curve(points, progress)


def _from_equilibrium(
    model: Model,
    start: CriticalSpeed,
    parameters: Mapping[str, Range],
    inputs: ArrayLike | None,
    longest_step: float,
) -> Run:
    if start.loss not in ("hunting", "fold") or start.period is not None:
        raise ParameterError(
            f"start is {start}; a curve of equilibria starts from hunting or a fold of a vehicle "
            "without a controller in discrete time"
        )
    if start.multiplicity > 1:
        raise ParameterError(
            f"start is {start}, where {start.multiplicity} modes are critical at once; a curve "
            "needs one"
        )
    assert start.speed is not None
    assert start.state is not None
    assert start.eigenvalue is not None
    if inputs is not None:
        raise ParameterError("inputs are given; a critical speed brings its own")
    conditions = (start.speed, checks.curvature(start.radius), start.cant)
    plane = Plane.of(model, parameters, conditions, start.inputs)
    guess = np.concatenate([start.state, plane.start])
    eigenvalue = start.eigenvalue

    def hopf() -> System:
        return systems.hopf_system(plane, eigenvalue)

    def fold() -> System:
        return systems.equilibrium_fold_system(plane)

    if start.loss == "hunting":
        return Run("Hopf", plane, hopf, guess, longest_step)
    return Run("fold of equilibria", plane, fold, guess, longest_step)


def _from_cycle(
    model: Model,
    start: SpecialPoint,
    parameters: Mapping[str, Range],
    inputs: ArrayLike | None,
    longest_step: float,
) -> Run:
    cycle = start.cycle
    u = checks.vector("inputs", inputs, model.input_names)
    plane = Plane.of(model, parameters, (cycle.speed, cycle.curvature, cycle.cant), u)
    parts = Shooting(plane, 1).parts(cycle.states)
    if len(parts) != 1:
        raise ParameterError(
            f"start is {start}, a motion of {len(parts)} uncoupled parts; a curve needs motions of one"
        )
    kind, system = _system(plane, start)
    guess = np.concatenate([cycle.states[0], [cycle.period], plane.start])
    return Run(kind, plane, system, guess, longest_step)


def _system(plane: Plane, start: SpecialPoint) -> tuple[CurveKind, Callable[[], System]]:
    """Return the kind of the curve through a special point, and what makes its equations."""
    cycle: Cycle = start.cycle
    motion = plane, cycle.states, cycle.period
    if start.kind == "fold":
        return "fold of cycles", lambda: systems.cycle_fold_system(*motion)
    if start.kind == "period doubling":
        return "period doubling", lambda: systems.flip_system(*motion)
    if start.kind == "torus":
        return "torus", lambda: systems.torus_system(*motion, start.multiplier)
    if start.kind == "symmetry breaking":
        signs = mirror_signs(plane, cycle.states, cycle.period)
        return "symmetry breaking", lambda: systems.flip_system(*motion, signs)
    raise ParameterError(
        f"start is {start}; curves are followed from a fold, a period doubling, a torus or a symmetry "
        "breaking point"
    )
