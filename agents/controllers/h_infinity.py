"""H-infinity control: the loop's largest gain over all frequencies is kept below a bound."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Self

from agents.controllers.controller import equipped
from agents.controllers.lqr import speed_nodes
from agents.controllers.scheduled import (
    CONTROL_PERIOD,
    Law,
    ScheduledController,
    readings_of,
    sensor_rows,
)
from agents.controllers.service import ranges_of_service
from design.linear.h_infinity import (
    MOTION,
    ROLL_OFF,
    SLACK,
    UncertainModel,
    h_infinity,
    uncertain_model,
)
from design.linear.regulator import Disturbances, Weights
from railenv import Model

ACCELEROMETER, GYRO = 0.11, 2.8e-4
"""Noise of the readings (m/s^2 and rad/s) that a design assumes."""

WEIGHTS = Weights(yaw=2.1e-3, moment=36.0)
"""A moment is cheap: it is limited by delay, noise and forces that the model does not foresee."""

DISTURBANCES = Disturbances(alignment=4e-5, moment=0.48, accelerometer=ACCELEROMETER, gyro=GYRO)
"""Above all, moments added to the command; relative sizes count."""


class HInfinity(ScheduledController):
    """H-infinity controller of the sampled lateral model, fixed or scheduled over speed.

    Its states estimate the vehicle's, from the moment applied after its limit. It subtracts the effect
    of the known cant deficiency from the accelerometer, and feeds back nothing steady. Wheels and rails
    other than the model's act as forces wherever they can enter (:func:`design.h_infinity`).
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
        ranges: Mapping[str, tuple[float, float]] | None = None,
        motion: float = MOTION,
        roll_off: float = ROLL_OFF,
        slack: float = SLACK,
        period: float = CONTROL_PERIOD,
    ) -> Self:
        """Design a controller at a speed (m/s), or at several speeds over which it is scheduled.

        Parameters
        ----------
        model : Model
        speed, speeds : float or sequence of float
            One of them, m/s.
        weights : design.Weights, optional
            Sizes of motion and commands that count the same.
        disturbances : design.Disturbances, optional
            Disturbances that enter; drifts must not be zero.
        ranges : mapping of str to (float, float), optional
            Ranges of numbers of the model, which change forces that it does not foresee; conicity (or
            wear) and creep coefficients in service when left out.
        motion : float
            Size of the motion to which these forces belong, m and rad.
        roll_off : float
            Frequency above which commands weigh more, in proportion to frequency, Hz.
        slack : float
            Bound on the loop's largest gain, as a multiple of the smallest achievable one.
        period : float
            Control period, s.

        Raises
        ------
        ParameterError
            If a value is not allowed, or no controller keeps the loop below a bound.
        """
        vehicle = equipped(model)
        given = ranges_of_service(vehicle) if ranges is None else ranges
        models = [
            uncertain_model(vehicle, speed=v, ranges=given, period=period)
            for v in speed_nodes(speed, speeds)
        ]
        return cls.of(
            models,
            weights=weights,
            disturbances=disturbances,
            motion=motion,
            roll_off=roll_off,
            slack=slack,
        )

    @classmethod
    def of(
        cls,
        models: Sequence[UncertainModel],
        *,
        weights: Weights | None = None,
        disturbances: Disturbances | None = None,
        motion: float = MOTION,
        roll_off: float = ROLL_OFF,
        slack: float = SLACK,
    ) -> Self:
        """Design a controller on existing models, one for each speed.

        Parameters
        ----------
        models : sequence of UncertainModel
            Models of one vehicle at increasing speeds; see :func:`design.uncertain_model`.
        weights, disturbances, motion, roll_off, slack
            As in :meth:`design`.
        """
        vehicle, period = models[0].model, float(models[0].system.dt)
        w = WEIGHTS if weights is None else weights
        d = DISTURBANCES if disturbances is None else disturbances
        found = [
            h_infinity(model, weights=w, disturbances=d, motion=motion, roll_off=roll_off, slack=slack)
            for model in models
        ]
        readings = readings_of(vehicle, "sensors", period)
        pick = sensor_rows(vehicle, [reading.signal for reading in readings])
        law = Law.of(
            [k.speed for k in found],
            A=[k.A - k.E @ k.C for k in found],
            B=[(k.B - k.E @ k.D) @ pick for k in found],
            C=[k.C for k in found],
            D=[k.D @ pick for k in found],
            E=[k.E for k in found],
        )
        about = {
            "weights": dataclasses.asdict(w),
            "disturbances": dataclasses.asdict(d),
            "motion": motion,
            "roll_off": roll_off,
            "slack": slack,
            "bounds": [k.bound for k in found],
            "norms": [k.norm for k in found],
            "vehicle": vehicle.vehicle_name,
        }
        limits = vehicle.limits
        return cls(law, readings, vehicle.command_names, limits, "sensors", period, about)
