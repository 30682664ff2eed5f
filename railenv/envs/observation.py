"""The entries of an environment's observation: name, unit, scale and source of each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

from railenv.equilibrium import find_equilibrium
from railenv.equipment import Equipped
from railenv.mounting import carried
from railenv.vehicles.vehicle import CREEP_COEFFICIENTS

Observation = Literal["state", "sensors"]

CREEP_FACTOR = "creep_factor"

CANT_BASE = 1.5
"""Base (m) over which cant is measured in millimetres."""


class Reading(NamedTuple):
    """An entry of an observation.

    Attributes
    ----------
    name : str
    unit : str
    scale : float
        Divisor of the quantity: its size in strong hunting.
    signal : str
        The same quantity (without noise) among the signals of :mod:`design.loop.feedback`.
    rest : float
        Value subtracted before: the height at which a body above the frames rests on its springs, or
        the middle of the range from which a number of the vehicle is drawn.
    drawn : bool
        Whether it is such a number, which is constant during an episode.
    """

    name: str
    unit: str
    scale: float
    signal: str
    rest: float = 0.0
    drawn: bool = False


def delay_slots(delay: float, control_period: float) -> int:
    """Return the length of the delay line of commands, including the present one."""
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
        rows = _state_rows(model)
        for command, limit, mount in zip(
            model.command_names, model.limits, model.equipment.mounts, strict=True
        ):
            unit = "N m" if mount.acts == "yaw" else "N"
            for age in range(1, delay_slots(model.delay, control_period)):
                name = f"{command}[-{age}]"
                rows.append(Reading(name, unit, float(limit), name))
    else:
        sizes = _sizes_of(model)
        for body in model.sensed:
            accel, gyro = f"accel_{body}", f"gyro_{body}"
            rows += [
                Reading(f"accelerometer_{body}", "m/s^2", sizes.get(accel, _SIZES["accel"]), accel),
                Reading(gyro, "rad/s", sizes.get(gyro, _SIZES["gyro"]), gyro),
            ]
    rows += [
        Reading("speed", "m/s", 100.0, "speed"),
        Reading("cant_deficiency", "rad", 0.150 / CANT_BASE, "cant_deficiency"),
    ]
    if observation == "state":
        rows.append(Reading("cant", "rad", 0.1, "cant"))
    return rows


def context_table(model: Equipped, randomize: Mapping[str, tuple[float, float]]) -> list[Reading]:
    """Return the entries for drawn numbers of a vehicle: from -1 to 1 over the range of each.

    Parameters
    ----------
    model : Equipped
    randomize : mapping of str to (float, float)
        Ranges; a number whose range has no width is left out.
    """
    rows = []
    for name, (low, high) in randomize.items():
        if low < high:
            signal, unit = _context_signal(model, name)
            half, middle = 0.5 * (high - low) * unit, 0.5 * (high + low) * unit
            rows.append(Reading(name, "", half, signal, middle, True))
    return rows


def context_ranges(model: Equipped, readings: Sequence[Reading]) -> dict[str, tuple[float, float]]:
    """Return the ranges of those readings that are entries of :func:`context_table`."""
    ranges = {}
    for reading in readings:
        if reading.drawn:
            _, unit = _context_signal(model, reading.name)
            low, high = reading.rest - reading.scale, reading.rest + reading.scale
            ranges[reading.name] = (low / unit, high / unit)
    return ranges


def _context_signal(model: Equipped, name: str) -> tuple[str, float]:
    """Return the vehicle's quantity that shows a drawn number, and its value at 1."""
    if name == CREEP_FACTOR:
        coefficient = CREEP_COEFFICIENTS[0]  # one shows the factor on all
        return coefficient, model.plant.parameters[coefficient]
    return name, 1.0


_UNITS = {
    "y": "m", "z": "m", "phi": "rad", "theta": "rad", "psi": "rad", "s": "m",
    "accel": "m/s^2", "gyro": "rad/s",
}  # fmt: skip

_SIZES = {
    "y": 0.01, "z": 0.05, "phi": 0.01, "theta": 0.01, "psi": 0.01, "s": 0.01,
    "dy": 0.2, "dz": 0.1, "dphi": 0.2, "dtheta": 0.2, "dpsi": 0.2,
    "accel": 5.0, "gyro": 0.2,
}  # fmt: skip

_SIZES_ABOVE = {
    "y": 0.05, "z": 0.02, "phi": 0.02, "theta": 0.002, "psi": 0.002,
    "dy": 0.1, "dz": 0.1, "dphi": 0.05, "dtheta": 0.01, "dpsi": 0.02,
    "accel": 1.0, "gyro": 0.05,
}  # fmt: skip
"""Typical magnitudes for bodies above the frames, which the secondary suspension keeps calm."""

_ANY_SPEED = 5.0  # m/s; the rest position on tangent track does not depend on it

_OF_UNKNOWN = 10.0
"""Scale of a state with an unknown name, in its typical magnitudes."""


def _sizes_of(model: Equipped) -> dict[str, float]:
    """Return the scales of the states, and of the sensors, of bodies above the frames."""
    sizes: dict[str, float] = {}
    for body in carried(model.plant):
        motion = model.body_states[body]
        sizes |= {state: _SIZES_ABOVE[kind] for kind, state in motion.items()}
        sizes |= {f"{kind}_{body}": _SIZES_ABOVE[kind] for kind in ("accel", "gyro")}
    return sizes


def resting_heights(model: Equipped) -> dict[str, float]:
    """Return the heights (m) at which bodies above the frames rest on tangent track.

    They settle on two levels of springs by much more than they move about this height.
    """
    heights = [model.body_states[b]["z"] for b in carried(model.plant) if "z" in model.body_states[b]]
    if not heights:
        return {}
    state = find_equilibrium(model.plant, speed=_ANY_SPEED).state
    return {name: float(state[model.plant.state_names.index(name)]) for name in heights}


def _state_rows(model: Equipped) -> list[Reading]:
    """Return the entries for the states of a model."""
    limits = {}
    for mount, limit in zip(model.equipment.mounts, model.limits, strict=True):
        value, rate = mount.state_names
        unit = "N m" if mount.acts == "yaw" else "N"
        limits[value], limits[rate] = (unit, float(limit)), (f"{unit}/s", 100.0 * float(limit))
    sizes = _sizes_of(model)
    rests = resting_heights(model)
    rows = []
    for name, scale in zip(model.state_names, model.scale, strict=True):
        kind = name.split("_", maxsplit=1)[0]
        if name in limits:
            rows.append(Reading(name, *limits[name], name))
        elif kind in _SIZES:
            unit = _UNITS[kind] if kind in _UNITS else f"{_UNITS[kind[1:]]}/s"
            size = sizes.get(name, _SIZES[kind])
            rows.append(Reading(name, unit, size, name, rests.get(name, 0.0)))
        else:
            rows.append(Reading(name, "", _OF_UNKNOWN * float(scale), name))
    return rows
