"""Evaluations of several controllers as one table: for the terminal, and for the README."""

from __future__ import annotations

from collections.abc import Sequence

from agents.evaluation.evaluation import Evaluation, written


def columns(evaluation: Evaluation) -> list[str]:
    """Return the headings of the table for an evaluation."""
    ride = evaluation.ride[0]["speed"]
    return [
        "controller",
        "reads",
        "linear",
        "nonlinear",
        f"robust ({evaluation.robust_over})",
        *(f"{curve.name}, linear / nonlinear" for curve in evaluation.curves[1:]),
        f"rms moment at {ride:g} m/s (kN m)",
    ]


def row(evaluation: Evaluation) -> list[str]:
    """Return one row of the table; speeds in m/s."""
    top = evaluation.plan.speed_range[1]
    return [
        evaluation.controller,
        evaluation.observation,
        written(evaluation.linear, top),
        written(evaluation.nonlinear, top),
        written(evaluation.robust, top),
        *(
            f"{written(curve.linear, top)} / {written(curve.nonlinear, top)}"
            for curve in evaluation.curves[1:]
        ),
        f"{1e-3 * evaluation.ride[0]['moment_rms']:.2f}",
    ]


def ordered(evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Return evaluations with the best first: those from sensors before those from the full state."""
    return sorted(
        evaluations, key=lambda e: (e.observation != "sensors", -(e.robust or 0.0), e.controller)
    )


def push(speed: float | None, passive: float | None, highest: float) -> str:
    """Return for a table the change of a critical speed (m/s) from the vehicle's own."""
    if speed is None or passive is None:
        return "failed"
    if speed >= highest * (1.0 - 1e-9):
        return f"> {highest - passive:+.0f}"
    return f"{speed - passive:+.1f}"


def markdown(evaluations: Sequence[Evaluation]) -> str:
    """Return the leaderboard as a Markdown table, the best sensor-only robust speed first."""
    rows = ordered(evaluations)
    heads = columns(rows[0])
    lines = [
        "| " + " | ".join(heads) + " |",
        "|---|---|" + "---:|" * (len(heads) - 2),
        *("| " + " | ".join(row(evaluation)) + " |" for evaluation in rows),
    ]
    return "\n".join(lines) + "\n"
