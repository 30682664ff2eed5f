"""Problems: a vehicle, its variations, its equipment, and the plan of its rating."""

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
    """A named, fixed task for controllers.

    Attributes
    ----------
    name : str
        Name with a version; numbers of different versions are not comparable.
    asks : str
        The task in a sentence.
    kind : {"bogie", "dual_wheelset", "coach"}
    vehicle : callable
        Returns the vehicle, on wheels between new and worn.
    place : {"secondary", "primary", "both"}
        Place of the actuators.
    sensed : tuple of str
        Bodies with an accelerometer and a gyro.
    ranges : mapping of str to (float, float)
        Ranges of numbers of the contact; every vehicle within them has to be stable.
    damper : YawDamper or PrimaryDamper
        The passive damper with the highest robust critical speed (:func:`tuned_damper` finds it).
    fitted : YawDamper, optional
        A passive damper beside the actuators, which still works when they fail.
    speed_range : (float, float)
        Range of the search, m/s; a loop that is unstable at the lowest speed has failed.
    ride_speeds : tuple of float
        Speeds of runs on irregular track, m/s.
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
        """Return the vehicle with its actuators, its sensors and the damper fitted beside them."""
        return self.passive(self.fitted)

    def passive(self, damper: Damper | None) -> Equipped:
        """Return the vehicle with only a passive damper, or none (None); actuators do nothing."""
        bare = without_dampers(self.vehicle())
        vehicle = bare if damper is None else damper.on(bare)
        return Equipped(_MODELS[self.kind](vehicle), self.place, self.actuator, sensed=self.sensed)


CONTACT = {"creep_factor": CREEP_FACTOR}
"""Ranges that vary with every contact."""
