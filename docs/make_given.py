"""Write what each shipped controller was given into docs/problems.md: ``python docs/make_given.py``.

Everything is read from the controllers' own files.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from blocks import refilled, table

import agents
from agents.controllers.shipped import shipped_problems

PAGE = Path(__file__).resolve().parent / "problems.md"
OTHERS = ("asked", "rated")
HEADINGS = ["problem", "controller", "reads", "commands", "vehicles it was made for", "spent on it"]

_DRIVES = {"speed": "speed", "cant": "cant deficiency"}

About = Mapping[str, Any]


def rows() -> str:
    """Return the table of all shipped controllers."""
    found = []
    for problem in shipped_problems():
        for kind in agents.shipped_names(problem):
            if kind == "passive":
                continue
            law = agents.shipped(kind, problem)
            cells = [reads(law), str(len(law.commands)), vehicles(law), spent(law)]
            found.append([f"`{problem}`", f"`{kind}`", *cells])
    return table(HEADINGS, found, len(HEADINGS))


def reads(law: Any) -> str:
    """Say which sensors it has."""
    if law.observation == "state":
        return "every state, without error"
    kinds = [reading.name.split("_")[0] for reading in law.readings]
    told = [_counted(kinds.count(kind), kind) for kind in ("accelerometer", "gyro")]
    told += [name for kind, name in _DRIVES.items() if kind in kinds]
    return ", ".join(told)


def _counted(count: int, name: str) -> str:
    return name if count == 1 else f"{count} {name}s"


def vehicles(law: Any) -> str:
    """Say for which vehicles it was designed, tuned or trained."""
    about: About = law.about
    if isinstance(law, agents.AdaptiveLQG):
        return f"a bank for {len(law.vehicles)}"
    if "exercises" in about:
        return f"{about['exercises']['levels'] ** 2}"
    if "lessons" in about:
        small = about["lessons"]["small"]
        return f"{len({str(sorted(case[4].items())) for case in small})}"
    goal: About = about.get("goal", about)
    if "vehicles" in goal:
        return f"{len(goal['vehicles'])}"
    if "conicities" in goal:
        return f"{len(goal['conicities']) * len(goal['creep_factors'])}"
    return f"one, conicity {about['conicity']:g}" if "conicity" in about else "the nominal one"


def spent(law: Any) -> str:
    """Say what its design, tuning or training looked at."""
    about: About = law.about
    if "exercises" in about:
        steps = about["judged"][-1][1]
        told = ", and the bank below it" if isinstance(law, agents.AdaptivePolicy) else ""
        return (
            f"{about['evaluations']} gradients of all runs, {steps / 1e6:.1f} million environment "
            f"steps{told}"
        )
    if "lessons" in about:
        lessons = about["lessons"]
        episodes = about["generations"] * about["population"]
        episodes *= sum(len(lessons[kind]) for kind in ("small", "large", "rides"))
        return f"{episodes} episodes of {lessons['duration']:g} s, and the output feedback below it"
    if "evaluations" not in about:
        count = len(law.vehicles) if isinstance(law, agents.AdaptiveLQG) else 1
        return f"{count} design{'s' if count > 1 else ''}, not tuned"
    looked = "designs" if "tuning" in about else "gains, each with all vehicles"
    return f"{about['evaluations']} {looked}"


if __name__ == "__main__":
    page = refilled(PAGE.read_text(encoding="utf-8"), {"given": rows}, OTHERS)
    PAGE.write_text(page, encoding="utf-8")
