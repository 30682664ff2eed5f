"""Write the table of docs/baselines.md and its pictures: ``python docs/make_baselines.py``.

They are made from docs/baselines.json, which ``python -m benchmarks.baselines.run`` measures, and from
docs/tasks.json for what classical controllers earn. The text is edited in the page itself.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from blocks import refilled

from railenv.tasks import TASKS

DOCS = Path(__file__).resolve().parent
PAGE, DATA, CLASSICAL = DOCS / "baselines.md", DOCS / "baselines.json", DOCS / "tasks.json"
NAMES = {"ppo": "PPO", "sac": "SAC", "td3": "TD3", "tqc": "TQC"}

Runs = dict[tuple[str, str], list[dict[str, Any]]]


def grouped(rows: list[dict[str, Any]]) -> Runs:
    """Return the runs of each task and algorithm, in the order of the tasks."""
    found: Runs = defaultdict(list)
    for row in rows:
        found[row["task"], row["algorithm"]].append(row)
    order = [task.id for task in TASKS]
    return dict(sorted(found.items(), key=lambda item: (order.index(item[0][0]), item[0][1])))


def table(runs: Runs) -> str:
    """Return what every algorithm reached in every task."""
    lines = [
        "| task | algorithm | seeds | steps | min | return | derailed | critical speed, m/s | solved |",
        "| --- | --- | ---: | ---: | ---: | --- | ---: | --- | ---: |",
    ]
    thresholds = {task.id: task.reward_threshold for task in TASKS}
    for (task, algorithm), found in runs.items():
        returns = np.array([row["mean"] for row in found])
        speeds = np.array([row["critical_speed"] for row in found])
        minutes = np.mean([row["seconds"] for row in found]) / 60.0
        cells = [
            task.removeprefix("railenv/"),
            NAMES[algorithm],
            f"{len(found)}",
            f"{found[0]['steps']}",
            f"{minutes:.1f}",
            _spread(returns),
            f"{np.mean([row['derailed'] for row in found]):.0%}",
            _spread(speeds),
            f"{(returns >= thresholds[task]).sum()}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _spread(values: np.ndarray[Any, Any]) -> str:
    low, middle, high = np.quantile(values, [0.0, 0.5, 1.0])
    return f"{middle:.0f} ({low:.0f} to {high:.0f})"


def _picture(task: str) -> str:
    return f"baselines-{task.removeprefix('railenv/').removesuffix('-v1').lower()}"


def gallery(runs: Runs) -> str:
    """Return the pictures, one for each task."""
    tasks = dict.fromkeys(task for task, _ in runs)
    return "\n\n".join(
        f"![Learning curves in {task.removeprefix('railenv/')}](pictures/{_picture(task)}.png)"
        for task in tasks
    )


def pictures(runs: Runs, classical: dict[str, Any], folder: Path) -> None:
    """Draw return and critical speed over the steps, the middle of the seeds and their spread."""
    import matplotlib.pyplot as plt

    from design.style import SERIES, style

    for task in dict.fromkeys(task for task, _ in runs):
        with style():
            figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
            for k, (algorithm, name) in enumerate(NAMES.items()):
                found = runs.get((task, algorithm))
                if found is None:
                    continue
                curves = np.array([row["curve"] for row in found])  # seeds, evaluations, 3
                steps = curves[0, :, 0] / 1e3
                for ax, column in ((left, 1), (right, 2)):
                    low, middle, high = np.quantile(curves[:, :, column], [0.0, 0.5, 1.0], axis=0)
                    ax.plot(steps, middle, color=SERIES[k], label=name)
                    ax.fill_between(steps, low, high, color=SERIES[k], alpha=0.15, lw=0)
            for name, ls in (("constant gain", ":"), ("LQR", "--")):
                if task in classical:
                    left.axhline(classical[task]["means"][name], color="0.4", lw=0.8, ls=ls, label=name)
            left.set_ylabel("mean return")
            right.set_ylabel("linear critical speed (m/s)")
            for ax in (left, right):
                ax.set_xlabel("environment steps (thousands)")
            left.legend(loc="lower right")
            figure.suptitle(task)
            figure.savefig(folder / f"{_picture(task)}.png", dpi=110)
            plt.close(figure)


if __name__ == "__main__":
    mpl.use("Agg")
    data = grouped(json.loads(DATA.read_text(encoding="utf-8")))
    known = json.loads(CLASSICAL.read_text(encoding="utf-8"))
    makers = {"reached": lambda: table(data), "curves": lambda: gallery(data)}
    PAGE.write_text(refilled(PAGE.read_text(encoding="utf-8"), makers), encoding="utf-8")
    if "--no-pictures" not in sys.argv:
        pictures(data, known, DOCS / "pictures")
