"""The registered tasks for controllers, from plain to hard, each under its own id.

A task is an environment with fixed keywords. It is kept only if a controller that does more than apply
a constant gain is clearly better than the best constant gain (docs/environments/tasks.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

_S1002 = {"law": "profiles", "wheel": "S1002", "rail": "UIC60", "inclination": 0.025}
_NEW_TO_WORN: Mapping[str, Any] = {
    "vehicle": "HIGH_SPEED_COACH_S1002",
    "contact": {"law": "family", "new": _S1002, "worn": {**_S1002, "wheel": "S1002_WORN"}, "wear": 0.5},
    "randomize": {"wear": (0.0, 1.0)},
    "observation": "sensors",
}
_UNKNOWN: Mapping[str, Any] = {
    "randomize": {"conicity": (0.05, 0.4)},
    "observation": "sensors",
}
_SHORT: Mapping[str, Any] = {"duration": 5.0, "initial_offset": 0.006}


@dataclass(frozen=True)
class Task:
    """A registered task.

    Attributes
    ----------
    id : str
        Id for ``gymnasium.make``.
    environment : str
        Name of its environment: ``"Bogie"``, ``"DualWheelset"`` or ``"Coach"``.
    asks : str
        The task in a sentence.
    reward_threshold : float
        Mean return at which it counts as solved: more than the best constant gain earns.
    keywords : mapping
        Keywords of the environment, as plain values.
    """

    id: str
    environment: str
    asks: str
    reward_threshold: float
    keywords: Mapping[str, Any] = field(default_factory=dict)


TASKS: tuple[Task, ...] = (
    Task(
        "railenv/Bogie-v1",
        "Bogie",
        "Damp a bogie whose state is measured, at every speed from 20 to 160 m/s.",
        1980.0,
    ),
    Task(
        "railenv/BogieSensors-v1",
        "Bogie",
        "The same up to 180 m/s from an accelerometer and a gyro, the last 16 readings of each.",
        975.0,
        {**_SHORT, "observation": "sensors", "history": 15, "speed_range": (20.0, 180.0)},
    ),
    Task(
        "railenv/BogieCurves-v1",
        "Bogie",
        "Into and out of curves by transitions, on wheels of unknown conicity.",
        1890.0,
        {
            **_UNKNOWN,
            "speed_range": (20.0, 180.0),
            "history": 15,
            "track": "curve",
            "tangent_share": 0.0,
            "initial_offset": 0.006,
            "duration": 10.0,
        },
    ),
    Task(
        "railenv/BogieWearGiven-v1",
        "Bogie",
        "Wheels from new to worn S1002, with the wear in the observation.",
        980.0,
        {**_SHORT, **_NEW_TO_WORN, "context": True, "history": 15},
    ),
    Task(
        "railenv/BogieWear-v1",
        "Bogie",
        "Wheels from new to worn S1002: one law for all, from the present readings.",
        978.0,
        {**_SHORT, **_NEW_TO_WORN},
    ),
    Task(
        "railenv/BogieWearHistory-v1",
        "Bogie",
        "Wheels from new to worn S1002, whose wear 0.4 s of readings may reveal.",
        980.0,
        {**_SHORT, **_NEW_TO_WORN, "history": 79},
    ),
    Task(
        "railenv/BogieRough-v1",
        "Bogie",
        "Fast on a rough line, on wheels of unknown conicity, with commands 25 ms late: a controller "
        "that damps by one gain derails.",
        580.0,
        {
            **_SHORT,
            **_UNKNOWN,
            "history": 15,
            "irregularity": "high",
            "irregularity_factor": (0.1, 0.2),
            "speed_range": (100.0, 180.0),
            "actuator_model": {"base": "secondary", "delay": 0.025},
        },
    ),
    Task(
        "railenv/BogieDelay-v1",
        "Bogie",
        "Commands arrive 40 ms late.",
        950.0,
        {
            **_SHORT,
            "actuator_model": {"base": "secondary", "delay": 0.04},
        },
    ),
    Task(
        "railenv/BogieWeak-v1",
        "Bogie",
        "An actuator of 4 kN m, which must not waste its moment.",
        938.0,
        {
            **_SHORT,
            "actuator_model": {"base": "secondary", "limit": 4e3},
        },
    ),
    Task(
        "railenv/BogieFailure-v1",
        "Bogie",
        "Two actuated wheelsets, one of which may fail while it runs.",
        800.0,
        {**_SHORT, "actuator": "primary", "actuator_failure": 0.75, "speed_range": (20.0, 200.0)},
    ),
    Task(
        "railenv/BogiePrimary-v1",
        "Bogie",
        "Actuated wheelsets, up to 250 m/s.",
        750.0,
        {**_SHORT, "actuator": "primary", "speed_range": (20.0, 250.0)},
    ),
    Task(
        "railenv/DualWheelset-v1",
        "DualWheelset",
        "Two wheelsets on a frame at rest, with a yaw actuator each.",
        1900.0,
    ),
    Task(
        "railenv/Coach-v1",
        "Coach",
        "A whole coach, with a yaw actuator on each of its bogies.",
        1975.0,
    ),
)
"""All tasks, from plain to hard within each vehicle."""
