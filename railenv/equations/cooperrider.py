"""The Cooperrider bogie (7 DOF) on tangent track, the benchmark of nonlinear railway dynamics.

Equations and numbers as in C. Kaas-Petersen, "Chaos in a railway bogie", Acta Mechanica 61 (1986),
and H. True's later work; the wheelsets' yaw inertia, the suspension's names and the sign conventions
are those of ``docs/physics.md``, section "Cooperrider bogie". The actuators' moments and the yaw
damper, which is off by default, are additions.
"""

from __future__ import annotations

from collections.abc import Sequence

from railenv.equations.functions import Scalar, positive_part, sqrt, where_positive

COORDINATES = ("y_w1", "psi_w1", "y_w2", "psi_w2", "y_b", "psi_b", "phi_b")
STATES = (*COORDINATES, *(f"d{name}" for name in COORDINATES))
INPUTS = ("M_w1", "M_w2", "M_b")

CREEPAGE_FLOOR_SQUARED = 1e-18
"""Keeps the derivative of the creepage's magnitude finite at zero creep."""


def creepages(
    y: Scalar, psi: Scalar, dy: Scalar, dpsi: Scalar, V: Scalar, p: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Lateral and longitudinal creepage, each over its ratio of Vermeulen and Johnson; magnitude."""
    xi_x = (dy / V - psi) / p.creep_ratio_lateral
    xi_y = (p.half_gauge * dpsi / V + p.conicity * y / p.wheel_radius) / p.creep_ratio_longitudinal
    return xi_x, xi_y, sqrt(xi_x * xi_x + xi_y * xi_y + CREEPAGE_FLOOR_SQUARED)


def creep_force(xi: Scalar, p: Scalar) -> Scalar:
    """Creep force over creepage (N) of one wheel by Vermeulen and Johnson's law."""
    u = p.creep_coefficient * xi / p.adhesion_force
    sliding = u - 3.0
    return where_positive(
        sliding,
        p.adhesion_force / xi,
        p.creep_coefficient * (1.0 - u / 3.0 + u * u / 27.0),
    )


def flange_force(y: Scalar, p: Scalar) -> Scalar:
    """Force (N) of the flange spring beyond the dead band, pushing back."""
    return p.flange_stiffness * (
        positive_part(y - p.flange_clearance) - positive_part(-y - p.flange_clearance)
    )


def primary(
    s: int, y: Scalar, psi: Scalar, yb: Scalar, psib: Scalar, phib: Scalar, p: Scalar
) -> tuple[Scalar, Scalar]:
    """Lateral force (N) and yaw moment (N m) of the springs of wheelset s on the frame."""
    return (
        2.0 * p.k1 * (y - yb - s * p.half_wheelbase * psib - p.h1 * phib),
        2.0 * p.k2 * p.d1 * p.d1 * (psi - psib),
    )


def secondary(
    yb: Scalar, psib: Scalar, phib: Scalar, dyb: Scalar, dpsib: Scalar, dphib: Scalar, p: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Lateral force (N), yaw and roll moment (N m) that the frame gives; roll with the primary's."""
    return (
        2.0 * p.D2 * (dyb - p.h2 * dphib) + 2.0 * p.k4 * (yb - p.h2 * phib),
        p.yaw_damping * dpsib + p.k6 * psib,
        2.0 * p.D1 * p.d2 * p.d2 * dphib
        + 2.0 * p.k5 * p.d2 * p.d2 * phib
        + 4.0 * p.k3 * p.d1 * p.d1 * phib,
    )


def cooperrider_bogie(
    x: Sequence[Scalar],
    u: Sequence[Scalar],
    speed: Scalar,
    curvature: Scalar,
    cant: Scalar,
    p: Scalar,
) -> list[Scalar]:
    """Time derivative of the 14 states; ``p`` has the fields of CooperriderParameters."""
    y1, psi1, y2, psi2, yb, psib, phib = x[:7]
    dy1, dpsi1, dy2, dpsi2, dyb, dpsib, dphib = x[7:]
    M_w1, M_w2, M_b = u
    accelerations: list[Scalar] = []
    lateral, yaw = [], []
    for s, y, psi, dy, dpsi, moment in (
        (+1, y1, psi1, dy1, dpsi1, M_w1),
        (-1, y2, psi2, dy2, dpsi2, M_w2),
    ):
        A, B = primary(s, y, psi, yb, psib, phib, p)
        xi_x, xi_y, xi = creepages(y, psi, dy, dpsi, speed, p)
        g = creep_force(xi, p)
        Fx, Fy = xi_x * g, xi_y * g
        accelerations += [
            (-A - 2.0 * Fx - flange_force(y, p)) / p.wheelset_mass,
            (-B - 2.0 * p.half_gauge * Fy + moment) / p.wheelset_yaw_inertia,
        ]
        lateral.append(A)
        yaw.append(B)
    A1, A2 = lateral
    A5, A6, A7 = secondary(yb, psib, phib, dyb, dpsib, dphib, p)
    accelerations += [
        (A1 + A2 - A5) / p.frame_mass,
        (p.half_wheelbase * (A1 - A2) + yaw[0] + yaw[1] - A6 + M_b - M_w1 - M_w2) / p.frame_yaw_inertia,
        (p.h1 * (A1 + A2) + p.h2 * A5 - A7) / p.frame_roll_inertia,
    ]
    return [*x[7:], *accelerations]
