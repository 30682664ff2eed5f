"""The paper's Table 1, and the vehicles beside it."""

from __future__ import annotations

from markupsafe import Markup

from design.reproduction.cases import VEHICLES
from design.reproduction.document import fragment
from design.reproduction.section import Data, DataTable, Section
from design.reproduction.store import Piece
from railenv.vehicles import FieldDescription, Vehicle, describe
from railenv.vehicles.further import FurtherParts

_HEADER = ("symbol", "unit", *(v.name for v in VEHICLES), "meaning", "source")


class Vehicles(Section):
    """Every parameter of the three vehicles."""

    key = "table-1"
    title = "Parameters (Table 1)"

    def pieces(self) -> tuple[Piece, ...]:
        """Return no pieces: the vehicles are not results."""
        return ()

    def text(self, data: Data) -> Markup:
        """Return the table."""
        rows = [_row(field) for field in _fields()]
        changed = sum(len(set(row[2 : 2 + len(VEHICLES)])) > 1 for row in rows)
        paragraphs = [
            *(f"{v.name}: {v.provenance}." for v in VEHICLES),
            f"{changed} of {len(rows)} parameters differ between the vehicles; they are tinted.",
        ]
        return fragment(
            "vehicles.html", paragraphs=paragraphs, header=_HEADER, rows=rows, count=len(VEHICLES)
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the table."""
        rows = [
            (f.symbol or f.name, f.unit, *(getattr(v, f.name) for v in VEHICLES), f.meaning, f.source)
            for f in _fields()
        ]
        return (DataTable("table_1", _HEADER, rows),)


def _fields() -> list[FieldDescription]:
    """Return the fields of bogies like the paper's."""
    left_out = {"name", "provenance", "overturning", *(f.name for f in describe(FurtherParts))}
    return [f for f in describe(Vehicle) if f.name not in left_out]


def _row(field: FieldDescription) -> tuple[str, ...]:
    values = tuple(_written(getattr(v, field.name)) for v in VEHICLES)
    return (field.symbol or field.name, field.unit, *values, field.meaning, field.source)


def _written(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower()
