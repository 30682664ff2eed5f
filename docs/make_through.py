"""Write what docs/learning.md tells of training through the simulator: ``python docs/make_through.py``.

Table and picture are made from docs/through.json, which ``python -m benchmarks.through.run`` measures.
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
PAGE, DATA = DOCS / "learning.md", DOCS / "through.json"
GOAL = 125.2
"""m/s, robust critical speed of the shipped output feedback (docs/leaderboard.json)."""


def table(runs: list[dict[str, Any]]) -> str:
    """Return what every seed reached."""
    headings = [
        "seed",
        "steps",
        "processor, s",
        "robust, m/s",
        "conicity",
        "creep factor",
        "Hz",
        "linear, m/s",
    ]
    rows = [
        [
            f"{run['seed']}",
            f"{run['steps']}",
            f"{run['seconds']:.0f}",
            f"{run['robust']:.1f}",
            f"{run['worst']['conicity']:.3f}",
            f"{run['worst']['creep_factor']:.2f}",
            "-" if run["frequency"] is None else f"{run['frequency']:.1f}",
            f"{run['linear']:.1f}",
        ]
        for run in runs
    ]
    speeds = np.array([run["robust"] for run in runs])
    low, middle, high = np.quantile(speeds, [0.0, 0.5, 1.0])
    said = (
        f"Robust critical speed, {len(runs)} seeds: middle {middle:.1f} m/s, from {low:.1f} to "
        f"{high:.1f}; {(speeds >= GOAL).sum()} of them reach the {GOAL} m/s of the output feedback."
    )
    return f"{rows_as_table(headings, rows)}\n\n{said}"


def picture(runs: list[dict[str, Any]], folder: Path) -> None:
    """Draw the robust critical speed over the steps, of every seed and the best so far."""
    import matplotlib.pyplot as plt

    from design.style import SERIES, style

    with style():
        figure, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
        curves = [np.array(run["curve"]) for run in runs]
        for run, curve in zip(runs, curves, strict=True):
            label = "seeds" if run is runs[0] else None
            ax.plot(curve[:, 0] / 1e6, curve[:, 1], ".-", lw=0.6, ms=3, color="0.6", label=label)
        best = np.array([np.maximum.accumulate(curve[:, 1]) for curve in curves])
        low, middle, high = np.quantile(best, [0.0, 0.5, 1.0], axis=0)
        steps = curves[0][:, 0] / 1e6
        ax.plot(steps, middle, color=SERIES[0], label="best so far, middle of the seeds")
        ax.fill_between(steps, low, high, color=SERIES[0], alpha=0.15, lw=0)
        ax.axhline(GOAL, color="0.3", lw=0.8, ls="--", label="output feedback")
        ax.set_xlabel("environment steps (millions)")
        ax.set_ylabel("robust critical speed (m/s)")
        ax.legend(loc="lower right")
        figure.savefig(folder / "through.png", dpi=110)
        plt.close(figure)


if __name__ == "__main__":
    mpl.use("Agg")
    data = json.loads(DATA.read_text(encoding="utf-8"))
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(refilled(text, {"through": lambda: table(data)}), encoding="utf-8")
    if "--no-pictures" not in sys.argv:
        picture(data, DOCS / "pictures")
