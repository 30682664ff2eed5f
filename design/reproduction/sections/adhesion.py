"""The adhesion limit of a curve, beside the paper's brackets."""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from design.reproduction import paper, pieces
from design.reproduction.adhesion import adhesion_limit
from design.reproduction.cases import CASES, MODEL_COLORS, MODEL_TITLES, MODELS, Case, ModelName
from design.reproduction.claims import cases_of
from design.reproduction.claims_of_diagrams import hunting_range
from design.reproduction.document import fragment
from design.reproduction.drawing import INK, legend_below, panel
from design.reproduction.section import Data, DataTable, Drawing, Section
from design.reproduction.settings import Settings
from design.reproduction.store import Piece

_LINES = {"TABLE_1": "-", "TABLE_1_PRINTED_LOADS": "--", "HIGH_SPEED_COACH": ":"}
_MARKERS = {"TABLE_1": ("o", 4.0), "TABLE_1_PRINTED_LOADS": ("s", 8.0), "HIGH_SPEED_COACH": ("^", 6.0)}


class Adhesion(Section):
    """The adhesion limit of a curve as a conjecture on the paper's speeds."""

    key = "adhesion"
    title = "A conjecture: the adhesion limit of the curve"

    def __init__(self, settings: Settings, *, whole: bool) -> None:
        self._settings = settings
        self._whole = whole

    def pieces(self) -> tuple[Piece, ...]:
        """Return the simulated diagrams, which show where hunting ends; none on the first page."""
        return tuple(pieces.diagram(c, self._settings) for c in CASES) if self._whole else ()

    def text(self, data: Data) -> Markup:
        """Return the conjecture and the table of limits."""
        rows = [_row(case) for case in CASES]
        inside = sum(row[-1] == "yes" for row in rows)
        paragraphs = [
            "Above the speed V = √(R (μN/m + g·cant)) the lateral load of the curve exceeds the "
            "friction of "
            "all wheels. N is the vertical load and m the mass that is pushed sideways, both summed "
            "over the "
            "model. No creep force holds a wheelset on the tread beyond it: it moves to the flange "
            "and rests "
            "there, and hunting ends. (The formula leaves out the springs. The dual wheelset's end "
            "at a "
            "fixed frame, and stiff ones, as the coach's, hold it on the tread.)",
            f"At R = {paper.RADIUS:g} m this speed lies inside the paper's bracket in {inside} of "
            f"{len(rows)} cases. "
            "There the order is the opposite of the paper's: hunting below, rest above.",
        ]
        if self._whole:
            paragraphs.append(
                "The marks show the highest speed at which a simulation still ends in hunting, on "
                "each of the curves of "
                "Figs 10 and 11."
            )
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption=f"R = {paper.RADIUS:g} m, cant {paper.CANT} rad.",
            header=("case", "adhesion limit", "paper's bracket", "inside"),
            rows=rows,
            words=1,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw the limit over the radius for each model."""
        return tuple(self._figure(kind, data) for kind in MODELS)

    def _figure(self, kind: ModelName, data: Data) -> Drawing:
        title = f"{MODEL_TITLES[kind]}, cant {paper.CANT} rad"
        figure, ax = panel(title, 4.4)
        radii = np.geomspace(*paper.RADII, 60)
        handles: list[Any] = []
        drawn = set()
        for case in cases_of(kind):
            limit = [adhesion_limit(case, r, paper.CANT) for r in radii]
            known = round(limit[0], 6)
            if known not in drawn:
                names = [c.vehicle.name for c in cases_of(case.kind) if _same_limit(c, radii[0], known)]
                text = "adhesion limit, " + ",\n".join(names)
                style = _LINES[case.vehicle.name]
                handles += ax.plot(radii, limit, style, color=MODEL_COLORS[kind], label=text)
                drawn.add(known)
            if self._whole:
                handles += self._marks(ax, case, data)
        printed = cases_of(kind)[0].printed
        bracket = ax.vlines(
            paper.RADIUS,
            printed.steady,
            printed.hunting,
            color=INK,
            lw=4.0,
            label="paper: steady to hunting",
        )
        handles.append(bracket)
        ax.set_xlabel("curve radius (m)")
        ax.set_ylabel("speed (m/s)")
        ax.set_xlim(0.0, None)
        ax.set_ylim(0.0, 190.0)
        legend_below(figure, handles)
        caption = f"Speed at which a curve uses up all adhesion of the {MODEL_TITLES[kind]}."
        return Drawing(
            f"adhesion_limit_{kind}", figure, caption, "Adhesion limit and the paper's speeds"
        )

    def _marks(self, ax: Axes, case: Case, data: Data) -> list[Any]:
        found = data[pieces.diagram(case, self._settings).name]
        reach = [hunting_range(found, case, i) for i in range(len(found.radius))]
        points = [(r, span[1]) for r, span in zip(found.radius, reach, strict=True) if span]
        if not points:
            return []
        x, y = zip(*points, strict=True)
        marker, size = _MARKERS[case.vehicle.name]
        return ax.plot(
            x,
            y,
            marker,
            ms=size,
            color=MODEL_COLORS[case.kind],
            mfc="none",
            label=f"hunting ends in simulation, {case.vehicle.name}",
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the limits over the radius."""
        header = ("model", "vehicle", "radius_m", "adhesion_limit_m_per_s")
        rows = [
            (c.kind, c.vehicle.name, r, adhesion_limit(c, r, paper.CANT))
            for c in CASES
            for r in (*np.geomspace(*paper.RADII, 25).tolist(), paper.RADIUS)
        ]
        return (DataTable("adhesion_limit", header, rows),)


def _same_limit(case: Case, radius: float, known: float) -> bool:
    return round(adhesion_limit(case, radius, paper.CANT), 6) == known


def _row(case: Case) -> tuple[str, ...]:
    limit = adhesion_limit(case, paper.RADIUS, paper.CANT)
    low, high = case.printed.steady, case.printed.hunting
    inside = "yes" if low <= limit <= high else "no"
    return case.title, f"{limit:.1f} m/s", f"{low:g} to {high:g} m/s", inside
