"""Write what docs/learning.md tells of the methods side by side: ``python docs/make_methods.py``.

Table and picture are made from docs/methods.json, which ``python -m benchmarks.methods.run`` measures.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from blocks import refilled
from blocks import table as rows_as_table

DOCS = Path(__file__).resolve().parent
PAGE, DATA = DOCS / "learning.md", DOCS / "methods.json"
NAMES = {
    "through": "through the simulator",
    "ppo": "PPO",
    "sac": "SAC",
    "td3": "TD3",
    "search": "policy search",
}
NEIGHBOUR = "output-feedback"  # of docs/problems.json: the best fixed linear law
PROBLEM = "bogie-secondary-v1"

Runs = list[dict[str, Any]]


def neighbour() -> float:
    """Return the robust critical speed (m/s) of the shipped output feedback."""
    ratings = json.loads((DOCS / "problems.json").read_text(encoding="utf-8"))
    return float(ratings[PROBLEM]["ratings"][NEIGHBOUR]["robust"])


def table(runs: Runs, goal: float) -> str:
    """Return what every method reached."""
    headings = ["method", "environment steps", "processor, s", "robust, m/s: least", "middle", "most"]
    headings += [f"seeds at {goal:.1f} or more", "nominal, m/s: middle"]
    rows = []
    for method, name in NAMES.items():
        own = [run for run in runs if run["method"] == method]
        if not own:
            continue
        speeds = np.array([run["robust"] for run in own])
        low, middle, high = np.quantile(speeds, [0.0, 0.5, 1.0])
        steps, seconds, linear = (
            float(np.median([run[key] for run in own])) for key in ("steps", "seconds", "linear")
        )
        cells = [f"{steps / 1e6:.2f} million", f"{seconds:.0f}", f"{low:.1f}", f"{middle:.1f}"]
        cells += [f"{high:.1f}", f"{(speeds >= goal).sum()} of {len(own)}", f"{linear:.1f}"]
        rows.append([name, *cells])
    return rows_as_table(headings, rows)


def picture(runs: Runs, goal: float, folder: Path) -> None:
    """Draw the robust critical speed over the share of the training, of every method."""
    import matplotlib.pyplot as plt

    from design.style import SERIES, style

    with style():
        figure, ax = plt.subplots(figsize=(6.8, 4.0), layout="constrained")
        grid = np.linspace(0.0, 1.0, 101)
        for (method, name), colour in zip(NAMES.items(), (*SERIES, "0.45"), strict=True):
            curves = [np.array(run["curve"]) for run in runs if run["method"] == method]
            if not curves:
                continue
            each = np.array([np.interp(grid, c[:, 0] / c[-1, 0], c[:, 1]) for c in curves])
            low, middle, high = np.quantile(each, [0.0, 0.5, 1.0], axis=0)
            ax.plot(grid * 100.0, middle, color=colour, label=name)
            ax.fill_between(grid * 100.0, low, high, color=colour, alpha=0.12, lw=0)
        ax.axhline(goal, color="0.3", lw=0.8, ls="--", label="output feedback (shipped)")
        ax.set_xlabel("share of the training (%)")
        ax.set_ylabel("robust critical speed (m/s)")
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, 1.2), ncols=3)
        figure.savefig(folder / "methods.png", dpi=110)
        plt.close(figure)


if __name__ == "__main__":
    mpl.use("Agg")
    data, reached = json.loads(DATA.read_text(encoding="utf-8")), neighbour()
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(refilled(text, {"methods": lambda: table(data, reached)}), encoding="utf-8")
    if "--no-pictures" not in sys.argv:
        picture(data, reached, DOCS / "pictures")
