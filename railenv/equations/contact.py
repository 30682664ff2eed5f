"""Wheel-rail contact of one wheelset: eqs 1-5 and 9-11 of the paper, with the print's errors mended.

Subscripts L and R are the left and right wheel. Names follow the paper: xi creepage, F* and M*
Kalker's linear creep force and moment, N normal load, beta and alpha the creep saturation. What the
print has wrong, and why, is in ``docs/physics.md``.
"""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations.coordinates import Motion, Rail, Running
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


class WheelsetContact(NamedTuple):
    """Resultant of all contact forces on a wheelset about its centre (N, N m)."""

    force_y: Scalar
    force_z: Scalar
    moment_roll: Scalar
    moment_yaw: Scalar


def wheel(side: int, w: Motion, rail: Rail, run: Running, p: Scalar) -> Wheel:
    """Return normal load (eq 4) and linear creep forces (eq 1) of the left (+1) or right (-1) wheel."""
    a, lam, V = p.half_gauge, p.conicity, run.speed
    # Displacements from the rails, which irregularities move: they set radius and compression only.
    y, z, phi = w.y - rail.align, w.z - rail.vert, w.phi - rail.cross
    radius = p.wheel_radius + side * lam * y
    slope = lam + side * w.phi

    # Eq 4. A wheel that lifts carries no load (the print would pull it down).
    normal_z = positive_part(-p.vertical_rail_stiffness * (z - side * (lam * y - a * phi)))
    incline = tan(slope)
    normal_y = -side * normal_z * incline
    normal = normal_z * sqrt(1.0 + incline * incline)

    # Creepages, and eq 1 (the print has a*psi where the rate a*psid belongs).
    xi_x = 1.0 + side * a * run.curvature - radius / p.wheel_radius - side * a * w.dpsi / V
    xi_y = (w.dy + radius * w.dphi) / V - w.psi
    xi_s = w.dpsi / V - run.curvature - side * lam / p.wheel_radius
    creep_x = -p.longitudinal_creep * xi_x
    creep_y = -p.lateral_creep * xi_y - p.lateral_spin_creep * xi_s
    creep_moment = p.lateral_spin_creep * xi_y - p.spin_creep * xi_s
    # A wheel without load has no creep force.
    creep_x, creep_y, creep_moment = (
        where_positive(normal_z, force, 0.0) for force in (creep_x, creep_y, creep_moment)
    )
    return Wheel(side, radius, slope, normal_y, normal_z, normal, creep_x, creep_y, creep_moment)


def saturation(left: Wheel, right: Wheel, p: Scalar) -> Scalar:
    """Saturation constant alpha of a wheelset (eqs 2-3), the cubic of the heuristic creep model.

    beta is the ratio of the sums over both wheels, so alpha (|F*_L| + |F*_R|) <= mu (N_L + N_R)
    whatever one wheel carries. The cubic meets 1/beta at beta = 3 with a continuous derivative, so
    no blend is needed there.
    """
    demand = creep_magnitude(left) + creep_magnitude(right)
    load = left.normal + right.normal
    beta = demand / (p.friction * where_positive(load, load, 1.0))  # demand is 0 with no load at all
    excess = beta - 3.0
    return where_positive(
        excess,
        1.0 / where_positive(excess, beta, 3.0),
        1.0 - beta / 3.0 + beta * beta / 27.0,
    )


def creep_magnitude(wheel: Wheel) -> Scalar:
    """Magnitude |F*| (N) of the linear creep force of a wheel, 0 for a wheel that carries no load."""
    squared = wheel.creep_x * wheel.creep_x + wheel.creep_y * wheel.creep_y
    return where_positive(wheel.normal_z, sqrt(squared + CREEP_FORCE_FLOOR**2), 0.0)


def flange_force(y: Scalar, p: Scalar) -> Scalar:
    """Force (N) of the flange spring pushing against a lateral displacement y (eq 5).

    A dead band of +-clearance. The printed blend multiplies the spring force and so pulls the wheel
    towards the rail just inside the clearance; this one is monotone.
    """

    def spring(d: Scalar) -> Scalar:
        return 0.5 * p.lateral_rail_stiffness * (d + sqrt(d * d + FLANGE_BLEND**2))

    return spring(y - p.flange_clearance) - spring(-y - p.flange_clearance)


def contact(w: Motion, rail: Rail, run: Running, p: Scalar) -> WheelsetContact:
    """Sum the contact forces of both wheels and the flange (eqs 9-11, and their part of eq 6)."""
    left, right = wheel(+1, w, rail, run, p), wheel(-1, w, rail, run, p)
    alpha = saturation(left, right, p)
    force_y = -flange_force(w.y - rail.align, p)
    force_z = moment_roll = moment_yaw = 0.0
    for c in (left, right):
        side = c.side
        # Eq 9: contact plane to track frame, for small yaw and slope.
        F_x = alpha * (c.creep_x - c.creep_y * w.psi)
        F_y = alpha * (c.creep_y + c.creep_x * w.psi)
        F_z = side * c.creep_y * c.slope  # unsaturated, as printed
        M_x = side * c.creep_moment * c.slope * w.psi  # unsaturated, as printed
        M_z = alpha * c.creep_moment
        # Eq 11: from the wheelset's centre to the contact.
        R_x = -side * p.half_gauge * w.psi
        R_y = side * p.half_gauge + c.radius * w.phi
        R_z = side * p.half_gauge * w.phi - c.radius
        force_y += F_y + c.normal_y
        force_z += F_z + c.normal_z
        moment_roll += R_y * (F_z + c.normal_z) - R_z * (F_y + c.normal_y) + M_x
        moment_yaw += R_x * (F_y + c.normal_y) - R_y * F_x + M_z
    return WheelsetContact(force_y, force_z, moment_roll, moment_yaw)
