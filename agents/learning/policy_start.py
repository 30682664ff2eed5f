"""The start of a policy search: weights with which every vehicle of a family decays, by linear models.

Episodes hardly show how to damp a mode that a policy does not yet move; the linearised closed loop
does. Its eigenvalues are differentiable in the weights of a policy that is linear in its inputs, so the
excess of growth rates over their aim is minimised with its gradient. The search goes on from there.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize

import design
from agents.controllers.service import vehicles_of_service
from agents.tuning.family import Family
from railenv import Equipped, checks
from railenv.errors import ParameterError

Array = NDArray[np.float64]

_SLOWEST = 4  # modes of each plant that count
_STEP = 1e-3  # of a weight; loops are affine in the weights, so any step is exact


@dataclass(frozen=True, kw_only=True)
class Target:
    """Vehicles and speeds at which all of them should be stable.

    Attributes
    ----------
    conicities, speeds : tuple of float
        Every conicity at every speed (m/s).
    creep_factor : float
        Creep factor of these vehicles.
    radius, cant : float
        m, rad.
    weight : float
        Their weight.
    """

    conicities: tuple[float, ...]
    speeds: tuple[float, ...]
    creep_factor: float = 1.0
    radius: float = math.inf
    cant: float = 0.0
    weight: float = 1.0

    def __post_init__(self) -> None:
        if not self.conicities or not self.speeds:
            raise ParameterError(
                "a target needs at least one conicity and one speed; one of them is empty"
            )
        checks.number("weight of a target", self.weight, low=0.0)


def _targets() -> tuple[Target, ...]:
    slow = (20.0, 30.0, 45.0, 65.0, 85.0, 100.0, 115.0, 122.0, 126.0, 129.0, 131.0, 133.0)
    fast = (150.0, 170.0, 190.0, 220.0, 250.0)
    poor = (20.0, 40.0, 80.0, 120.0, 133.0)
    return (
        Target(conicities=(0.05, 0.1, 0.2, 0.3, 0.4), speeds=slow, creep_factor=1.4),
        Target(conicities=(0.05, 0.1, 0.2, 0.3, 0.4), speeds=poor, creep_factor=0.6),
        Target(conicities=(0.05, 0.1), speeds=fast, weight=0.3),
        _curve(12000.0, 140.0, 160.0, 172.0),
        _curve(8000.0, 110.0, 130.0, 145.0, 155.0),
        _curve(5000.0, 90.0, 105.0, 115.0),
    )


def _curve(radius: float, *speeds: float) -> Target:
    return Target(conicities=(0.1,), speeds=speeds, radius=radius, cant=0.0873, weight=0.1)


@dataclass(frozen=True, kw_only=True)
class Aim:
    """The goal of a start.

    Attributes
    ----------
    targets : tuple of Target
        Each target must be met before the next is added.
    decay : float
        Rate (1/s) at which every motion should decay; faster decay earns nothing.
    size : float
        Weight of the squared weights, which keeps moments small.
    """

    targets: tuple[Target, ...] = field(default_factory=_targets)
    decay: float = 0.6
    size: float = 0.02

    def __post_init__(self) -> None:
        if not self.targets:
            raise ParameterError("targets of an aim is empty; an aim needs at least one target")
        checks.number("decay", self.decay, low=0.0, unit="1/s")
        checks.number("size", self.size, low=0.0)

    def plain(self) -> dict[str, Any]:
        """Return everything as plain numbers and lists, for a policy's file."""
        told = dataclasses.asdict(self)
        for target in told["targets"]:
            target["radius"] = None if math.isinf(target["radius"]) else target["radius"]
        return told


def start_weights(
    model: Equipped,
    signals: list[str],
    loop_of: Callable[[Array], design.Feedback],
    dimension: int,
    aim: Aim,
    period: float,
    iterations: int = 300,
) -> Array:
    """Return weights that minimise the cubes of the excesses of growth rates over ``-aim.decay``.

    Parameters
    ----------
    model : Equipped
    signals : list of str
        Readings of the policy, by names of :mod:`design.loop.feedback`.
    loop_of : callable
        Returns the policy with some weights; its linearisation must be affine in them.
    dimension : int
        Number of weights.
    aim : Aim
    period : float
        Control period, s.
    iterations : int
        Iterations of the quasi-Newton method for each added target.
    """
    weights, plants = np.zeros(dimension), []
    # one target after the other: started from zero, all at once end where the first is not met
    for target in aim.targets:
        changes = vehicles_of_service(model, target.conicities, (target.creep_factor,))
        family = Family.of(model, signals, changes, target.speeds, period, target.radius, target.cant)
        plants += [
            (target.weight, *_plant(family, i, signals, loop_of, dimension))
            for i in range(len(family.speed))
        ]
        weights = _minimized(plants, weights, aim, period, iterations)
    return weights


def _minimized(
    plants: list[tuple[float, Array, Array]],
    start: Array,
    aim: Aim,
    period: float,
    iterations: int,
) -> Array:
    """Return weights that make some plants decay, from a start."""

    def cost(weights: Array) -> tuple[float, Array]:
        total, slope = aim.size * float(weights @ weights), 2.0 * aim.size * weights
        for weight, constant, parts in plants:
            rates, slopes = _slowest(constant, parts, weights, period)
            excess = np.maximum(rates + aim.decay, 0.0)
            total += weight * float((excess**3).sum())
            slope = slope + 3.0 * weight * excess**2 @ slopes
        return total, slope

    found = optimize.minimize(cost, start, jac=True, method="L-BFGS-B", options={"maxfun": iterations})
    return np.asarray(found.x)


def _plant(
    family: Family,
    i: int,
    signals: list[str],
    loop_of: Callable[[Array], design.Feedback],
    dimension: int,
) -> tuple[Array, Array]:
    """Return a plant's closed loop without weights and its derivatives by them, balanced."""
    at = np.array([family.speed[i] if name == "speed" else 0.0 for name in signals])

    def loop(weights: Array) -> Array:
        law = loop_of(weights).linearize(at)
        A, B, C, D = (np.asarray(matrix)[None] for matrix in (law.A, law.B, law.C, law.D))
        return family.loops(A, B, C, D, [i])[0]

    constant = loop(np.zeros(dimension))
    parts = np.array([(loop(row) - constant) / _STEP for row in _STEP * np.eye(dimension)])
    _, (scale, _) = linalg.matrix_balance(constant, permute=False, separate=True)
    balance = scale[None, :] / scale[:, None]
    return constant * balance, parts * balance


def _slowest(constant: Array, parts: Array, weights: Array, period: float) -> tuple[Array, Array]:
    """Return growth rates of a loop's slowest modes (1/s), and their derivatives by the weights."""
    values, left, right = linalg.eig(constant + np.tensordot(weights, parts, 1), left=True)
    slowest = np.argsort(-np.abs(values))[:_SLOWEST]
    mu, x, y = values[slowest], right[:, slowest], left[:, slowest].conj()
    slopes = np.einsum("it,kij,jt->tk", y, parts, x) / (np.einsum("it,it->t", y, x) * mu)[:, None]
    return np.log(np.abs(mu)) / period, slopes.real / period
