"""Write the tables of docs/clients.md: ``python docs/make_clients.py``.

They are made from docs/clients.json, which ``python -m benchmarks.clients.run`` writes (half an hour).
The text around the tables is edited in the page itself.
"""

from __future__ import annotations

import json
from pathlib import Path
from textwrap import indent
from typing import Any

from blocks import refilled
from make_reliability import table

DOCS = Path(__file__).resolve().parent
PAGE, DATA = DOCS / "clients.md", DOCS / "clients.json"


def log(rows: list[dict[str, Any]]) -> str:
    """Return the table of all clients."""
    lines = [
        [
            f"{row['client']} {row['version'] or ''}".strip(),
            row["ran"] if "error" not in row else "fails, see below",
            row["python"],
            row.get("gymnasium", ""),
            f"{row['steps']}" if "steps" in row else "",
            f"{row['seconds']:.0f}" if "seconds" in row else "",
            f"{row['before']:.1f}" if "before" in row else "",
            f"{row['after']:.1f}" if "after" in row else "",
            _outcome(row, _idle(rows)),
        ]
        for row in rows
    ]
    heads = ["client", "what was run", "Python", "Gymnasium", "steps", "s", "before", "after", ""]
    return table(heads, lines, 2)


def _idle(rows: list[dict[str, Any]]) -> float:
    """Return what the episodes return without any command."""
    (value,) = (row["idle"] for row in rows if "idle" in row)
    return float(value)


def _outcome(row: dict[str, Any], idle: float) -> str:
    """Say in a word or two how it went."""
    if "error" in row:
        return "error"
    if "improved" not in row:
        return "passes"
    if row["improved"]:
        return "improves"
    than_idle = "above" if row["after"] > idle else "below"
    return f"does not improve; {than_idle} no command"


def idle(rows: list[dict[str, Any]]) -> str:
    """Say what there is to beat."""
    return f"Without any command the 20 episodes return {_idle(rows):.1f} on average."


def errors(rows: list[dict[str, Any]]) -> str:
    """Return what the clients that failed printed."""
    failed = [row for row in rows if "error" in row]
    if not failed:
        return "None failed."
    return "\n\n".join(
        f"{row['client']} ({row['name']}):\n\n{indent(row['error'], '    ')}" for row in failed
    )


def page(text: str) -> str:
    """Return the text of the page with its tables made anew."""
    rows = json.loads(DATA.read_text(encoding="utf-8"))
    return refilled(
        text, {maker.__name__: lambda maker=maker: maker(rows) for maker in (idle, log, errors)}
    )


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
