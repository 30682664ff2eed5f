"""Search classical controllers in the registered tasks: ``python -m benchmarks.tasks.run``.

Writes docs/tasks.json after every task; ``docs/make_tasks.py`` makes the page of it.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from benchmarks.tasks.classical import row
from railenv import checks
from railenv.tasks import TASKS

OUT = Path(__file__).resolve().parents[2] / "docs" / "tasks.json"


def main(
    only: Annotated[list[str] | None, typer.Option(help="Ids of tasks; all when left out.")] = None,
) -> None:
    """Search and judge, task by task."""
    ids = [task.id for task in TASKS]
    checks.known("task", only or [], ids)
    console = Console(highlight=False, markup=False, soft_wrap=True)
    kept = json.loads(OUT.read_text(encoding="utf-8")) if OUT.is_file() else {}
    for env_id in only or ids:
        start = time.process_time()
        found = asdict(row(env_id))
        kept[env_id] = {**found, "seconds": round(time.process_time() - start)}
        console.print(f"{env_id}: {kept[env_id]}")
        ordered = {name: kept[name] for name in ids if name in kept}
        OUT.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
