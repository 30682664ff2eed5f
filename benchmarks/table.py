"""Rows of the table of results, and its three forms: terminal, Markdown and JSON."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich import box
from rich.console import JustifyMethod
from rich.table import Table

HEADINGS = ("what", "value", "unit", "statistic", "compared with", "ratio", "required", "holds")
_RIGHT = ("value", "ratio")
_UNBROKEN = ("value", "unit", "ratio", "holds")

SCALES = {"s": 1.0, "ms": 1e3, "µs": 1e6, "ns": 1e9}


@dataclass(frozen=True)
class Row:
    """One measurement; the last four fields stay empty where nothing is compared or required."""

    what: str
    value: float | str
    unit: str
    statistic: str
    compared_with: str = ""
    ratio: float | None = None
    required: str = ""
    holds: bool | None = None

    @property
    def cells(self) -> tuple[str, ...]:
        """The row as text, ordered as ``HEADINGS``."""
        value = self.value if isinstance(self.value, str) else number(self.value)
        ratio = "" if self.ratio is None else number(self.ratio)
        holds = "" if self.holds is None else "yes" if self.holds else "NO"
        return (
            self.what,
            value,
            self.unit,
            self.statistic,
            self.compared_with,
            ratio,
            self.required,
            holds,
        )


def number(value: float) -> str:
    """Three significant digits, without an exponent."""
    digits = 2 - math.floor(math.log10(abs(value))) if value else 0
    return f"{value:.{max(digits, 0)}f}"


def with_unit(seconds: float, unit: str) -> str:
    """Return a time as text in a unit of ``SCALES``."""
    return f"{number(seconds * SCALES[unit])} {unit}"


def terminal(rows: Iterable[Row], title: str) -> Table:
    """Return the table for a terminal."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for heading in HEADINGS:
        justify: JustifyMethod = "right" if heading in _RIGHT else "left"
        table.add_column(heading, justify=justify, no_wrap=heading in _UNBROKEN, overflow="fold")
    for row in rows:
        table.add_row(*row.cells, style="bold red" if row.holds is False else None)
    return table


def markdown(rows: Iterable[Row], title: str, about: Sequence[str] = ()) -> str:
    """Return the table as Markdown, below paragraphs on what it is."""
    rule = ["---:" if heading in _RIGHT else "---" for heading in HEADINGS]
    table = [f"| {' | '.join(cells)} |" for cells in (HEADINGS, rule, *(row.cells for row in rows))]
    return "\n\n".join(["# Benchmarks", *about, title, "\n".join(table)]) + "\n"


def records(rows: Sequence[Row]) -> list[dict[str, object]]:
    """Return the rows for JSON."""
    return [dataclasses.asdict(row) for row in rows]
