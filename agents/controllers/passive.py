"""No control at all: the vehicle with its actuators idle."""

from __future__ import annotations

from typing import Self

import numpy as np

from agents.controllers.controller import equipped
from agents.controllers.scheduled import CONTROL_PERIOD, Law, ScheduledController, readings_of
from railenv import Model


class Passive(ScheduledController):
    """A controller that commands nothing."""

    @classmethod
    def design(cls, model: Model, *, period: float = CONTROL_PERIOD) -> Self:
        """Return the passive controller of a vehicle."""
        vehicle = equipped(model)
        readings = readings_of(vehicle, "sensors", period)
        gain = np.zeros((1, len(vehicle.command_names), len(readings)))
        limits = vehicle.limits
        return cls(
            Law.of([1.0], gain), readings, vehicle.command_names, limits, "sensors", period, about={}
        )
