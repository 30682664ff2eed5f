"""Panels of the report: small enough to be read on a phone, in the style of :mod:`design.plots`."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from design.plots import style

PANEL = (4.6, 3.5)
"""Inches; wider figures would be too small to read on a phone."""

INK = "#333333"


def panel(title: str = "", height: float = PANEL[1]) -> tuple[Figure, Axes]:
    """Return an empty figure of the report's width with one pair of axes."""
    with style():
        figure = Figure(figsize=(PANEL[0], height))
        ax = figure.subplots()
    retitle(ax, title)
    return figure, ax


def legend_inside(ax: Axes) -> None:
    """Put a legend of the axes' labelled lines into a upper right corner."""
    with style():
        ax.legend(loc="upper right", fontsize=8)


def retitle(ax: Axes, title: str) -> None:
    """Replace the title that a plot of :mod:`design` has given itself."""
    for place in ("center", "left"):
        ax.set_title("", loc=place)
    ax.set_title(title, loc="left", fontsize=10)


def take_handles(ax: Axes) -> list[Any]:
    """Remove the legend of some axes and return its entries."""
    handles = ax.get_legend_handles_labels()[0]
    legend = ax.get_legend()
    if legend is not None:
        legend.remove()
    return list(handles)


def legend_below(figure: Figure, handles: Sequence[Any], columns: int = 2) -> None:
    """Put a legend below the axes, where it covers nothing."""
    with style():
        figure.legend(handles=list(handles), loc="outside lower left", ncols=columns, fontsize=8)


def svg(figure: Figure) -> bytes:
    """Return a figure as SVG that is the same in every run."""
    stream = io.BytesIO()
    with style(), mpl.rc_context({"svg.hashsalt": "railenv"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()


def write_svg(figure: Figure, path: Path) -> bytes:
    """Write a figure and return its text."""
    text = svg(figure)
    path.write_bytes(text)
    return text
