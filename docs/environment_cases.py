"""The environments that have a page, and what their pictures show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import gymnasium

import design
import railenv
from railenv.envs.environment import BogieEnv, CoachEnv, DualWheelsetEnv, HuntingEnv


@dataclass(frozen=True)
class Case:
    """One environment, its page and what its picture shows.

    Attributes
    ----------
    kind : type
        Class of the environment.
    title : str
        Also the name in the id.
    file : str
        Name of page and picture, without suffix.
    actuators : tuple of str
        Default first.
    bodies : mapping of str to str
        What each body is called on the page.
    actuated : str
        Where the actuators of the picture are, in its caption.
    model : Model
        Vehicle of the picture.
    speed, radius, cant : float
        Running conditions of the picture: m/s, m, rad.
    against : {"psi", "dpsi"}
        What the actions of the picture are against: yaw angle or yaw rate.
    gain : float
        Action per rad or rad/s.
    """

    kind: type[HuntingEnv]
    title: str
    file: str
    actuators: tuple[str, ...]
    bodies: Mapping[str, str]
    actuated: str
    model: railenv.Model
    speed: float
    radius: float
    cant: float
    against: Literal["psi", "dpsi"] = "psi"
    gain: float = 300.0

    @property
    def id(self) -> str:
        """Name under which Gymnasium knows the environment."""
        return f"railenv/{self.title}-v1"

    def make(self, **keywords: Any) -> HuntingEnv:
        """Return the environment without wrappers."""
        env = gymnasium.make(self.id, **keywords).unwrapped
        assert isinstance(env, HuntingEnv)
        return env

    @cached_property
    def critical_speed(self) -> float:
        """Of the vehicle of the picture, m/s."""
        speed = design.critical_speed(self.model, radius=self.radius, cant=self.cant).speed
        assert speed is not None
        return speed


CASES = (
    Case(
        BogieEnv,
        "Bogie",
        "bogie",
        ("secondary", "primary", "lateral", "none"),
        {"w1": "leading wheelset", "w2": "trailing wheelset", "b": "bogie frame"},
        "the bogie frame",
        railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW),
        speed=105.0,
        radius=6500.0,
        cant=0.0873,
    ),
    Case(
        DualWheelsetEnv,
        "DualWheelset",
        "dual-wheelset",
        ("primary", "none"),
        {"w1": "leading wheelset", "w2": "trailing wheelset"},
        "each wheelset",
        railenv.DualWheelset(railenv.TABLE_1),
        speed=50.0,
        radius=1500.0,
        cant=0.08,
    ),
    Case(
        CoachEnv,
        "Coach",
        "coach",
        ("secondary", "lateral", "primary", "both", "none"),
        {
            **{f"w{i}": f"{n} wheelset" for i, n in enumerate(("first", "second", "third", "last"), 1)},
            "b1": "leading frame",
            "b2": "trailing frame",
            "body": "vehicle body",
        },
        "each frame",
        railenv.Coach(railenv.HIGH_SPEED_COACH_HOLLOW),
        speed=105.0,
        radius=6500.0,
        cant=0.0873,
        against="dpsi",
        gain=20.0,
    ),
)
