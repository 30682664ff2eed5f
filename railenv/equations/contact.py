"""Wheel-rail contact of one wheelset: eqs 1-5 and 9-11 of the paper, with the print's errors mended.

Names follow the paper: xi creepage, F* and M* Kalker's linear creep force and moment, N normal load,
beta and alpha the creep saturation. What the print has wrong, and why, is in ``docs/physics.md``.
``p`` has the numbers of the wheelset as attributes (the fields of
:class:`railenv.vehicles.elements.Wheelset`), and ``p.left`` and ``p.right`` those of the contact law of
each wheel with the law itself, a :class:`railenv.equations.shapes.Law`.
"""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations import creep
from railenv.equations.coordinates import Motion, Rail, Running, Wrench
from railenv.equations.functions import (
    Scalar,
    exp,
    log,
    positive_part,
    sqrt,
    where_positive,
)
from railenv.equations.shapes import Touch, direction

CREEP_FORCE_FLOOR = 1e-3
"""N, joins the magnitude of a creep force smoothly at zero creep (its derivative stays finite)."""

FLANGE_BLEND = 2e-5
"""m, width over which the flange spring sets in (its derivative stays finite)."""


class Point(NamedTuple):
    """Where and how one wheel touches its rail.

    ``incline`` is the tangent of the slope by which the contact plane rises towards the wheel's side,
    ``stretch`` the length along the plane over that across the track.
    """

    side: int  # +1 left, -1 right
    law: Scalar  # numbers of the contact law
    anchor: (
        Scalar  # lateral place and depth below the axle of the point of the rail that eta follows, m
    )
    level: Scalar
    touch: Touch
    compression: Scalar  # of the rail, m; negative where the wheel has lifted
    radius: Scalar  # rolling radius, m
    incline: Scalar
    stretch: Scalar
    arm: Scalar  # lateral place of the contact from the wheelset's centre, m


def point(side: int, w: Motion, rail: Rail, p: Scalar) -> Point:
    """Return the contact of the left (+1) or right (-1) wheel.

    Irregularities move the rails: sideways by y_t, up by z_t on both sides and by a phi_t on the left.
    """
    law = p.left if side > 0 else p.right
    anchor, level = reference(law, p)
    y = w.y - rail.align
    eta = side * (y + level * w.phi) + 0.5 * anchor * (w.phi * w.phi - w.psi * w.psi)
    touch = law.law.touch(law, eta)
    incline = touch.slope + side * w.phi
    stretch = sqrt(1.0 + incline * incline)
    wheel_rise = w.z + side * anchor * w.phi - touch.height - y * w.phi - 0.5 * level * w.phi * w.phi
    rail_rise = rail.vert + side * p.half_gauge * rail.cross
    return Point(
        side,
        law,
        anchor,
        level,
        touch,
        compression=rail_rise - wheel_rise,
        radius=p.wheel_radius + side * 0.5 * p.radius_difference + touch.radius,
        incline=incline,
        stretch=stretch,
        arm=side * (p.half_gauge + place(touch, incline, stretch, law)) - y,
    )


def reference(law: Scalar, p: Scalar) -> tuple[Scalar, Scalar]:
    """Return lateral place and depth (m) below the axle of the point of the rail that eta follows.

    That is the contact at eta = 0, or the centre of the rail's head where that is an arc.
    """
    if not law.law.round_rail:
        return p.half_gauge, p.wheel_radius
    sine, cosine = direction(law)
    head = law.rail_profile_radius
    return p.half_gauge + head * sine, p.wheel_radius + head * cosine


def place(touch: Touch, incline: Scalar, stretch: Scalar, law: Scalar) -> Scalar:
    """Return the place of the contact on the rail, outwards from that at eta = 0 (m).

    The steeper the contact plane, the further inwards it lies on a round head.
    """
    if not law.law.round_rail:
        return touch.place
    return law.rail_profile_radius * (direction(law)[0] - incline / stretch)


class Normal(NamedTuple):
    """The normal contact of one wheel: exact derivatives of the potential K c^2 / 2.

    ``yaw`` is the moment on a wheelset that runs askew.
    """

    vertical: Scalar  # N_z, N
    lateral: Scalar  # N_y, N
    roll: Scalar  # N m, about the wheelset's centre
    yaw: Scalar  # N m
    magnitude: Scalar  # N, N


def normal_contact(c: Point, w: Motion, rail: Rail, p: Scalar) -> Normal:
    """Return the forces of the normal contact (eq 4), the derivative of its potential.

    A wheel that lifts carries no load (the print would pull it down).
    """
    load = positive_part(p.vertical_rail_stiffness * c.compression)
    thrust = load * c.touch.slope  # of the potential, along eta
    y = w.y - rail.align
    over = load * (c.side * c.anchor - y - c.level * w.phi)
    return Normal(
        vertical=load,
        lateral=-c.side * thrust - load * w.phi,
        roll=over - thrust * (c.side * c.level + c.anchor * w.phi),
        yaw=thrust * c.anchor * w.psi,
        magnitude=load * c.stretch,
    )


class Creepage(NamedTuple):
    """Longitudinal and lateral creepage (1), and spin (1/m), of one wheel in its contact plane."""

    x: Scalar
    y: Scalar
    spin: Scalar


def creepages(c: Point, w: Motion, run: Running, p: Scalar) -> Creepage:
    """Return the creepages of eq 1 (the print has a*psi where the rate a*psid belongs).

    The wheel follows its rail up and down, so along the contact plane it moves faster than across the
    track.
    """
    turning = w.dpsi / run.speed - run.curvature
    return Creepage(
        1.0 - c.radius / p.wheel_radius - c.arm * turning,
        ((w.dy + c.radius * w.dphi) / run.speed - w.psi) * c.stretch,
        (turning - c.side * c.touch.slope / c.radius) / c.stretch,
    )


class Wheel(NamedTuple):
    """What one wheel feels: its contact, normal load, and Kalker's linear creep force and moment."""

    point: Point
    normal: Normal
    creep_x: Scalar  # N
    creep_y: Scalar
    creep_moment: Scalar  # N m


def wheel(side: int, w: Motion, rail: Rail, run: Running, p: Scalar) -> Wheel:
    """Return normal load (eq 4) and linear creep forces (eq 1) of the left (+1) or right (-1) wheel."""
    found = point(side, w, rail, p)
    normal = normal_contact(found, w, rail, p)
    return Wheel(found, normal, *kalker(creepages(found, w, run, p), normal, p))


def kalker(xi: Creepage, normal: Normal, p: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Return Kalker's linear creep forces (N) along x and y and the spin moment (N m), eq 1.

    A wheel without load has no creep force.
    """
    size = growth(normal, p)  # of the contact ellipse; its axes go with the third root of the load
    force, coupling = size * size, size * size * size
    creep_x = -p.longitudinal_creep * force * xi.x
    creep_y = -p.lateral_creep * force * xi.y - p.lateral_spin_creep * coupling * xi.spin
    creep_moment = p.lateral_spin_creep * coupling * xi.y - p.spin_creep * force * force * xi.spin
    load = normal.vertical
    return (
        where_positive(load, creep_x, 0.0),
        where_positive(load, creep_y, 0.0),
        where_positive(load, creep_moment, 0.0),
    )


def growth(normal: Normal, p: Scalar) -> Scalar:
    """Return by which factor the axes of the contact ellipse differ from those at the load given.

    1 where the creep coefficients are constants (no ``creep_load``).
    """
    if p.creep_load is None:
        return 1
    load = normal.magnitude
    return exp(log(where_positive(load, load, p.creep_load) / p.creep_load) / 3.0)


def saturation(left: Wheel, right: Wheel, p: Scalar) -> tuple[Scalar, Scalar]:
    """Return the saturation constants alpha of both wheels (eqs 2 and 3).

    One for both, as printed: the ratio of the sums over both wheels, so that alpha (|F*_L| + |F*_R|)
    <= mu (N_L + N_R) whatever one wheel carries. Or one for each wheel.
    """
    if p.saturation_of == "wheel":
        return share([left], p), share([right], p)
    both = share([left, right], p)
    return both, both


def share(wheels: list[Wheel], p: Scalar) -> Scalar:
    """Return alpha of some wheels together."""
    beta = saturation_ratio(wheels, p)
    if p.saturation == "polach":
        return creep.polach(beta, p.polach_adhesion, p.polach_slip)
    return creep.heuristic(beta)


def saturation_ratio(wheels: list[Wheel], p: Scalar) -> Scalar:
    """Return linear creep force over adhesion limit, beta (eq 3), of some wheels together."""
    demand = sum(creep_magnitude(c) for c in wheels)
    load = sum(c.normal.magnitude for c in wheels)
    # without load there is no creep force, and any value does
    return where_positive(load, demand, 1.0) / (p.friction * where_positive(load, load, 1.0))


def creep_magnitude(wheel: Wheel) -> Scalar:
    """Magnitude |F*| (N) of the linear creep force of a wheel, 0 for a wheel that carries no load."""
    squared = wheel.creep_x * wheel.creep_x + wheel.creep_y * wheel.creep_y
    return where_positive(wheel.normal.vertical, sqrt(squared + CREEP_FORCE_FLOOR**2), 0.0)


def flange_force(y: Scalar, p: Scalar) -> Scalar:
    """Force (N) of the flange springs pushing back against a lateral displacement y (eq 5)."""
    return flange_spring(+1, y, p) - flange_spring(-1, y, p)


def flange_spring(side: int, y: Scalar, p: Scalar) -> Scalar:
    """Force (N), not negative, on the flange of the left (+1) or right (-1) wheel.

    A spring beyond the clearance. The printed blend multiplies the spring force and so pulls the wheel
    towards the rail just inside the clearance; this one is monotone. Where the profile has a flange
    there is no spring.
    """
    if (p.left if side > 0 else p.right).law.has_flange:
        return 0
    d = side * y - p.flange_clearance
    return 0.5 * p.lateral_rail_stiffness * (d + sqrt(d * d + FLANGE_BLEND**2))


class RailForce(NamedTuple):
    """Force (N) and moment (N m) of the rail on one wheel, about the wheelset's centre."""

    side: int
    force_x: Scalar
    force_y: Scalar  # without that on the flange
    force_z: Scalar
    roll: Scalar
    yaw: Scalar


def rail_forces(w: Motion, rail: Rail, run: Running, p: Scalar) -> tuple[RailForce, RailForce]:
    """Return the forces on the left and right wheel in the track frame (eqs 9-11)."""
    left, right = wheel(+1, w, rail, run, p), wheel(-1, w, rail, run, p)
    alphas = saturation(left, right, p)
    return rail_force(left, alphas[0], w, p), rail_force(right, alphas[1], w, p)


def rail_force(c: Wheel, alpha: Scalar, w: Motion, p: Scalar) -> RailForce:
    """Turn a wheel's contact forces, saturated by alpha, into the track frame (eqs 9-11).

    The print leaves the creep parts of F_z and M_x unsaturated; here all creep is saturated.
    """
    at, normal = c.point, c.normal
    # Eq 10: alpha; eq 9: contact plane to track frame, for small yaw.
    along = alpha * c.creep_x
    across, moment = alpha * c.creep_y / at.stretch, alpha * c.creep_moment / at.stretch
    force_x = along - across * w.psi
    force_y = across + along * w.psi
    force_z = at.side * across * at.incline
    moment_x = at.side * moment * at.incline * w.psi
    # Eq 11: from the wheelset's centre to the contact.
    arm_x, arm_y, arm_z = -at.side * p.half_gauge * w.psi, at.arm, -at.radius
    return RailForce(
        at.side,
        force_x=force_x,
        force_y=force_y + normal.lateral,
        force_z=force_z + normal.vertical,
        roll=arm_y * force_z - arm_z * force_y + moment_x + normal.roll,
        yaw=arm_x * force_y - arm_y * force_x + moment + normal.yaw,
    )


def contact(w: Motion, rail: Rail, run: Running, p: Scalar) -> Wrench:
    """Sum the contact forces of both wheels about the wheelset's centre (their part of eq 6).

    The flange spring pushes at axle height: as printed, it enters the lateral equation only.
    """
    left, right = rail_forces(w, rail, run, p)
    return Wrench(
        force_y=left.force_y + right.force_y - flange_force(w.y - rail.align, p),
        force_z=left.force_z + right.force_z,
        roll=left.roll + right.roll,
        yaw=left.yaw + right.yaw,
    )
