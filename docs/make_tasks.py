"""Write the tables of docs/environments/tasks.md: ``python docs/make_tasks.py``.

They are made from docs/tasks.json, which ``python -m benchmarks.tasks.run`` measures, and from what is
registered. The text around the tables is edited in the page itself.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from blocks import refilled, table

from railenv.tasks import TASKS, Task

DOCS = Path(__file__).resolve().parent
PAGE, DATA = DOCS / "environments" / "tasks.md", DOCS / "tasks.json"
KINDS = ("idle", "constant gain", "output feedback", "LQG", "LQR")


def _linked(task: Task) -> str:
    return f"[{task.id.removeprefix('railenv/')}](#{_anchor(task)})"


def _anchor(task: Task) -> str:
    return task.id.removeprefix("railenv/").lower()


def earned(data: dict[str, Any]) -> str:
    """Return the table of what is earned in the tasks that have been measured."""
    rows = []
    for task in TASKS:
        if task.id not in data:
            continue
        row = data[task.id]
        cells = [_cell(row["means"][kind], row["derailed"][kind]) for kind in KINDS]
        threshold = f"{task.reward_threshold:g}"
        rows.append([_linked(task), f"{row['steps']}", *cells, f"{row['bound']:.0f}", threshold])
    return table(["task", "steps", *KINDS, "bound", "solved from"], rows)


def _cell(mean: float, derailed: float) -> str:
    return f"{mean:.0f}" + (f" ({derailed:.0%})" if derailed else "")


def sections(data: dict[str, Any]) -> str:
    """Return a section for each task: what is asked, how it is made, what the best are."""
    parts = []
    for task in TASKS:
        lines = [f"## {task.id.removeprefix('railenv/')}", "", task.asks, ""]
        rows = [[f"`{name}`", f"`{_plain(value)}`"] for name, value in task.keywords.items()]
        base = f"`railenv/{task.environment}-v1`"
        if rows:
            lines += [f"{base} with", "", table(["keyword", "value"], rows, 2), ""]
        else:
            lines += [f"{base} as it is.", ""]
        if task.id in data:
            told = data[task.id]["told"]
            lines += [f"Best constant gain: {told['constant gain']}.", ""]
        parts.append("\n".join(lines))
    return "\n".join(parts).rstrip()


def _plain(value: Any) -> str:
    return json.dumps(value).replace("|", "\\|")


if __name__ == "__main__":
    found = json.loads(DATA.read_text(encoding="utf-8"))
    makers = {"earned": lambda: earned(found), "tasks": lambda: sections(found)}
    PAGE.write_text(refilled(PAGE.read_text(encoding="utf-8"), makers), encoding="utf-8")
    print(f"wrote {PAGE}")
