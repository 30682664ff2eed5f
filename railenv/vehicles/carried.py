"""Actuators and sensors in the TOML file of a vehicle.

``[[yaw_actuator]]`` and ``[[lateral_actuator]]`` tables name the bodies between which they act;
numbers left out are those of ``Actuator.secondary()``. One ``[sensors]`` table names the bodies that
carry sensors; numbers left out are those of ``Sensors.standard()``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.vehicles.actuators import Actuator, LateralActuator, Sensors, YawActuator

ACTUATORS: dict[str, type[YawActuator]] = {
    "yaw_actuator": YawActuator,
    "lateral_actuator": LateralActuator,
}
"""Kinds of actuators, by the name of their tables in a file."""

SENSORS = "sensors"
"""Name of the table of the sensors."""

_NUMBERS = tuple(f.name for f in dataclasses.fields(Actuator))


def places_of(kind: type[YawActuator]) -> tuple[str, ...]:
    """Return the fields of an actuator that give its place."""
    return tuple(f.name for f in dataclasses.fields(kind) if f.name != "actuator")


def actuators(data: Mapping[str, Any], source: str) -> tuple[YawActuator, ...]:
    """Return the actuators that the content of a file declares.

    Raises
    ------
    ParameterError
        If one lacks its bodies or has a number that is not allowed.
    UnknownNameError
        If one has an unknown field.
    """
    found = []
    for kind, record in ACTUATORS.items():
        tables = data.get(kind, [])
        if not (isinstance(tables, list) and all(isinstance(t, dict) for t in tables)):
            raise ParameterError(f"{kind} in {source} must be tables, each headed [[{kind}]]")
        for number, table in enumerate(tables, 1):
            label = f"{table.get('name', f'{kind} number {number}')} in {source}"
            checks.known(f"field of {label}", table, [*places_of(record), *_NUMBERS])
            if "between" not in table:
                raise ParameterError(f"{label} lacks between (the two bodies between which it acts)")
            numbers = {n: v for n, v in table.items() if n in _NUMBERS}
            where = {n: v for n, v in table.items() if n not in _NUMBERS}
            found.append(record(actuator=Actuator.secondary().replace(**numbers), **where))
    return tuple(found)


def sensors(data: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return the sensors that the content of a file declares, and the bodies that carry them.

    Raises
    ------
    ParameterError
        If it is not a table, or has a number that is not allowed.
    UnknownNameError
        If it has an unknown field.
    """
    if SENSORS not in data:
        return {}
    table = data[SENSORS]
    if not isinstance(table, dict):
        raise ParameterError(f"{SENSORS} in {source} is {shown(table)}; it must be a table [{SENSORS}]")
    names = [f.name for f in dataclasses.fields(Sensors)]
    checks.known(f"field of {SENSORS} in {source}", table, ["bodies", *names])
    numbers = {n: v for n, v in table.items() if n in names}
    return {"sensors": Sensors.standard().replace(**numbers), "sensed": table.get("bodies")}


def tables(given: Sequence[YawActuator]) -> dict[str, list[dict[str, Any]]]:
    """Return actuators as a file has them, by the name of their tables."""
    found: dict[str, list[dict[str, Any]]] = {}
    for kind, record in ACTUATORS.items():
        for actuator in given:
            if type(actuator) is record:
                where = {n: getattr(actuator, n) for n in places_of(record)}
                numbers = dataclasses.asdict(actuator.actuator)
                found.setdefault(kind, []).append(
                    {**where, "between": list(actuator.between), **numbers}
                )
    return found
