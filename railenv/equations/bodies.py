"""Equations of motion of one body (eq 6): a wheelset, or a body without wheels."""

from __future__ import annotations

from collections.abc import Sequence

from railenv.equations.coordinates import Motion, Running, Wrench
from railenv.equations.functions import Scalar, sin


def gyroscopic(w: Motion, run: Running, p: Scalar) -> Wrench:
    """Gyroscopic moments of an axle that spins at V/r0, on a track that itself turns at V/R.

    On a cant ramp the track rolls under the wheelset, too.
    """
    V = run.speed
    rolling = w.dphi + V * run.cant_slope
    return Wrench(
        roll=-p.pitch_inertia * V / p.wheel_radius * (V * run.curvature - w.dpsi),
        yaw=-p.pitch_inertia * (V / p.wheel_radius + V * run.curvature * sin(run.cant)) * rolling,
    )


def turning(run: Running, p: Scalar) -> Wrench:
    """Inertia of a body against the track that turns ever faster into a curve (about z)."""
    return Wrench(yaw=p.yaw_inertia * run.speed * run.speed * run.curvature_slope)


def accelerations(acting: Wrench, p: Scalar, coordinates: Sequence[str]) -> list[Scalar]:
    """Accelerations of a body's coordinates under all that acts about its centre of mass."""
    parts = {
        "y": (acting.force_y, "mass"),
        "z": (acting.force_z, "mass"),
        "phi": (acting.roll, "roll_inertia"),
        "theta": (acting.pitch, "pitch_inertia"),
        "psi": (acting.yaw, "yaw_inertia"),
    }
    return [parts[c][0] / getattr(p, parts[c][1]) for c in coordinates]
