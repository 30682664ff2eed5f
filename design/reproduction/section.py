"""What a report is made of: sections, the figures and tables in them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from design.reproduction.store import Piece

Data = Mapping[str, Any]
"""Results of pieces by the pieces' names."""


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
    """Numbers behind a section, written as CSV.

    Attributes
    ----------
    name : str
        Name of its file, without ending.
    header : tuple of str
        With units.
    rows : sequence of sequence
    """

    name: str
    header: tuple[str, ...]
    rows: Sequence[Sequence[Any]]


class Section(ABC):
    """A part of the report: what it needs computed, and how it shows that.

    A section computes nothing itself. It names its pieces; they are computed once, kept on disk and
    handed back as ``data``, together with those of all other sections. Pieces with the same name are
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
        """Return the numbers to write as CSV."""
        return ()
