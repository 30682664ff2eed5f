"""Conversion of settings to plain values, as in JSON and on command lines, and back.

Gymnasium keeps the keywords of an environment in its spec, writes them as JSON and makes environments
from them again. So keywords that are records may also be mappings of their fields, or names
where they have names; ``base`` in a mapping names the record that supplies the other fields.
"""

from __future__ import annotations

import dataclasses
import enum
import tomllib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from railenv import checks
from railenv.contact.given import contact_law
from railenv.contact.laws import ContactLaw
from railenv.contact.pair import ProfilePair
from railenv.equipment import Actuator, Sensors
from railenv.errors import ParameterError, shown
from railenv.irregularity import Line
from railenv.vehicles import (
    HIGH_SPEED_COACH,
    HIGH_SPEED_COACH_HOLLOW,
    TABLE_1,
    TABLE_1_PRINTED_LOADS,
    Vehicle,
    files,
)
from railenv.vehicles.assembly import Assembly
from railenv.vehicles.vehicle import preset

ACTUATORS: Mapping[str, Callable[[], Actuator]] = {
    "secondary": Actuator.secondary,
    "primary": Actuator.primary,
    "lateral": Actuator.lateral,
}
"""Actuators with a name."""

SENSORS: Mapping[str, Callable[[], Sensors]] = {"standard": Sensors.standard, "ideal": Sensors.ideal}
"""Sensors with a name."""


def record(
    setting: str,
    kind: type[Any],
    value: Any,
    named: Mapping[str, Callable[[], Any]] | None = None,
    base: str | None = None,
) -> Any:
    """Return a record from itself, its name, or a mapping of its fields.

    Parameters
    ----------
    setting : str
        Name of the setting in messages.
    kind : type
        Class of the record.
    value : record, str or mapping
    named : mapping of str to callable, optional
        Records with a name.
    base : str, optional
        Name of the record that supplies fields left out of a mapping, unless it has a ``base``.

    Raises
    ------
    ParameterError
        If it is something else, or a field is missing.
    UnknownNameError
        If there is no such name or field.
    """
    names = list(named or ())
    if isinstance(value, kind):
        return value
    if isinstance(value, str) and named:
        checks.known(setting, [value], names)
        return named[value]()
    if not isinstance(value, Mapping):
        listed = f", its name ({', '.join(names)})" if names else ""
        raise ParameterError(
            f"{setting} is {shown(value)}; it must be a {_called(kind)}{listed} or a mapping of its "
            "fields"
        )
    fields = {name: given for name, given in value.items() if not (named and name == "base")}
    checks.known(f"field of {setting}", fields, [f.name for f in dataclasses.fields(kind)])
    base = value.get("base", base) if named else None
    if base is not None:
        checks.known(f"base of {setting}", [base], names)
        return dataclasses.replace(named[base](), **fields)  # type: ignore[index]
    missing = [
        f.name
        for f in dataclasses.fields(kind)
        if f.name not in fields
        and f.default is dataclasses.MISSING
        and f.default_factory is dataclasses.MISSING
    ]
    if missing:
        also = f", or a base ({', '.join(names)}) to take them from" if names else ""
        raise ParameterError(f"{setting} lacks {', '.join(missing)}; give them{also}")
    return kind(**fields)


def _called(kind: type[Any]) -> str:
    return kind.__name__ if kind.__module__.startswith("railenv.envs") else f"railenv.{kind.__name__}"


def vehicle(value: Any) -> Vehicle | Assembly:
    """Return a vehicle from itself, the name of a shipped one, or the content of its file.

    Raises
    ------
    ParameterError
        If it is something else, or a value is not allowed.
    UnknownNameError
        If there is no such vehicle or field.
    """
    if isinstance(value, (Vehicle, Assembly)):
        return value
    if isinstance(value, str):
        return preset(value)
    if not isinstance(value, Mapping):
        raise ParameterError(
            f"vehicle is {shown(value)}; it must be a railenv.Vehicle, a railenv.Assembly, the name of "
            "a shipped vehicle, or what a file of a vehicle holds"
        )
    if files.describes_assembly(value):
        return Assembly.described(value, "vehicle")
    if "base" in value and not {"conicity", "contact"}.isdisjoint(value):
        value = {"conicity": None, "contact": None, **value}  # one of them takes the place of both
    from railenv.vehicles.presets import PRESETS

    named = {v.name: (lambda v=v: v) for v in PRESETS}
    found: Vehicle = record("vehicle", Vehicle, value, named)
    return found


def contact(value: Any) -> ContactLaw:
    """Return a contact law from itself, a mapping, or the name of one that needs nothing else."""
    return contact_law({"law": value} if isinstance(value, str) else value)


def irregularity(value: Any) -> Any:
    """Return a setting of irregularity, with a mapping of a line's fields made into the line."""
    return record("irregularity", Line, value) if isinstance(value, Mapping) else value


def plain(value: Any) -> Any:
    """Return a keyword as JSON values, where that is possible.

    Vehicles and contact laws become what files hold, a shipped vehicle its name, other records
    mappings of their fields. Models of one's own stay as they are.
    """
    if isinstance(value, Vehicle):
        return value.name if _is_shipped(value) else _fields(value)
    if isinstance(value, Assembly):
        return tomllib.loads(value.to_toml())
    if isinstance(value, ContactLaw):
        return plain(value.to_mapping())
    if isinstance(value, enum.Enum):
        return plain(value.value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _fields(value)
    if isinstance(value, Mapping):
        return {name: plain(given) for name, given in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(given) for given in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return value


def _is_shipped(value: Vehicle) -> bool:
    """Whether a vehicle is one that comes with the package."""
    if isinstance(value.contact, ProfilePair):
        from railenv.vehicles.presets import PRESETS  # builds the profiles, which takes a second

        return value in PRESETS
    return value in (TABLE_1, TABLE_1_PRINTED_LOADS, HIGH_SPEED_COACH, HIGH_SPEED_COACH_HOLLOW)


def _fields(value: Any) -> dict[str, Any]:
    """Return the fields of a record that has them, as plain values."""
    fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    if isinstance(fields.get("contact"), ContactLaw):
        fields.pop("conicity", None)  # its contact law has it
    return {name: plain(given) for name, given in fields.items() if given is not None}
