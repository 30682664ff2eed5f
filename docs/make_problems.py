"""Write the tables and pictures of docs/problems.md: ``python docs/make_problems.py``.

They are made from docs/problems.json, which ``python -m benchmarks.problems.run`` measures, and from
the problems themselves. The text around them is edited in the page.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
from blocks import refilled, table

from agents.problems import PROBLEMS, Rating
from agents.problems.rating_plots import plot_ratings
from agents.problems.table import COLUMNS, row

DOCS = Path(__file__).resolve().parent
PASSIVE = ("no yaw damper", "best passive damper")
PAGE, DATA, PICTURES = DOCS / "problems.md", DOCS / "problems.json", DOCS / "pictures"


def asked() -> str:
    """Return the table of the problems."""
    rows = []
    for one in PROBLEMS:
        ranges = (f"{name.replace('_', ' ')} {a:g} to {b:g}" for name, (a, b) in one.ranges.items())
        commands, sensed = one.model().command_names, one.sensed
        told = [", ".join(f"`{name}`" for name in names) for names in (commands, sensed)]
        rows.append([f"`{one.name}`", one.asks, *told, ", ".join(ranges), str(one.damper)])
    head = ["problem", "what is asked", "commands", "sensors on", "varies", "best passive damper"]
    return table(head, rows, len(head))


def rated(data: dict[str, Any]) -> str:
    """Return a section for each problem that has been rated: a table of all ratings, and a picture."""
    parts = []
    for one in PROBLEMS:
        if one.name not in data:
            continue
        ratings = ratings_of(data, one.name)
        columns = zip(COLUMNS[1:], *(row(rating)[1:] for rating in ratings), strict=True)
        rows = [[heading, *cells] for heading, *cells in columns]
        head = ["", *(rating.controller for rating in ratings)]
        lines = [f"### {one.name}", "", one.asks, "", table(head, rows), ""]
        lines += [f"![Robust critical speeds in {one.name}](pictures/problem-{one.name}.png)", ""]
        lines += [*_compared(ratings), ""]
        lines += [*_held(data[one.name]["recoverable"]), ""]
        parts.append("\n".join(lines).rstrip())
    return "\n\n".join(parts)


def _compared(ratings: list[Rating]) -> list[str]:
    """Return in words how the most robust controller that reads sensors compares with the damper."""
    damped = next(rating for rating in ratings if rating.controller == PASSIVE[1])
    others = [r for r in ratings if r.controller not in PASSIVE and r.observation == "sensors"]
    if not others or damped.robust is None:
        return []
    best = max(others, key=lambda rating: rating.robust or 0.0)
    runs = zip(best.ride, damped.ride, strict=True)
    calmer = sum(own.wz <= passive.wz for own, passive in runs)
    robust = best.robust or 0.0
    times = f"{robust / damped.robust:.2f} times the best passive damper"
    reached = f"reaches {robust:.1f} m/s, {times}"
    if robust >= best.highest_speed:
        reached = f"is stable up to the highest speed tried, {robust:.0f} m/s, {times}"
    return [
        f"The most robust controller from sensors, `{best.controller}`, {reached}. Its ride index is "
        f"at most that damper's in {calmer} of {len(best.ride)} runs on the irregular line."
    ]


def _held(modes: list[dict[str, Any]]) -> list[str]:
    """Return in words what the actuators can bring back beyond the best passive damper."""
    if not modes:
        return []
    told = "; ".join(
        f"{mode['frequency']:.1f} Hz, growing at {mode['growth']:.2f} 1/s: "
        f"{1e3 * mode['amplitude']:.2g} mm"
        for mode in modes
    )
    return [
        f"On the most worn wheels at {modes[0]['speed']:.0f} m/s, 1.25 times what the best passive "
        "damper reaches, the actuators can at most bring back (lateral amplitude of a wheelset): "
        f"{told}."
    ]


def ratings_of(data: dict[str, Any], name: str) -> list[Rating]:
    """Return the ratings of a problem, as they were made."""
    return [Rating.from_summary(summary) for summary in data[name]["ratings"].values()]


def draw(data: dict[str, Any]) -> None:
    """Draw a picture for each problem."""
    mpl.use("Agg")
    for name in data:
        drawn = plot_ratings(ratings_of(data, name))
        drawn.figure.savefig(PICTURES / f"problem-{name}.png", dpi=110)


if __name__ == "__main__":
    found = json.loads(DATA.read_text(encoding="utf-8"))
    makers = {"asked": asked, "rated": lambda: rated(found)}
    PAGE.write_text(refilled(PAGE.read_text(encoding="utf-8"), makers, ("given",)), encoding="utf-8")
    draw(found)
    print(f"wrote {PAGE} and pictures")
