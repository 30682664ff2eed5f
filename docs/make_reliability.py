"""Write the tables of docs/reliability.md: ``python docs/make_reliability.py``.

They are made from docs/reliability.json, which ``python -m benchmarks.reliability.run`` measures (some
minutes). The text around the tables is edited in the page itself.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from blocks import refilled, table

DOCS = Path(__file__).resolve().parent
PAGE, DATA = DOCS / "reliability.md", DOCS / "reliability.json"

_FAILURE = "failure"


def _part(data: dict[str, Any], part: str) -> list[dict[str, Any]]:
    """Return the rows of one part of what was measured."""
    return [row for row in data["measured"] if row["part"] == part]


def _outcomes(rows: list[dict[str, Any]], columns: dict[str, str]) -> str:
    """Return a table of how often each outcome came up; outcomes without a column are named."""
    lines, total = [], Counter[str]()
    for row in rows:
        outcomes = row["outcomes"]
        total.update(outcomes)
        lines.append(_line(row["name"], outcomes, columns))
    lines.append(_line("**all**", total, columns))
    return table(["", "examples", *columns.values(), "failures"], lines)


def _line(name: str, outcomes: dict[str, int], columns: dict[str, str]) -> list[str]:
    unknown = set(outcomes) - set(columns) - {_FAILURE}
    if unknown:
        raise ValueError(f"outcomes without a column: {sorted(unknown)}")
    counts = [outcomes.get(column, 0) for column in columns]
    return [name, *(f"{n}" for n in (sum(outcomes.values()), *counts, outcomes.get(_FAILURE, 0)))]


def fuzz(data: dict[str, Any]) -> str:
    """Return the table of the fuzz run."""
    merged = []
    for row in _part(data, "fuzz"):
        outcomes = dict(row["outcomes"])
        # a subclass of ParameterError, and the command's two ways to end
        outcomes["ParameterError"] = sum(
            outcomes.pop(name, 0) for name in ("ParameterError", "UnknownNameError")
        )
        for name in ("CommandFailedError", "WrongUseError"):
            outcomes["ParameterError"] += outcomes.pop(name, 0)
        merged.append({"name": row["name"], "outcomes": {k: v for k, v in outcomes.items() if v}})
    columns = {
        "result": "sane result",
        "ParameterError": "value or name refused",
        "EquilibriumError": "no equilibrium",
        "SimulationError": "motion diverges",
        "EquationError": "no kernel",
    }
    return _outcomes(merged, columns)


def damage(data: dict[str, Any]) -> str:
    """Return the table of damaged files."""
    columns = {
        "refused": "refused",
        "as before": "read as before",
        "a part": "whole lines read",
        "other values": "other values read",
    }
    return _outcomes(_part(data, "damage"), columns)


def soak(data: dict[str, Any]) -> str:
    """Return the table of long runs."""
    rows = [
        [
            row["what"],
            f"{row['simulated'] / 3600.0:.3g}",
            f"{row['episodes']}",
            f"{row['derailed']}",
            f"{row['settled']:.1f}",
            f"{row['last']:.1f}",
            f"{row['highest']:.1f}",
            f"{row['last'] - row['settled']:+.2f}",
        ]
        for row in _part(data, "soak")
    ]
    return table(
        [
            "",
            "simulated (h)",
            "episodes",
            "derailed",
            "after a tenth (MiB)",
            "at the end (MiB)",
            "highest (MiB)",
            "growth (MiB)",
        ],
        rows,
    )


def sensitivity(data: dict[str, Any]) -> str:
    """Return the table of time steps and precisions."""
    exact = _part(data, "sensitivity")[0]
    rows = []
    for row in _part(data, "sensitivity"):
        differences = [
            "" if row is exact else f"{100.0 * (row[name] / exact[name] - 1.0):+.{digits}f} %"
            for name, digits in (("growth", 3), ("critical", 4), ("amplitude", 3))
        ]
        rows.append(
            [
                row["what"],
                f"{row['growth']:.5f}",
                differences[0],
                f"{row['critical']:.3f}",
                differences[1],
                f"{1e3 * row['amplitude']:.4f}",
                differences[2],
            ]
        )
    heads = ["", "growth rate at 118 m/s (1/s)", "", "critical speed (m/s)", "", "amplitude (mm)", ""]
    return table(heads, rows)


def periods(data: dict[str, Any]) -> str:
    """Return the table of control periods."""
    rows = [[f"{1e3 * row['period']:g}", f"{row['linear']:.2f}"] for row in _part(data, "periods")]
    return table(["control period (ms)", "critical speed (m/s)"], rows, 0)


def onsets(data: dict[str, Any]) -> str:
    """Return the table of nonlinear critical speeds against simulation."""
    columns = {
        "agrees": "agree",
        "no hunting": "none found, none simulated",
        "hunts below": "hunts below",
        "does not hunt above": "does not hunt above",
        "hunts where none was found": "hunts where none was found",
    }
    lines, total = [], Counter[str]()
    for row in _part(data, "onsets"):
        total.update(row["outcomes"])
        shares = [f"{row[name]:.2f}" for name in ("middle_share", "lowest_share")]
        lines.append([row["name"], *_counts(row["outcomes"], columns), *shares])
    lines.append(["**all**", *_counts(total, columns), "", ""])
    heads = ["contact", "vehicles", *columns.values()]
    return table([*heads, "nonlinear / linear, median", "lowest"], lines)


def _counts(outcomes: dict[str, int], columns: dict[str, str]) -> list[str]:
    unknown = set(outcomes) - set(columns)
    if unknown:
        raise ValueError(f"outcomes without a column: {sorted(unknown)}")
    return [f"{n}" for n in (sum(outcomes.values()), *(outcomes.get(c, 0) for c in columns))]


def circumstances(data: dict[str, Any]) -> str:
    """Say with what everything was measured."""
    about = ", ".join(f"{name} {value}" for name, value in data["circumstances"].items())
    examples = sum(sum(row["outcomes"].values()) for row in _part(data, "fuzz"))
    files = sum(sum(row["outcomes"].values()) for row in _part(data, "damage"))
    failures = sum(
        r["outcomes"].get(_FAILURE, 0) for r in (*_part(data, "fuzz"), *_part(data, "damage"))
    )
    minutes = sum(row["seconds"] for row in (*_part(data, "fuzz"), *_part(data, "damage"))) / 60.0
    return (
        f"{examples} examples and {files} damaged files, {failures} failures, in {minutes:.0f} minutes "
        f"of one processor; {about}."
    )


def page(text: str) -> str:
    """Return the text of the page with its tables made anew."""
    data = json.loads(DATA.read_text(encoding="utf-8"))
    makers = (circumstances, fuzz, damage, soak, sensitivity, periods, onsets)
    return refilled(text, {maker.__name__: lambda maker=maker: maker(data) for maker in makers})


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
