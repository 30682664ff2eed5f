"""The contact of a conical wheelset with its rails, written out wheel by wheel.

The normal forces are the derivatives of the energy in the rails, taken by complex step; the creep
forces are vectors in the contact planes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from railenv.equations.coordinates import Motion, Rail, Running

STEP = 1e-30
CREEP_FORCE_FLOOR = 1e-3  # N
FLANGE_BLEND = 2e-5  # m


class ContactForce(NamedTuple):
    """Force (N) and moment (N m) of the rails on a wheelset, about its centre."""

    force_y: float
    force_z: float
    roll: float
    yaw: float


def shift(s, y, phi, psi, p):
    """Shift (m) of the wheel on side s towards its flange: at rail level, and by the turned axle."""
    return s * y + s * p.wheel_radius * phi + p.half_gauge * (phi**2 - psi**2) / 2.0


def compression(s, y, z, phi, psi, rail, p):
    """Vertical compression (m) of the rail on side s; ``y`` is relative to the rails."""
    lift = p.conicity * shift(s, y, phi, psi, p)
    tilt = y * phi + p.wheel_radius * phi**2 / 2.0
    return rail.vert + s * p.half_gauge * rail.cross - (z + s * p.half_gauge * phi - lift - tilt)


def energy(q, rail, p):
    """Energy (J) in the rails under both wheels."""
    parts = [compression(s, *q, rail, p) for s in (+1, -1)]
    return sum(p.vertical_rail_stiffness * c**2 / 2.0 for c in parts if np.real(c) > 0.0)


def normal_forces(q, rail, p):
    """Forces on y, z, phi and psi: how the energy falls with them."""
    found = []
    for i in range(4):
        moved = [complex(value, STEP * (i == j)) for j, value in enumerate(q)]
        found.append(-np.imag(energy(moved, rail, p)) / STEP)
    return found


def contact(w: Motion, rail: Rail, run: Running, p) -> ContactForce:
    """Forces of the rails on a wheelset: normal load, creep and flange springs."""
    q = (w.y - rail.align, w.z, w.phi, w.psi)
    wheels = [creep(s, q, w, rail, run, p) for s in (+1, -1)]
    force, moment = np.zeros(3), np.zeros(3)
    for (linear, spin, _, basis, arm), share in zip(wheels, shares(wheels, p), strict=True):
        along, across, normal = basis
        acting = share * (linear[0] * along + linear[1] * across)
        force += acting
        moment += np.cross(arm, acting) + share * spin * normal
    lateral, vertical, roll, yaw = normal_forces(q, rail, p)
    return ContactForce(
        lateral + force[1] - _flange(q[0], p) + _flange(-q[0], p),
        vertical + force[2],
        roll + moment[0],
        yaw + moment[2],
    )


def creep(s, q, w, rail, run, p):
    """Linear creep force and spin moment of a wheel, its load, axes of its plane, and its arm."""
    y, z, phi, psi = q
    load = p.vertical_rail_stiffness * max(compression(s, y, z, phi, psi, rail, p), 0.0)
    radius = p.wheel_radius + p.conicity * shift(s, y, phi, psi, p)
    rise = s * (p.conicity + s * phi)  # of the contact plane, to the left
    plane = np.hypot(1.0, rise)
    along = np.array([1.0, psi, 0.0])
    across = np.array([-psi, 1.0, rise]) / plane
    normal = np.array([rise * psi, -rise, 1.0]) / plane
    arm = np.array([-s * p.half_gauge * psi, s * p.half_gauge - y, -radius])
    # the point of the wheel over the ground, over the speed
    turning = w.dpsi / run.speed - run.curvature
    xi_x = 1.0 - radius / p.wheel_radius - arm[1] * turning
    xi_y = ((w.dy + radius * w.dphi) / run.speed - psi) * plane
    spin = (turning - s * p.conicity / radius) / plane
    if load == 0.0:
        return np.zeros(2), 0.0, 0.0, (along, across, normal), arm
    grown = 1.0
    if getattr(p, "load_dependent_creep", False):
        at_rest = p.gravity * (p.wheelset_mass + (p.frame_mass + p.body_mass / 2.0) / 2.0) / 2.0
        grown = (load * plane / at_rest) ** (1.0 / 3.0)
    f11, f33 = p.lateral_creep * grown**2, p.longitudinal_creep * grown**2
    f12, f22 = p.lateral_spin_creep * grown**3, p.spin_creep * grown**4
    linear = np.array([-f33 * xi_x, -f11 * xi_y - f12 * spin])
    return linear, f12 * xi_y - f22 * spin, load * plane, (along, across, normal), arm


def shares(wheels, p):
    """Share of the linear creep forces that each wheel transmits, of what ``creep`` gives for both."""
    demand = [np.sqrt(f @ f + CREEP_FORCE_FLOOR**2) if load else 0.0 for f, _, load, _, _ in wheels]
    limit = [p.friction * load for _, _, load, _, _ in wheels]
    if getattr(p, "saturation_of", "wheelset") == "wheelset":
        demand, limit = [sum(demand)] * 2, [sum(limit)] * 2
    return [_share(d / most, p) if most else 1.0 for d, most in zip(demand, limit, strict=True)]


def _share(beta, p):
    if getattr(p, "saturation", "heuristic") == "polach":
        epsilon = np.pi / 4.0 * beta
        kept, slid = p.polach_adhesion * epsilon, p.polach_slip * epsilon
        return 2.0 / np.pi * (kept / (1.0 + kept**2) + np.arctan(slid)) / beta
    return 1.0 / beta if beta > 3.0 else (1.0 - (1.0 - beta / 3.0) ** 3) / beta


def _flange(y, p):
    """Force (N) of the spring behind the flange on the side to which y points."""
    beyond = y - p.flange_clearance
    return p.lateral_rail_stiffness * (beyond + np.sqrt(beyond**2 + FLANGE_BLEND**2)) / 2.0
