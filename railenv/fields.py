"""Fields of records whose numbers may be texts, for parts of a vehicle and contact laws.

Numbers are SI. Each is a float, or a text that computes it from the names of parameters
(``"frame_mass + body_mass / 2"``). A field that is left out (None) does not appear in the equations.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Self

from railenv import checks, tables
from railenv.errors import ParameterError, shown
from railenv.tables import Table

Number = float | str | None
Points = tuple[tuple[float, ...], tuple[float, ...]]


def number(unit: str, meaning: str, *, needed: bool = False, **bounds: float | bool) -> Any:
    """Return a dataclass field that holds a number; bounds as in ``checks.number``."""
    default = dataclasses.MISSING if needed else None
    metadata = {"unit": unit, "meaning": meaning, "bounds": bounds}
    return dataclasses.field(default=default, metadata=metadata)


def positive(unit: str, meaning: str) -> Any:
    """Return a dataclass field that must be given a number greater than 0."""
    return number(unit, meaning, needed=True, low=0.0, open_low=True)


def nonnegative(unit: str, meaning: str, needed: bool = False) -> Any:
    """Return a dataclass field that holds a number not less than 0."""
    return number(unit, meaning, needed=needed, low=0.0)


def characteristic(x: str, y: str, meaning: str, *, needed: bool = False) -> Any:
    """Return a dataclass field that holds a table of points."""
    metadata = {"unit": f"{x}, {y}", "meaning": meaning, "table": True}
    default = dataclasses.MISSING if needed else None
    return dataclasses.field(default=default, metadata=metadata)


def choice(meaning: str, allowed: tuple[str, ...], default: str) -> Any:
    """Return a dataclass field that holds one of some words."""
    return dataclasses.field(default=default, metadata={"meaning": meaning, "allowed": allowed})


def as_points(label: str, value: Any) -> Points:
    """Return the points of an odd characteristic as tuples of floats.

    Raises
    ------
    ParameterError
        If they are not points; ``label`` names their owner in the message.
    """
    try:
        x, y = value
        points = tuple(map(float, x)), tuple(map(float, y))
    except (TypeError, ValueError):
        raise ParameterError(f"{label} is {shown(value)}; it must be two lists of numbers") from None
    _check_points(label, points)
    return points


@cache
def _check_points(label: str, points: Points) -> None:
    tables.characteristic(*points, odd=True, name=label)


@dataclass(frozen=True)
class Numbered:
    """Base of records whose numbers and tables the equations read by the names of the fields."""

    kind: ClassVar[str]
    """Name of the record in files."""

    @property
    def called(self) -> str:
        """Name of the record in messages."""
        return self.kind

    def check_fields(self) -> None:
        """Check all numbers that are not texts, and all choices."""
        for f in dataclasses.fields(self):
            value = getattr(self, f.name)
            if "allowed" in f.metadata:
                checks.choice(f"{f.name} of {self.called}", value, f.metadata["allowed"])
            elif "bounds" in f.metadata and not isinstance(value, (str, type(None))):
                self.checked(f.name, value)

    def checked(self, field: str, value: Any) -> float:
        """Return the number of a field; raise ParameterError if it is not allowed."""
        f = next(f for f in dataclasses.fields(self) if f.name == field)
        label = f"{field} of {self.called}"
        return checks.number(label, value, unit=f.metadata["unit"], **f.metadata["bounds"])

    @classmethod
    def number_fields(cls) -> list[str]:
        """Return the names of the fields that hold a number or an expression."""
        return [f.name for f in dataclasses.fields(cls) if "bounds" in f.metadata]

    @classmethod
    def table_fields(cls) -> list[str]:
        """Return the names of the fields that equations read as tables."""
        return [f.name for f in dataclasses.fields(cls) if "table" in f.metadata]

    def has_table(self, field: str) -> bool:
        """Return whether there is a table of this name."""
        return getattr(self, field) is not None

    def table(self, field: str) -> Table:
        """Return a table in the form that the kernels read."""
        return Table.through(*getattr(self, field), odd=True, name=f"{field} of {self.called}")

    def given(self, prefix: str) -> dict[str, str]:
        """Return the expression of each field that is given; a number is named after its field."""
        values = {field: getattr(self, field) for field in self.number_fields()}
        numbers = {
            field: value if isinstance(value, str) else prefix + field
            for field, value in values.items()
            if value is not None
        }
        return {**numbers, **{f: prefix + f for f in self.table_fields() if self.has_table(f)}}

    def numbers(self, prefix: str) -> dict[str, float]:
        """Return the numbers that are not texts, by their names as parameters."""
        values = {field: getattr(self, field) for field in self.number_fields()}
        return {
            prefix + field: value
            for field, value in values.items()
            if value is not None and not isinstance(value, str)
        }

    def settings(self) -> list[Any]:
        """Return all that is neither number nor table, to distinguish structures."""
        skip = {*self.number_fields(), *self.table_fields(), "name"}
        return [[f.name, getattr(self, f.name)] for f in dataclasses.fields(self) if f.name not in skip]

    def renumbered(self, prefix: str, changes: Mapping[str, float]) -> Self:
        """Return the record with its own numbers in ``changes`` changed."""
        own: dict[str, Any] = {
            field: changes[prefix + field]
            for field in self.number_fields()
            if prefix + field in self.numbers(prefix) and prefix + field in changes
        }
        return dataclasses.replace(self, **own) if own else self

    def shared(self, prefix: str) -> dict[str, str]:
        """Return the texts with which another record reads this one's numbers."""
        return {name.removeprefix(prefix): name for name in self.numbers(prefix)}

    def reading(self, prefix: str) -> Self:
        """Return a record that reads this one's numbers."""
        shared: dict[str, Any] = dict(self.shared(prefix))
        return dataclasses.replace(self, **shared) if shared else self
