"""Simulated bifurcation diagrams: the paper's Figs 10 and 11."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup

from design.cycles.diagram import SimulatedDiagram
from design.reproduction import paper, pieces
from design.reproduction.cases import CASES, MODEL_TITLES, MODELS, Case
from design.reproduction.claims import cases_of
from design.reproduction.claims_of_diagrams import START, amplitude, hunting_range, largest, on_track
from design.reproduction.document import fragment
from design.reproduction.drawing import legend_below, panel
from design.reproduction.section import Data, DataTable, Drawing, Section
from design.reproduction.settings import Settings
from design.reproduction.store import Piece
from design.style import NEUTRAL

_FIGURES = {"bogie": "Fig 10", "dual_wheelset": "Fig 11"}


class Diagrams(Section):
    """Final motions of simulations, over speed and curve radius."""

    key = "diagrams"
    title = "Bifurcation diagrams by simulation (Figs 10 and 11)"

    def __init__(self, settings: Settings) -> None:
        self._settings = settings

    def pieces(self) -> tuple[Piece, ...]:
        """Return the diagrams."""
        return tuple(pieces.diagram(case, self._settings) for case in CASES)

    def text(self, data: Data) -> Markup:
        """Return the text and the table of hunting speeds."""
        rows = [
            (
                case.title,
                *(_span(self._found(data, case), case, i) for i in range(len(paper.DIAGRAM_RADII))),
            )
            for case in CASES
        ]
        disturbance = next(iter(self._found(data, CASES[0]).starts[START].values()))
        paragraphs = [
            f"Every point is the end of a simulation of {self._settings.diagram_duration:g} s that "
            "starts with the "
            f"leading wheelset {1e3 * disturbance:g} mm beside the running equilibrium (or beside "
            "the last one, where "
            "there is none). A disturbance that dies out slowly is still seen. Points are left out "
            "where the wheelset is more than two flange clearances off the centre: "
            "a real one would have climbed the rail.",
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption="Lowest and highest speed with more than 1 mm of amplitude at the end, m/s.",
            header=("case", *(f"{r:g} m" for r in paper.DIAGRAM_RADII)),
            rows=rows,
            words=1,
        )

    def _found(self, data: Data, case: Case) -> SimulatedDiagram:
        found: SimulatedDiagram = data[pieces.diagram(case, self._settings).name]
        return found

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw the largest displacement and the amplitude for every case."""
        shown = (("a", "largest displacement", largest), ("b", "amplitude", amplitude))
        return tuple(
            _panel(self._found(data, case), case, part, what, measure)
            for kind in MODELS
            for part, what, measure in shown
            for case in cases_of(kind)
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the extremes of every simulation."""
        header = (
            "radius_m",
            "speed_m_per_s",
            "start_y_w1_m",
            "lowest_y_w1_m",
            "highest_y_w1_m",
            "steady",
        )
        tables = []
        for case in CASES:
            found = self._found(data, case)
            rows = [
                (r, v, *start.values(), *found_ends(found, i, j, k), bool(found.steady[i, j]))
                for i, r in enumerate(found.radius)
                for j, v in enumerate(found.speed)
                for k, start in enumerate(found.starts)
            ]
            tables.append(DataTable(f"diagram_{case.key}", header, rows))
        return tuple(tables)


def found_ends(found: SimulatedDiagram, row: int, column: int, start: int) -> tuple[float, float]:
    """Return the extremes (m) of the first state at the end of one simulation."""
    return float(found.lowest[row, column, start, 0]), float(found.highest[row, column, start, 0])


def _span(found: SimulatedDiagram, case: Case, row: int) -> str:
    reach = hunting_range(found, case, row)
    return "none" if reach is None else f"{reach[0]:.0f} to {reach[1]:.0f}"


def _panel(
    found: SimulatedDiagram,
    case: Case,
    part: str,
    what: str,
    measure: Callable[[SimulatedDiagram], Any],
) -> Drawing:
    name, inside, values = _FIGURES[case.kind], on_track(found, case), measure(found)
    figure, ax = panel(case.vehicle.name, 4.4)
    colors = mpl.colormaps["viridis"](np.linspace(0.0, 0.92, len(found.radius)))
    for i, color in enumerate(colors):
        y = np.where(inside[i], 1e3 * values[i], np.nan)
        ax.plot(found.speed, y, ".-", color=color, ms=3.5, lw=0.7, label=f"R = {found.radius[i]:g} m")
    clearance = 1e3 * case.vehicle.flange_clearance
    ax.axhline(clearance, color=NEUTRAL, ls=":", lw=1.2, label=f"flange clearance {clearance:.2f} mm")
    ax.set_xlabel("speed (m/s)")
    ax.set_ylabel(f"{what} of y_w1 (mm)")
    ax.set_ylim(0.0, 2.0 * clearance)
    ax.set_xlim(0.0, None)
    legend_below(figure, ax.get_legend_handles_labels()[0])
    caption = (
        f"{name}. {case.title}: {what} of the leading wheelset at the end of simulations, "
        f"cant {paper.CANT} rad."
    )
    file = f"{name.lower().replace(' ', '')}{part}_{case.vehicle.name}"
    return Drawing(file, figure, caption, f"{name}: {MODEL_TITLES[case.kind]}")
