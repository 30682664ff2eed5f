"""Wheel-rail contact of one wheelset: eqs 1-5 and 9-11 of the paper, with the print's errors mended.

Subscripts L and R are the left and right wheel. Names follow the paper: xi creepage, F* and M*
Kalker's linear creep force and moment, N normal load, beta and alpha the creep saturation. What the
print has wrong, and why, is in ``docs/physics.md``. ``p`` has the numbers of the wheelset and its
contact as attributes (the fields of :class:`railenv.vehicles.elements.Wheelset`).
"""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations.coordinates import Motion, Rail, Running, Wrench
from railenv.equations.functions import Scalar, positive_part, sqrt, tan, where_positive

CREEP_FORCE_FLOOR = 1e-3
"""N, joins the magnitude of a creep force smoothly at zero creep (its derivative stays finite)."""

FLANGE_BLEND = 2e-5
"""m, width over which the flange spring sets in (its derivative stays finite)."""


class Wheel(NamedTuple):
    """What one wheel feels in its contact plane and where the contact lies.

    ``slope`` is the angle by which the contact plane rises towards the wheel's own side.
    """

    side: int  # +1 left, -1 right
    radius: Scalar  # rolling radius, m
    slope: Scalar  # rad
    normal_y: Scalar  # components of the normal load, N
    normal_z: Scalar
    normal: Scalar  # its magnitude, N
    creep_x: Scalar  # Kalker's linear creep force, N
    creep_y: Scalar
    creep_moment: Scalar  # and spin moment, N m


def wheel(side: int, w: Motion, rail: Rail, run: Running, p: Scalar) -> Wheel:
    """Return normal load (eq 4) and linear creep forces (eq 1) of the left (+1) or right (-1) wheel."""
    radius = p.wheel_radius + side * p.conicity * (w.y - rail.align)
    slope = p.conicity + side * w.phi
    normal_y, normal_z, normal = normal_load(side, slope, w, rail, p)
    creep = kalker(creepages(side, radius, w, run, p), normal_z, p)
    return Wheel(side, radius, slope, normal_y, normal_z, normal, *creep)


def normal_load(
    side: int, slope: Scalar, w: Motion, rail: Rail, p: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Return lateral and vertical component and magnitude (N) of a wheel's normal load (eq 4).

    A wheel that lifts carries no load (the print would pull it down).
    """
    a, lam = p.half_gauge, p.conicity
    # Displacements from the rails, which irregularities move: they set radius and compression only.
    y, z, phi = w.y - rail.align, w.z - rail.vert, w.phi - rail.cross
    normal_z = positive_part(-p.vertical_rail_stiffness * (z - side * (lam * y - a * phi)))
    incline = tan(slope)
    return -side * normal_z * incline, normal_z, normal_z * sqrt(1.0 + incline * incline)


class Creepage(NamedTuple):
    """Longitudinal and lateral creepage (1), and spin (1/m), of one wheel."""

    x: Scalar
    y: Scalar
    spin: Scalar


def creepages(side: int, radius: Scalar, w: Motion, run: Running, p: Scalar) -> Creepage:
    """Return the creepages of eq 1 (the print has a*psi where the rate a*psid belongs)."""
    a, lam, V = p.half_gauge, p.conicity, run.speed
    return Creepage(
        1.0 + side * a * run.curvature - radius / p.wheel_radius - side * a * w.dpsi / V,
        (w.dy + radius * w.dphi) / V - w.psi,
        w.dpsi / V - run.curvature - side * lam / p.wheel_radius,
    )


def kalker(xi: Creepage, normal_z: Scalar, p: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Return Kalker's linear creep forces (N) along x and y and the spin moment (N m), eq 1.

    A wheel without load has no creep force.
    """
    creep_x = -p.longitudinal_creep * xi.x
    creep_y = -p.lateral_creep * xi.y - p.lateral_spin_creep * xi.spin
    creep_moment = p.lateral_spin_creep * xi.y - p.spin_creep * xi.spin
    return (
        where_positive(normal_z, creep_x, 0.0),
        where_positive(normal_z, creep_y, 0.0),
        where_positive(normal_z, creep_moment, 0.0),
    )


def saturation(left: Wheel, right: Wheel, p: Scalar) -> Scalar:
    """Saturation constant alpha of a wheelset (eq 2), the cubic of the heuristic creep model.

    The cubic meets 1/beta at beta = 3 with a continuous derivative, so no blend is needed there.
    """
    beta = saturation_ratio(left, right, p)
    excess = beta - 3.0
    return where_positive(
        excess,
        1.0 / where_positive(excess, beta, 3.0),
        1.0 - beta / 3.0 + beta * beta / 27.0,
    )


def saturation_ratio(left: Wheel, right: Wheel, p: Scalar) -> Scalar:
    """Linear creep force over adhesion limit, beta, of a wheelset (eq 3).

    The ratio of the sums over both wheels, so alpha (|F*_L| + |F*_R|) <= mu (N_L + N_R) whatever one
    wheel carries.
    """
    demand = creep_magnitude(left) + creep_magnitude(right)
    load = left.normal + right.normal
    return demand / (p.friction * where_positive(load, load, 1.0))  # demand is 0 with no load at all


def creep_magnitude(wheel: Wheel) -> Scalar:
    """Magnitude |F*| (N) of the linear creep force of a wheel, 0 for a wheel that carries no load."""
    squared = wheel.creep_x * wheel.creep_x + wheel.creep_y * wheel.creep_y
    return where_positive(wheel.normal_z, sqrt(squared + CREEP_FORCE_FLOOR**2), 0.0)


def flange_force(y: Scalar, p: Scalar) -> Scalar:
    """Force (N) of the flange springs pushing back against a lateral displacement y (eq 5)."""
    return flange_spring(+1, y, p) - flange_spring(-1, y, p)


def flange_spring(side: int, y: Scalar, p: Scalar) -> Scalar:
    """Force (N), not negative, on the flange of the left (+1) or right (-1) wheel.

    A spring beyond the clearance. The printed blend multiplies the spring force and so pulls the wheel
    towards the rail just inside the clearance; this one is monotone.
    """
    d = side * y - p.flange_clearance
    return 0.5 * p.lateral_rail_stiffness * (d + sqrt(d * d + FLANGE_BLEND**2))


class RailForce(NamedTuple):
    """Force (N) and moment (N m) of the rail on one wheel, and where it acts (m)."""

    side: int
    force_x: Scalar
    force_y: Scalar  # without that on the flange
    force_z: Scalar
    moment_x: Scalar
    moment_z: Scalar
    arm_x: Scalar
    arm_y: Scalar
    arm_z: Scalar


def rail_forces(w: Motion, rail: Rail, run: Running, p: Scalar) -> tuple[RailForce, RailForce]:
    """Return the forces on the left and right wheel in the track frame (eqs 9-11)."""
    left, right = wheel(+1, w, rail, run, p), wheel(-1, w, rail, run, p)
    alpha = saturation(left, right, p)
    return rail_force(left, alpha, w, p), rail_force(right, alpha, w, p)


def rail_force(c: Wheel, alpha: Scalar, w: Motion, p: Scalar) -> RailForce:
    """Turn a wheel's contact forces, saturated by alpha, into the track frame (eqs 9-11)."""
    side, a = c.side, p.half_gauge
    return RailForce(
        side,
        # Eq 9: contact plane to track frame, for small yaw and slope; eq 10: alpha.
        force_x=alpha * (c.creep_x - c.creep_y * w.psi),
        force_y=alpha * (c.creep_y + c.creep_x * w.psi) + c.normal_y,
        force_z=side * c.creep_y * c.slope + c.normal_z,  # creep unsaturated, as printed
        moment_x=side * c.creep_moment * c.slope * w.psi,  # unsaturated, as printed
        moment_z=alpha * c.creep_moment,
        # Eq 11: from the wheelset's centre to the contact.
        arm_x=-side * a * w.psi,
        arm_y=side * a + c.radius * w.phi,
        arm_z=side * a * w.phi - c.radius,
    )


def contact(w: Motion, rail: Rail, run: Running, p: Scalar) -> Wrench:
    """Sum the contact forces of both wheels about the wheelset's centre (their part of eq 6).

    The flange pushes at axle height: as printed, it enters the lateral equation only.
    """
    left, right = rail_forces(w, rail, run, p)
    return Wrench(
        force_y=left.force_y + right.force_y - flange_force(w.y - rail.align, p),
        force_z=left.force_z + right.force_z,
        roll=_roll_moment(left) + _roll_moment(right),
        yaw=_yaw_moment(left) + _yaw_moment(right),
    )


def _roll_moment(f: RailForce) -> Scalar:
    return f.arm_y * f.force_z - f.arm_z * f.force_y + f.moment_x


def _yaw_moment(f: RailForce) -> Scalar:
    return f.arm_x * f.force_y - f.arm_y * f.force_x + f.moment_z
