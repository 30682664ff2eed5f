"""Compute where motions are irregular, for docs/limit-cycles.md: ``python docs/make_irregular.py``.

Results are kept in docs/irregular.json, from which the table of the page is written; they and the
pictures are computed anew with ``--motions`` (half an hour); ``--missing`` computes only what the file
lacks, and the pictures.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from blocks import refilled

import design
import railenv
from design.irregular.motion import Motion, setting_of
from design.irregular.section_diagram import SectionPoint
from design.style import style
from railenv.models import Model

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "limit-cycles.md"
RESULTS = DOCS / "irregular.json"
PICTURES = DOCS / "pictures"

CANT = 0.0873  # rad, of the curves
AWAY = {"y_w1": 8e-3, "y_w2": 8e-3}  # m: starts hunting
TIME = {"settle": 60.0, "duration": 40.0}  # s, at each speed
EXPONENTS = 4
COACH = railenv.HIGH_SPEED_COACH
COOPERRIDER_FRICTION = 0.15  # Kaas-Petersen


@dataclass(frozen=True)
class Case:
    """A model on a curve (cant as above; none on tangent track), and the speeds (m/s) to look at.

    Hunting starts at ``begin``, and is carried down and up from there by ``step``. ``time_step`` (s)
    is that of the integration where the usual one is too long; exponents are means ``over`` some
    time (s).
    """

    name: str
    radius: float
    lowest: float
    begin: float
    highest: float
    step: float
    time_step: float | None = None
    over: float = 100.0

    @property
    def model(self) -> Model:
        """The model."""
        return MODELS[self.name]

    @property
    def cant(self) -> float:
        """Cant, rad."""
        return 0.0 if math.isinf(self.radius) else CANT

    @property
    def place(self) -> dict[str, float]:
        """Radius and cant, as the package takes them."""
        return {"radius": self.radius, "cant": self.cant}

    @property
    def key(self) -> str:
        """What the results are kept under."""
        return f"{self.name}, R = {self.radius:g} m"


MODELS: dict[str, Model] = {
    "`TABLE_1` dual wheelset": railenv.DualWheelset(railenv.TABLE_1),
    "`TABLE_1` bogie": railenv.Bogie(railenv.TABLE_1),
    "Cooperrider bogie": railenv.CooperriderBogie(),
    "`HIGH_SPEED_COACH` bogie": railenv.Bogie(COACH),
    "the same without wheelbase curving": railenv.Bogie(COACH.replace(wheelbase_curving=False)),
    "`HIGH_SPEED_COACH_HOLLOW` bogie": railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW),
    "`HIGH_SPEED_COACH_S1002` bogie": railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002),
    "`HIGH_SPEED_COACH`, whole": railenv.Coach(COACH),
}

CASES = (
    Case("`TABLE_1` dual wheelset", math.inf, 36.0, 40.0, 100.0, 4.0),
    Case("`TABLE_1` dual wheelset", 2500.0, 36.0, 40.0, 88.0, 4.0),
    Case("`TABLE_1` bogie", math.inf, 14.0, 20.0, 40.0, 2.0),
    Case("`TABLE_1` bogie", 2500.0, 12.0, 16.0, 60.0, 4.0),
    Case("Cooperrider bogie", math.inf, 82.0, 114.0, 160.0, 1.0, 1e-4),
    Case("`HIGH_SPEED_COACH` bogie", math.inf, 92.0, 110.0, 350.0, 6.0),
    Case("`HIGH_SPEED_COACH` bogie", 10000.0, 92.0, 112.0, 164.0, 2.0),
    Case("`HIGH_SPEED_COACH` bogie", 6250.0, 88.0, 105.0, 131.0, 1.0),
    Case("`HIGH_SPEED_COACH` bogie", 4000.0, 70.0, 86.0, 110.0, 2.0),
    Case("the same without wheelbase curving", 6250.0, 91.0, 105.0, 133.0, 1.0),
    Case("`HIGH_SPEED_COACH_HOLLOW` bogie", math.inf, 92.0, 110.0, 350.0, 6.0),
    Case("`HIGH_SPEED_COACH_HOLLOW` bogie", 6250.0, 94.0, 112.0, 150.0, 2.0),
    Case("`HIGH_SPEED_COACH_S1002` bogie", math.inf, 85.0, 100.0, 136.0, 3.0),
    Case("`HIGH_SPEED_COACH_S1002` bogie", 6250.0, 90.0, 110.0, 146.0, 4.0),
    Case("`HIGH_SPEED_COACH`, whole", math.inf, 70.0, 90.0, 200.0, 10.0, over=60.0),
    Case("`HIGH_SPEED_COACH`, whole", 10000.0, 78.0, 90.0, 158.0, 4.0, over=60.0),
    Case("`HIGH_SPEED_COACH`, whole", 6250.0, 74.0, 90.0, 126.0, 2.0, over=60.0),
    Case("`HIGH_SPEED_COACH`, whole", 4000.0, 67.0, 75.0, 97.0, 2.0, over=240.0),
)


def motions(case: Case) -> list[dict[str, Any]]:
    """Return what motion a case comes to at every speed, and what its wheels do there.

    Exponents are computed only where a section does not tell, as they take ten times as long.
    """
    place = case.place
    start = design.poincare_section(
        case.model, speed=case.begin, perturbation=AWAY, settle=60.0, duration=10.0, **place
    )
    middle = float(start.highest[0] + start.lowest[0]) / 2.0
    points: list[SectionPoint] = []
    for sweep, speeds in (
        ("down", np.arange(case.begin - case.step, case.lowest - 1e-9, -case.step)[::-1]),
        ("up", np.arange(case.begin, case.highest + 1e-9, case.step)),
    ):
        found = design.section_diagram(
            case.model,
            speeds,
            sweeps=(sweep,),  # type: ignore[arg-type]
            initial_state=start.end,
            at=round(middle, 4),
            step=case.time_step,
            **TIME,
            **place,
        )
        points += found.of(sweep)  # type: ignore[arg-type]
    return [_point(case, point) for point in points]


def _point(case: Case, point: SectionPoint) -> dict[str, Any]:
    """Return one motion as numbers: its kind, its exponents where these tell it, and its wheels."""
    section = point.section
    low, high = float(section.lowest[0]), float(section.highest[0])
    told: dict[str, Any] = {"speed": point.value, "kind": section.kind, "lowest": low, "highest": high}
    if section.moves and (len(section) < 10 or section.period is None or section.period > 8):
        exponents = _exponents(case, point.value, section.end)
        told["kind"] = exponents.kind
        if exponents.kind == "periodic":
            told["kind"] = _counted(section)
        told["exponents"] = exponents.exponents.tolist()
        told["bound"] = exponents.bound.tolist()
        told["own"] = exponents.own_error
    elif section.moves:
        told["kind"] = _counted(section)
    return told | _wheels(case, point)


def _counted(section: design.PoincareSection) -> str:
    """Return after which points a periodic motion is back though corners blur its section."""
    if len(section) < 10:
        return "period 1"  # it stays on one flange and does not pass the section
    misses = [section.miss(k) for k in range(1, min(9, len(section) // 2))]
    best = next((k for k, miss in enumerate(misses) if miss <= _SAME), int(np.argmin(misses)))
    return f"period {best + 1}" if misses[best] <= _BLUR else "periodic"


_SAME, _BLUR = 0.005, 0.02  # of the swing: a motion that is back as far as corners let it; at most


def _exponents(case: Case, speed: float, start: Any) -> design.LyapunovExponents:
    return design.lyapunov_exponents(
        case.model,
        speed=speed,
        count=EXPONENTS,
        duration=case.over,
        settle=10.0,
        initial_state=start,
        step=case.time_step,
        **case.place,
    )


def _wheels(case: Case, point: SectionPoint) -> dict[str, float | None]:
    """Return the smallest wheel load (N), the largest Y/Q and share of the limit of guiding forces.

    The Cooperrider bogie has no wheel loads but the adhesion limit that one makes: its Y/Q is the force
    of the flange spring of the leading wheelset over that load, as far as it is known.
    """
    model = case.model
    if isinstance(model, railenv.CooperriderBogie):
        section, p = point.section, model.parameters
        beyond = max(section.highest[0], -section.lowest[0]) - p["flange_clearance"]
        load = p["adhesion_force"] / COOPERRIDER_FRICTION
        return {
            "load": None,
            "ratio": float(p["flange_stiffness"] * max(beyond, 0.0) / load),
            "shift": None,
        }
    assert isinstance(model, railenv.Assembled)
    curvature = 0.0 if math.isinf(case.radius) else 1.0 / case.radius
    motion = Motion(
        setting_of(model, point.value, case.radius, case.cant, None), point.section.end, None
    )
    states = motion.record(
        400, 2.5e-3 / math.ceil(2.5e-3 / motion.step), math.ceil(2.5e-3 / motion.step)
    )
    loads = [
        wheel.normal.magnitude
        for x in states
        for pair in model.wheels(x, speed=point.value, curvature=curvature, cant=case.cant)
        for wheel in pair
    ]
    run = railenv.simulate(
        model,
        speed=point.value,
        duration=max(6.0, 120.0 / point.value),
        initial_state=point.section.end,
        output_step=2e-3,
        **case.place,
    )
    found = railenv.assess(model, run)
    shares = {
        name: max(q.value / q.limit for q in found.quantities if q.name == name and q.limit)
        for name in ("Y/Q", "sum of guiding forces")
    }
    return {
        "load": float(min(loads)),
        "ratio": 0.8 * shares["Y/Q"],
        "shift": shares["sum of guiding forces"],
    }


# -------------------------------------------------------------------------------- the table

HEAD = (
    "vehicle, curve",
    "speeds (m/s)",
    "one oscillation a period",
    "several",
    "two frequencies",
    "chaos",
    "at rest",
    "not decided",
    "beyond a limit from",
)
_LOST, _RATIO = 1.0, 0.8  # N of load that is left, and Y/Q
_COMING_TO_REST = 1e-5  # m: peak to peak of what is left of a motion that decays slowly


def table() -> str:
    """Return the table of what motions there are, from the results that are kept."""
    kept = json.loads(RESULTS.read_text(encoding="utf-8"))
    rows = [_row(case, kept[case.key]) for case in CASES]
    lines = [HEAD, ["---"] * len(HEAD), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _row(case: Case, points: list[dict[str, Any]]) -> list[str]:
    curve = "tangent" if math.isinf(case.radius) else f"{case.radius:g} m"
    looked = f"{points[0]['speed']:g} to {points[-1]['speed']:g}"
    columns = [_ranges(points, column) for column in range(6)]
    return [f"{case.name}, {curve}", looked, *columns, _limit(points)]


def _ranges(points: Sequence[dict[str, Any]], column: int) -> str:
    """Return the speeds at which the motion belongs to a column, as ranges."""
    found = []
    for inside, group in groupby(points, key=lambda p: _column(p) == column):
        speeds = [p["speed"] for p in group]
        if inside:
            many = speeds[0] != speeds[-1]
            found.append(f"{speeds[0]:g} to {speeds[-1]:g}" if many else f"{speeds[0]:g}")
    return ", ".join(found)


def _column(point: dict[str, Any]) -> int:
    """Return the column of the table that a motion belongs to."""
    kind = point["kind"]
    if kind in ("at rest", "equilibrium") or point["highest"] - point["lowest"] < _COMING_TO_REST:
        return 4
    if kind.startswith("period "):
        return 0 if kind == "period 1" else 1
    return {"periodic": 1, "torus": 2, "chaotic": 3}.get(kind, 5)


def _limit(points: Sequence[dict[str, Any]]) -> str:
    """Return the speed at which a wheel first lifts, or Y/Q or the guiding forces pass their limit."""
    if all(p["ratio"] is None for p in points):
        return "has no wheel loads"
    told = []
    for name, beyond in (
        ("Y/Q", lambda p: p["ratio"] is not None and p["ratio"] > _RATIO),
        ("guiding forces", lambda p: p["shift"] is not None and p["shift"] > 1.0),
        ("a wheel lifts", lambda p: p["load"] is not None and p["load"] < _LOST),
    ):
        speeds = [p["speed"] for p in points if beyond(p)]
        if speeds:
            told.append(f"{min(speeds):g} ({name})")
    return ", ".join(told) or "none"


def page(text: str) -> str:
    """Return the page with its table made anew."""
    return refilled(
        text, {"irregular": table}, others=("heights", "vehicles", "curves", "special points of curves")
    )


# ----------------------------------------------------------------------------- the pictures

CASCADE = Case("`HIGH_SPEED_COACH` bogie", 6250.0, 112.0, 105.0, 130.6, 0.25)
CHAOS, TORUS = 122.0, 83.0  # m/s
SECTION = 4e-3  # m: where y_w1 passes


def cascade() -> None:
    """Draw the bifurcation diagram of the coach's bogie on a curve, with its largest exponent."""
    start = design.poincare_section(
        CASCADE.model, speed=CASCADE.begin, perturbation=AWAY, duration=1.0, **CASCADE.place
    )
    found = design.section_diagram(
        CASCADE.model,
        np.arange(CASCADE.lowest, CASCADE.highest, CASCADE.step),
        sweeps=("up",),
        initial_state=start.end,
        settle=60.0,
        duration=80.0,
        exponents=2,
        exponents_over=40.0,
        progress=True,
        **CASCADE.place,
    )
    figure = found.plot().figure
    figure.savefig(PICTURES / "irregular-cascade.png", dpi=110)


def sections() -> None:
    """Draw the return map of the bogie's chaos and the section of the whole coach's torus."""
    with style():
        figure, axes = plt.subplots(1, 2, figsize=(9.6, 4.4))
    bogie = design.poincare_section(
        CASCADE.model, speed=CHAOS, perturbation=AWAY, duration=900.0, **CASCADE.place
    )
    bogie.plot_return_map(ax=axes[0])
    axes[0].set_title(f"coach's bogie, R = {CASCADE.radius:g} m, {CHAOS:g} m/s: chaos", loc="left")
    coach = design.poincare_section(
        MODELS["`HIGH_SPEED_COACH`, whole"],
        speed=TORUS,
        radius=4000.0,
        cant=CANT,
        perturbation=AWAY,
        at=SECTION,
        settle=120.0,
        duration=400.0,
    )
    coach.plot(("psi_w1", "y_w3"), ax=axes[1])
    axes[1].set_title(f"whole coach, R = 4000 m, {TORUS:g} m/s: two frequencies", loc="left")
    figure.savefig(PICTURES / "irregular-sections.png", dpi=110)


def main() -> None:
    """Compute what is asked for and write the page."""
    asked = sys.argv[1:]
    if "--motions" in asked or "--missing" in asked:
        kept = json.loads(RESULTS.read_text(encoding="utf-8")) if "--missing" in asked else {}
        for case in CASES:
            if case.key in kept:
                continue
            kept[case.key] = motions(case)
            print(case.key, flush=True)
            RESULTS.write_text(json.dumps(kept) + "\n", encoding="utf-8")
        cascade()
        sections()
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
