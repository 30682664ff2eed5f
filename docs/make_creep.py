"""Compute the numbers of docs/how-to/creep.md and draw its picture: ``python docs/make_creep.py``.

The text around the tables is edited in the page itself.
"""

from __future__ import annotations

import csv
import functools
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from blocks import refilled
from numpy.typing import NDArray

import railenv
from railenv.contact.creep_comparison import CreepComparison, Direction, compare_creep_laws
from railenv.contact.creep_laws import LAWS, creep_forces
from railenv.contact.fastsim import Bound, fastsim
from railenv.contact.patch import ContactPatch

PAGE = Path(__file__).resolve().parent / "how-to" / "creep.md"
PICTURE = PAGE.parent.parent / "pictures" / "creep-laws.png"
REFERENCE = PAGE.parent.parent.parent / "tests" / "data" / "contact"

COACH = railenv.HIGH_SPEED_COACH
WHEEL = ContactPatch.of_wheel(55.9e3, COACH.wheel_radius, 0.3, COACH.friction)
SPIN_CASE = ContactPatch(8e-3, 4e-3, 82e3, 0.3)
CURVES = ContactPatch(6.304e-3, 12.61e-3, 106.7e3, 0.33)

SPINS = (
    ("none", 0.0),
    ("tread, conicity 0.05", math.sin(math.atan(0.05)) / COACH.wheel_radius),
    ("worn tread, 13 degrees", 0.5),
    ("flange, 70 degrees", math.sin(math.radians(70.0)) / COACH.wheel_radius),
)
SHOWN = (0.0, 0.5, 2.0)


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table whose columns after the first are numbers."""
    lines = [headings, ["---", *["---:"] * (len(headings) - 1)], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def compared() -> CreepComparison:
    """Return the laws on the coach's wheel at the spins of the table."""
    return compare_creep_laws(WHEEL, [spin for _, spin in SPINS])


def deviations() -> str:
    """Largest differences of the laws from FASTSIM."""
    found = compared()
    columns: list[tuple[str, Direction]] = [("heuristic", "longitudinal"), ("heuristic", "lateral")]
    columns += [("polach", "longitudinal"), ("polach", "lateral")]
    rows = []
    for i, (where, spin) in enumerate(SPINS):
        at = found.spin[i]
        cells = [
            f"{found.deviation(law, direction, at):.1%}"
            for law in ("heuristic", "polach")
            for direction in ("longitudinal", "lateral")
        ]
        rows.append((f"{where}: {spin:.2f} 1/m", *cells))
    headings = ["spin", *(f"{'Polach' if law == 'polach' else law}, {d}" for law, d in columns)]
    return table(headings, rows)


def one_case() -> str:
    """Lateral force of the case with creepage and spin against each other, by all laws."""
    exact = _reference("fastsim_cases.csv")[0]["fy_over_mu_n"]
    names = {
        "kalker": "Kalker, linear",
        "heuristic": "heuristic",
        "polach": "Polach",
        "fastsim": "FASTSIM",
    }
    rows = [("CONTACT", f"{exact:.3f}", "")]
    for law in reversed(LAWS):
        force = float(creep_forces(law, 0.0, -6.25e-4, 0.625, SPIN_CASE).lateral) / SPIN_CASE.adhesion
        rows.append((names[law], f"{force:.3f}", f"{force / exact - 1.0:+z.0%}"))
    return table(("law", "F_y / μN", "from CONTACT"), rows)


def published() -> str:
    """FASTSIM of this package beside published values."""
    rows = []
    cases = {int(row["case"]): row["fy_over_mu_n"] for row in _reference("fastsim_cases.csv")}
    bounds: tuple[Bound, Bound] = ("parabolic", "elliptic")
    for cells, numbers in ((44, (2, 3)), (220, (5, 6))):
        for bound, number in zip(bounds, numbers, strict=True):
            found = fastsim(0.0, -6.25e-4, 0.625, SPIN_CASE, strips=cells, cells=cells, bound=bound)
            ours = float(found.lateral) / SPIN_CASE.adhesion
            what = f"with spin, {bound} bound, {cells} x {cells} cells"
            rows.append(
                (what, f"{cases[number]:.4f}", f"{ours:.4f}", f"{ours / cases[number] - 1.0:+z.1%}")
            )
    creepage, force = _curve(61, 90)
    ours = _pure(creepage, 44)
    worst = int(np.argmax(np.abs(ours / force - 1.0)))
    rows.append(
        (
            "curve without spin, 44 x 44 cells, worst of 30",
            f"{force[worst]:.4f}",
            f"{ours[worst]:.4f}",
            f"{ours[worst] / force[worst] - 1.0:+z.1%}",
        )
    )
    creepage, force = _curve(1, 30)
    ours = _pure(creepage, 400)
    worst = int(np.argmax(np.abs(ours - force)))
    rows.append(
        (
            "the same beside CONTACT, 400 x 400 cells",
            f"{force[worst]:.4f}",
            f"{ours[worst]:.4f}",
            f"{ours[worst] / force[worst] - 1.0:+z.1%}",
        )
    )
    return table(("F / μN", "published", "here", "difference"), rows)


@functools.cache
def _reference(name: str) -> list[dict[str, float]]:
    with (REFERENCE / name).open(newline="", encoding="utf-8") as stream:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(stream)]


def _curve(first: int, last: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rows = [r for r in _reference("creep_force_curves.csv") if first <= r["case"] <= last]
    return (
        np.array([r["longitudinal_creepage"] for r in rows]),
        np.array([r["fx_over_mu_n"] for r in rows]),
    )


def _pure(creepage: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
    found = fastsim(creepage, 0.0, 0.0, CURVES, strips=cells, cells=cells)
    return found.longitudinal / CURVES.adhesion


MADE = {"deviations": deviations, "one case": one_case, "published": published}


def page(text: str) -> str:
    """Return the page with its tables made anew."""
    return refilled(text, MADE)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    compare_creep_laws(WHEEL, SHOWN).plot().savefig(PICTURE, dpi=120)
    print(f"wrote {PAGE.name} and {PICTURE.name}")
