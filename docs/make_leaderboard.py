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
from agents.evaluation.leaderboard import markdown, ordered

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
    from agents.evaluation.diagram import closed_loop_diagram
    from agents.evaluation.evaluation_plots import plot_comparison
    from agents.evaluation.growth import linear_growth_rates
    from agents.evaluation.growth_plots import plot_growth
    from agents.evaluation.rollout_plots import plot_histories

    evaluations = ordered(agents.load_evaluations(DOCS / "leaderboard.json"))
    coach = agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))
    best = agents.shipped("output-feedback")
    some = {
        "passive": None,
        "yaw-rate": agents.shipped("yaw-rate"),
        "output-feedback": best,
        "lqr": agents.shipped("lqr"),
    }
    diagram = closed_loop_diagram(best, coach, np.linspace(100.0, 280.0, 46), name="output-feedback")
    speeds = np.linspace(20.0, 220.0, 81)
    rates = {name: linear_growth_rates(coach, each, speeds) for name, each in some.items()}
    plots = {
        "leaderboard": plot_comparison(evaluations),
        "closed_loop_diagram": diagram.plot(),
        "histories": plot_histories(some, coach, speed=130.0, duration=3.0),
        "growth": plot_growth(rates, speeds),
    }
    for name, plot in plots.items():
        plot.figure.savefig(folder / f"{name}.png", bbox_inches="tight")


if __name__ == "__main__":
    mpl.use("Agg")
    for page in PAGES:
        page.write_text(written(page, table()), encoding="utf-8")
    if "--no-pictures" not in sys.argv:
        pictures(DOCS / "pictures")
