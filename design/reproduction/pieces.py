"""The pieces that sections of the report share, by name."""

from __future__ import annotations

import math

import numpy as np

from design.reproduction import computations, paper
from design.reproduction.cases import Case
from design.reproduction.settings import Settings
from design.reproduction.store import Piece

LISTED_RADII = (10_000.0, 6250.0, 1000.0, 250.0)
"""m, the curves of the table of critical speeds."""

DURATION, WINDOW, SHOWN = 30.0, 10.0, 10.0
"""Times simulated, evaluated at the end, and drawn from the start, s."""

BELOW, ABOVE = 0.98, 1.05
"""Speeds of the motions of Figs 12 and 13, as multiples of the linear critical speed."""

BELOW_RUN, ABOVE_RUN = 500.0, 2500.0
"""Lengths of these runs, m: a decay, and enough for hunting to grow from a small disturbance."""

_SWEPT = 25
_HIGHEST = 140.0  # m/s, the highest speed of a motion in the paper


def critical_speeds(case: Case) -> Piece:
    """Return critical speeds on tangent track and over curve radius."""
    radii = np.geomspace(*paper.RADII, _SWEPT).tolist()
    inputs = {"model": case.model, "radii": radii, "listed": list(LISTED_RADII), "cant": paper.CANT}
    return Piece(
        f"critical-speeds-{case.key}",
        computations.critical_speeds,
        inputs,
        f"critical speeds, {case.title}",
    )


def motion(case: Case, speed: float) -> Piece:
    """Return a motion at a speed on the curve of Figs 6 to 9."""
    name = f"motion-{case.key}-{speed:g}"
    inputs = {"model": case.model, "speed": speed, **_CURVE, **_TIMES, "shown": SHOWN}
    return Piece(name, computations.motion, inputs, f"motion at {speed:g} m/s, {case.title}")


def motion_below(case: Case) -> Piece:
    """Return the whole motion a little below the critical speed: the paper's Fig 12."""
    inputs = {"model": case.model, "factor": BELOW, **_CURVE, "distance": BELOW_RUN, "window": None}
    name = f"motion-below-{case.key}"
    return Piece(name, computations.motion_at_critical, inputs, f"motion below critical, {case.title}")


def motion_above(case: Case) -> Piece:
    """Return the motion a little above the critical speed."""
    inputs = {"model": case.model, "factor": ABOVE, **_CURVE, "distance": ABOVE_RUN, "window": WINDOW}
    name = f"motion-above-{case.key}"
    return Piece(name, computations.motion_at_critical, inputs, f"motion above critical, {case.title}")


def simulated_critical_speed(case: Case) -> Piece:
    """Return the speed from which a simulation hunts, on the curve of Figs 6 to 9."""
    return Piece(
        f"simulated-critical-speed-{case.key}",
        computations.simulated_critical_speed,
        {"model": case.model, **_CURVE, "duration": 1.5 * DURATION, "window": WINDOW},
        f"critical speed by simulation, {case.title}",
    )


def natural_frequencies(case: Case) -> Piece:
    """Return hunting, kinematic and natural frequencies at the critical speed."""
    name = f"natural-frequencies-{case.key}"
    return Piece(name, computations.natural_frequencies, {"model": case.model}, name)


def diagram(case: Case, settings: Settings) -> Piece:
    """Return simulated bifurcation diagrams: the paper's Figs 10 and 11."""
    inputs = {
        "model": case.model,
        "speeds": np.linspace(*paper.DIAGRAM_SPEEDS, settings.diagram_speeds).tolist(),
        "radii": list(paper.DIAGRAM_RADII),
        "cant": paper.CANT,
        "duration": settings.diagram_duration,
        "window": 2.0,
    }
    name = f"diagram-{case.key}"
    return Piece(name, computations.diagram, inputs, f"simulated diagram, {case.title}")


def branch(case: Case, radius: float, settings: Settings) -> Piece:
    """Return limit cycles from the Hopf point on tangent track or on a curve."""
    tangent = math.isinf(radius)
    where = "tangent" if tangent else f"{radius:g}m"
    inputs = {
        "model": case.model,
        "radius": radius,
        "cant": 0.0 if tangent else paper.CANT,
        "highest": _HIGHEST,
        "points": settings.branch_points,
        "longest_step": settings.branch_step,
    }
    name = f"branch-{where}-{case.key}"
    return Piece(name, computations.branch, inputs, f"limit cycles, {where}, {case.title}")


def chart(case: Case, settings: Settings) -> Piece:
    """Return Hopf point and fold over the conicity, on tangent track."""
    inputs = {
        "model": case.model,
        "parameter": "conicity",
        "values": np.linspace(0.03, 0.10, settings.chart_points).tolist(),
        "radius": math.inf,
        "cant": 0.0,
    }
    return Piece(f"map-{case.key}", computations.chart, inputs, f"map over conicity, {case.title}")


_CURVE = {"radius": paper.RADIUS, "cant": paper.CANT}
_TIMES = {"duration": DURATION, "window": WINDOW}
