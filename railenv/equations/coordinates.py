"""Coordinates, running conditions and rail displacements that the equations of motion share.

The frame of reference runs along the track centre line at the forward speed: x forward, y to the
left, z up; phi is roll (about x), psi is yaw (about z). A positive curvature is the curve whose outer
rail is the left one, a positive cant raises the left rail. The curve of the other hand has negative
curvature and cant, and is the mirror image (y, phi, psi) -> (-y, -phi, -psi).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from railenv.equations.functions import Scalar

COORDINATES = ("y", "z", "phi", "theta", "psi")
"""Coordinates that a body may have, in the order of the state vector."""

GROUND = "ground"
"""Name of the track frame where something is attached to no body."""


class Running(NamedTuple):
    """Running conditions: speed (m/s), curvature (1/m), cant angle (rad), and their slopes.

    On a transition each body has those of its own place; ``curvature_slope`` (1/m^2) and ``cant_slope``
    (rad/m) say how curvature and cant change along the track there.
    """

    speed: Scalar
    curvature: Scalar
    cant: Scalar
    curvature_slope: Scalar = 0
    cant_slope: Scalar = 0


class Site(NamedTuple):
    """How the track at a body's place differs from that at the vehicle's origin (see Running)."""

    curvature: Scalar = 0
    curvature_slope: Scalar = 0
    cant: Scalar = 0
    cant_slope: Scalar = 0


def at_site(run: Running, site: Site) -> Running:
    """Return the running conditions at a body's own place."""
    return Running(
        run.speed,
        run.curvature + site.curvature,
        run.cant + site.cant,
        run.curvature_slope + site.curvature_slope,
        run.cant_slope + site.cant_slope,
    )


def site_names(bodies: Sequence[str]) -> tuple[str, ...]:
    """Names of the numbers of the sites of some bodies: ``curvature_at_w1, ...``."""
    return tuple(f"{part}_at_{body}" for body in bodies for part in Site._fields)


class Motion(NamedTuple):
    """Displacements (m, rad) and velocities (m/s, rad/s) of one body.

    Coordinates that a body does not have are zero, such as the pitch theta of a wheelset.
    """

    y: Scalar
    z: Scalar
    phi: Scalar
    psi: Scalar
    dy: Scalar
    dz: Scalar
    dphi: Scalar
    dpsi: Scalar
    theta: Scalar = 0
    dtheta: Scalar = 0


class Wrench(NamedTuple):
    """Force (N) and moment (N m) along and about x, y and z, about a point that the user says."""

    force_x: Scalar = 0
    force_y: Scalar = 0
    force_z: Scalar = 0
    roll: Scalar = 0
    pitch: Scalar = 0
    yaw: Scalar = 0


class Rail(NamedTuple):
    """Track irregularity under a wheelset: rail displacement y_t, z_t (m), cross-level phi_t (rad)."""

    align: Scalar
    vert: Scalar
    cross: Scalar


AT_REST = Motion(*[0] * 8)
"""A body that does not move, such as the frame that the dual wheelset is suspended from."""


def total(wrenches: Sequence[Wrench]) -> Wrench:
    """Return the sum of wrenches about one point."""
    return Wrench(*(sum(parts) for parts in zip(*wrenches, strict=True))) if wrenches else Wrench()


def state_names(bodies: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Names of the states of some bodies: ``y_w1, z_w1, ...`` then ``dy_w1, dz_w1, ...``.

    Parameters
    ----------
    bodies : mapping of str to sequence of str
        Coordinates of each body, by its name.
    """
    coordinates = [f"{c}_{body}" for body, own in bodies.items() for c in own]
    return (*coordinates, *(f"d{name}" for name in coordinates))


def motions(x: Sequence[Scalar], bodies: Mapping[str, Sequence[str]]) -> dict[str, Motion]:
    """Split a state vector (all coordinates, then all rates, then the rest) into motions of bodies."""
    n = sum(len(own) for own in bodies.values())
    found, first = {}, 0
    for body, own in bodies.items():
        places = range(first, first + len(own))
        values = {c: x[i] for c, i in zip(own, places, strict=True)}
        rates = {f"d{c}": x[n + i] for c, i in zip(own, places, strict=True)}
        found[body] = AT_REST._replace(**values, **rates)
        first += len(own)
    return found


def irregularity_names(wheelsets: Sequence[str]) -> tuple[str, ...]:
    """Names of the irregularity inputs: ``align_w1, align_w2, vert_w1, ...``."""
    return tuple(f"{kind}_{w}" for kind in Rail._fields for w in wheelsets)


def rails(u: Sequence[Scalar]) -> list[Rail]:
    """Split irregularity inputs (ordered as :func:`irregularity_names`) into one Rail per wheelset."""
    n = len(u) // 3
    return [Rail(u[i], u[n + i], u[2 * n + i]) for i in range(n)]
