"""Write the leaderboard into README and docs/controllers.md, and its pictures.

The numbers are those of docs/leaderboard.json, which ``railenv evaluate --store docs/leaderboard.json``
computes (some minutes).
"""

import re
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

import agents
import railenv
from agents.leaderboard import markdown

DOCS = Path(__file__).resolve().parent
PAGES = (DOCS / "controllers.md", DOCS.parent / "README.md")
MARKS = re.compile(r"(<!-- leaderboard -->\n).*?(<!-- end of leaderboard -->)", re.DOTALL)


def written(page, table):
    """Return a page's text with the leaderboard in it."""
    return MARKS.sub(lambda m: f"{m[1]}{table}{m[2]}", page.read_text(encoding="utf-8"))


def table():
    """Return the leaderboard of the stored evaluations."""
    return markdown(agents.load_evaluations(DOCS / "leaderboard.json"))


def pictures(folder):
    """Draw the comparison and what it stands on."""
    from agents.plots import (
        plot_closed_loop_diagram,
        plot_comparison,
        plot_damping,
        plot_histories,
    )

    evaluations = agents.load_evaluations(DOCS / "leaderboard.json")
    coach = agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
    best = agents.shipped("output-feedback")
    some = {
        "passive": None,
        "yaw-rate": agents.shipped("yaw-rate"),
        "output-feedback": best,
        "lqr": agents.shipped("lqr"),
    }
    plots = {
        "leaderboard": plot_comparison(evaluations),
        "closed_loop_diagram": plot_closed_loop_diagram(best, coach, np.linspace(100.0, 280.0, 46)),
        "histories": plot_histories(some, coach, speed=130.0, duration=3.0),
        "growth": plot_damping(some, coach, np.linspace(20.0, 220.0, 81)),
    }
    for name, plot in plots.items():
        plot.figure.savefig(folder / f"{name}.png", bbox_inches="tight")


if __name__ == "__main__":
    mpl.use("Agg")
    for page in PAGES:
        page.write_text(written(page, table()), encoding="utf-8")
    if "--no-pictures" not in sys.argv:
        pictures(DOCS / "pictures")
