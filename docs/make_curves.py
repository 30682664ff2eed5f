"""Compute the curves of docs/limit-cycles.md and draw them: ``python docs/make_curves.py``.

Numbers are kept in docs/curves.json; ``make_coaches.py`` puts them into the page, with its own.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

import design
import railenv
from design import BifurcationCurve, CurveSpecialPoint
from design.style import style

DOCS = Path(__file__).resolve().parent
KEPT = DOCS / "curves.json"
PICTURE = DOCS / "pictures" / "curves-coach.png"

COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)
PLANE = {"conicity": (0.02, 0.45), "speed": (50.0, 150.0)}
CONICITIES = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)


def curves() -> dict[str, BifurcationCurve]:
    """Follow the Hopf points, the folds of the branch as shipped, and those from the Bautin point."""
    hopf = design.critical_speed(COACH)
    points = design.bifurcation_curve(COACH, hopf, PLANE)
    bautin = _bautin(points)
    branch = design.cycle_branch(COACH, start=hopf)
    return {
        "Hopf": points,
        "flange": design.bifurcation_curve(COACH, branch.folds[0], PLANE),
        "small": design.bifurcation_curve(COACH, bautin, PLANE, kind="fold of cycles"),
    }


def _bautin(points: BifurcationCurve) -> CurveSpecialPoint:
    (found,) = (s for s in points.special if s.kind == "Bautin")
    return found


def numbers(found: dict[str, BifurcationCurve]) -> dict[str, Any]:
    """Return what the tables tell, ready for JSON."""
    hopf = found["Hopf"]
    gentle = _bautin(hopf).values[0]
    rows = []
    for value in CONICITIES:
        cells: list[float | str | None] = [value, *hopf.at("conicity", value)]
        cells.append("gently" if value > gentle else "jumps")
        for name in ("small", "flange"):
            passages = found[name].at("conicity", value)
            cells.append(passages[0] if passages else None)
        rows.append(cells)
    special = [
        [found[name].kind, s.kind, *s.values, s.point.frequency]
        for name in found
        for s in found[name].special
    ]
    return {"speeds": rows, "special": special}


def draw(found: dict[str, BifurcationCurve]) -> None:
    """Draw all curves in one picture."""
    with style():
        _, ax = plt.subplots(figsize=(6.8, 4.6))
        for curve in found.values():
            curve.plot(ax=ax)
        ax.set_title("HIGH_SPEED_COACH bogie on tangent track")
        ax.figure.savefig(PICTURE)


def speeds(found: dict[str, Any]) -> str:
    """Return the table of speeds over conicity."""

    def cell(value: float | str | None) -> str:
        if value is None:
            return ""
        return value if isinstance(value, str) else f"{value:.2f}"

    rows = [[f"{row[0]:g}", *map(cell, row[1:])] for row in found["speeds"]]
    headings = ("conicity", "Hopf point", "leaves", "fold of small motions", "fold with flange contact")
    return table(headings, rows)


def special(found: dict[str, Any]) -> str:
    """Return the table of special points."""
    rows: list[Sequence[str]] = [
        (curve, kind, f"{x:.4f}", f"{y:.2f} m/s", f"{f:.3f} Hz")
        for curve, kind, x, y, f in found["special"]
    ]
    return table(("curve", "special point", "conicity", "speed", "frequency"), rows)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def kept() -> dict[str, Any]:
    """Return the numbers of the tables."""
    found: dict[str, Any] = json.loads(KEPT.read_text(encoding="utf-8"))
    return found


MAKERS: dict[str, Callable[[], str]] = {
    "curves": lambda: speeds(kept()),
    "special points of curves": lambda: special(kept()),
}


if __name__ == "__main__":
    followed = curves()
    draw(followed)
    KEPT.write_text(json.dumps(numbers(followed), indent=1) + "\n", encoding="utf-8")
    print(f"wrote {KEPT} and {PICTURE}")
