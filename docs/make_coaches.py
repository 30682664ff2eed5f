"""Compute what the body costs for docs/limit-cycles.md: ``python docs/make_coaches.py``.

Linear critical speeds are computed anew; those of limit cycles are kept in docs/coaches.json, and are
computed anew with ``--branches`` (some minutes). The text around the tables is edited in the page.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import make_curves
from blocks import refilled

import design
import railenv
from design.stability.critical_speed import CriticalSpeed
from railenv.contact.pair import ProfilePair

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "limit-cycles.md"
BRANCHES = DOCS / "coaches.json"

COACH = railenv.HIGH_SPEED_COACH
WITHOUT_YAW_DAMPERS: dict[str, Any] = dict.fromkeys(
    f"secondary_yaw_damper_{part}" for part in ("force", "stiffness", "arm", "height")
)
HEIGHTS: dict[str, dict[str, float]] = {
    "as shipped": {},
    "springs above the frame's centre": {"secondary_height": 0.58, "body_height": 1.39},
    "common": {"frame_height": 0.05, "secondary_height": 0.47, "body_height": 1.08},
    "all at the axles": dict.fromkeys(
        ("frame_height", "secondary_height", "body_height", "lateral_stop_height"), 0.0
    ),
}
"""Heights (m above the axles) of frame, secondary springs and body, by what to call them."""

CONICITIES = (0.05, 0.02)
HIGHEST = 300.0  # m/s
LOWEST = 40.0  # m/s, of branches of limit cycles


def vehicles() -> dict[str, railenv.Vehicle]:
    """Return the vehicles of the second table, by what to call them."""
    manchester, train = railenv.MANCHESTER_1, railenv.CRH380A
    bare = train.replace(**WITHOUT_YAW_DAMPERS)
    return {
        "`HIGH_SPEED_COACH`": COACH,
        "`HIGH_SPEED_COACH`, conicity 0.02": COACH.replace(conicity=0.02),
        "`HIGH_SPEED_COACH_HOLLOW`": railenv.HIGH_SPEED_COACH_HOLLOW,
        "`MANCHESTER_1`": manchester,
        "`MANCHESTER_1`, worn": run_in(manchester, 0.5e-3),
        "`CRH380A`": train,
        "`CRH380A`, worn": run_in(train, 1e-3),
        "`CRH380A` without yaw dampers": bare,
        "`CRH380A` without yaw dampers, worn": run_in(bare, 1e-3),
    }


def run_in(vehicle: railenv.Vehicle, depth: float) -> railenv.Vehicle:
    """Return a vehicle whose wheels have lost some depth (m) of their treads."""
    pair = vehicle.contact
    assert isinstance(pair, ProfilePair)
    return vehicle.replace(contact=railenv.worn(pair, depth=depth, spread=3e-3))


def heights() -> str:
    """Return the table over the heights of the bodies."""
    head = ["conicity", "heights", "frame, springs, body (m)", "bogie alone", "whole vehicle", "mode"]
    rows = [
        [f"{conicity:g}", name, _heights_of(vehicle), *speeds(vehicle)]
        for conicity in CONICITIES
        for name, changes in HEIGHTS.items()
        for vehicle in [COACH.replace(conicity=conicity, **changes)]
    ]
    return table(head, rows)


def _heights_of(vehicle: railenv.Vehicle) -> str:
    springs = vehicle.secondary_height
    levels = (vehicle.frame_height, vehicle.frame_height if springs is None else springs)
    return ", ".join(f"{height:g}" for height in (*levels, vehicle.body_height))


def compared() -> str:
    """Return the table of the vehicles."""
    kept = json.loads(BRANCHES.read_text(encoding="utf-8"))
    head = ["vehicle", "conicity at 3 mm", "bogie alone", "whole vehicle", "mode"]
    head += ["nonlinear, bogie", "nonlinear, whole vehicle"]
    rows = []
    for name, vehicle in vehicles().items():
        law = vehicle.contact
        conicity = law.equivalent_conicity(3e-3) if isinstance(law, ProfilePair) else vehicle.conicity
        assert conicity is not None
        folds = [_speed(value) for value in kept.get(name, (None, None))]
        rows.append([name, f"{conicity:.2f}", *speeds(vehicle), *folds])
    return table(head, rows)


def speeds(vehicle: railenv.Vehicle) -> list[str]:
    """Return critical speeds of the bogie alone and of the whole vehicle, and the latter's mode."""
    alone, whole = (critical(kind(vehicle)) for kind in (railenv.Bogie, railenv.Coach))
    return [_told(alone), _told(whole), mode(whole)]


def critical(model: railenv.Bogie | railenv.Coach) -> CriticalSpeed:
    """Return the critical speed on tangent track."""
    return design.critical_speed(model, speed_range=(5.0, HIGHEST))


def mode(found: CriticalSpeed) -> str:
    """Return the name of the mode that is lost, with the body's share of its energy."""
    if found.mode_shape is None:
        return ""
    return f"{found.mode_shape.name}; body {found.mode_shape.participation.roles['body']:.0%}"


def _told(found: CriticalSpeed) -> str:
    if found.speed is None or found.frequency is None:
        return f"> {HIGHEST:g} m/s"
    return f"{found.speed:.1f} m/s, {found.frequency:.2f} Hz"


def _speed(value: float | None) -> str:
    return "" if value is None else f"{value:.1f} m/s"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def branches() -> dict[str, list[float]]:
    """Compute the nonlinear critical speeds of those vehicles that hunt, bogie and whole vehicle."""
    found: dict[str, list[float]] = {}
    for name, vehicle in vehicles().items():
        if "worn" in name or name == "`CRH380A`":
            continue
        found[name] = [nonlinear(kind(vehicle)) for kind in (railenv.Bogie, railenv.Coach)]
        print(name, found[name], flush=True)
    return found


def nonlinear(model: railenv.Bogie | railenv.Coach) -> float:
    """Return the lowest speed at which the branch of limit cycles has a motion.

    Where it leaves the Hopf point towards higher speeds and stays there, that is the linear one.
    """
    speed = critical(model).speed
    assert speed is not None
    top = 5.0 * math.ceil(speed * 1.03 / 5.0)
    branch = design.cycle_branch(model, parameter_range=(LOWEST, top))
    assert branch.nonlinear_critical_speed is not None
    return branch.nonlinear_critical_speed


MAKERS: dict[str, Callable[[], str]] = {
    "heights": heights,
    "vehicles": compared,
    **make_curves.MAKERS,  # of the same page
}


def page(text: str) -> str:
    """Return the page with its tables made anew."""
    return refilled(text, MAKERS, others=("irregular",))


if __name__ == "__main__":
    if "--branches" in sys.argv:
        BRANCHES.write_text(json.dumps(branches(), indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PAGE}")
