"""An assessment as a table of text."""

from __future__ import annotations

import math
from itertools import groupby
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from railenv.assessment.assessment import Assessment
    from railenv.assessment.records import Quantity

HEADINGS = ("quantity", "where", "value", "limit", "share", "", "filter")
_SHOWN = {"N": ("kN", 1e-3, ".1f"), "m/s^2": ("m/s^2", 1.0, ".2f"), "1": ("", 1.0, ".3f")}
_TO_THE_RIGHT = (2, 3, 4)


def shown_quantities(assessment: Assessment, every: bool) -> list[Quantity]:
    """Return all quantities, or the worst of each name."""
    if every:
        return list(assessment.quantities)
    return [assessment.worst(name) for name in dict.fromkeys(q.name for q in assessment.quantities)]


def text_table(assessment: Assessment, every: bool) -> str:
    """Return a table with columns of equal width, groups under their headings, and the verdict."""
    found = shown_quantities(assessment, every)
    rows = [cells(q) for q in found]
    widths = [max(len(row[k]) for row in (HEADINGS, *rows)) for k in range(len(HEADINGS))]
    lines = [title(assessment), "", _line(HEADINGS, widths)]
    for group, members in groupby(zip(found, rows, strict=True), key=lambda pair: pair[0].group):
        lines += [group.upper(), *(_line(row, widths) for _, row in members)]
    lines += ["", *(f"left out: {note}" for note in assessment.notes), verdict(assessment)]
    return "\n".join(lines)


def markdown_table(assessment: Assessment, every: bool) -> str:
    """Return a Markdown table with the group of each quantity, then the verdict."""
    headings = ("group", *(h or "within" for h in HEADINGS))
    rule = ["---", *("---:" if k in _TO_THE_RIGHT else "---" for k in range(len(HEADINGS)))]
    rows = [(q.group, *cells(q)) for q in shown_quantities(assessment, every)]
    lines = [f"| {' | '.join(row)} |" for row in (headings, rule, *rows)]
    notes = [f"- left out: {note}" for note in assessment.notes]
    return "\n".join(
        [title(assessment), "", *lines, "", *notes, *([""] if notes else []), verdict(assessment)]
    )


def verdict(assessment: Assessment) -> str:
    """Return one line that says which limits are exceeded, if any."""
    if assessment.passed is None:
        return "no value has a limit, so none is judged"
    if assessment.passed:
        return "all values are within their limits"
    names = dict.fromkeys(q.name for q in assessment.exceeded)
    worst = (assessment.worst(name) for name in names)
    listed = "; ".join(f"{q.name} {_share(q)} at {q.where}" for q in worst)
    return f"LIMITS EXCEEDED: {listed}"


def title(assessment: Assessment) -> str:
    """Return one line with the model, the section and its conditions."""
    first, last = assessment.section
    curve = "tangent track" if math.isinf(assessment.radius) else f"R = {assessment.radius:.4g} m"
    return (
        f"{assessment.model}, {first:.0f} to {last:.0f} m, up to {assessment.speed:.4g} m/s, {curve}, "
        f"instability read at {assessment.hunting_frequency:.2f} Hz"
    )


def cells(q: Quantity) -> tuple[str, ...]:
    """Return the row of a quantity."""
    unit, factor, precision = _SHOWN[q.unit]
    value = f"{q.value * factor:{precision}} {unit}".strip()
    limit = "" if q.limit is None else f"{q.limit * factor:{precision}} {unit}".strip()
    told = {True: "ok", False: "EXCEEDED", None: ""}[q.passed]
    return q.name, q.where, value, limit, _share(q), told, q.filter


def _share(q: Quantity) -> str:
    return "" if q.share is None else f"{q.share:.0%}"


def _line(row: tuple[str, ...], widths: list[int]) -> str:
    padded = [
        cell.rjust(width) if k in _TO_THE_RIGHT else cell.ljust(width)
        for k, (cell, width) in enumerate(zip(row, widths, strict=True))
    ]
    return "  ".join(padded).rstrip()
