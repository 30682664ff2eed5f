"""Map of where a vehicle never, may and must hunt, over the conicity of its wheels."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from design.cycles.hunting_map import HuntingMap
from design.reproduction import pieces
from design.reproduction.cases import COACH
from design.reproduction.document import fragment
from design.reproduction.drawing import legend_below, panel, retitle, take_handles
from design.reproduction.section import Data, DataTable, Drawing, Section
from design.reproduction.settings import Settings
from design.reproduction.store import Piece


class Map(Section):
    """Linear and nonlinear critical speeds against the conicity, for the coach."""

    key = "map"
    title = "Beyond the paper: steeper cones"

    def __init__(self, settings: Settings) -> None:
        self._settings = settings

    def pieces(self) -> tuple[Piece, ...]:
        """Return the map."""
        return (pieces.chart(COACH, self._settings),)

    def text(self, data: Data) -> Markup:
        """Return the table of the map."""
        found = data[self.pieces()[0].name]
        rows = [
            (f"{value:.3f}", _speed(onset), rests_on, _speed(hopf), note)
            for value, onset, rests_on, hopf, note in _rows(found)
        ]
        paragraphs = [
            f"{COACH.title} over the conicity of its cones, tangent track: below the nonlinear "
            "critical speed it never hunts, between it and the Hopf point a large enough disturbance "
            "makes it hunt, above the Hopf point it must.",
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption="Speeds in m/s.",
            header=("conicity", "nonlinear critical speed", "resting on", "Hopf point", "remark"),
            rows=rows,
            words=0,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw the map."""
        found = data[self.pieces()[0].name]
        figure, ax = panel("", 4.2)
        found.plot(ax)
        retitle(ax, COACH.title)
        legend_below(figure, take_handles(ax))
        caption = f"{COACH.title}, tangent track: where it hunts, over the conicity."
        return (Drawing("map_conicity", figure, caption),)

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the map."""
        found = data[self.pieces()[0].name]
        header = ("conicity", "nonlinear_critical_m_per_s", "rests_on", "hopf_m_per_s", "remark")
        return (DataTable("map_conicity", header, _rows(found)),)


def _rows(found: HuntingMap) -> list[tuple[float, float, str, float, str]]:
    rests_on = ["" if onset is None else onset.rests_on for onset in found.onsets]
    columns = (found.value, found.onset_speed, rests_on, found.hopf_speed, found.notes)
    return list(zip(*columns, strict=True))


def _speed(value: float) -> str:
    return "none" if np.isnan(value) else f"{value:.2f}"
