"""Meanings and units of the numbers of a model, for axes and legends."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

from railenv.equipment import Equipped
from railenv.models import Assembled, Model


class Meaning(NamedTuple):
    """Meaning and unit of a number; "1" is the unit of a pure number, "" is an unknown one."""

    text: str
    unit: str


def meaning_of(model: Model, parameter: str) -> Meaning:
    """Return the meaning of a model's parameter; for a user's own equations, only its name."""
    if isinstance(model, Equipped):
        return _of_equipment(model, parameter) or meaning_of(model.plant, parameter)
    record: Any = getattr(model, "vehicle", None) or getattr(model, "record", None)
    if found := _of_contact(record, parameter):
        return found
    if record is not None and (found := _of_field(record, parameter)):
        return found
    if record is not None and parameter == "creep_factor":
        return Meaning("factor on the creep coefficients", "1")
    if isinstance(model, Assembled):
        for part in model.assembly.parts:
            field = parameter.removeprefix(f"{part.name}_")
            if field != parameter and (found := _of_field(part, field)):
                return Meaning(parameter, found.unit)
    return Meaning(parameter, "")


def _of_contact(record: Any, name: str) -> Meaning | None:
    """Return the meaning of a number of a vehicle's contact law, after its name."""
    law = getattr(record, "contact", None)
    if law is None or name not in law.number_fields():
        return None
    found = _of_field(law, name)
    return found and Meaning(f"{name.replace('_', ' ')}: {found.text}", found.unit)


def _of_field(record: Any, name: str) -> Meaning | None:
    for field in dataclasses.fields(record):
        if field.name == name and "meaning" in field.metadata:
            return Meaning(field.metadata["meaning"], field.metadata.get("unit", ""))
    return None


def _of_equipment(model: Equipped, name: str) -> Meaning | None:
    for group, actuator in model.groups.items():
        field = name if name == "delay" else name.removeprefix(group)
        if (field != name or not group or name == "delay") and (found := _of_field(actuator, field)):
            kind = group.removesuffix("_")
            return found if name == field else Meaning(f"{kind}: {found.text}", found.unit)
    return _of_field(model.sensors, name)
