"""Tuning of structured output feedback by the gradient of the worst growth rate.

Vehicles of several conicities (or wears) and creep factors at speeds up to a target make a family of
linear plants. The derivatives of an eigenvalue with respect to the gains follow from its eigenvectors
where the loop closes. So the worst growth rate of the family, as a soft maximum, is minimised with its
gradient. The target speed rises as long as every plant of the family can be kept stable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from agents.controllers.output_feedback import (
    Filters,
    OutputFeedback,
    Term,
    basis,
    low_pass_share,
    terms_of,
)
from agents.controllers.scheduled import CONTROL_PERIOD, readings_of
from agents.controllers.service import vehicles_of_service
from agents.tuning.family import Family
from railenv import Equipped
from railenv.errors import ParameterError
from railenv.threads import one_blas_thread

Array = NDArray[np.float64]

_ACCELERATION, _YAW_RATE = 0.4, 4.0
"""Usual gains, in shares of the limit per m/s^2 and per rad/s, to scale the search."""

_SHARPNESS = 4.0  # s, of the soft maximum of decay rates
_TOP = 4  # slowest modes of each plant that count
_FLOOR = 1e-12
_DEFECTIVE = 1e7  # share of a state in a mode, where eigenvalues meet and have no derivative
_LARGEST = 1e60  # entry of a left eigenvector, in whatever unit


@dataclass(frozen=True, kw_only=True)
class Goal:
    """The goal of the tuning.

    Attributes
    ----------
    vehicles : tuple of mapping, optional
        Changes of the model, each a vehicle that has to decay; when left out, five conicities (or
        wears) with two creep factors, if the model has these numbers.
    speeds : tuple of float
        Speeds, m/s; the target speed is added.
    decay : float
        Rate (1/s) at which every motion of every plant has to decay.
    noise : float
        Moment (share of the limit) that the sensors' noise alone may command.
    """

    vehicles: tuple[Mapping[str, float], ...] | None = None
    speeds: tuple[float, ...] = (20.0, 30.0, 40.0, 55.0, 70.0, 85.0, 100.0, 115.0, 130.0, 145.0)
    decay: float = 0.3
    noise: float = 0.08

    def of(self, model: Equipped) -> tuple[Mapping[str, float], ...]:
        """Return the vehicles for a model."""
        if self.vehicles is None:
            return vehicles_of_service(model, creep_factors=(0.6, 1.4))
        return self.vehicles


@dataclass(frozen=True)
class _Gains:
    """Scaling of a search's gains, shape (nodes, m, t), to those of the controller.

    Attributes
    ----------
    units : ndarray, shape (m, t)
    noise : ndarray, shape (m, t, t)
        Covariance of the noise that the terms let through, in shares of each limit.
    """

    units: Array
    noise: Array

    @classmethod
    def of(cls, model: Equipped, filters: Filters, period: float) -> Self:
        """Return the scaling for a model's output feedback."""
        terms, limits = terms_of(model, filters), model.limits
        units = np.outer(limits, [_usual(term) for term in terms])
        noise = _let_through(model, terms, period)
        return cls(units, noise / limits[:, None, None] ** 2)

    def scaled(self, gains: ArrayLike, nodes: int) -> Array:
        """Return given gains as scaled in the search."""
        given = np.asarray(gains, dtype=float)
        shape = (nodes, *self.units.shape)
        if given.shape != shape or not np.isfinite(given).all():
            raise ParameterError(f"begin has shape {given.shape}; it must be {shape} finite numbers")
        return np.asarray(given / self.units).ravel()

    def start(self, model: Equipped, terms: Sequence[Term], nodes: int, seed: int) -> Array:
        """Return scaled gains near a plain yaw damper of each actuator."""
        gains = np.zeros((nodes, *self.units.shape))
        for k, mount in enumerate(model.equipment.mounts):
            for t, term in enumerate(terms):
                own = term.corner is None and term.signal in (f"gyro_{b}" for b in mount.between[:1])
                gains[:, k, t] = -0.5 * (mount.acts == "yaw" and own)
        if seed > 0:
            gains += 0.2 * np.random.default_rng(seed).normal(size=gains.shape)
        return gains.ravel()


def _inverses(right: Array) -> Array:
    """Return the left eigenvectors of matrices; infinities if right ones are not independent."""
    try:
        return np.asarray(np.linalg.inv(right))
    except np.linalg.LinAlgError:
        found = np.full_like(right, np.inf)
        for k, vectors in enumerate(right):
            try:
                found[k] = np.linalg.inv(vectors)
            except np.linalg.LinAlgError:
                continue
        return found


def _usual(term: Term) -> float:
    """Return a usual gain of a term, as a share of the limit per m/s^2 or rad/s."""
    unit = _ACCELERATION if term.signal.startswith("accel_") else _YAW_RATE
    return unit if term.corner is None else unit * max(1.0, 10.0 / term.corner)


class _Objective:
    """Soft maximum of the growth rates of a family, with its gradient in the scheduled gains."""

    def __init__(
        self, family: Family, parts: tuple[Array, ...], nodes: Array, goal: Goal, gains: _Gains
    ) -> None:
        self.family, self.goal, self.gains = family, goal, gains
        A, B, C, D = parts
        self.rows = np.concatenate([D @ family.S, C], axis=1)  # (t, n + k)
        # shares of the nodes' gains at each plant's speed
        clipped = np.clip(family.speed, nodes[0], nodes[-1])
        self.shares = np.array([np.interp(clipped, nodes, row) for row in np.eye(len(nodes))]).T
        q, n, k = len(family.A), family.A.shape[1], len(A)
        self.fixed = np.zeros((q, n + k, n + k))
        self.fixed[:, :n, :n] = family.A
        self.fixed[:, n:, :n] = B @ family.S
        self.fixed[:, n:, n:] = A
        self.n, self.k = n, k

    def at_nodes(self, x: Array) -> Array:
        """Return the gains at the nodes, shape (nodes, m, t)."""
        return np.asarray(x.reshape(-1, *self.gains.units.shape) * self.gains.units)

    def rates(self, x: Array, period: float) -> tuple[Array, Array]:
        """Return growth rates (q, top) and their derivatives (q, top, m, t)."""
        gains = np.einsum("qk,kmt->qmt", self.shares, self.at_nodes(x))
        M = self.fixed.copy()
        M[:, : self.n] += self.family.B @ (gains @ self.rows)
        values, right = np.linalg.eig(M)
        order = np.argsort(-np.abs(values), axis=1)[:, :_TOP]
        left = _inverses(right)
        mu = np.take_along_axis(values, order, 1)
        v = np.take_along_axis(right, order[:, None, :], 2)  # (q, z, top)
        w = np.take_along_axis(left, order[:, :, None], 1)  # (q, top, z)
        into = (w[:, :, : self.n] @ self.family.B) / mu[:, :, None]  # (q, top, m)
        slope = np.einsum("qam,qta->qamt", into, self.rows @ v)
        # where eigenvalues meet, inverses are of no use, however large they are in a state alone
        shares = np.abs(w * v.swapaxes(1, 2)).max(axis=2)
        slope[~((shares < _DEFECTIVE) & (np.abs(w).max(axis=2) < _LARGEST))] = 0.0
        rates = np.log(np.maximum(np.abs(mu), _FLOOR)) / period
        return rates, slope.real / period

    def __call__(self, x: Array, period: float) -> tuple[float, Array]:
        rates, slopes = self.rates(x, period)
        top = rates.max()
        weight = np.exp(_SHARPNESS * (rates - top))
        total = weight.sum()
        value = top + np.log(total) / _SHARPNESS
        per_plant = np.einsum("qa,qamt->qmt", weight / total, slopes)
        gradient = np.einsum("qk,qmt->kmt", self.shares, per_plant) * self.gains.units
        # noise commanded at each node, beyond what is allowed
        gains = self.at_nodes(x)
        through = np.einsum("mts,kms->kmt", self.gains.noise, gains)
        commanded = np.sqrt((gains * through).sum(axis=2)) + 1e-12
        excess = np.maximum(commanded - self.goal.noise, 0.0)
        value += 1e2 * float((excess**2).sum())
        gradient += 2e2 * (excess / commanded)[:, :, None] * through * self.gains.units
        return float(value), gradient.ravel()

    def minimized(self, x: Array, period: float, iterations: int) -> Any:
        """Return SciPy's result from scaled gains, by the quasi-Newton method."""
        options = {"maxiter": iterations}
        return optimize.minimize(self, x, (period,), "L-BFGS-B", jac=True, options=options)


@dataclass(frozen=True)
class Tuned:
    """Result of a tuning.

    Attributes
    ----------
    controller : OutputFeedback
    target : float
        Highest speed (m/s) for which the goal was met.
    evaluations : int
        Number of closed-loop families evaluated: the cost of the tuning.
    """

    controller: OutputFeedback
    target: float
    evaluations: int


def tune_output_feedback(
    model: Equipped,
    *,
    filters: Filters | None = None,
    nodes: Sequence[float] = (20.0, 60.0, 100.0, 140.0, 180.0),
    goal: Goal | None = None,
    begin: ArrayLike | None = None,
    start: float = 110.0,
    step: float = 5.0,
    highest: float = 300.0,
    iterations: int = 150,
    period: float = CONTROL_PERIOD,
    seed: int = 0,
) -> Tuned:
    """Tune the gains of an :class:`agents.OutputFeedback` for the highest robust critical speed.

    Parameters
    ----------
    model : Equipped
    filters : Filters, optional
    nodes : sequence of float
        Speeds between which gains are linear, m/s; they are held beyond the target that was reached.
    goal : Goal, optional
    begin : array_like, shape (nodes, m, t), optional
        Gains from which the search starts, as in :meth:`OutputFeedback.design`; those of a plain yaw
        damper when left out.
    start, step, highest : float
        First target speed, step and highest target speed, m/s.
    iterations : int
        Iterations of the quasi-Newton method for each target.
    period : float
        Control period, s.
    seed : int
        Seed of the initial gains if they are left out; 0 is the plain yaw damper.

    Returns
    -------
    Tuned

    Raises
    ------
    ParameterError
        If not even the first target can be met.
    """
    wanted = Goal() if goal is None else goal
    f = Filters() if filters is None else filters
    knots = np.asarray(nodes, dtype=float)
    best, reached, evaluations = None, 0.0, 0
    with one_blas_thread():
        problem = _Problem(model, f, knots, wanted, period)
        x = problem.gains.start(model, terms_of(model, f), len(knots), seed)
        if begin is not None:
            x = problem.gains.scaled(begin, len(knots))
        for target in np.arange(start, highest + 1e-9, step).tolist():
            objective = problem.up_to(target)
            found = objective.minimized(x, period, iterations)
            evaluations += int(found.nfev)
            if objective.rates(found.x, period)[0].max() > -wanted.decay:
                break
            best, reached, x = objective.at_nodes(found.x), target, found.x
    if best is None:
        raise ParameterError(
            f"start is {start:g} m/s; with these filters the family cannot be kept stable up to there"
        )
    about = {
        "vehicles": [dict(vehicle) for vehicle in wanted.of(model)],
        "speeds": list(wanted.speeds),
        "decay": wanted.decay,
        "noise": wanted.noise,
        "target": reached,
        "evaluations": evaluations,
        "seed": seed,
    }
    held, gains = _held(best, knots, reached)
    controller = OutputFeedback.design(
        model, speeds=held, gains=gains, filters=f, period=period, about=about
    )
    return Tuned(controller, reached, evaluations)


class _Problem:
    """The constant parts of a tuning while its target speed rises."""

    def __init__(
        self, model: Equipped, filters: Filters, knots: Array, goal: Goal, period: float
    ) -> None:
        self.model, self.knots, self.goal, self.period = model, knots, goal, period
        readings = readings_of(model, "sensors", period)
        self.signals = [reading.signal for reading in readings]
        self.parts = basis(model, readings, filters, period)
        self.gains = _Gains.of(model, filters, period)
        self.vehicles = goal.of(model)
        self.base = self._family(goal.speeds)

    def _family(self, speeds: Sequence[float]) -> Family:
        return Family.of(self.model, self.signals, self.vehicles, speeds, self.period)

    def up_to(self, target: float) -> _Objective:
        """Return the objective over all plants up to a target speed (m/s)."""
        goal, base = self.goal, self.base
        extra = np.arange(max(goal.speeds) + 10.0, target, 10.0).tolist()
        more = self._family([*extra, target])
        below = base.speed < target
        family = Family(base.A[below], base.B[below], base.S, base.speed[below]).joined(more)
        return _Objective(family, self.parts, self.knots, goal, self.gains)


def _let_through(model: Equipped, terms: Sequence[Term], period: float) -> Array:
    """Return the covariance of white noise after the terms: none between those of two sensors.

    The output of a low-pass filter contains past readings only, so not the present noise.
    """
    s = model.sensors
    found = np.zeros((len(terms), len(terms)))
    for i, one in enumerate(terms):
        level = s.accelerometer_noise if one.signal.startswith("accel_") else s.gyro_noise
        for k, other in enumerate(terms):
            if one.signal == other.signal:
                found[i, k] = level**2 * _alike(one.corner, other.corner, period)
    return found


def _alike(one: float | None, other: float | None, period: float) -> float:
    """Return the covariance of white noise of variance 1 behind two filters (None: none)."""
    if one is None or other is None:
        return float(one is other)
    a, b = low_pass_share(one, period), low_pass_share(other, period)
    return a * b / (1.0 - (1.0 - a) * (1.0 - b))


def _held(gains: Array, knots: Array, reached: float) -> tuple[Array, Array]:
    """Return speeds and gains held constant beyond a speed, where the goal did not cover them."""
    held = np.append(knots[knots < reached], reached)
    columns = gains.reshape(len(knots), -1).T
    interpolated = np.array([np.interp(held, knots, column) for column in columns]).T
    return held, interpolated.reshape(len(held), *gains.shape[1:])
