"""Frozen records of physical quantities: checked on creation, described by their metadata.

Every field has its symbol, unit, meaning, allowed range and source in its metadata, from which the
parameter tables of the command line and of the documentation are made.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Self

from railenv import checks

TABLE = "Table 1"
"""Default source of a quantity."""


def quantity(
    symbol: str,
    unit: str,
    meaning: str,
    source: str = TABLE,
    *,
    default: Any = dataclasses.MISSING,
    **bounds: float | bool,
) -> Any:
    """Return a dataclass field for a physical quantity; bounds are those of ``checks.number``."""
    metadata = {"symbol": symbol, "unit": unit, "meaning": meaning, "source": source}
    return dataclasses.field(default=default, metadata={**metadata, "bounds": bounds})


def positive(symbol: str, unit: str, meaning: str, source: str = TABLE, **bounds: float | bool) -> Any:
    """Return a dataclass field for a quantity greater than 0."""
    return quantity(symbol, unit, meaning, source, low=0.0, open_low=True, **bounds)


def nonnegative(
    symbol: str, unit: str, meaning: str, source: str = TABLE, **bounds: float | bool
) -> Any:
    """Return a dataclass field for a quantity not less than 0."""
    return quantity(symbol, unit, meaning, source, low=0.0, **bounds)


def optional(
    symbol: str, unit: str, meaning: str, source: str, group: str, **bounds: float | bool
) -> Any:
    """Return an optional field: None, or a quantity; bounds are those of ``checks.number``.

    Fields with the same ``group`` belong together: give all of them or none.
    """
    metadata = {"symbol": symbol, "unit": unit, "meaning": meaning, "source": source, "group": group}
    return dataclasses.field(default=None, metadata={**metadata, "bounds": bounds})


def optional_table(symbol: str, x: str, y: str, meaning: str, source: str, group: str) -> Any:
    """Return an optional field: None, or two lists of numbers, the second over the first."""
    metadata = {"symbol": symbol, "unit": f"{x}, {y}", "meaning": meaning, "source": source}
    return dataclasses.field(default=None, metadata={**metadata, "group": group, "table": True})


@dataclass(frozen=True, kw_only=True)
class ParameterRecord:
    """Base of the frozen records of physical quantities: checks on creation, and ``replace``."""

    def __post_init__(self) -> None:
        """Check every quantity against its metadata and make it a float."""
        for f in dataclasses.fields(self):
            given = getattr(self, f.name)
            if "bounds" in f.metadata and not (given is None and f.default is None):
                value = checks.number(f.name, given, unit=f.metadata["unit"], **f.metadata["bounds"])
                object.__setattr__(self, f.name, value)

    def parameters(self) -> dict[str, float]:
        """Return all numbers that the equations of motion read, by name."""
        values = {
            f.name: getattr(self, f.name) for f in dataclasses.fields(self) if "bounds" in f.metadata
        }
        return {name: value for name, value in values.items() if value is not None}

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises
        ------
        UnknownNameError
            If a name is not a field.
        ParameterError
            If a value is not allowed.

        Examples
        --------
        >>> import railenv
        >>> railenv.HIGH_SPEED_COACH.replace(conicity=0.2).conicity
        0.2
        """
        checks.known("field", changes, [f.name for f in dataclasses.fields(self)])
        return dataclasses.replace(self, **changes)


@dataclass(frozen=True)
class FieldDescription:
    """One row of a parameter table."""

    name: str
    symbol: str
    unit: str
    meaning: str
    source: str


def describe(record: type) -> list[FieldDescription]:
    """Describe the fields of a parameter record (a dataclass of quantities), in order."""
    return [
        FieldDescription(
            f.name,
            f.metadata.get("symbol", ""),
            f.metadata.get("unit", ""),
            f.metadata["meaning"],
            f.metadata["source"],
        )
        for f in dataclasses.fields(record)
    ]
