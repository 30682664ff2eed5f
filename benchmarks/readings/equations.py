"""The bogie and the dual wheelset of the paper (eqs 6 to 8 and 12), with its misprints as switches.

A switch is a parameter: 0 is the corrected reading, 1 the printed one, unless said otherwise.

==================  ==========================================================================
switch              what it does
==================  ==========================================================================
same_lever          F_syw has + L psi_b for both wheelsets
wheelset_lever      the frame's rows have L_w psi_w, which the wheelsets' rows lack
no_height           F_syb lacks 4 K_py h_G phi_b
no_leading_damper   F_syb lacks the damper of the leading wheelset
spring_to_frame     psi_wb of M_szw is psi_b where 1 ...
spring_to_itself    ... psi_w where 1 (the spring vanishes), and the ground where both are 0
damper_sign         of M_d in M_szw: -1 resists, +1 is the print's
damper_on_frame     M_d sees the frame's yaw rate and reacts on the frame (1), or neither (0)
yaw_in_creepage     a psi / V in the longitudinal creepage instead of a dpsi / V
==================  ==========================================================================

Masses whose lateral and vertical load each body carries, and the wheelset's pitch inertia, are
parameters too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import railenv
from benchmarks.readings.contact import Forces, Place, corrected, printed
from railenv.equations.functions import Scalar, sin, where_positive

Contact = Callable[[Place, Scalar, Scalar, Scalar], Forces]

COORDINATES = ("y", "z", "phi", "psi")
CONTACTS: dict[str, Contact] = {"corrected": corrected, "printed": printed}

REST = Place(*[0.0] * 8)


def _states(bodies: Sequence[str]) -> list[str]:
    names = [f"{c}_{body}" for body in bodies for c in COORDINATES]
    return [*names, *(f"d{name}" for name in names)]


def _places(x: Sequence[Scalar]) -> list[Place]:
    n = len(x) // 2
    return [Place(*x[i : i + 4], *x[n + i : n + i + 4]) for i in range(0, n, 4)]


def _damper(v: Scalar, p: Scalar) -> Scalar:
    """Eq 7."""
    odd, even = v * (p.c1 + p.c3 * v * v), v * v * (p.c2 + p.c4 * v * v)
    return odd + where_positive(v, even, -even)


def _damping_moment(w: Place, frame: Place, p: Scalar) -> Scalar:
    """M_d of eq 8 as it stands in M_szw."""
    b = p.primary_arm
    return p.damper_sign * b * _damper(b * (w.dpsi - p.damper_on_frame * frame.dpsi), p)


def _on_wheelset(s: int, w: Place, frame: Place, p: Scalar) -> Forces:
    """F_syw, F_szw, M_sxw and M_szw of eq 12."""
    lever = (s + p.same_lever * (1.0 - s)) * p.half_wheelbase
    h, b2 = p.frame_height, p.primary_arm * p.primary_arm
    y = frame.y + lever * frame.psi + h * frame.phi - w.y
    dy = frame.dy + lever * frame.dpsi + h * frame.dphi - w.dy
    end = p.spring_to_frame * frame.psi + p.spring_to_itself * w.psi
    return Forces(
        2.0 * (p.k_y * y + p.c_y * dy),
        2.0 * (p.k_z * (frame.z - w.z) + p.c_z * (frame.dz - w.dz)),
        2.0 * b2 * (p.k_z * (frame.phi - w.phi) + p.c_z * (frame.dphi - w.dphi)),
        2.0 * b2 * (p.k_x * (end - w.psi) + p.c_x * (frame.dpsi - w.dpsi))
        + _damping_moment(w, frame, p),
    )


def _on_frame(s: int, w: Place, frame: Place, p: Scalar) -> Forces:
    """What the wheelset on side s gives to F_syb, F_szb, M_sxb and M_szb of eq 12."""
    L, h, b2 = p.half_wheelbase, p.frame_height, p.primary_arm * p.primary_arm
    y = frame.y - w.y + s * (L * frame.psi - p.wheelset_lever * L * w.psi)
    dy = frame.dy - w.dy + s * (L * frame.dpsi - p.wheelset_lever * L * w.dpsi)
    leading = 1.0 - p.no_leading_damper * (1.0 + s) / 2.0
    spring = y + (1.0 - p.no_height) * h * frame.phi
    full = p.k_y * (y + h * frame.phi) + p.c_y * (dy + h * frame.dphi)
    roll = p.k_z * (frame.phi - w.phi) + p.c_z * (frame.dphi - w.dphi)
    yaw = p.k_x * (frame.psi - w.psi) + p.c_x * (frame.dpsi - w.dpsi)
    return Forces(
        -2.0 * (p.k_y * spring + p.c_y * (leading * dy + h * frame.dphi)),
        -2.0 * (p.k_z * (frame.z - w.z) + p.c_z * (frame.dz - w.dz)),
        -2.0 * (b2 * roll + h * full),
        -2.0 * (b2 * yaw + s * L * (p.k_y * y + p.c_y * dy))
        - p.damper_on_frame * _damping_moment(w, frame, p),
    )


def _wheelset(
    w: Place,
    spring: Forces,
    contact: Contact,
    speed: Scalar,
    curvature: Scalar,
    cant: Scalar,
    p: Scalar,
) -> list[Scalar]:
    """The wheelset's rows of eq 6."""
    rail = contact(w, speed, curvature, p)
    spin = p.wheelset_pitch_inertia
    turn = speed / p.wheel_radius
    roll = -spin * turn * (speed * curvature - w.dpsi)
    yaw = -spin * (turn + speed * curvature * sin(cant)) * w.dphi
    lateral = p.wheelset_lateral_load * (speed * speed * curvature - p.gravity * cant)
    vertical = -p.wheelset_vertical_load * (p.gravity + speed * speed * curvature * cant)
    return [
        (rail.y + spring.y + lateral) / p.wheelset_mass,
        (rail.z + spring.z + vertical) / p.wheelset_mass,
        (rail.roll + spring.roll + roll) / p.wheelset_roll_inertia,
        (rail.yaw + spring.yaw + yaw) / p.wheelset_yaw_inertia,
    ]


def _bogie(contact: Contact) -> Callable[..., list[Scalar]]:
    def bogie(x, u, speed, curvature, cant, p):
        *wheelsets, frame = _places(x)
        rates = list(x[len(x) // 2 :])
        parts = []
        for s, w in zip((+1, -1), wheelsets, strict=True):
            spring = _on_wheelset(s, w, frame, p)
            rates += _wheelset(w, spring, contact, speed, curvature, cant, p)
            parts.append(_on_frame(s, w, frame, p))
        total = Forces(*(a + b for a, b in zip(*parts, strict=True)))
        lateral = p.frame_lateral_load * (speed * speed * curvature - p.gravity * cant)
        vertical = -p.frame_vertical_load * (p.gravity + speed * speed * curvature * cant)
        rates += [
            (total.y + lateral) / p.frame_mass,
            (total.z + vertical) / p.frame_mass,
            total.roll / p.frame_roll_inertia,
            total.yaw / p.frame_yaw_inertia,
        ]
        return rates

    return bogie


def _dual_wheelset(contact: Contact) -> Callable[..., list[Scalar]]:
    def dual_wheelset(x, u, speed, curvature, cant, p):
        rates = list(x[len(x) // 2 :])
        for s, w in zip((+1, -1), _places(x), strict=True):
            spring = _on_wheelset(s, w, REST, p)
            rates += _wheelset(w, spring, contact, speed, curvature, cant, p)
        return rates

    return dual_wheelset


def parameters() -> dict[str, float]:
    """Return Table 1 with every switch off; the loads are those of the bogie, each carried once."""
    v = railenv.TABLE_1
    return {
        "gravity": v.gravity,
        "wheelset_mass": v.wheelset_mass,
        "wheelset_roll_inertia": v.wheelset_roll_inertia,
        "wheelset_yaw_inertia": v.wheelset_yaw_inertia,
        "wheelset_pitch_inertia": v.wheelset_pitch_inertia,
        "frame_mass": v.frame_mass,
        "frame_roll_inertia": v.frame_roll_inertia,
        "frame_yaw_inertia": v.frame_yaw_inertia,
        "half_gauge": v.half_gauge,
        "wheel_radius": v.wheel_radius,
        "conicity": v.conicity,
        "friction": v.friction,
        "flange_clearance": v.flange_clearance,
        "f11": v.lateral_creep,
        "f12": v.lateral_spin_creep,
        "f22": v.spin_creep,
        "f33": v.longitudinal_creep,
        "vertical_rail_stiffness": v.vertical_rail_stiffness,
        "lateral_rail_stiffness": v.lateral_rail_stiffness,
        "k_x": v.primary_longitudinal_stiffness,
        "k_y": v.primary_lateral_stiffness,
        "k_z": v.primary_vertical_stiffness,
        "c_x": v.primary_longitudinal_damping,
        "c_y": v.primary_lateral_damping,
        "c_z": v.primary_vertical_damping,
        "c1": v.yaw_damper_c1,
        "c2": v.yaw_damper_c2,
        "c3": v.yaw_damper_c3,
        "c4": v.yaw_damper_c4,
        "primary_arm": v.primary_arm,
        "half_wheelbase": v.half_wheelbase,
        "frame_height": v.frame_height,
        "wheelset_lateral_load": v.wheelset_mass,
        "wheelset_vertical_load": v.wheelset_mass,
        "frame_lateral_load": v.frame_mass + v.body_mass / 2.0,
        "frame_vertical_load": v.frame_mass + v.body_mass / 2.0,
        "same_lever": 0.0,
        "wheelset_lever": 0.0,
        "no_height": 0.0,
        "no_leading_damper": 0.0,
        "spring_to_frame": 1.0,
        "spring_to_itself": 0.0,
        "damper_sign": -1.0,
        "damper_on_frame": 1.0,
        "yaw_in_creepage": 0.0,
    }


def bogie(contact: str) -> railenv.Model:
    """Return the bogie (12 degrees of freedom) with one of the contacts, corrected otherwise."""
    return _model("bogie", ("w1", "w2", "b"), _bogie(CONTACTS[contact]))


def dual_wheelset(contact: str) -> railenv.Model:
    """Return the dual wheelset (8) with one of the contacts, corrected otherwise."""
    model = _model("dual wheelset", ("w1", "w2"), _dual_wheelset(CONTACTS[contact]))
    carried = railenv.TABLE_1.frame_mass + railenv.TABLE_1.body_mass / 2.0
    mass = railenv.TABLE_1.wheelset_mass + carried / 2.0
    return model.replace(wheelset_lateral_load=mass, wheelset_vertical_load=mass)


def _model(name: str, bodies: Sequence[str], equations: Any) -> railenv.Model:
    scale = [1e-3] * (8 * len(bodies))
    return railenv.Model(name, _states(bodies), ["unused"], equations, parameters(), scale)
