"""Critical speeds: the table, and the paper's Fig 5."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from matplotlib.lines import Line2D

from design.reproduction import paper, pieces
from design.reproduction.cases import CASES, MODEL_TITLES, MODELS, VEHICLE_COLORS, VEHICLES, ModelName
from design.reproduction.claims import cases_of
from design.reproduction.document import fragment
from design.reproduction.drawing import INK, legend_below, panel, retitle, take_handles
from design.reproduction.section import Data, DataTable, Drawing, Section
from design.reproduction.store import Piece
from design.stability.loss import CriticalSpeed
from design.stability.sweep_plots import loss_handles

TITLE = "Speed at which steady running ends, m/s"
HEADINGS = ("radius of curve", "tangent", *(f"{r:g} m" for r in pieces.LISTED_RADII))
CAPTION = (
    f"cant {paper.CANT} rad on curves; f: the equilibrium on the tread ends in a fold, "
    "w: it ends where a wheel lifts, otherwise by hunting"
)

_DEFICIENCY = 0.150 / 1.5  # rad: 150 mm over the base of 1.5 m, what real lines allow
_LOOKS: dict[str, dict[str, float]] = {
    "TABLE_1_PRINTED_LOADS": {"markersize": 9.0, "linewidth": 4.0, "zorder": 1.5}
}
_TOP: dict[ModelName, float] = {"bogie": 150.0, "dual_wheelset": 430.0}


class CriticalSpeeds(Section):
    """Critical speed against curve radius."""

    key = "critical-speeds"
    title = "Critical speed against curve radius (Fig 5)"

    def pieces(self) -> tuple[Piece, ...]:
        """Return the critical speeds of all cases."""
        return tuple(pieces.critical_speeds(case) for case in CASES)

    def rows(self, data: Data) -> list[list[str]]:
        """Return the table of critical speeds: a row for each model of each vehicle."""
        rows = []
        for case in CASES:
            found = data[pieces.critical_speeds(case).name]
            cells = [brief(found["tangent"]), *map(brief, found["listed"])]
            rows.append([case.title, *cells])
        return rows

    def text(self, data: Data) -> Markup:
        """Return the table."""
        paragraphs = [
            "The linear critical speed is the first speed at which steady running is lost. The "
            "equilibrium is "
            "followed from low speed, so the speed belongs to running on the tread. The paper's Fig "
            "5 is drawn from "
            f"{paper.RADII[0]:g} to {paper.RADII[1]:g} m.",
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption=f"{TITLE}; {CAPTION}.",
            header=HEADINGS,
            rows=self.rows(data),
            words=1,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw Fig 5 (a) and (b)."""
        return tuple(_figure(kind, data, part) for kind, part in zip(MODELS, "ab", strict=True))

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the table and the sweeps."""
        header = ("model", "vehicle", "radius_m", "critical_speed_m_per_s", "frequency_hz", "loss")
        rows = [
            (c.kind, c.vehicle.name, r.radius, r.speed, r.frequency, r.loss)
            for c in CASES
            for found in [data[pieces.critical_speeds(c).name]]
            for r in (found["tangent"], *found["listed"], *found["sweep"].results)
        ]
        return (DataTable("critical_speeds", header, rows),)


def brief(found: CriticalSpeed) -> str:
    """Return a critical speed in a few characters."""
    if found.speed is None:
        return f"> {found.speed_range[1]:g}" if found.loss == "none" else found.loss
    mark = {"fold": " f", "end": " w"}.get(found.loss, "")
    return f"{found.speed:.1f}{mark}"


def _figure(kind: ModelName, data: Data, part: str) -> Drawing:
    title = f"{MODEL_TITLES[kind]}, cant {paper.CANT} rad"
    figure, ax = panel(title, 4.4)
    losses = set()
    for case in cases_of(kind):
        sweep = data[pieces.critical_speeds(case).name]["sweep"]
        before = len(ax.lines)
        sweep.plot(ax, case.vehicle.name, VEHICLE_COLORS[case.vehicle.name])
        for line in ax.lines[before:]:  # two vehicles nearly coincide: one shows around the other
            line.set(**_LOOKS.get(case.vehicle.name, {}))
        losses |= {str(r.loss) for r in sweep.results}
    radii = np.geomspace(*paper.RADII, 60)
    gravity = VEHICLES[0].gravity
    deficient = np.sqrt(radii * gravity * (paper.CANT + _DEFICIENCY))
    (limit,) = ax.plot(radii, deficient, ":", color=INK, lw=1.2, label="cant deficiency 150 mm")
    printed = cases_of(kind)[0].printed
    ax.vlines(paper.RADIUS, printed.steady, printed.hunting, color=INK, lw=4.0)
    bracket = Line2D([], [], color=INK, lw=4.0, label="paper: steady to hunting")
    ax.set_ylim(0.0, _TOP[kind])
    retitle(ax, title)
    take_handles(ax)
    vehicles = [
        Line2D([], [], color=VEHICLE_COLORS[c.vehicle.name], label=c.vehicle.name)
        for c in cases_of(kind)
    ]
    legend_below(figure, [*vehicles, limit, bracket, *loss_handles(losses)])
    caption = (
        f"Fig 5 ({part}). Critical speed of the {MODEL_TITLES[kind]} against the radius of the curve."
    )
    return Drawing(f"fig05{part}_critical_speed_{kind}", figure, caption, "Fig 5")
