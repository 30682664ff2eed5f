"""Linear-quadratic-Gaussian control: a regulator fed by a Kalman filter from the sensors."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import equipped
from agents.controllers.lqr import speed_nodes
from agents.controllers.scheduled import (
    CONTROL_PERIOD,
    Law,
    ScheduledController,
    readings_of,
    sensor_rows,
)
from design.linear.regulator import Disturbances, Observer, Weights, kalman, lqr
from railenv import Model

Array = NDArray[np.float64]


class LQG(ScheduledController):
    """Regulator and Kalman filter of the same lateral model, fixed or scheduled over speed.

    The filter uses the moment applied after its limit, subtracts the effect of the known cant
    deficiency from the accelerometer, and estimates offsets of the readings.
    """

    @classmethod
    def design(
        cls,
        model: Model,
        *,
        speed: float | None = None,
        speeds: Sequence[float] | None = None,
        weights: Weights | None = None,
        disturbances: Disturbances | None = None,
        period: float = CONTROL_PERIOD,
    ) -> Self:
        """Design a controller at a speed (m/s), or at several speeds over which it is scheduled.

        Parameters
        ----------
        model : Model
        speed, speeds : float or sequence of float
            One of them, m/s.
        weights : design.Weights, optional
        disturbances : design.Disturbances, optional
        period : float
            Control period, s.
        """
        vehicle = equipped(model)
        nodes = speed_nodes(speed, speeds)
        readings = readings_of(vehicle, "sensors", period)
        signals = [reading.signal for reading in readings]
        w = Weights() if weights is None else weights
        d = Disturbances() if disturbances is None else disturbances
        pick = sensor_rows(vehicle, signals)
        stacked: dict[str, list[Array]] = {name: [] for name in "ABCDE"}
        for v in nodes:
            observer = kalman(vehicle, speed=v, disturbances=d, period=period)
            regulator = lqr(vehicle, speed=v, weights=w, period=period)
            K = np.zeros((len(vehicle.command_names), len(observer.A)))
            labels = observer.system.state_labels
            K[:, [labels.index(label) for label in regulator.system.state_labels]] = regulator.gain
            for name, matrix in _law(observer, K, pick).items():
                stacked[name].append(matrix)
        law = Law.of(nodes, **{name: np.array(matrices) for name, matrices in stacked.items()})
        about = {
            "weights": dataclasses.asdict(w),
            "disturbances": dataclasses.asdict(d),
            "vehicle": vehicle.vehicle_name,
        }
        limits = vehicle.limits
        return cls(law, readings, vehicle.command_names, limits, "sensors", period, about)


def _law(o: Observer, K: Array, pick: Array) -> dict[str, Array]:
    """Return a regulator and a filter as one law; ``pick`` selects the sensors from the readings."""
    corrected = np.eye(len(o.A)) - o.M @ o.C
    return {
        "A": o.A @ corrected,
        "B": o.A @ o.M @ pick,
        "C": -K @ corrected,
        "D": -K @ o.M @ pick,
        "E": o.B,
    }
