"""Power spectra: the paper's Figs 12 and 13."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from design.reproduction import paper, pieces
from design.reproduction.cases import CASES, MODEL_COLORS, MODEL_TITLES, VEHICLES, Case
from design.reproduction.document import fragment
from design.reproduction.drawing import legend_below, panel, retitle, take_handles
from design.reproduction.section import Data, DataTable, Drawing, Section, significant
from design.reproduction.store import Piece
from design.style import NEUTRAL
from railenv.vehicles import Vehicle

_HIGHEST = 8.0  # Hz
_DECADES = 8.0
_STILL = 1e-6  # m


class Spectra(Section):
    """Main frequencies below and above the critical speed."""

    key = "spectra"
    title = "Power spectra (Figs 12 and 13)"

    def pieces(self) -> tuple[Piece, ...]:
        """Return the motions whose spectra are shown."""
        return tuple(
            piece
            for case in CASES
            for piece in (
                pieces.motion_below(case),
                pieces.motion_above(case),
                pieces.motion(case, case.printed.hunting),
            )
        )

    def text(self, data: Data) -> Markup:
        """Return the main frequencies."""
        rows = [row for case in CASES for row in _rows(case, data)]
        paragraphs = [
            f"Lateral displacement of the leading wheelset, R = {paper.RADIUS:g} m. The paper does "
            "not give the speeds of "
            f"these figures. Fig 12 is taken {1.0 - pieces.BELOW:.0%} below our own linear critical "
            "speed, over the "
            f"first {pieces.BELOW_RUN:g} m from zero initial conditions; Fig 13 "
            f"{pieces.ABOVE - 1.0:.0%} above it, over the last "
            f"{pieces.WINDOW:g} s of a run of {pieces.ABOVE_RUN:g} m. The table also has the speeds "
            "at which the paper shows hunting.",
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption="Main frequencies and root mean squares.",
            header=("case", "where", "speed", "main frequency", "rms", "paper"),
            rows=rows,
            words=2,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw the spectra of both models for every vehicle."""
        return tuple(
            drawing
            for figure, piece, group in (
                ("Fig 12", pieces.motion_below, "Fig 12: below the critical speed"),
                ("Fig 13", pieces.motion_above, "Fig 13: above the critical speed"),
            )
            for vehicle in VEHICLES
            for drawing in _panel(figure, piece, group, vehicle, data)
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the densities."""
        tables = []
        for case in CASES:
            for piece in self.pieces():
                found = data[piece.name]
                if found is None or not piece.name.startswith("motion-") or case.key not in piece.name:
                    continue
                s = found["spectrum"]
                rows = [
                    (significant(float(f)), significant(float(d)))
                    for f, d in zip(s.frequency, s.density, strict=True)
                    if f < 20.0
                ]
                name = f"spectrum_{piece.name.removeprefix('motion-')}"
                tables.append(DataTable(name, ("frequency_hz", "density_m2_per_hz"), rows))
        return tuple({t.name: t for t in tables}.values())


def _rows(case: Case, data: Data) -> list[tuple[str, ...]]:
    printed = case.printed
    shown = (
        ("below (Fig 12)", pieces.motion_below(case), f"{printed.frequency_below:g} Hz"),
        ("above (Fig 13)", pieces.motion_above(case), f"{printed.frequency:g} Hz"),
        (printed.hunting_figure, pieces.motion(case, printed.hunting), f"{printed.frequency:g} Hz"),
    )
    return [(case.title, where, *_cells(data[piece.name]), text) for where, piece, text in shown]


def _cells(found: dict[str, Any] | None) -> tuple[str, str, str]:
    if found is None:
        return "no critical speed", "", ""
    speed = f"{found['speed']:.2f} m/s"
    if found["amplitude"] < _STILL:
        return speed, "at rest", ""
    s = found["spectrum"]
    return speed, f"{s.main_frequency:.3f} Hz", f"{1e3 * s.rms:.2f} mm"


def _panel(figure: str, piece: Any, group: str, vehicle: Vehicle, data: Data) -> list[Drawing]:
    drawn, ax = panel(vehicle.name, 4.1)
    peaks = []
    for case in CASES:
        found = data[piece(case).name] if case.vehicle is vehicle else None
        if found is None:
            continue
        s = found["spectrum"]
        label = f"{MODEL_TITLES[case.kind]}, {found['speed']:.1f} m/s"
        s.plot(ax, label, MODEL_COLORS[case.kind])
        peaks.append(1e6 * float(s.density.max()))
    if not peaks:
        return []
    for printed, kind in ((paper.BOGIE, "bogie"), (paper.DUAL_WHEELSET, "dual_wheelset")):
        value = printed.frequency_below if figure == "Fig 12" else printed.frequency
        ax.axvline(value, color=MODEL_COLORS[kind], lw=1.0, ls=":")
    ax.plot([], [], ":", color=NEUTRAL, label="the paper's main frequencies")
    ax.set_xlim(0.0, _HIGHEST)
    ax.set_ylim(max(peaks) * 10.0**-_DECADES, 5.0 * max(peaks))
    retitle(ax, vehicle.name)
    ax.set_ylabel("power spectral density of y_w1 (mm²/Hz)")
    legend_below(drawn, take_handles(ax))
    caption = (
        f"{figure}. {vehicle.name}: power spectral density of the leading wheelset's displacement."
    )
    return [Drawing(f"{figure.lower().replace(' ', '')}_{vehicle.name}", drawn, caption, group)]
