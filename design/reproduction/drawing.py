"""Panels of the report: small enough for a phone, in the style of :mod:`design.style`."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from design.style import style

PANEL = (4.6, 3.5)
"""Inches; wider figures would be too small to read on a phone."""

INK = "#333333"

_HALF_A_LINE = 32  # characters of a legend that half the width of a panel holds


def panel(title: str = "", height: float = PANEL[1]) -> tuple[Figure, Axes]:
    """Return an empty figure of the report's width with one pair of axes."""
    with style():
        figure = Figure(figsize=(PANEL[0], height))
        ax = figure.subplots()
    retitle(ax, title)
    return figure, ax


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


def legend_below(figure: Figure, handles: Sequence[Any]) -> None:
    """Put a legend below the axes, where it hides nothing, in as many columns as its texts allow."""
    longest = max((len(line) for h in handles for line in str(h.get_label()).splitlines()), default=0)
    columns = 2 if longest <= _HALF_A_LINE else 1
    with style():
        figure.legend(handles=list(handles), loc="outside lower left", ncols=columns, fontsize=8)


def write_figure(figure: Figure, folder: Path, name: str) -> tuple[bytes, tuple[Path, ...]]:
    """Write a figure as SVG and PNG, the same in every run.

    Returns
    -------
    bytes
        The SVG.
    tuple of Path
        Both files.
    """
    stream, paths = io.BytesIO(), (folder / f"{name}.svg", folder / f"{name}.png")
    with style(), mpl.rc_context({"svg.hashsalt": "railenv"}):
        layout = figure.get_layout_engine()
        if layout is not None:
            layout.execute(figure)
            figure.set_layout_engine("none")  # laid out once, for both files
        figure.savefig(stream, format="svg", metadata={"Date": None})
        figure.savefig(paths[1])
    text = stream.getvalue()
    paths[0].write_bytes(text)
    return text, paths
