"""The parts of a report: sections, with their figures and tables."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from design.reproduction.store import Piece
from railenv.errors import ParameterError

Data = Mapping[str, Any]
"""Results of pieces by their names."""


@dataclass(frozen=True)
class Drawing:
    """A figure of a section.

    Attributes
    ----------
    name : str
        Name of its file, without ending.
    figure : matplotlib.figure.Figure
    caption : str
        Plain text, shown below the figure and as its alternative text.
    group : str
        Figures in a row with the same group are laid out side by side under this heading; a figure
        with an empty group stands alone, at full width.
    """

    name: str
    figure: Figure
    caption: str
    group: str = ""


@dataclass(frozen=True)
class DataTable:
    """Numbers behind a section, written as CSV and as JSON.

    Attributes
    ----------
    name : str
        Name of its files, without ending.
    header : tuple of str
        Names of the columns, with units; all different.
    rows : sequence of sequence
        Numbers as numbers, not as text.

    Raises
    ------
    ParameterError
        If two columns have the same name, or the entries of a row do not match the columns.
    """

    name: str
    header: tuple[str, ...]
    rows: Sequence[Sequence[Any]]

    def __post_init__(self) -> None:
        if len(set(self.header)) < len(self.header):
            raise ParameterError(
                f"header of the table {self.name} is {self.header}; a name occurs twice"
            )
        for row in self.rows:
            if len(row) != len(self.header):
                raise ParameterError(
                    f"a row of the table {self.name} has {len(row)} entries; it must have "
                    f"{len(self.header)}"
                )

    @property
    def columns(self) -> dict[str, list[Any]]:
        """The table by columns."""
        return {name: [row[i] for row in self.rows] for i, name in enumerate(self.header)}


def significant(value: float, digits: int = 6) -> float:
    """Return a number rounded to some significant digits, for tables with many numbers."""
    return float(f"{value:.{digits}g}")


class Section(ABC):
    """A part of the report: its computations, and their presentation.

    A section computes nothing itself. It names its pieces; they are computed once, kept on disk and
    passed back as ``data``, together with those of all other sections. Pieces with the same name are
    the same piece.

    Attributes
    ----------
    key : str
        Short name, for links.
    title : str
    """

    key: str
    title: str

    @abstractmethod
    def pieces(self) -> tuple[Piece, ...]:
        """Return the computations that the section needs."""

    @abstractmethod
    def text(self, data: Data) -> Markup:
        """Return the section's text as HTML, with everything in it escaped."""

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Return the section's figures."""
        return ()

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the numbers to write as CSV and JSON."""
        return ()
