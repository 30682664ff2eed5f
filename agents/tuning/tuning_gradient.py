"""Tuning of structured output feedback by the gradient of the worst growth rate.

Vehicles of several conicities and creep factors at speeds up to a target make a family of linear
plants. An eigenvalue's derivative with respect to the gains is known from its eigenvectors where the
loop closes. So the worst growth rate of the family, as a soft maximum, is minimised with its gradient.
The target speed rises as long as every plant of the family can be kept stable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from agents.controllers.controller import check_single_actuator
from agents.controllers.output_feedback import GAINS, Filters, OutputFeedback, basis
from agents.controllers.scheduled import CONTROL_PERIOD, readings_of
from agents.tuning.family import Family
from railenv import Equipped
from railenv.errors import ParameterError
from railenv.threads import one_blas_thread

Array = NDArray[np.float64]

_UNITS = np.array([1e4, 1e5, 1e5, 1e6])  # of the four gains, so that the search sees like sizes
_SHARPNESS = 4.0  # s, of the soft maximum of decay rates
_TOP = 4  # slowest modes of each plant that count
_FLOOR = 1e-12


@dataclass(frozen=True, kw_only=True)
class Goal:
    """What the tuning asks for.

    Attributes
    ----------
    conicities, creep_factors : tuple of float
        Every one with every other, as far as the vehicle has these numbers.
    speeds : tuple of float
        m/s; the target speed is added.
    decay : float
        Rate (1/s) at which every motion of every plant has to decay.
    noise : float
        Moment (share of the limit) that the sensors' noise alone may command.
    """

    conicities: tuple[float, ...] = (0.05, 0.1, 0.2, 0.3, 0.4)
    creep_factors: tuple[float, ...] = (0.6, 1.4)
    speeds: tuple[float, ...] = (20.0, 30.0, 40.0, 55.0, 70.0, 85.0, 100.0, 115.0, 130.0, 145.0)
    decay: float = 0.3
    noise: float = 0.08


class _Objective:
    """Soft maximum of the growth rates of a family, with its gradient in the scheduled gains."""

    def __init__(
        self, family: Family, parts: tuple[Array, ...], nodes: Array, goal: Goal, noise: Array
    ) -> None:
        self.family, self.goal = family, goal
        self.parts = parts
        self.noise = noise
        # shares of the nodes' gains at each plant's speed
        clipped = np.clip(family.speed, nodes[0], nodes[-1])
        self.shares = np.array([np.interp(clipped, nodes, row) for row in np.eye(len(nodes))]).T
        A, B, _, _ = parts
        q, n, k = len(family.A), family.A.shape[1], len(A)
        self.fixed = np.zeros((q, n + k, n + k))
        self.fixed[:, :n, :n] = family.A
        self.fixed[:, n:, :n] = B @ family.S
        self.fixed[:, n:, n:] = A
        self.n, self.k = n, k

    def rates(self, x: Array, period: float) -> tuple[Array, Array]:
        """Return growth rates (q, top) and their derivatives (q, top, gains)."""
        _, _, C, D = self.parts
        gains = self.shares @ (x.reshape(-1, len(GAINS)) * _UNITS)
        rows = np.concatenate([D @ self.family.S, C], axis=2)  # (4, m, n + k)
        M = self.fixed.copy()
        M[:, : self.n] += self.family.B @ np.einsum("qi,imz->qmz", gains, rows)
        values, right = np.linalg.eig(M)
        order = np.argsort(-np.abs(values), axis=1)[:, :_TOP]
        left = np.linalg.inv(right)
        mu = np.take_along_axis(values, order, 1)
        v = np.take_along_axis(right, order[:, None, :], 2)  # (q, z, top)
        w = np.take_along_axis(left, order[:, :, None], 1)[:, :, : self.n]  # (q, top, n)
        into = w @ self.family.B  # (q, top, m)
        seen = np.einsum("imz,qzt->qtim", rows, v)
        slope = np.einsum("qtm,qtim->qti", into, seen) / mu[:, :, None]
        rates = np.log(np.maximum(np.abs(mu), _FLOOR)) / period
        return rates, slope.real / period

    def __call__(self, x: Array, period: float) -> tuple[float, Array]:
        rates, slopes = self.rates(x, period)
        top = rates.max()
        weight = np.exp(_SHARPNESS * (rates - top))
        total = weight.sum()
        value = top + np.log(total) / _SHARPNESS
        per_plant = np.einsum("qt,qti->qi", weight / total, slopes)
        gradient = (self.shares.T @ per_plant) * _UNITS
        # noise commanded at each node, beyond what is allowed
        gains = x.reshape(-1, len(GAINS)) * _UNITS
        commanded = np.sqrt((np.square(gains) * self.noise).sum(axis=1)) + 1e-12
        excess = np.maximum(commanded - self.goal.noise, 0.0)
        value += 1e2 * float((excess**2).sum())
        gradient += 2e2 * (excess / commanded)[:, None] * gains * self.noise * _UNITS
        return float(value), gradient.ravel()

    def minimized(self, x: Array, period: float, iterations: int) -> Any:
        """Return what SciPy finds from scaled gains, by the quasi-Newton method."""
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
        Closed-loop families that were looked at: the tuning's budget.
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
        With a single yaw actuator, and sensors on a body that it acts on.
    filters : Filters, optional
    nodes : sequence of float
        Speeds between which gains are linear, m/s; they are held beyond the target that was reached.
    goal : Goal, optional
    start, step, highest : float
        Target speeds that are tried, m/s.
    iterations : int
        Of the quasi-Newton method, for each target.
    period : float
        Control period, s.
    seed : int
        Of the gains that the search starts from.

    Returns
    -------
    Tuned

    Raises
    ------
    ParameterError
        If not even the first target can be met, or the model has other actuators or sensors.
    """
    check_single_actuator(model, "the tuning of output feedback")
    wanted = Goal() if goal is None else goal
    f = Filters() if filters is None else filters
    knots = np.asarray(nodes, dtype=float)
    x, best, reached, evaluations = _start(knots, seed), None, 0.0, 0
    with one_blas_thread():
        problem = _Problem(model, f, knots, wanted, period)
        for target in np.arange(start, highest + 1e-9, step).tolist():
            objective = problem.up_to(target)
            found = objective.minimized(x, period, iterations)
            evaluations += int(found.nfev)
            if objective.rates(found.x, period)[0].max() > -wanted.decay:
                break
            best, reached, x = found.x, target, found.x
    if best is None:
        raise ParameterError(
            f"start is {start:g} m/s; with these filters the family cannot be kept stable up to there"
        )
    about = {"goal": asdict(wanted), "target": reached, "evaluations": evaluations, "seed": seed}
    held, gains = _held(best.reshape(-1, len(GAINS)) * _UNITS, knots, reached)
    controller = OutputFeedback.design(
        model, speeds=held, gains=gains, filters=f, period=period, about=about
    )
    return Tuned(controller, reached, evaluations)


class _Problem:
    """What of a tuning stays the same while its target speed rises."""

    def __init__(
        self, model: Equipped, filters: Filters, knots: Array, goal: Goal, period: float
    ) -> None:
        self.model, self.knots, self.goal, self.period = model, knots, goal, period
        readings = readings_of(model, "sensors", period)
        self.signals = [reading.signal for reading in readings]
        self.parts = basis(model, readings, filters, period)
        self.noise = _let_through(model, filters, period)
        self.base = self._family(goal.speeds)

    def _family(self, speeds: Sequence[float]) -> Family:
        goal = self.goal
        factors = goal.creep_factors
        return Family.of(
            self.model, self.signals, goal.conicities, speeds, self.period, creep_factors=factors
        )

    def up_to(self, target: float) -> _Objective:
        """Return the objective over all plants up to a target speed (m/s)."""
        goal, base = self.goal, self.base
        extra = np.arange(max(goal.speeds) + 10.0, target, 10.0).tolist()
        more = self._family([*extra, target])
        below = base.speed < target
        family = Family(base.A[below], base.B[below], base.S, base.speed[below]).joined(more)
        return _Objective(family, self.parts, self.knots, goal, self.noise)


def _let_through(model: Equipped, f: Filters, period: float) -> Array:
    """Return the variance of noise that each gain lets through, in shares of the limit."""
    s = model.sensors
    shares = [1.0, _passed(f.acceleration, period), 1.0, _passed(f.yaw_rate, period)]
    levels = [s.accelerometer_noise, s.accelerometer_noise, s.gyro_noise, s.gyro_noise]
    return np.asarray(np.square(levels) * shares / model.limits[0] ** 2)


def _held(gains: Array, knots: Array, reached: float) -> tuple[Array, Array]:
    """Return speeds and gains of which none changes beyond a speed, where nothing was asked of them."""
    held = np.append(knots[knots < reached], reached)
    return held, np.array([np.interp(held, knots, column) for column in gains.T]).T


def _start(knots: Array, seed: int) -> Array:
    """Return scaled gains near a plain yaw damper."""
    rng = np.random.default_rng(seed)
    gains = np.zeros((len(knots), len(GAINS)))
    gains[:, 2] = -5e4
    gains += 0.2 * rng.normal(size=gains.shape) * _UNITS * (seed > 0)
    return (gains / _UNITS).ravel()


def _passed(corner: float, period: float) -> float:
    """Return the share of white noise's variance that a first-order low-pass filter lets through."""
    share = 1.0 - np.exp(-2.0 * np.pi * corner * period)
    return float(share / (2.0 - share))
