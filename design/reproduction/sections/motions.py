"""Phase portraits and time histories: the paper's Figs 6 to 9."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from design.cycles.motion_plots import phase_portrait, plot_response
from design.reproduction import paper, pieces
from design.reproduction.cases import MODEL_TITLES, MODELS, Case, ModelName
from design.reproduction.claims import cases_of
from design.reproduction.claims_of_motions import describe
from design.reproduction.document import fragment
from design.reproduction.drawing import panel, retitle
from design.reproduction.section import Data, DataTable, Drawing, Section, significant
from design.reproduction.store import Piece
from design.style import STABLE, UNSTABLE

_BODY: dict[ModelName, str] = {"bogie": "b", "dual_wheelset": "w1"}
"""Body that the figures show: the paper's bogie is the frame."""


class Motions(Section):
    """Motions below and above the paper's critical speeds."""

    key = "motions"
    title = "Phase portraits and time histories (Figs 6 to 9)"

    def pieces(self) -> tuple[Piece, ...]:
        """Return the motions."""
        return tuple(pieces.motion(case, speed) for _, case, speed in _shown())

    def text(self, data: Data) -> Markup:
        """Return the ends of all motions."""
        rows = [
            (figure, case.title, f"{speed:g} m/s", describe(_found(data, case, speed), case))
            for figure, case, speed in _shown()
        ]
        paragraphs = [
            f"R = {paper.RADIUS:g} m, cant {paper.CANT} rad, zero initial conditions, as in the "
            "paper. The figures show the "
            f"first {pieces.SHOWN:g} s; how a motion ends is judged within the last "
            f"{pieces.WINDOW:g} s of "
            f"{pieces.DURATION:g} s, at the leading wheelset. The bogie's figures show the frame, as "
            "the paper's do. "
            "Red: hunting at the end; blue: at rest. Table 1's lateral springs are so soft that the "
            "lateral load of the "
            "curve moves the frame far to the outside.",
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption="How the motions end.",
            header=("figure", "case", "speed", "motion at the end"),
            rows=rows,
            words=4,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw (a), (b) and (c) of every figure for every vehicle."""
        drawings = []
        for figure, case, speed in _shown():
            drawings += _panels(figure, case, speed, _found(data, case, speed))
        return tuple(drawings)

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the time histories."""
        tables = []
        for _, case, speed in _shown():
            response = _found(data, case, speed)["response"]
            header = ("time_s", *response.output_labels)
            rows = [
                tuple(significant(float(v)) for v in (t, *row))
                for t, row in zip(response.time, response.outputs.T, strict=True)
            ]
            tables.append(DataTable(f"motion_{case.key}_{speed:g}", header, rows))
        return tuple(tables)


def _shown() -> list[tuple[str, Case, float]]:
    shown = []
    for kind in MODELS:
        first = cases_of(kind)[0].printed
        for figure, speed in (
            (first.steady_figure, first.steady),
            (first.hunting_figure, first.hunting),
        ):
            shown += [(figure, case, speed) for case in cases_of(kind)]
    return shown


def _found(data: Data, case: Case, speed: float) -> dict[str, Any]:
    return data[pieces.motion(case, speed).name]


def _panels(figure: str, case: Case, speed: float, found: dict[str, Any]) -> list[Drawing]:
    response, body = found["response"], _BODY[case.kind]
    color = UNSTABLE if found["hunts"] else STABLE
    group = f"{figure}: {MODEL_TITLES[case.kind]} at {speed:g} m/s"
    file = figure.lower().replace(" ", "0")
    drawings = []
    for part, coordinate in (("a", f"y_{body}"), ("b", f"psi_{body}")):
        drawn, ax = panel()
        phase_portrait(response, (coordinate, f"d{coordinate}"), ax=ax, color=color)
        retitle(ax, f"{case.vehicle.name}, {speed:g} m/s")
        caption = f"{figure} ({part}). {case.vehicle.name}: {describe(found, case)}."
        drawings.append(Drawing(f"{file}{part}_{case.vehicle.name}", drawn, caption, group))
    drawn, ax = panel()
    plot_response(response, [f"y_{body}"], ax, color=color, lw=1.0)
    retitle(ax, f"{case.vehicle.name}, {speed:g} m/s")
    caption = f"{figure} (c). {case.vehicle.name}: {describe(found, case)}."
    drawings.append(Drawing(f"{file}c_{case.vehicle.name}", drawn, caption, group))
    return drawings
