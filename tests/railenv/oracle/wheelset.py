"""Equations of motion of one wheelset (the wheelset rows of eq 6)."""

from __future__ import annotations

from railenv.equations.coordinates import Motion, Rail, Running
from railenv.equations.functions import Scalar, sin
from tests.railenv.oracle.contact import contact
from tests.railenv.oracle.loads import CarriedMass, lateral_load, vertical_load
from tests.railenv.oracle.suspension import SuspensionForce


def accelerations(
    w: Motion,
    rail: Rail,
    suspension: SuspensionForce,
    yaw_moment: Scalar,
    carried: CarriedMass,
    run: Running,
    p: Scalar,
) -> list[Scalar]:
    """Accelerations (y, z, phi, psi) of a wheelset that carries the weight of ``carried``.

    ``yaw_moment`` (N m) is that of the primary yaw actuator.
    """
    c = contact(w, rail, run, p)
    V = run.speed
    force_y = c.force_y + suspension.force_y + lateral_load(carried, run, p)
    force_z = c.force_z + suspension.force_z + vertical_load(carried, run, p)
    # Gyroscopic terms of the axle that spins at V/r0, on a track that itself turns at V/R.
    gyroscopic_roll = -p.wheelset_pitch_inertia * V / p.wheel_radius * (V * run.curvature - w.dpsi)
    gyroscopic_yaw = (
        -p.wheelset_pitch_inertia * (V / p.wheel_radius + V * run.curvature * sin(run.cant)) * w.dphi
    )
    roll = c.roll + suspension.moment_roll + gyroscopic_roll
    yaw = c.yaw + suspension.moment_yaw + gyroscopic_yaw + yaw_moment
    return [
        force_y / p.wheelset_mass,
        force_z / p.wheelset_mass,
        roll / p.wheelset_roll_inertia,
        yaw / p.wheelset_yaw_inertia,
    ]
