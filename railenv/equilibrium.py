"""Running equilibria: steady running at one speed on one curve, and branches of them.

On a tight curve several equilibria coexist, on the tread and on the flange, and the one on the tread
can end in a fold. A solver started cold may find any of them, so the equilibrium is followed: from
tangent track at low speed (where it is unique, found by Levenberg-Marquardt) into the curve, then up
in speed, by pseudo-arclength continuation with the exact Jacobian.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import EquilibriumError, ParameterError
from railenv.evaluator import Evaluator
from railenv.model import Model

Array = NDArray[np.float64]

RESIDUAL_LIMIT = 1e-6
"""Largest derivative (m/s^2, rad/s^2) at an equilibrium; smaller ones are rounding error."""

LOW_SPEED = 3.0
"""Speed (m/s) at which branches enter the curve."""

_NEWTON_TOLERANCE = 1e-8  # last correction, in units of arclength (see Branch)
_NEWTON_STEPS = 8
_FARTHEST_CORRECTION = 1e3
_RELATIVE_UNIT = 0.1
_LARGEST_STEP, _SMALLEST_STEP = 1.0, 1e-7  # units of arclength
_LARGEST_MISS = 0.15  # of the step, between the prediction along the tangent and the branch
_SHORT_STEP = 1e-2
_SHARPEST_KINK = 2.0  # the same for shorter steps: flange contact bends the branch, no step jumps
_FARTHEST_BACK = 20.0  # units of s behind its start at which a branch is given up
_FEW_STEPS = 4  # the step grows after a corrector that needed no more


@dataclass(frozen=True)
class Equilibrium:
    """A running equilibrium.

    Attributes
    ----------
    speed, radius, cant : float
        m/s, m (``math.inf`` on tangent track), rad.
    state : ndarray, shape (n_states,)
    inputs : ndarray, shape (n_inputs,)
    residual : float
        Largest remaining derivative, m/s^2 or rad/s^2.
    state_names : tuple of str
    """

    speed: float
    radius: float
    cant: float
    state: Array
    inputs: Array
    residual: float
    state_names: tuple[str, ...]

    def __getitem__(self, name: str) -> float:
        """Return one state by its name."""
        checks.known("state", [name], self.state_names)
        return float(self.state[self.state_names.index(name)])


@dataclass(frozen=True)
class Point:
    """A point of a branch.

    Attributes
    ----------
    position : ndarray, shape (n_states + 1,)
        State, and the path parameter s.
    tangent : ndarray, shape (n_states + 1,)
        Unit tangent of (state, s), divided by ``scale``.
    scale : ndarray, shape (n_states + 1,)
        Size of one unit of arclength here, for each state and s.
    jacobian : ndarray
        Derivatives with respect to states, inputs, speed, curvature and cant.
    """

    position: Array
    tangent: Array
    scale: Array
    jacobian: Array

    @property
    def s(self) -> float:
        """Path parameter."""
        return float(self.position[-1])

    @property
    def state(self) -> Array:
        """State, shape (n_states,)."""
        return self.position[:-1]

    @property
    def forward(self) -> bool:
        """Whether the path parameter grows along the branch; it does not beyond a fold."""
        return bool(self.tangent[-1] > 0.0)


@dataclass(frozen=True)
class SpeedPath:
    """Running conditions along a branch at constant curve: s is the logarithm of the speed."""

    curvature: float
    cant: float
    unit: float = 0.15
    """Change of s that is one unit of arclength; 0.15 is 16 % in speed."""

    def at(self, s: float) -> tuple[float, float, float]:
        """Return speed, curvature and cant at ``s``."""
        return math.exp(s), self.curvature, self.cant

    def slope(self, s: float) -> tuple[float, float, float]:
        """Return the derivatives of speed, curvature and cant with respect to ``s``."""
        return math.exp(s), 0.0, 0.0


@dataclass(frozen=True)
class CurvePath:
    """Running conditions along a branch at constant speed, from tangent (s = 0) to a curve (s = 1)."""

    speed: float
    curvature: float
    cant: float
    unit = 0.2

    def at(self, s: float) -> tuple[float, float, float]:
        """Return speed, curvature and cant at ``s``."""
        return self.speed, s * self.curvature, s * self.cant

    def slope(self, s: float) -> tuple[float, float, float]:
        """Return the derivatives of speed, curvature and cant with respect to ``s``."""
        return 0.0, self.curvature, self.cant


class Stuck(Exception):
    """The corrector no longer converges, however small the step."""


class Branch:
    """A branch of equilibria, followed along a path by pseudo-arclength continuation.

    One unit of arclength is the path's ``unit`` of s, or a change of all states by the model's
    ``scale`` (for states far from zero, a tenth of their magnitude).
    """

    def __init__(self, model: Model, path: SpeedPath | CurvePath, inputs: Array) -> None:
        self.path = path
        self.name = model.name
        self._model = model
        self._n = model.n_states
        self._evaluator: Evaluator = model.evaluator()
        self._inputs = inputs
        self._up = np.append(np.zeros(self._n), 1.0)  # the direction of s
        from scipy.linalg.lapack import dgesv  # a slow import, not paid by `import railenv`

        self._solve = dgesv  # numpy.linalg.solve takes twice as long for a matrix this small

    def _scale(self, state: Array) -> Array:
        scale = np.empty(self._n + 1)
        scale[:-1] = math.sqrt(self._n) * (self._model.scale + _RELATIVE_UNIT * np.abs(state))
        scale[-1] = self.path.unit
        return scale

    def residual(self, state: Array, s: float) -> float:
        """Return the largest derivative (m/s^2, rad/s^2) of a state at ``s``."""
        self._evaluator.set(state, *self.path.at(s), self._inputs)
        return largest_derivative(self._evaluator)

    def _bordered(self, z: Array, scale: Array) -> tuple[Array, Array, Array]:
        """Return f, its derivative in units of ``scale`` with a free last row, and the Jacobian."""
        n = self._n
        self._evaluator.set(z[:n], *self.path.at(z[n]), self._inputs)
        f = self._evaluator.rhs()
        jacobian = self._evaluator.jacobian()
        bordered = np.empty((n + 1, n + 1))
        bordered[:n, :n] = jacobian[:, :n]
        bordered[:n, n] = jacobian[:, -3:] @ self.path.slope(z[n])
        bordered[:n] *= scale
        return f, bordered, jacobian

    def point(self, guess: Array, normal: Array, scale: Array) -> tuple[Point, int]:
        """Solve f = 0 by Newton's method in the hyperplane through ``guess`` with a normal.

        Parameters
        ----------
        guess : ndarray, shape (n_states + 1,)
            State and s.
        normal : ndarray, shape (n_states + 1,)
            Normal of the hyperplane, divided by ``scale``; the tangent points to the same side.
        scale : ndarray, shape (n_states + 1,)

        Returns
        -------
        Point, number of Newton steps

        Raises
        ------
        Stuck
            If it does not converge.
        """
        z, right = guess, np.zeros((self._n + 1, 2))
        right[-1, 1] = 1.0  # the second solution is the tangent
        for steps in range(1, _NEWTON_STEPS + 1):
            f, bordered, jacobian = self._bordered(z, scale)
            bordered[-1] = normal
            right[:-1, 0] = f
            right[-1, 0] = normal @ ((z - guess) / scale)
            *_, solution, singular = self._solve(bordered, right)
            if singular:
                raise Stuck
            change = solution[:, 0]
            size = float(np.abs(change).max())
            if not size < _FARTHEST_CORRECTION:
                raise Stuck
            z = z - change * scale
            if size < _NEWTON_TOLERANCE:
                here = self._scale(z[:-1])
                tangent = solution[:, 1] * scale / here
                tangent /= math.sqrt(tangent @ tangent)
                return Point(z, tangent, here, jacobian), steps
        raise Stuck

    def start(self, state: Array, s: float) -> Point:
        """Return the point at ``s`` near ``state``; the branch leaves it towards larger s.

        Raises
        ------
        EquilibriumError
            If the Jacobian is singular there.
        """
        try:
            return self.point(np.append(state, s), self._up, self._scale(state))[0]
        except Stuck:
            speed, curvature, cant = self.path.at(s)
            raise EquilibriumError(
                f"the running equilibrium of {self.name} at {speed:g} m/s, curvature {curvature:g} 1/m "
                f"and cant {cant:g} rad is not isolated (its Jacobian is singular), so no branch can "
                "be followed from it; a state that nothing restores, or a fold, does that",
                self.residual(state, s),
                speed,
            ) from None

    def between(self, p: Point, q: Point, fraction: float) -> Point:
        """Return the point of the branch at a fraction of the way from p to q."""
        way = q.position - p.position
        chord = way / p.scale
        length = float(np.linalg.norm(chord))
        if length == 0.0:
            return p
        return self.point(p.position + fraction * way, chord / length, p.scale)[0]

    def paces(self, p: Point, q: Point) -> tuple[float, float]:
        """Return the arclength per fraction of the way from p to q (:meth:`between`), at p and at q.

        Each is in units of its own point.
        """
        chord = (q.position - p.position) / p.scale
        squared = float(chord @ chord)
        return (
            squared / float(chord @ p.tangent),
            squared / float(chord @ (q.tangent * q.scale / p.scale)),
        )

    def ahead(self, p: Point, distance: float) -> Point:
        """Return the uncorrected prediction of a point's tangent, some units of arclength ahead."""
        z = p.position + distance * p.tangent * p.scale
        self._evaluator.set(z[: self._n], *self.path.at(z[self._n]), self._inputs)
        return Point(z, p.tangent, p.scale, self._evaluator.jacobian())

    def points(self, first: Point, s_end: float) -> Iterator[Point]:
        """Follow the branch from a point, passing folds, until s reaches ``s_end``.

        The last point lies at ``s_end`` exactly. Steps are in units of arclength.

        Raises
        ------
        Stuck
            If the corrector fails at the smallest step, or the branch turns back beyond its start.
        """
        point, step = first, _LARGEST_STEP
        yield point
        while point.s < s_end:
            try:
                following, steps = self._advance(point, step, s_end)
            except Stuck:
                step /= 2.0
                if step < _SMALLEST_STEP:
                    raise
                continue
            if following.s < first.s - _FARTHEST_BACK * self.path.unit:
                raise Stuck
            point = following
            yield point
            if steps <= _FEW_STEPS:
                step = min(2.0 * step, _LARGEST_STEP)

    def _advance(self, point: Point, step: float, s_end: float) -> tuple[Point, int]:
        """Return the next point, at ``s_end`` if the step would pass it, and its Newton steps."""
        guess = point.position + step * point.tangent * point.scale
        following, steps = self.point(guess, point.tangent, point.scale)
        missed = (following.position - guess) / point.scale
        miss = math.sqrt(missed @ missed)
        if miss > (_LARGEST_MISS if step > _SHORT_STEP else _SHARPEST_KINK) * step:
            raise Stuck  # too far from the prediction to be the same branch with no fold between
        if following.s > s_end:
            fraction = (s_end - point.s) / (following.s - point.s)
            guess = point.position + fraction * (following.position - point.position)
            guess[-1] = s_end
            return self.point(guess, self._up, point.scale)
        return following, steps


def largest_derivative(evaluator: Evaluator) -> float:
    """Return the largest magnitude of the derivatives at an evaluator's present state."""
    return float(np.abs(evaluator.rhs()).max())


def tangent_equilibrium(model: Model, speed: float, inputs: Array) -> Array:
    """Find the equilibrium on tangent track by Levenberg-Marquardt from the model's guess.

    Raises
    ------
    EquilibriumError
        If it finds none.
    """
    from scipy import optimize  # a slow import, not paid by `import railenv`

    evaluator = model.evaluator()
    n = model.n_states

    def f(x: Array) -> Array:
        evaluator.set(x, speed, 0.0, 0.0, inputs)
        return evaluator.rhs()

    def jacobian(x: Array) -> Array:
        evaluator.set(x, speed, 0.0, 0.0, inputs)
        return evaluator.jacobian()[:, :n]

    with np.errstate(all="ignore"):  # MINPACK underflows on its way; what it finds is checked
        result: Any = optimize.root(
            f, model.guess, jac=jacobian, method="lm", options={"xtol": 1e-15, "ftol": 1e-15}
        )
    residual = float(np.abs(f(result.x)).max())
    if not residual < RESIDUAL_LIMIT:
        raise EquilibriumError(
            f"{model.name} has no running equilibrium on tangent track at {speed:g} m/s that "
            f"Levenberg-Marquardt finds from the model's guess: the largest derivative left is "
            f"{residual:.3g} (limit {RESIDUAL_LIMIT:g})",
            residual,
        )
    return np.asarray(result.x)


def enter_curve(
    model: Model, curvature: float, cant: float, inputs: Array, speed: float = LOW_SPEED
) -> Array:
    """Find the equilibrium on a curve at low speed, followed from tangent track.

    Raises
    ------
    EquilibriumError
        If there is no equilibrium on tangent track or the branch cannot be followed to the curve.
    """
    model.check_conditions(speed, curvature, cant)
    state = tangent_equilibrium(model, speed, inputs)
    if curvature == 0.0 and cant == 0.0:
        return state
    branch = Branch(model, CurvePath(speed, curvature, cant), inputs)
    return _at_end(branch, state, 0.0, 1.0, through_folds=True)


def find_equilibrium(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    inputs: ArrayLike | None = None,
    through_folds: bool = False,
) -> Equilibrium:
    """Find the running equilibrium at a speed on a curve, on the branch that starts at low speed.

    Parameters
    ----------
    model : Model
    speed : float
        Forward speed, m/s.
    radius : float
        Curve radius, m; ``math.inf`` is tangent track, negative the other hand.
    cant : float
        Cant angle, rad.
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs; zero when left out.
    through_folds : bool, default False
        Also follow the branch around a fold in speed. An accelerating train does not reach the part
        beyond: it would jump from the tread onto the flange.

    Raises
    ------
    EquilibriumError
        If the branch ends before the speed is reached; the message gives the place and the residual.
    """
    speed = checks.speed(speed)
    curvature, cant = checks.curvature(radius), checks.cant(cant)
    u = checks.vector("inputs", inputs, model.input_names)
    low = min(speed, LOW_SPEED)
    state = enter_curve(model, curvature, cant, u, low)
    if speed > low:
        branch = Branch(model, SpeedPath(curvature, cant), u)
        state = _at_end(branch, state, math.log(low), math.log(speed), through_folds)
    evaluator = model.evaluator()
    evaluator.set(state, speed, curvature, cant, u)
    return Equilibrium(
        speed, float(radius), cant, state, u, largest_derivative(evaluator), model.state_names
    )


def _at_end(branch: Branch, state: Array, s: float, s_end: float, through_folds: bool) -> Array:
    """Return the state at ``s_end`` of a branch from (state, s).

    Raises
    ------
    EquilibriumError
        If the branch does not reach it.
    """
    reached: Point | None = None
    try:
        for reached in branch.points(branch.start(state, s), s_end):
            if not (reached.forward or through_folds):
                raise Stuck
    except Stuck:
        raise _lost(branch, reached, s_end) from None
    assert reached is not None
    return reached.state


def follow_speeds(
    model: Model, speeds: ArrayLike, *, radius: float = math.inf, cant: float = 0.0
) -> Iterator[Point]:
    """Follow the running equilibrium through increasing speeds; yield one point for each.

    Parameters
    ----------
    model : Model
    speeds : array_like
        Increasing, m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).

    Raises
    ------
    EquilibriumError
        If the branch ends before the next speed; the points before it have been yielded.
    """
    curvature, cant = checks.curvature(radius), checks.cant(cant)
    targets = [checks.speed(v) for v in np.atleast_1d(np.asarray(speeds, dtype=float))]
    low = min(targets[0], LOW_SPEED)
    inputs = np.zeros(model.n_inputs)
    branch = Branch(model, SpeedPath(curvature, cant), inputs)
    state, s = enter_curve(model, curvature, cant, inputs, low), math.log(low)
    for v, following in zip(targets, [*targets[1:], math.inf], strict=True):
        if not v < following:
            raise ParameterError(f"speed {following:g} m/s follows {v:g}; speeds must increase")
        state, s = _at_end(branch, state, s, math.log(v), through_folds=False), math.log(v)
        yield branch.start(state, s)


def _lost(branch: Branch, point: Point | None, s_end: float) -> EquilibriumError:
    """Return the error with the end of a branch and its last state's residual at the wanted place."""
    speed, curvature, cant = branch.path.at(s_end)
    where = f"{speed:g} m/s on a curve of {curvature:g} 1/m with cant {cant:g} rad"
    if point is None:
        return EquilibriumError(
            f"{branch.name} has no running equilibrium that can be followed towards {where}", math.inf
        )
    reached_speed, reached_curvature, _ = branch.path.at(point.s)
    residual = branch.residual(point.state, s_end)
    if point.forward:
        end = "it ends there, as when a wheel lifts off the rail"
        advice = ""
    else:
        end = "it turns back in a fold"
        advice = "; through_folds=True follows it beyond the fold"
    return EquilibriumError(
        f"{branch.name} has no running equilibrium at {where} on the branch that starts on tangent "
        f"track at low speed: near {reached_speed:.4g} m/s and curvature {reached_curvature:.4g} 1/m "
        f"{end}. With its last state the largest derivative at the wanted condition is "
        f"{residual:.3g}. Lower the speed, widen the curve or change the cant{advice}",
        residual,
        reached_speed,
    )
