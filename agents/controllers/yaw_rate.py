"""Feedback of the yaw rate: an active yaw damper in its simplest form."""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from agents.controllers.controller import equipped, sensed_bodies
from agents.controllers.scheduled import CONTROL_PERIOD, Law, ScheduledController, readings_of
from railenv import Model, checks

WASHOUT = 0.2
"""Frequency (Hz) below which the yaw rate is not damped, such as that of the curve itself."""


class YawRateFeedback(ScheduledController):
    """Opposing moment of each yaw actuator to the yaw rate of its body, without the mean.

    The gyro's reading passes a first-order high-pass filter, because on a curve it has a steady part,
    the turning of the track.
    """

    @classmethod
    def design(
        cls,
        model: Model,
        *,
        gain: float,
        washout: float = WASHOUT,
        period: float = CONTROL_PERIOD,
    ) -> Self:
        """Return a controller with a fixed gain.

        Parameters
        ----------
        model : Model
            A model with only yaw actuators, each with a gyro on a body on which it acts (or a single
            gyro).
        gain : float
            Gain of every actuator, N m per rad/s.
        washout : float
            Corner frequency of the high-pass filter, Hz; 0 for no filter.
        period : float
            Control period, s.

        Raises
        ------
        ParameterError
            If the model has other actuators or sensors.
        """
        vehicle = equipped(model)
        bodies = sensed_bodies(vehicle, "feedback of the yaw rate")
        gain = checks.number("gain", gain, unit="N m s/rad")
        washout = checks.number("washout", washout, low=0.0, unit="Hz")
        readings = readings_of(vehicle, "sensors", period)
        names = [reading.signal for reading in readings]
        m = len(vehicle.command_names)
        # z follows the reading, u = -gain (reading - z)
        share = 1.0 - math.exp(-2.0 * math.pi * washout * period)
        B = np.zeros((1, m, len(readings)))
        for k, body in enumerate(bodies):
            B[0, k, names.index(f"gyro_{body}")] = 1.0
        if share == 0.0:
            law = Law.of([1.0], D=-gain * B)
        else:
            A, C = (1.0 - share) * np.eye(m)[None], gain * np.eye(m)[None]
            law = Law.of([1.0], A=A, B=share * B, C=C, D=-gain * B)
        about = {"gain": gain, "washout": washout}
        return cls(law, readings, vehicle.command_names, vehicle.limits, "sensors", period, about)
