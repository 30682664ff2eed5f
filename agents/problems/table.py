"""Ratings of several controllers on one problem as a table: for the terminal, and for pages."""

from __future__ import annotations

import math
from collections.abc import Sequence

from agents.evaluation.evaluation import written
from agents.problems.rating import Loss, Rating

COLUMNS = (
    "controller",
    "robust (m/s)",
    "body hunting from",
    "bogie hunting from",
    "9 mm dies out to",
    "Wz",
    "rms moment",
    "power (W)",
    "Y/Q in curves",
    "gain, phase, delay margin",
    "actuators lost",
    "delay doubled",
    "sensors frozen",
)
"""Headings of the table."""


def row(rating: Rating) -> list[str]:
    """Return one row of the table; speeds in m/s."""
    top = rating.highest_speed
    speeds = list(rating.nonlinear.values())
    nonlinear = None if None in speeds else min(s for s in speeds if s is not None)
    ride = rating.worst_ride
    derailed = sum(run.derailed for run in rating.ride)
    failures = rating.failures
    frozen = f"{failures.frozen:.0%}" + (", derails" if failures.frozen_derailed else "")
    return [
        rating.controller,
        written(rating.robust, top),
        _from(rating.lowest("body hunting")),
        _from(_other(rating)),
        written(nonlinear, top),
        f"{ride.wz:.2f}" + (f" ({derailed} of {len(rating.ride)} derail)" if derailed else ""),
        f"{max(run.moment for run in rating.ride):.0%}",
        f"{max(run.power for run in rating.ride):.0f}",
        f"{max(run.nadal for run in rating.curving):.0%}",
        _margins(rating),
        written(failures.lost, top),
        "-" if failures.doubled_delay is None else written(failures.doubled_delay, top),
        frozen,
    ]


def _other(rating: Rating) -> Loss | None:
    """Return the loss at the lowest speed that is not body hunting."""
    known = [
        loss
        for loss in rating.losses
        if loss.speed is not None and loss.kind != "none" and "body hunting" not in loss.kind
    ]
    return min(known, key=lambda loss: loss.speed or 0.0, default=None)


def _from(loss: Loss | None) -> str:
    if loss is None or loss.speed is None:
        return "-"
    return f"{loss.speed:.1f}" + (f" ({loss.frequency:.1f} Hz)" if loss.frequency else "")


def _margins(rating: Rating) -> str:
    margin = rating.margin
    if margin is None:
        return "-"
    gain = f"{margin.gain:.2f}" if math.isfinite(margin.gain) else "any"
    phase = f"{math.degrees(margin.phase):.0f}°" if math.isfinite(margin.phase) else "any"
    delay = "> 200" if margin.delay is None else f"{1e3 * margin.delay:.0f}"
    return f"{gain}, {phase}, {delay} ms"


def markdown(ratings: Sequence[Rating]) -> str:
    """Return ratings as a Markdown table."""
    lines = [
        "| " + " | ".join(COLUMNS) + " |",
        "|---|" + "---:|" * (len(COLUMNS) - 1),
        *("| " + " | ".join(row(rating)) + " |" for rating in ratings),
    ]
    return "\n".join(lines) + "\n"
