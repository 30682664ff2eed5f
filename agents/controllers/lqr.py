"""Linear-quadratic regulator from the full state: the limit if everything were measured."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import equipped
from agents.controllers.scheduled import CONTROL_PERIOD, Law, ScheduledController, readings_of
from design.linear.regulator import Weights, lqr
from railenv import Equipped, Model, checks, find_equilibrium
from railenv.errors import ParameterError

Array = NDArray[np.float64]


class LQR(ScheduledController):
    """Feedback of all lateral states, actuators and commands on their way, fixed or scheduled.

    It acts on deviations from the running equilibrium of the vehicle for which it was designed, which
    is taken as linear in curvature and cant (exact on wide curves, before the flange is touched).
    """

    @classmethod
    def design(
        cls,
        model: Model,
        *,
        speed: float | None = None,
        speeds: Sequence[float] | None = None,
        weights: Weights | None = None,
        period: float = CONTROL_PERIOD,
    ) -> Self:
        """Design a controller at a speed (m/s), or at several speeds over which it is scheduled.

        Parameters
        ----------
        model : Model
        speed, speeds : float or sequence of float
            One of them, m/s.
        weights : design.Weights, optional
        period : float
            Control period, s.
        """
        vehicle = equipped(model)
        nodes = speed_nodes(speed, speeds)
        readings = readings_of(vehicle, "state", period)
        signals = [reading.signal for reading in readings]
        w = Weights() if weights is None else weights
        D = np.zeros((len(nodes), len(vehicle.command_names), len(readings)))
        for k, v in enumerate(nodes):
            regulator = lqr(vehicle, speed=v, weights=w, period=period)
            columns = [signals.index(label) for label in regulator.system.state_labels]
            D[k][:, columns] = -regulator.gain
            for signal, shift in _curve_shift(vehicle, v, regulator.system.state_labels).items():
                D[k][:, signals.index(signal)] += regulator.gain @ shift
        about = {"weights": dataclasses.asdict(w), "vehicle": vehicle.vehicle_name}
        limits = vehicle.limits
        law = Law.of(nodes, D)
        return cls(law, readings, vehicle.command_names, limits, "state", period, about)


def _curve_shift(model: Equipped, speed: float, labels: Sequence[str]) -> dict[str, Array]:
    """Return the effect of cant deficiency and cant (per rad) on the equilibrium of some states."""
    state = find_equilibrium(model.plant, speed=speed).state
    A, _ = model.plant.jacobian(state, speed=speed)
    conditions = model.plant.condition_jacobian(state, speed=speed)
    per_curvature, per_cant = -np.linalg.solve(A, conditions[:, 1:]).T
    # cant deficiency = V^2 k / g - cant
    per_curvature = per_curvature * model.gravity / speed**2
    names = model.plant.state_names
    picked = np.array([[x[names.index(n)] if n in names else 0.0 for n in labels]
                       for x in (per_curvature, per_curvature + per_cant)])  # fmt: skip
    return {"cant_deficiency": picked[0], "cant": picked[1]}


def speed_nodes(speed: float | None, speeds: Sequence[float] | None) -> list[float]:
    """Return the speeds (m/s) at which a controller is designed."""
    if (speed is None) == (speeds is None):
        raise ParameterError(f"speed is {speed!r} and speeds is {speeds!r}; give one of them")
    return [checks.speed(v) for v in ([speed] if speeds is None else speeds)]
