"""Coordinates, running conditions and rail displacements that the equations of motion share.

The frame of reference runs along the track centre line at the forward speed: x forward, y to the
left, z up; phi is roll (about x), psi is yaw (about z). A positive curvature is the curve whose outer
rail is the left one, a positive cant raises the left rail. The curve of the other hand has negative
curvature and cant, and is the mirror image (y, phi, psi) -> (-y, -phi, -psi).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from railenv.equations.functions import Scalar

COORDINATES = ("y", "z", "phi", "psi")
"""Coordinates of one body, in the order of the state vector."""


class Running(NamedTuple):
    """Running conditions: speed (m/s), curvature (1/m) and cant angle (rad)."""

    speed: Scalar
    curvature: Scalar
    cant: Scalar


class Motion(NamedTuple):
    """Displacements (m, rad) and velocities (m/s, rad/s) of one body."""

    y: Scalar
    z: Scalar
    phi: Scalar
    psi: Scalar
    dy: Scalar
    dz: Scalar
    dphi: Scalar
    dpsi: Scalar


class Rail(NamedTuple):
    """Track irregularity under a wheelset: rail displacement y_t, z_t (m), cross-level phi_t (rad)."""

    align: Scalar
    vert: Scalar
    cross: Scalar


AT_REST = Motion(*[0.0] * 8)
"""A body that does not move, such as the frame that the dual wheelset is suspended from."""


def bodies(x: Sequence[Scalar]) -> list[Motion]:
    """Split a state vector (all coordinates, then all rates) into the motions of its bodies."""
    n = len(x) // 2
    return [Motion(*x[i : i + 4], *x[n + i : n + i + 4]) for i in range(0, n, 4)]


def state_names(body_names: Sequence[str]) -> tuple[str, ...]:
    """Names of the states of some bodies: ``y_w1, z_w1, ...`` then ``dy_w1, dz_w1, ...``."""
    coordinates = [f"{c}_{body}" for body in body_names for c in COORDINATES]
    return (*coordinates, *(f"d{name}" for name in coordinates))


def irregularity_names(wheelsets: Sequence[str]) -> tuple[str, ...]:
    """Names of the irregularity inputs: ``align_w1, align_w2, vert_w1, ...``."""
    return tuple(f"{kind}_{w}" for kind in Rail._fields for w in wheelsets)


def rails(u: Sequence[Scalar]) -> list[Rail]:
    """Split irregularity inputs (ordered as :func:`irregularity_names`) into one Rail per wheelset."""
    n = len(u) // 3
    return [Rail(u[i], u[n + i], u[2 * n + i]) for i in range(n)]
