"""Growth and decay of small motions: linear, and in the environment as a check."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import design
from agents.controllers.controller import Controller, equipped
from agents.evaluation.rollout import Case, Rollout
from railenv import Equipped, Model
from railenv.errors import EquilibriumError, ParameterError

Array = NDArray[np.float64]

SMALL = 1e-6
"""Offset (m) of all bodies from which motions grow or decay, far below the width of any kink."""

_OVER = 1e-6  # of the offset, below which a motion has died out


def linear_growth_rates(model: Model, controller: Any, speeds: Sequence[float]) -> Array:
    """Return the growth rate (1/s) of the least stable mode of the linear closed loop at some speeds.

    Parameters
    ----------
    model : Model
    controller : design.Feedback or None
        None for the vehicle alone.
    speeds : sequence of float
        m/s, on tangent track.

    Returns
    -------
    ndarray, shape (n_speeds,)
    """
    locus = design.speed_locus(equipped(model), speeds, controller=controller)
    return np.asarray(locus.loci.real.max(axis=1))


def growth_rates(
    model: Equipped,
    controller: Controller | None,
    speeds: Sequence[float],
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    vehicle: Mapping[str, float] | None = None,
    duration: float = 8.0,
) -> Array:
    """Measure the growth rates of small motions in the environment, at several speeds at once.

    All bodies start off the running equilibrium. The rate is the slope of the logarithm of the motion's
    size over the last half, where the least stable mode is alone. The motion is measured from its mean
    there, for a controller may move the equilibrium.

    Parameters
    ----------
    model : Equipped
    controller : Controller or None
    speeds : sequence of float
        m/s.
    radius, cant : float
        m, rad.
    vehicle : mapping, optional
        Changes of the vehicle.
    duration : float
        s.

    Returns
    -------
    ndarray, shape (n_speeds,)
        1/s.
    """
    cases = [Case(v, radius, cant, SMALL, vehicle or {}) for v in speeds]
    names = [own[c] for own in model.body_states.values() for c in ("y", "psi") if c in own]
    motion = Rollout(model, controller, cases).run(duration, names)
    half = len(motion.time) // 2
    values = motion.states[half:] - motion.states[half:].mean(axis=0)
    windows = np.array_split(values, 8)
    size = np.array([np.sqrt((w**2).mean(axis=(0, 2))) for w in windows])
    middle = (np.arange(8) + 0.5) * (duration / 2.0) / 8
    size = np.maximum(size, 1e-300)
    rates = np.polyfit(middle, np.log(size), 1)[0]
    # a motion below rounding errors has decayed, whatever these do
    return np.where(size[-1] < _OVER * SMALL, np.log(size[-1] / SMALL) / duration, rates)


class MeasuredCriticalSpeed(NamedTuple):
    """The speed up to which small motions decay in the environment.

    Attributes
    ----------
    speed : float or None
        m/s; None if they grow at the lowest speed, the highest speed tried if they never do.
    loss : {"hunting", "none", "unstable at start"}
    """

    speed: float | None
    loss: str


def measured_critical_speed(
    model: Equipped,
    controller: Controller,
    speed_range: tuple[float, float],
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    vehicle: Mapping[str, float] | None = None,
) -> MeasuredCriticalSpeed:
    """Find the speed up to which small motions decay in the environment, refined in rounds.

    This is for controllers without a linearisation.

    Parameters
    ----------
    model : Equipped
    controller : Controller
    speed_range : (float, float)
        m/s.
    radius, cant : float
        m, rad.
    vehicle : mapping, optional
        Changes of the vehicle.
    """
    speeds = np.geomspace(*speed_range, 32)
    result = float(speed_range[1])
    for _ in range(3):
        try:
            rates = growth_rates(
                model, controller, speeds.tolist(), radius=radius, cant=cant, vehicle=vehicle
            )
        except EquilibriumError:
            speeds = np.linspace(speeds[0], speeds[-1] * 0.9, len(speeds))
            continue
        growing = np.flatnonzero(rates >= 0.0)
        if not len(growing):
            return MeasuredCriticalSpeed(float(speeds[-1]), "none")
        k = int(growing[0])
        if k == 0:
            return MeasuredCriticalSpeed(None, "unstable at start")
        share = -rates[k - 1] / (rates[k] - rates[k - 1])
        result = float(speeds[k - 1] + share * (speeds[k] - speeds[k - 1]))
        speeds = np.linspace(speeds[k - 1], speeds[k], len(speeds))
    return MeasuredCriticalSpeed(result, "hunting")


def simulated_critical_speed(
    model: Equipped,
    controller: Controller | None,
    around: float,
    *,
    width: float = 0.03,
    points: int = 13,
    duration: float = 8.0,
    radius: float = math.inf,
    cant: float = 0.0,
    vehicle: Mapping[str, float] | None = None,
) -> float:
    """Find the speed at which small motions in the environment change from decay to growth.

    Parameters
    ----------
    model : Equipped
    controller : Controller or None
    around : float
        Speed near which to search, m/s.
    width : float
        Width of the search to either side, as a share of that speed.
    points : int
        Number of speeds to simulate.
    duration : float
        s.
    radius, cant : float
        m, rad.
    vehicle : mapping, optional
        Changes of the vehicle.

    Raises
    ------
    ParameterError
        If motions do not change from decay to growth there.
    """
    speeds = np.linspace((1.0 - width) * around, (1.0 + width) * around, points)
    rates = growth_rates(
        model,
        controller,
        speeds.tolist(),
        radius=radius,
        cant=cant,
        vehicle=vehicle,
        duration=duration,
    )
    crossing = np.flatnonzero((rates[:-1] < 0.0) & (rates[1:] >= 0.0))
    if not len(crossing):
        raise ParameterError(
            f"around is {around:g} m/s; from {speeds[0]:.4g} to {speeds[-1]:.4g} m/s motions do not "
            f"change from decay to growth (rates {rates[0]:.3g} to {rates[-1]:.3g} 1/s)"
        )
    k = int(crossing[0])
    share = -rates[k] / (rates[k + 1] - rates[k])
    return float(speeds[k] + share * (speeds[k + 1] - speeds[k]))
