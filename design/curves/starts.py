"""Starts of curves: critical speeds, and special points of branches of limit cycles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from design.curves import systems
from design.curves.curve import CurveKind
from design.curves.mirror import mirror_signs
from design.curves.plane import Plane, Range
from design.curves.systems import System
from design.cycles.cycle import SpecialPoint
from design.cycles.shooting import Shooting
from design.stability.loss import CriticalSpeed
from railenv import checks
from railenv.errors import ParameterError
from railenv.models import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Beginning:
    """The start of a curve.

    Attributes
    ----------
    kind : str
    plane : Plane
    system : callable
        Returns new equations, which refer to the beginning.
    guess : ndarray
        State, period (for periodic motions) and the two parameters.
    at : str or None
        The special point, if such a curve ends there.
    """

    kind: CurveKind
    plane: Plane
    system: Callable[[], System]
    guess: Array
    at: str | None = None


def from_critical_speed(
    model: Model, start: CriticalSpeed, parameters: Mapping[str, Range]
) -> Beginning:
    """Begin a curve of Hopf points or of folds of equilibria."""
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
    conditions = (start.speed, checks.curvature(start.radius), start.cant)
    plane = Plane.of(model, parameters, conditions, start.inputs)
    guess = np.concatenate([start.state, plane.start])
    eigenvalue = start.eigenvalue
    if start.loss == "hunting":
        return Beginning("Hopf", plane, partial(systems.hopf_system, plane, eigenvalue), guess)
    return Beginning(
        "fold of equilibria", plane, partial(systems.equilibrium_fold_system, plane), guess
    )


def from_cycle(
    model: Model, start: SpecialPoint, parameters: Mapping[str, Range], inputs: Array
) -> Beginning:
    """Begin a curve of the kind of a special point of a branch."""
    cycle = start.cycle
    plane = Plane.of(model, parameters, (cycle.speed, cycle.curvature, cycle.cant), inputs)
    check_parts(plane, cycle.states, str(start))
    kind, system = _system(plane, start)
    guess = np.concatenate([cycle.states[0], [cycle.period], plane.start])
    return Beginning(kind, plane, system, guess)


def check_parts(plane: Plane, states: Array, start: str) -> None:
    """Raise ParameterError unless one part of the model oscillates."""
    parts = Shooting(plane, 1).parts(states)
    if len(parts) != 1:
        raise ParameterError(
            f"start is {start}, a motion of {len(parts)} uncoupled parts; a curve needs motions of one"
        )


def _system(plane: Plane, start: SpecialPoint) -> tuple[CurveKind, Callable[[], System]]:
    """Return the kind of the curve through a special point, and a function that makes its equations."""
    motion = plane, start.cycle.states, start.cycle.period
    if start.kind == "fold":
        return "fold of cycles", partial(systems.cycle_fold_system, *motion)
    if start.kind == "period doubling":
        return "period doubling", partial(systems.flip_system, *motion)
    if start.kind == "torus":
        return "torus", partial(systems.torus_system, *motion, start.multiplier)
    if start.kind == "symmetry breaking":
        signs = mirror_signs(*motion)
        return "symmetry breaking", partial(systems.flip_system, *motion, signs)
    raise ParameterError(
        f"start is {start}; curves are followed from a fold, a period doubling, a torus or a symmetry "
        "breaking point"
    )
