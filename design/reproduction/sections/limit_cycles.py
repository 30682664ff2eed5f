"""Results beyond the paper: unstable limit cycles, folds, and the kind of each Hopf point."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from markupsafe import Markup

from design.cycles.cycle import CycleBranch
from design.cycles.cycle_plots import stability_runs
from design.reproduction import paper, pieces
from design.reproduction.cases import CASES, MODEL_TITLES, MODELS, Case
from design.reproduction.document import fragment
from design.reproduction.drawing import INK, legend_below, panel, retitle, take_handles
from design.reproduction.section import Data, DataTable, Drawing, Section
from design.reproduction.settings import Settings
from design.reproduction.store import Piece
from design.style import STABLE, UNSTABLE

_CURVES = (math.inf, paper.RADIUS)


class LimitCycles(Section):
    """Branches of limit cycles from the Hopf points."""

    key = "limit-cycles"
    title = "Beyond the paper: unstable limit cycles, folds and the kind of Hopf point"

    def __init__(self, settings: Settings) -> None:
        self._settings = settings

    def pieces(self) -> tuple[Piece, ...]:
        """Return the branches on tangent track and on the curve of Figs 6 to 9."""
        return tuple(
            pieces.branch(case, radius, self._settings) for radius in _CURVES for case in CASES
        )

    def _found(self, data: Data) -> list[tuple[Case, float, dict[str, Any]]]:
        """Return the branches that exist."""
        found = []
        for radius in _CURVES:
            for case in CASES:
                one = data[pieces.branch(case, radius, self._settings).name]
                if one is not None:
                    found.append((case, radius, one))
        return found

    def text(self, data: Data) -> Markup:
        """Return Hopf points and folds."""
        paragraphs = [
            "A simulation finds stable motions only. These branches are followed from the Hopf point "
            "by continuation, "
            "so they have the unstable limit cycles too (dashed). The amplitude of an unstable one "
            "is the disturbance "
            "that steady running survives. The lowest fold is the nonlinear critical speed: below it "
            "there is no "
            "hunting of this branch. Cases without a Hopf point below 200 m/s are left out.",
        ]
        return fragment(
            "table.html",
            paragraphs=paragraphs,
            caption="Linear and nonlinear critical speeds.",
            header=(
                "case",
                "track",
                "Hopf point",
                "kind",
                "frequency",
                "hunting persists from",
                "branch ends",
            ),
            rows=[_row(*each) for each in self._found(data)],
            words=2,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw amplitude and frequency of every branch."""
        return tuple(
            draw(case, radius, found["branch"])
            for place in _CURVES
            for kind in MODELS
            for draw in (_amplitude, _frequency)
            for case, radius, found in self._found(data)
            if radius == place and case.kind == kind
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return every limit cycle."""
        header = ("speed_m_per_s", "frequency_hz", "amplitude_y_w1_m", "largest_multiplier", "stable")
        tables = []
        for case, radius, found in self._found(data):
            rows = [
                (
                    c.speed,
                    c.frequency,
                    float(c.amplitudes[0]),
                    abs(c.multipliers[0]) if c.multipliers.size else math.nan,
                    c.stable,
                )
                for c in found["branch"].cycles
            ]
            tables.append(DataTable(f"limit_cycles_{_place(radius)}_{case.key}", header, rows))
        return tuple(tables)


def _place(radius: float) -> str:
    return "tangent" if math.isinf(radius) else f"{radius:g}m"


def _track(radius: float) -> str:
    return "tangent" if math.isinf(radius) else f"R = {radius:g} m"


def _row(case: Case, radius: float, found: dict[str, Any]) -> tuple[str, ...]:
    branch = found["branch"]
    onset = branch.onset
    return (
        case.title,
        _track(radius),
        f"{branch.hopf.speed:.3f} m/s",
        found["criticality"],
        f"{branch.hopf.frequency:.3f} Hz",
        "none" if onset is None else f"{onset.value:.3f} m/s ({onset.rests_on})",
        f"{branch.speed[-1]:.1f} m/s",
    )


def _group(what: str, case: Case, radius: float) -> str:
    return f"{what} of limit cycles, {_track(radius)}: {MODEL_TITLES[case.kind]}"


def _amplitude(case: Case, radius: float, branch: CycleBranch) -> Drawing:
    figure, ax = panel("", 4.2)
    branch.plot(ax=ax)
    retitle(ax, case.vehicle.name)
    legend_below(figure, take_handles(ax))
    caption = f"{case.title}, {_track(radius)}: amplitude of limit cycles."
    file = f"limit_cycles_{_place(radius)}_{case.key}"
    return Drawing(file, figure, caption, _group("Amplitude", case, radius))


def _frequency(case: Case, radius: float, branch: CycleBranch) -> Drawing:
    figure, ax = panel(case.vehicle.name, 4.2)
    for part, stable in stability_runs(branch.stable):
        color, line = (STABLE, "-") if stable else (UNSTABLE, "--")
        ax.plot(branch.speed[part], branch.frequency[part], line, color=color)
    printed = case.printed.frequency
    ax.axhline(printed, color=INK, ls=":", lw=1.2)
    if branch.stable.any():
        ax.plot([], [], color=STABLE, label="stable limit cycles")
    if not branch.stable.all():
        ax.plot([], [], "--", color=UNSTABLE, label="unstable limit cycles")
    ax.plot([], [], ":", color=INK, label=f"paper, Fig 13: {printed:g} Hz")
    ax.set_ylim(0.0, 1.2 * max(printed, float(np.max(branch.frequency))))
    ax.set_xlabel("speed (m/s)")
    ax.set_ylabel("frequency (Hz)")
    legend_below(figure, ax.get_legend_handles_labels()[0])
    caption = f"{case.title}, {_track(radius)}: frequency of limit cycles."
    file = f"limit_cycles_{_place(radius)}_{case.key}_frequency"
    return Drawing(file, figure, caption, _group("Frequency", case, radius))
