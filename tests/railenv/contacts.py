"""Wheelsets on all contact laws, alone on their rails, for tests of the contact."""

from functools import cache
from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq

import railenv
from railenv.contact.profiles import Profile
from railenv.equations.contact import FLANGE_BLEND, point, wheel
from railenv.equations.coordinates import Motion, Rail, Running

SMOOTH = Rail(0.0, 0.0, 0.0)
TANGENT = Running(30.0, 0.0, 0.0)
STEP = 1e-30

CREEP = ("lateral_creep", "longitudinal_creep", "spin_creep", "lateral_spin_creep")


@cache
def laws():
    """Return a contact of each law, by name; S1002 on UIC 60 and worn for those on profiles."""
    new, worn = railenv.ProfilePair(), railenv.ProfilePair(wheel="S1002_WORN")
    return {
        "cone": railenv.Cone(0.05),
        "steep cone": railenv.Cone(0.4),
        "linear": railenv.LinearProfile(0.2, 0.03, 13.6),
        "arcs": railenv.ArcProfile(0.05, 0.35, 0.3),
        "hollow": railenv.HollowTread(0.2, 0.034, 0.3),
        "profiles": new,
        "family": railenv.ProfileFamily(new, worn, 0.4),
    }


LAWS = tuple(laws())


def numbers(contact=None, **changes):
    """Return the leading wheelset of Table 1's with another contact law, as the equations read it."""
    vehicle = railenv.TABLE_1 if contact is None else railenv.TABLE_1.replace(contact=contact)
    model = railenv.DualWheelset(vehicle.replace(**changes))
    return model.equations.assembly.with_numbers({**model.parameters, **model.tables}).wheelsets[0]


def other(p, **changes):
    """Return numbers of a wheelset with some of them changed."""
    return SimpleNamespace(**{**vars(p), **changes})


def without_creep(p, **changes):
    """Return numbers of a wheelset that has no friction."""
    return other(p, **dict.fromkeys(CREEP, 0.0), **changes)


def spring_energy(y, p):
    """Energy (J) of the springs behind the flanges: the integral of the blended spring."""
    found = 0.0
    for side in (+1, -1):
        law = p.left if side > 0 else p.right
        if not law.law.has_flange:
            d = side * y - p.flange_clearance
            root = np.sqrt(d * d + FLANGE_BLEND**2)
            log = np.arcsinh(d / FLANGE_BLEND)
            found += 0.25 * p.lateral_rail_stiffness * (d * d + d * root + FLANGE_BLEND**2 * log)
    return found


def rail_energy(q, p, rail=SMOOTH):
    """Energy (J) that rails and flange springs hold."""
    w = Motion(*q, 0.0, 0.0, 0.0, 0.0)
    stored = spring_energy(w.y - rail.align, p)
    for side in (+1, -1):
        c = point(side, w, rail, p)
        if complex(c.compression).real > 0.0:
            stored += 0.5 * p.vertical_rail_stiffness * c.compression**2
    return stored


def loaded(**motion):
    """Return a wheelset pressed 1 mm into the rails, about its static load."""
    return Motion(**{**dict.fromkeys(Motion._fields, 0.0), "z": -1e-3, **motion})


def pair(w, p, run=TANGENT, rail=SMOOTH):
    """Return left and right wheel."""
    return wheel(+1, w, rail, run, p), wheel(-1, w, rail, run, p)


def moving(wrench):
    """Force along y and z, moment about x and z: what moves a wheelset."""
    return np.array([wrench.force_y, wrench.force_z, wrench.roll, wrench.yaw])


# ------------------------------------------------------------------- profiles in closed form

HALF_GAUGE = 0.75  # of the pairs made here
_DEPTH = 0.0005


def on_round_rail(wheel_points, angle, radius, **changes):
    """Return a wheel on a circular rail that it touches at its tape circle, under a contact angle.

    ``wheel_points`` are from there, outwards and up.
    """
    widest = min(0.6, 0.06 / radius)
    lean = np.linspace(-widest, widest, 361)
    y = radius * (np.sin(lean) + np.sin(angle))
    z = radius * (np.cos(lean) - np.cos(angle))
    face = radius * (np.sin(angle) - np.sin(np.arccos(1.0 - _DEPTH / radius)))
    given = {
        "gauge": 2.0 * (HALF_GAUGE + face),
        "gauge_depth": _DEPTH,
        "inclination": 0.0,
        "rail_yield": 0.0,
        **changes,
    }
    return railenv.ProfilePair(
        Profile.of(wheel_points, kind="wheel", name="wheel"),
        Profile.of(np.stack([y, z], axis=1), kind="rail", name="rail"),
        **given,
    )


def straight(conicity):
    """Return the points of a straight tread."""
    y = np.linspace(-0.025, 0.025, 25)
    return np.stack([y, conicity * y], axis=1)


def hollow(radius, angle):
    """Return the points of a hollow arc that has this contact angle at 0."""
    lean = np.linspace(-0.2, 0.2, 321)
    y = radius * (np.sin(lean) + np.sin(angle))
    return np.stack([y, radius * (np.cos(lean) - np.cos(angle))], axis=1)


# ------------------------------------------------------------------------------ stability


def jacobian(model, x, speed):
    """Derivatives of the plain equations by the states, by complex step."""
    n = model.n_states
    u = [0.0] * model.n_inputs
    columns = []
    for j in range(n):
        z = [complex(value, STEP * (i == j)) for i, value in enumerate(x)]
        rates = model.plain_rhs(z, u, speed, 0.0, 0.0)
        columns.append([complex(rate).imag / STEP for rate in rates])
    return np.array(columns).T


def rest(model, speed):
    """Running equilibrium on tangent track, by Newton's method on the plain equations."""
    x = np.array(model.guess)
    for _ in range(8):
        rates = model.plain_rhs(x.tolist(), [0.0] * model.n_inputs, speed, 0.0, 0.0)
        x = x - np.linalg.solve(jacobian(model, x, speed), rates)
    return x


def growth(model, speed):
    """Growth (1/s) and frequency (Hz) of the least damped motion, without kernels."""
    eigenvalues = np.linalg.eigvals(jacobian(model, rest(model, speed), speed))
    least = eigenvalues[np.argmax(eigenvalues.real)]
    return float(least.real), abs(float(least.imag)) / (2.0 * np.pi)


def critical_speed(model, near):
    """Speed (m/s) at which the least damped motion begins to grow, within 3 % of one."""
    return brentq(lambda v: growth(model, v)[0], 0.97 * near, 1.03 * near, xtol=1e-11, rtol=1e-13)


def assert_hunts_from(model, speed, frequency, accuracy=1e-3):
    """Assert that motion begins to grow at a speed (m/s), with a frequency (Hz)."""
    below, above = (growth(model, speed * (1.0 + sign * accuracy)) for sign in (-1.0, 1.0))
    assert below[0] < 0.0 < above[0]
    assert abs(0.5 * (below[1] + above[1]) / frequency - 1.0) < accuracy
