"""What an environment's observation holds: name, unit, scale and source of every entry."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from railenv.equipment import Equipped

Observation = Literal["state", "sensors"]

CANT_BASE = 1.5
"""m, the base over which cant is measured in millimetres."""


class Reading(NamedTuple):
    """An entry of an observation.

    Attributes
    ----------
    name : str
    unit : str
    scale : float
        What the quantity is divided by: its size in strong hunting.
    signal : str
        The same quantity (without noise) among the signals of :mod:`design.loop.feedback`.
    """

    name: str
    unit: str
    scale: float
    signal: str


def delay_slots(delay: float, control_period: float) -> int:
    """Return the length of the line in which commands wait, the present one included."""
    return math.floor(delay / control_period + 1e-9) + 2


def observation_table(
    model: Equipped, observation: Observation, control_period: float
) -> list[Reading]:
    """Return the entries of an observation, without history.

    Parameters
    ----------
    model : Equipped
    observation : {"state", "sensors"}
    control_period : float
        s.
    """
    rows = []
    if observation == "state":
        limit = model.actuator.limit
        rows = [Reading(n, _unit(n), _scale(n, limit), n) for n in model.state_names]
        for command in model.command_names:
            for age in range(1, delay_slots(model.actuator.delay, control_period)):
                name = f"{command}[-{age}]"
                rows.append(Reading(name, "N m", limit, name))
    else:
        for body in model.equipment.sensed:
            rows += [
                Reading(f"accelerometer_{body}", "m/s^2", _SIZES["accel"], f"accel_{body}"),
                Reading(f"gyro_{body}", "rad/s", _SIZES["gyro"], f"gyro_{body}"),
            ]
    rows += [
        Reading("speed", "m/s", 100.0, "speed"),
        Reading("cant_deficiency", "rad", 0.150 / CANT_BASE, "cant_deficiency"),
    ]
    if observation == "state":
        rows.append(Reading("cant", "rad", 0.1, "cant"))
    return rows


_UNITS = {
    "y": "m", "z": "m", "phi": "rad", "psi": "rad",
    "T": "N m", "accel": "m/s^2", "gyro": "rad/s",
}  # fmt: skip

_SIZES = {
    "y": 0.01, "z": 0.05, "phi": 0.01, "psi": 0.01,
    "dy": 0.2, "dz": 0.1, "dphi": 0.2, "dpsi": 0.2,
    "accel": 5.0, "gyro": 0.2,
}  # fmt: skip


def _unit(name: str) -> str:
    kind = name.split("_", maxsplit=1)[0]
    return f"{_UNITS[kind[1:]]}/s" if kind.startswith("d") else _UNITS[kind]


def _scale(name: str, limit: float) -> float:
    kind = name.split("_", maxsplit=1)[0]
    return {"T": limit, "dT": 100.0 * limit, **_SIZES}[kind]
