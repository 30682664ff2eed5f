"""What a problem is: a vehicle, what of it varies, what it carries, and what it is rated by."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from agents.controllers.service import CREEP_FACTOR
from agents.problems.damper import PrimaryDamper, YawDamper, without_dampers
from railenv import Actuator, Bogie, Coach, DualWheelset, Equipped, Vehicle
from railenv.equipment import Place

Kind = Literal["bogie", "dual_wheelset", "coach"]
Damper = YawDamper | PrimaryDamper

_MODELS: Mapping[Kind, type[Bogie | DualWheelset | Coach]] = {
    "bogie": Bogie,
    "dual_wheelset": DualWheelset,
    "coach": Coach,
}


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A named task for controllers, always the same one.

    Attributes
    ----------
    name : str
        With its version: numbers of other versions do not compare.
    asks : str
        What is asked, in a sentence.
    kind : {"bogie", "dual_wheelset", "coach"}
    vehicle : callable
        Gives the vehicle, on wheels between new and worn.
    place : {"secondary", "primary", "both"}
        Of the actuators.
    sensed : tuple of str
        Bodies with an accelerometer and a gyro.
    ranges : mapping of str to (float, float)
        What of the contact varies: every vehicle within has to be stable.
    damper : YawDamper or PrimaryDamper
        The passive damper with the highest robust critical speed (:func:`tuned_damper` finds it).
    fitted : YawDamper, optional
        A passive damper that stands beside the actuators and goes on when they fail.
    speed_range : (float, float)
        m/s, over which speeds are searched; a loop that is unstable at the lowest one has failed.
    ride_speeds : tuple of float
        m/s, of runs on irregular track.
    """

    name: str
    asks: str
    kind: Kind
    vehicle: Callable[[], Vehicle]
    place: Place
    sensed: tuple[str, ...]
    ranges: Mapping[str, tuple[float, float]]
    damper: Damper
    fitted: YawDamper | None = None
    speed_range: tuple[float, float] = (20.0, 400.0)
    ride_speeds: tuple[float, ...] = (80.0, 110.0, 140.0)
    actuator: Actuator | None = None

    def model(self) -> Equipped:
        """Return the vehicle with its actuators, sensors and the damper that is fitted beside them."""
        return self.passive(self.fitted)

    def passive(self, damper: Damper | None) -> Equipped:
        """Return the vehicle with a passive damper alone (None: with none); actuators do nothing."""
        bare = without_dampers(self.vehicle())
        vehicle = bare if damper is None else damper.on(bare)
        return Equipped(_MODELS[self.kind](vehicle), self.place, self.actuator, sensed=self.sensed)


CONTACT = {"creep_factor": CREEP_FACTOR}
"""What varies of every contact."""
