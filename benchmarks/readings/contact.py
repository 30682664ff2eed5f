"""Contact of a wheelset with its rails, as corrected and as printed (eqs 1 to 5 and 9 to 11).

Both return the forces of the rails on a wheelset: lateral and vertical (N), roll and yaw moment (N m).
``p.yaw_in_creepage`` switches between ``a dpsi / V`` (0) and the print's ``a psi / V`` (1).
"""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations.functions import Scalar, positive_part, sqrt, tan, tanh, where_positive

FORCE_FLOOR = 1e-3
"""N, under the root of a creep force, so that its derivative exists at zero."""

BLEND = 2e-5
"""m, over which the corrected flange spring sets in."""

STEEP = 1e4
"""Factor within the print's hyperbolic tangents."""


class Place(NamedTuple):
    """Coordinates of a wheelset and their rates."""

    y: Scalar
    z: Scalar
    phi: Scalar
    psi: Scalar
    dy: Scalar
    dz: Scalar
    dphi: Scalar
    dpsi: Scalar


class Forces(NamedTuple):
    """Force (N) and moment (N m) of the rails on a wheelset."""

    y: Scalar
    z: Scalar
    roll: Scalar
    yaw: Scalar


def _turning(w: Place, speed: Scalar, p: Scalar) -> Scalar:
    """What stands beside the half gauge in the longitudinal creepage: dpsi / V, or the print's psi."""
    return (w.dpsi + p.yaw_in_creepage * (w.psi - w.dpsi)) / speed


# ------------------------------------------------------------------------------ corrected


def corrected(w: Place, speed: Scalar, curvature: Scalar, p: Scalar) -> Forces:
    """Forces on one conservative geometry; a wheel that lifts carries nothing."""
    wheels = [_wheel(s, w, speed, curvature, p) for s in (+1, -1)]
    demand = sum(size for *_, size in wheels)
    limit = p.friction * sum(load for _, _, load, _ in wheels)
    loaded = where_positive(limit, limit, 1.0)
    beta = demand / loaded
    long = where_positive(beta, beta, 1.0)
    cubic = 1.0 - beta / 3.0 + beta * beta / 27.0
    alpha = where_positive(3.0 - beta, cubic, 1.0 / long)
    parts = [
        [n + alpha * c for n, c in zip(normal, creep, strict=True)] for normal, creep, _, _ in wheels
    ]
    lateral, vertical, roll, yaw = (left + right for left, right in zip(*parts, strict=True))
    return Forces(lateral - _spring(w.y, p) + _spring(-w.y, p), vertical, roll, yaw)


def _wheel(s: int, w: Place, speed: Scalar, curvature: Scalar, p: Scalar):
    """Normal forces, linear creep forces, load, and size of the creep force of a wheel."""
    a, r0, lam = p.half_gauge, p.wheel_radius, p.conicity
    eta = s * (w.y + r0 * w.phi) + a * (w.phi * w.phi - w.psi * w.psi) / 2.0
    tilt = w.phi * w.y + r0 * w.phi * w.phi / 2.0
    load = positive_part(p.vertical_rail_stiffness * (lam * eta + tilt - w.z - s * a * w.phi))
    thrust = load * lam
    normal = (
        -s * thrust - load * w.phi,
        load,
        load * (s * a - w.y - r0 * w.phi) - thrust * (s * r0 + a * w.phi),
        thrust * a * w.psi,
    )
    slope = lam + s * w.phi
    chi = sqrt(1.0 + slope * slope)
    radius = r0 + lam * eta
    arm = s * a - w.y
    turning = w.dpsi / speed - curvature
    xi_x = 1.0 - radius / r0 - arm * (_turning(w, speed, p) - curvature)
    xi_y = ((w.dy + radius * w.dphi) / speed - w.psi) * chi
    spin = (turning - s * lam / radius) / chi
    along = -p.f33 * xi_x
    across = -p.f11 * xi_y - p.f12 * spin
    moment = p.f12 * xi_y - p.f22 * spin
    # axes of the contact plane: along (1, psi, 0), across (-psi, 1, s slope) / chi
    fx = along - across * w.psi / chi
    fy = along * w.psi + across / chi
    fz = across * s * slope / chi
    back = -s * a * w.psi
    creep = (
        fy,
        fz,
        arm * fz + radius * fy + moment * s * slope * w.psi / chi,
        back * fy - arm * fx + moment / chi,
    )
    size = sqrt(along * along + across * across + FORCE_FLOOR * FORCE_FLOOR)
    creep = tuple(where_positive(load, c, 0.0) for c in creep)
    return normal, creep, load * chi, where_positive(load, size, 0.0)


def _spring(y: Scalar, p: Scalar) -> Scalar:
    beyond = y - p.flange_clearance
    return p.lateral_rail_stiffness * (beyond + sqrt(beyond * beyond + BLEND * BLEND)) / 2.0


# ------------------------------------------------------------------------------ as printed


def printed(w: Place, speed: Scalar, curvature: Scalar, p: Scalar) -> Forces:
    """Forces of eqs 1 to 5 and 9 to 11 to the letter: wheels may pull, the flange spring too."""
    a, r0, lam = p.half_gauge, p.wheel_radius, p.conicity
    ratios, sides = [], []
    for s in (+1, -1):
        radius = r0 + s * lam * w.y
        slope = lam + s * w.phi
        vertical = -p.vertical_rail_stiffness * (w.z - s * lam * w.y + s * a * w.phi)
        lateral = -s * vertical * tan(slope)
        xi_x = 1.0 + s * a * curvature - radius / r0 - s * a * _turning(w, speed, p)
        xi_y = (w.dy + radius * w.dphi) / speed - w.psi
        spin = w.dpsi / speed - curvature - s * lam / r0
        along = -p.f33 * xi_x
        across = -p.f11 * xi_y - p.f12 * spin
        moment = p.f12 * xi_y - p.f22 * spin
        size = sqrt(along * along + across * across + FORCE_FLOOR * FORCE_FLOOR)
        load = sqrt(vertical * vertical + lateral * lateral + 1.0)  # 1 N: the wheels start unloaded
        ratios.append(size / (p.friction * load))
        sides.append((s, radius, slope, vertical, lateral, along, across, moment))
    beta = (ratios[0] + ratios[1]) / 2.0
    below = tanh(STEEP * (3.0 - beta)) / 2.0 + 0.5
    alpha = (1.0 - beta / 3.0 + beta * beta / 27.0) * below + (1.0 - below) / beta
    total = [0.0, 0.0, 0.0, 0.0]
    for s, radius, slope, vertical, lateral, along, across, moment in sides:
        fx = alpha * (along - across * w.psi)
        fy = alpha * (across + along * w.psi)
        fz = s * across * slope  # eq 10 leaves it, and the moment about x, unsaturated
        back, arm, depth = -s * a * w.psi, s * a + radius * w.phi, s * a * w.phi - radius
        total[0] = total[0] + fy + lateral
        total[1] = total[1] + fz + vertical
        total[2] = total[2] + arm * (fz + vertical) - depth * (fy + lateral)
        total[2] = total[2] + s * moment * slope * w.psi
        total[3] = total[3] + back * (fy + lateral) - arm * fx + alpha * moment
    return Forces(total[0] - _flange(w.y, p), *total[1:])


def _flange(y: Scalar, p: Scalar) -> Scalar:
    """Eq 5."""
    outer, inner = y - p.flange_clearance, y + p.flange_clearance
    return p.lateral_rail_stiffness * (
        outer * (tanh(STEEP * outer) / 2.0 + 0.5) + inner * (tanh(-STEEP * inner) / 2.0 + 0.5)
    )
