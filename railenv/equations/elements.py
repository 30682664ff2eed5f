"""Force elements of a vehicle: each acts between two bodies, with equal and opposite forces.

An element sees the motion of its attachment on body B against that on body A (:class:`Relative`) and
gives the wrench on A about the attachment; B receives the opposite (:func:`on_bodies`), so action =
reaction holds in any vehicle. ``e`` has the element's numbers as attributes
(:mod:`railenv.vehicles.elements` declares them). ``e.pair`` elements stand twice, at +-``e.y``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from railenv.equations.coordinates import Motion, Running, Wrench
from railenv.equations.functions import Scalar, sqrt, table, where_positive


class Relative(NamedTuple):
    """Displacement (m, rad) and velocity (m/s, rad/s) of B's attachment point against A's."""

    x: Scalar
    y: Scalar
    z: Scalar
    roll: Scalar
    pitch: Scalar
    yaw: Scalar
    dx: Scalar
    dy: Scalar
    dz: Scalar
    droll: Scalar
    dpitch: Scalar
    dyaw: Scalar


class Arm(NamedTuple):
    """Place of an attachment in a body, from its centre of mass (m)."""

    x: Scalar
    y: Scalar
    z: Scalar


Action = tuple[Wrench, list[Scalar]]
"""Wrench on A about the attachment, and the time derivatives of the element's own states."""


# --------------------------------------------------------------------------- attachments


def point(arm: Arm, m: Motion) -> tuple[list[Scalar], list[Scalar]]:
    """Displacements and velocities of a body's point, then the body's rotations, for small angles."""
    here = [
        arm.z * m.theta - arm.y * m.psi,
        m.y + arm.x * m.psi - arm.z * m.phi,
        m.z + arm.y * m.phi - arm.x * m.theta,
        m.phi,
        m.theta,
        m.psi,
    ]
    rate = [
        arm.z * m.dtheta - arm.y * m.dpsi,
        m.dy + arm.x * m.dpsi - arm.z * m.dphi,
        m.dz + arm.y * m.dphi - arm.x * m.dtheta,
        m.dphi,
        m.dtheta,
        m.dpsi,
    ]
    return here, rate


class End(NamedTuple):
    """One end of an element: its arm in the body, the body's motion, and the track at its place."""

    arm: Arm
    motion: Motion
    run: Running


def relative(a: End, b: End, height: Scalar, counts: Scalar) -> Relative:
    """Return how B's attachment moves against A's.

    Each body's coordinates are measured from the track at its own place, and the track of B differs
    from that of A: it is turned, displaced and, on a cant ramp, twisted (:func:`track_between`).

    Parameters
    ----------
    a, b : End
    height : float
        Of the attachment above the rails, m.
    counts : float
        1 where the track turns between bodies, 0 where it does not (as in the paper).
    """
    here_a, rate_a = point(a.arm, a.motion)
    here_b, rate_b = point(b.arm, b.motion)
    place, rates = track_between(a, b, height)
    return Relative(
        *(q - p + counts * t for p, q, t in zip(here_a, here_b, place, strict=True)),
        *(q - p + counts * t for p, q, t in zip(rate_a, rate_b, rates, strict=True)),
    )


def track_between(a: End, b: End, height: Scalar) -> tuple[list[Scalar], list[Scalar]]:
    """Return how B's attachment stands against A's where both bodies are in the middle of the track.

    Displacements and rotations, then their rates. Curvature and cant are linear between the two
    places: B's track is turned by the integral of the curvature, displaced by what it departs from A's
    tangent, and rolled by the difference of the cants, about the middle between the rails. The turn and
    the roll move what is off the middle.
    """
    x_a, x_b = a.arm.x, b.arm.x
    k_a, k_b = a.run.curvature, b.run.curvature
    between = x_a - x_b  # how far B lies ahead
    turn, twist = (k_a + k_b) / 2 * between, b.run.cant - a.run.cant
    cubic = (x_a + x_b) * (k_b * x_a - k_a * x_b)
    aside = (2 * k_b * x_b * x_b - 2 * k_a * x_a * x_a - cubic) / 6
    V = a.run.speed
    turning, twisting = V * (k_b - k_a), V * (b.run.cant_slope - a.run.cant_slope)
    shifting = -turning * (x_a + x_b) / 2
    y = b.arm.y
    return (
        [turn * y, aside - twist * height, twist * y, twist, 0, -turn],
        [turning * y, shifting - twisting * height, twisting * y, twisting, 0, -turning],
    )


def lean(a: End, b: End, r: Relative) -> Relative:
    """Return the same with the vertical stretch to second order, as bodies that have moved see it.

    Points above or below a body's centre sink as it rolls and pitches, and the vertical is that of the
    two bodies between them: it leans as they do on average.
    """
    roll, pitch = a.motion.phi + r.roll / 2, a.motion.theta + r.pitch / 2
    rolling, pitching = a.motion.dphi + r.droll / 2, a.motion.dtheta + r.dpitch / 2
    z, dz = r.z - roll * r.y + pitch * r.x, r.dz - rolling * r.y + pitching * r.x
    dz = dz - roll * r.dy + pitch * r.dx
    for end, sign in ((a, 1), (b, -1)):
        height, m = sign * end.arm.z, end.motion
        z = z + height * (m.phi * m.phi + m.theta * m.theta) / 2
        dz = dz + height * (m.phi * m.dphi + m.theta * m.dtheta)
    return r._replace(z=z, dz=dz)


def where_moved_to(a: End, b: End, r: Relative, force: Scalar) -> tuple[Wrench, Wrench]:
    """Return what a vertical force (N) on A does beyond itself as it acts where bodies have moved to.

    It stands in the middle between the two attachments, which have shifted against each other, and
    leans as :func:`lean` says, of whose stretch these are the derivatives: so a body that moves aside
    bears on what carries it there, and tilts it. On A and B, about the attachments.
    """
    roll, pitch = a.motion.phi + r.roll / 2, a.motion.theta + r.pitch / 2
    aside, along = Wrench(force_x=force * pitch, force_y=-force * roll), (r.y / 2, r.x / 2)
    on_a = aside._replace(
        roll=force * (along[0] - a.arm.z * a.motion.phi),
        pitch=-force * (along[1] + a.arm.z * a.motion.theta),
    )
    on_b = opposite(aside)._replace(
        roll=force * (along[0] + b.arm.z * b.motion.phi),
        pitch=force * (b.arm.z * b.motion.theta - along[1]),
    )
    return on_a, on_b


def at_centre(arm: Arm, f: Wrench) -> Wrench:
    """Return a wrench at an attachment as the same about the body's centre of mass."""
    return Wrench(
        f.force_x,
        f.force_y,
        f.force_z,
        f.roll + arm.y * f.force_z - arm.z * f.force_y,
        f.pitch + arm.z * f.force_x - arm.x * f.force_z,
        f.yaw + arm.x * f.force_y - arm.y * f.force_x,
    )


def opposite(f: Wrench) -> Wrench:
    """Return the reaction to a wrench."""
    return Wrench(*(-part for part in f))


# ----------------------------------------------------------------- springs and dampers


def spring(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Linear springs with viscous damping in parallel along the three axes; one, or a pair.

    A pair is evaluated as a whole: what two springs at +-y do to the middle between them.
    """
    count, arm = (2, e.y) if e.pair else (1, 0)
    return Wrench(
        force_x=count * (e.k_x * r.x + e.c_x * r.dx),
        force_y=count * (e.k_y * r.y + e.c_y * r.dy),
        force_z=count * (e.k_z * r.z + e.c_z * r.dz),
        roll=count * (arm * arm * (e.k_z * r.roll + e.c_z * r.droll) + e.k_roll * r.roll),
        pitch=count * e.k_pitch * r.pitch,
        yaw=count * (arm * arm * (e.k_x * r.yaw + e.c_x * r.dyaw) + e.k_yaw * r.yaw),
    ), []


def damper(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Damper along one axis: a constant times the speed, or a table of force over speed."""
    speeds = [v for _, v in _stretch(e, r)]
    forces = [e.c * v if e.force is None else table(e.force, v) for v in speeds]
    return _along(e, forces), []


def series_damper(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Damper on a rubber end (Maxwell): its state is the damper's own stretch (m).

    The rubber carries ``k (stretch of both - state)``; the damper moves as fast as that force drives
    it: by its constant, or by its table, which is read the other way round, speed over force.
    """
    forces = [e.k * (both - own) for (both, _), own in zip(_stretch(e, r), q, strict=True)]
    rates = [f / e.c if e.force is None else table(e.force, f) for f in forces]
    return _along(e, forces), rates


def stop(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Bump stop along one axis: no force within its clearance, a table of force beyond it."""
    return _along(e, [table(e.force, d) for d, _ in _stretch(e, r)]), []


def roll_bar(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Anti-roll bar: a moment against the roll of one body on the other."""
    return Wrench(roll=e.k * r.roll + e.c * r.droll), []


def traction_rod(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Longitudinal rod between two bodies, with rubber in its ends."""
    return Wrench(force_x=e.k * r.x + e.c * r.dx), []


def friction(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Dry friction along one axis, made smooth: ``force * v / sqrt(v^2 + width^2)``."""
    forces = [e.force * v / sqrt(v * v + e.width * e.width) for _, v in _stretch(e, r)]
    return _along(e, forces), []


def _sides(e: Scalar) -> tuple[int, ...]:
    return (+1, -1) if e.pair else (0,)


def stretch(side: Scalar, e: Scalar, r: Relative) -> tuple[Scalar, Scalar]:
    """Stretch (m) and its rate (m/s) along the element's axis, at ``side * e.y`` from the middle."""
    arm = side * e.y
    along = {
        "x": (r.x - arm * r.yaw, r.dx - arm * r.dyaw),
        "y": (r.y, r.dy),
        "z": (r.z + arm * r.roll, r.dz + arm * r.droll),
    }
    return along[e.axis]


def _stretch(e: Scalar, r: Relative) -> list[tuple[Scalar, Scalar]]:
    """Stretch and its rate on each side of a pair."""
    return [stretch(side, e, r) for side in _sides(e)]


def _along(e: Scalar, forces: Sequence[Scalar]) -> Wrench:
    """Sum forces (N) along the element's axis, on each side of a pair, at the middle."""
    sum_of = sum(forces)
    moment = sum(side * e.y * f for side, f in zip(_sides(e), forces, strict=True))
    if e.axis == "x":
        return Wrench(force_x=sum_of, yaw=-moment)
    if e.axis == "y":
        return Wrench(force_y=sum_of)
    return Wrench(force_z=sum_of, roll=moment)


# -------------------------------------------------------------- the paper's yaw damper


def yaw_damper_force(v: Scalar, e: Scalar) -> Scalar:
    """Longitudinal force (N) of the paper's nonlinear yaw damper at the speed v, m/s (eq 7).

    A quartic polynomial for v > 0 and its odd extension for v < 0.
    """
    odd = v * (e.c1 + e.c3 * v * v)
    even = v * v * (e.c2 + e.c4 * v * v)
    return odd + where_positive(v, even, -even)


def yaw_damper(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Yaw damper of the paper (eq 8): its force at the arm ``e.y`` resists A's yaw rate."""
    return Wrench(yaw=-e.y * yaw_damper_force(-e.y * r.dyaw, e)), []


# ---------------------------------------------------------------------- driven elements


def yaw_moment(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Moment (N m) about z that an input gives: on A, and its reaction on B."""
    return Wrench(yaw=u[0]), []


def lateral_force(e: Scalar, r: Relative, q: Sequence[Scalar], u: Sequence[Scalar]) -> Action:
    """Force (N) along y that an input gives: on A, and its reaction on B."""
    return Wrench(force_y=u[0]), []
