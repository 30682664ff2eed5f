"""Other curves through a special point of a curve."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from design.curves import systems
from design.curves.bordering import NoPoint
from design.curves.curve import CurveError, CurveKind, CurvePoint, CurveSpecialPoint
from design.curves.ends import size
from design.curves.follower import Follower
from design.curves.plane import Plane, Range
from design.curves.starts import Beginning, check_parts
from design.curves.systems import System
from design.cycles.shooting import CONDITIONS, Shooting, steps_for
from design.stability.mode_shape import displacement_rows
from railenv import checks
from railenv.errors import ParameterError
from railenv.models import Model

Array = NDArray[np.float64]

THROUGH: dict[CurveKind, tuple[str, ...]] = {
    "Hopf": ("Bautin", "Hopf-Hopf", "fold-Hopf", "Bogdanov-Takens"),
    "fold of equilibria": ("fold-Hopf", "Bogdanov-Takens"),
    "fold of cycles": ("Bautin", "fold-flip", "fold-torus"),
    "period doubling": ("fold-flip", "flip-torus", "1:2 resonance"),
    "torus": ("fold-torus", "flip-torus", "double torus", "1:2 resonance"),
}
"""Special points through which a curve of each kind leads."""

_AMPLITUDES = (0.1, 0.3, 1.0, 0.03)  # of the model's scale, tried in turn at a Bautin point
_STAYS = 0.2  # of such an amplitude: a smaller one is the equilibrium itself


def through(
    model: Model,
    start: CurveSpecialPoint,
    kind: CurveKind | None,
    parameters: Mapping[str, Range],
    inputs: Array,
) -> Beginning:
    """Begin another curve at a special point of a curve.

    Raises
    ------
    ParameterError
        If no curve of the kind leads through the point.
    CurveError
        If no curve of folds of cycles is found at a Bautin point.
    """
    leading = [name for name, points in THROUGH.items() if start.kind in points]
    if not leading:
        raise ParameterError(f"start is {start}; no other curve is followed from such a point")
    checks.choice(f"kind of the curve from {start.kind}", kind, leading)
    assert kind is not None
    point = start.point
    values = dict(zip(point.parameters, point.values, strict=True))
    own = {name: value for name, value in values.items() if name not in CONDITIONS}
    placed = model.replace(**own) if own else model
    conditions = (point.speed, point.curvature, point.cant)
    plane = Plane.of(placed, parameters, conditions, inputs)
    if kind in ("Hopf", "fold of equilibria"):
        return _equilibria(plane, start, kind)
    if start.kind == "Bautin":
        return _small_cycles(plane, start)
    return _cycles(plane, start, kind)


def _equilibria(plane: Plane, start: CurveSpecialPoint, kind: CurveKind) -> Beginning:
    point = start.point
    guess = np.concatenate([point.state, plane.start])
    if kind == "fold of equilibria":
        return Beginning(kind, plane, partial(systems.equilibrium_fold_system, plane), guess)
    if start.kind == "Bogdanov-Takens":
        return Beginning(kind, plane, partial(systems.hopf_system, plane, 0j), guess, start.kind)
    if start.kind == "Bautin":
        assert point.period is not None
        eigenvalue = 2j * math.pi / point.period
    else:
        eigenvalue = _critical(point, point.spectrum.real)
    return Beginning(kind, plane, partial(systems.hopf_system, plane, eigenvalue), guess)


def _cycles(plane: Plane, start: CurveSpecialPoint, kind: CurveKind) -> Beginning:
    point = start.point
    assert point.period is not None
    shooting = Shooting(plane, point.steps)
    states = shooting.shoot(point.state, point.period, plane.start).states
    check_parts(plane, states, str(start))
    guess = np.concatenate([point.state, [point.period], plane.start])
    motion = plane, states, point.period
    at: str | None = None
    system: Callable[[], System]
    if kind == "fold of cycles":
        system = partial(systems.cycle_fold_system, *motion)
    elif kind == "period doubling":
        system = partial(systems.flip_system, *motion)
    else:
        double = start.kind == "1:2 resonance"
        at = start.kind if double else None
        logarithms = np.log(np.abs(point.spectrum) + 1e-300)
        multiplier = -1.0 + 0j if double else _critical(point, logarithms)
        system = partial(systems.torus_system, *motion, multiplier)
    return Beginning(kind, plane, system, guess, at)


def _critical(point: CurvePoint, growth: Array) -> complex:
    """Return the complex eigenvalue or multiplier nearest to its limit that is not yet critical."""
    spectrum, other = point.spectrum, point.critical.conjugate()
    apart = np.minimum(np.abs(spectrum - point.critical), np.abs(spectrum - other))
    taken = apart < 1e-4 * max(abs(point.critical), 1e-6)
    candidates = (spectrum.imag > 0.0) & ~taken
    if not candidates.any():
        raise CurveError("the special point has no second pair that is critical")
    k = int(np.argmin(np.where(candidates, np.abs(growth), np.inf)))
    return complex(spectrum[k])


def _small_cycles(plane: Plane, start: CurveSpecialPoint) -> Beginning:
    """Begin the curve of folds of cycles at a Bautin point, with a motion of small amplitude."""
    point = start.point
    assert point.period is not None
    shooting = Shooting(plane, 1)
    shooting.steps = steps_for(shooting, point.state, point.period, plane.start)
    n, scale = plane.model.n_states, plane.model.scale
    values, vectors = np.linalg.eig(shooting.linear(point.state, plane.start)[:, :n])
    mode = vectors[:, np.argmin(np.abs(values - 2j * math.pi / point.period))]
    seen = (mode / scale)[displacement_rows(plane.model)]
    mode = mode / seen[np.argmax(np.abs(seen))]
    turn = np.exp(2j * np.pi * np.linspace(0.0, 1.0, shooting.steps + 1))
    for amplitude in _AMPLITUDES:
        states = point.state + amplitude * (turn[:, None] * mode).real
        guess = np.concatenate([states[0], [point.period], plane.start])
        motion = plane, states, point.period
        beginning = Beginning(
            "fold of cycles", plane, partial(systems.cycle_fold_system, *motion), guess
        )
        try:
            node = Follower(beginning.system(), 1.0).start(guess, 1)
        except NoPoint:
            continue
        if size(plane, node.features) > _STAYS * amplitude:
            return beginning
    raise CurveError(
        f"no fold of limit cycles of small amplitude is found near the {start}; follow a branch "
        "of limit cycles nearby, and start from its fold"
    )
