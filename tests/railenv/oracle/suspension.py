"""Suspension forces: eqs 7, 8 and 12 of the paper, derived from a potential and a dissipation function.

The print of eq 12 breaks action = reaction; these follow from one spring deflection per direction, so
whatever a wheelset receives the frame gives (``docs/physics.md``, section "Primary suspension").
"""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations.coordinates import Motion, Running
from railenv.equations.functions import Scalar, where_positive


class SuspensionForce(NamedTuple):
    """Suspension force (N) and moment (N m) on a body."""

    force_y: Scalar
    force_z: Scalar
    moment_roll: Scalar
    moment_yaw: Scalar


def yaw_damper_force(v: Scalar, p: Scalar) -> Scalar:
    """Longitudinal force (N) of the paper's nonlinear yaw damper at the speed v, m/s (eq 7).

    A quartic polynomial for v > 0 and its odd extension for v < 0.
    """
    odd = v * (p.yaw_damper_c1 + p.yaw_damper_c3 * v * v)
    even = v * v * (p.yaw_damper_c2 + p.yaw_damper_c4 * v * v)
    return odd + where_positive(v, even, -even)


def primary(s: int, w: Motion, frame: Motion, run: Running, p: Scalar) -> SuspensionForce:
    """Primary suspension force on the leading (s = +1) or trailing (s = -1) wheelset (eq 12).

    With ``wheelbase_curving`` on, each wheelset's coordinates are measured from the track under it,
    which on a curve is displaced and turned against the frame's.
    """
    L, h, b = p.half_wheelbase, p.frame_height, p.primary_arm
    curving = p.wheelbase_curving * run.curvature
    lateral = frame.y + s * L * frame.psi + h * frame.phi - w.y + curving * L * L / 2.0
    lateral_rate = frame.dy + s * L * frame.dpsi + h * frame.dphi - w.dy
    yaw = frame.psi - w.psi + s * L * curving
    yaw_rate = frame.dpsi - w.dpsi
    damper = b * yaw_damper_force(-b * yaw_rate, p)  # eq 8, resists the wheelset's own yaw rate
    return SuspensionForce(
        force_y=2.0
        * (p.primary_lateral_stiffness * lateral + p.primary_lateral_damping * lateral_rate),
        force_z=2.0
        * (
            p.primary_vertical_stiffness * (frame.z - w.z)
            + p.primary_vertical_damping * (frame.dz - w.dz)
        ),
        moment_roll=2.0
        * b
        * b
        * (
            p.primary_vertical_stiffness * (frame.phi - w.phi)
            + p.primary_vertical_damping * (frame.dphi - w.dphi)
        ),
        moment_yaw=2.0
        * b
        * b
        * (p.primary_longitudinal_stiffness * yaw + p.primary_longitudinal_damping * yaw_rate)
        - damper,
    )


def primary_reaction(s: int, on_wheelset: SuspensionForce, p: Scalar) -> SuspensionForce:
    """Force on the frame that balances ``on_wheelset``: action = reaction about the frame's centre."""
    return SuspensionForce(
        force_y=-on_wheelset.force_y,
        force_z=-on_wheelset.force_z,
        moment_roll=-(on_wheelset.moment_roll + p.frame_height * on_wheelset.force_y),
        moment_yaw=-(on_wheelset.moment_yaw + s * p.half_wheelbase * on_wheelset.force_y),
    )


def secondary(frame: Motion, p: Scalar) -> SuspensionForce:
    """Secondary suspension force on the frame, against a body at rest in the track frame.

    Beyond the paper. The frame carries the static vertical load (``loads.bogie_frame_load``), so only
    the damper acts vertically.
    """
    bs2 = p.secondary_arm * p.secondary_arm
    return SuspensionForce(
        force_y=-2.0
        * (p.secondary_lateral_stiffness * frame.y + p.secondary_lateral_damping * frame.dy),
        force_z=-2.0 * p.secondary_vertical_damping * frame.dz,
        moment_roll=-2.0
        * bs2
        * (p.secondary_vertical_stiffness * frame.phi + p.secondary_vertical_damping * frame.dphi),
        moment_yaw=-2.0
        * bs2
        * (
            p.secondary_longitudinal_stiffness * frame.psi
            + p.secondary_longitudinal_damping * frame.dpsi
        ),
    )
