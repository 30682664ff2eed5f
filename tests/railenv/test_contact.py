"""Wheel-rail contact: adhesion limit, loss of contact, flange and kinematics of rolling."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import railenv
from railenv.equations.contact import (
    Wheel,
    contact,
    creep_magnitude,
    flange_force,
    saturation,
    wheel,
)
from railenv.equations.coordinates import Motion, Rail, Running

P = railenv.Bogie(railenv.TABLE_1).assembly.with_numbers(railenv.TABLE_1.parameters()).wheelsets[0]
NO_SPIN = SimpleNamespace(**{**vars(P), "lateral_spin_creep": 0.0, "spin_creep": 0.0})
SMOOTH = Rail(0.0, 0.0, 0.0)
TANGENT = Running(30.0, 0.0, 0.0)
STEP = 1e-30


def loaded(**motion):
    """Return a wheelset pressed 1 mm into the rails, about its static load."""
    return Motion(**{**dict.fromkeys(Motion._fields, 0.0), "z": -1e-3, **motion})


def pair(w, run=TANGENT, rail=SMOOTH, p=P):
    return wheel(+1, w, rail, run, p), wheel(-1, w, rail, run, p)


def wheels_with(beta, load=5e4):
    """Return two alike wheels whose linear creep forces are beta times the adhesion limit."""
    alike = Wheel(+1, 0.46, 0.05, 0.0, load, load, beta * P.friction * load, 0.0, 0.0)
    return alike, alike._replace(side=-1)


def random_wheelsets(rng, count):
    """Draw wheelsets pressed in or lifted, on one side or both, creeping little up to sliding."""
    for _ in range(count):
        violence = 10.0 ** rng.uniform(-4.0, 1.5)
        displacements = rng.uniform(-1.0, 1.0, 4) * [2e-2, 2e-3, 8e-3, 5e-2]
        run = Running(rng.uniform(1.0, 150.0), rng.uniform(-4e-3, 4e-3), 0.1)
        yield Motion(*displacements, *(violence * rng.uniform(-1.0, 1.0, 4))), run


def moving(wrench):
    """Force along y and z, moment about x and z: what moves a wheelset."""
    return np.array([wrench.force_y, wrench.force_z, wrench.roll, wrench.yaw])


# -------------------------------------------------------------------------- adhesion


def test_creep_forces_never_exceed_the_adhesion_of_both_wheels():
    rng = np.random.default_rng(1)
    usage, lifted = [], 0
    for w, run in random_wheelsets(rng, 3000):
        left, right = pair(w, run)
        alpha = saturation(left, right, P)
        force = alpha * sum(math.hypot(c.creep_x, c.creep_y) for c in (left, right))
        limit = P.friction * (left.normal + right.normal)
        assert 0.0 < alpha <= 1.0
        assert force <= limit * (1.0 + 1e-12)
        usage.append(force / limit if limit else 0.0)
        lifted += (left.normal == 0.0) != (right.normal == 0.0)
    # the sample has to reach the limit, stay far from it, and lift single wheels
    assert max(usage) > 0.999
    assert np.quantile(usage, 0.1) < 0.5
    assert lifted > 100


def test_force_on_the_wheelset_in_the_plane_of_the_track_stays_within_adhesion():
    # the resultant itself: flange and normal forces taken away, for a wheelset that stands straight
    for rate in (1e-3, 1e-1, 1e1, 1e3):
        w = loaded(dy=rate)
        left, right = pair(w, p=NO_SPIN)
        lateral = contact(w, SMOOTH, TANGENT, NO_SPIN).force_y - left.normal_y - right.normal_y
        limit = NO_SPIN.friction * (left.normal + right.normal)
        assert -limit * (1.0 + 1e-9) <= lateral < 0.0
        if rate >= 10.0:
            assert lateral == pytest.approx(-limit, rel=1e-9)


def test_saturation_joins_smoothly_where_sliding_sets_in():
    below, above = 3.0 - 1e-9, 3.0 + 1e-9
    assert saturation(*wheels_with(below), P) == pytest.approx(1.0 / 3.0, abs=1e-9)
    assert saturation(*wheels_with(above), P) == pytest.approx(1.0 / 3.0, abs=1e-9)
    slopes = [saturation(*wheels_with(complex(b, STEP)), P).imag / STEP for b in (below, above)]
    # -1/3 + 2 beta/27 and -1/beta^2 at beta = 3
    assert_allclose(slopes, -1.0 / 9.0, atol=1e-8)


def test_saturation_follows_the_cubic_law_and_then_slides():
    for beta in (0.1, 1.0, 2.5, 2.95, 2.99):
        # force over adhesion, the law as Vermeulen and Johnson have it
        transmitted = beta * saturation(*wheels_with(beta), P)
        assert transmitted == pytest.approx(1.0 - (1.0 - beta / 3.0) ** 3, rel=1e-10)
    for beta in (3.01, 3.5, 10.0, 1e4):
        assert beta * saturation(*wheels_with(beta), P) == pytest.approx(1.0, rel=1e-12)


def test_saturation_is_monotone_and_its_force_never_falls():
    betas = np.linspace(0.0, 6.0, 1201)
    alphas = np.array([saturation(*wheels_with(b), P) for b in betas])
    assert (np.diff(alphas) < 0.0).all()
    assert (np.diff(betas * alphas) > -1e-12).all()


def test_derivatives_are_finite_at_zero_creep():
    left, right = wheels_with(complex(0.0, STEP))
    assert saturation(left, right, P).imag == 0.0
    assert creep_magnitude(left).imag == 0.0


# ------------------------------------------------------------------- loss of contact


@pytest.mark.parametrize(("roll", "lifted"), [(5e-3, 0), (-5e-3, 1)])
def test_lifted_wheel_has_neither_load_nor_creep(roll, lifted):
    # rolling to the right (phi > 0) raises the left wheel
    w = loaded(phi=roll, dy=3.0, dpsi=0.2)
    wheels = pair(w)
    off, on = wheels[lifted], wheels[1 - lifted]
    assert (off.normal_z, off.normal_y, off.normal) == (0.0, 0.0, 0.0)
    assert (off.creep_x, off.creep_y, off.creep_moment) == (0.0, 0.0, 0.0)
    assert creep_magnitude(off) == 0.0
    assert on.normal_z > 0.0
    assert abs(on.creep_y) > 0.0
    # and the wheel that remains has only its own adhesion
    alpha = saturation(*wheels, P)
    assert alpha * creep_magnitude(on) == pytest.approx(P.friction * on.normal, rel=1e-9)


def test_wheelset_in_the_air_feels_no_force():
    w = loaded(z=5e-3, phi=1e-3, psi=0.01, dy=2.0, dphi=1.0, dpsi=-1.0)
    wheels = pair(w)
    assert saturation(*wheels, P) == 1.0
    resultant = contact(w, SMOOTH, TANGENT, P)
    others = moving(resultant)[1:]
    assert_allclose(others, 0.0, atol=0.0)
    # the flange's blend has a tail of K w^2/(4 delta) per side, the same on both where y = 0
    assert resultant.force_y == 0.0


def test_load_sets_in_continuously():
    lift = [wheel(+1, loaded(z=z), SMOOTH, TANGENT, P).normal_z for z in (-1e-12, 0.0, 1e-12)]
    assert_allclose(lift, [P.vertical_rail_stiffness * 1e-12, 0.0, 0.0], rtol=1e-12)


def test_normal_load_stands_at_right_angles_to_the_contact_plane():
    left, right = pair(loaded(y=2e-3, phi=4e-4))
    for c in (left, right):
        assert math.atan2(-c.side * c.normal_y, c.normal_z) == pytest.approx(c.slope, rel=1e-12)
        assert math.hypot(c.normal_y, c.normal_z) == pytest.approx(c.normal, rel=1e-12)
    assert left.normal_y < 0.0 < right.normal_y  # the cones centre the wheelset
    assert left.slope - right.slope == pytest.approx(2.0 * 4e-4)


# ------------------------------------------------------------------------- geometry


def turned(axis, angle):
    """Matrix that turns by an angle about x or z."""
    c, s = math.cos(angle), math.sin(angle)
    if axis == "x":
        return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rail_actions(w, p):
    """Force and moment of each wheel by finite rotations, of which the equations have small angles.

    A row per wheel: F_y, F_z, M_x, M_z about the wheelset's centre. The linear creep forces lie in
    the contact planes, which yaw with the wheelset.
    """
    rows = []
    for c in pair(w, p=p):
        plane = turned("x", c.side * c.slope)
        creep = turned("z", w.psi) @ plane
        F = creep @ [c.creep_x, c.creep_y, 0.0] + plane @ [0.0, 0.0, c.normal]
        arm = turned("z", w.psi) @ turned("x", w.phi) @ [0.0, c.side * p.half_gauge, -c.radius]
        M = np.cross(arm, F) + creep @ [0.0, 0.0, c.creep_moment]
        rows.append([F[1], F[2], M[0], M[2]])
    return np.array(rows)


@pytest.mark.parametrize(
    ("part", "accuracy"),
    [
        ("normal load", 1e-5),
        # the equations take the cosine of the cone's angle for 1
        ("lateral_creep", 3e-3),
        ("longitudinal_creep", 3e-3),
        ("spin_creep", 3e-3),
    ],
)
def test_forces_of_the_rails_add_up_as_their_geometry_says(part, accuracy):
    # One force law at a time, far from the flange, and so weak that nothing saturates. What the normal
    # loads alone give is then taken away again.
    creep = dict.fromkeys(
        ["lateral_creep", "longitudinal_creep", "spin_creep", "lateral_spin_creep"], 0.0
    )
    numbers = {**vars(P), **creep, "flange_clearance": 1e3}
    loads = SimpleNamespace(**numbers)
    p = SimpleNamespace(**{**numbers, part: 1e3})
    rng = np.random.default_rng(3)
    for _ in range(20):
        y, phi, psi = rng.uniform(-1.0, 1.0, 3) * [5e-3, 1e-3, 3e-3]
        w = loaded(y=y, phi=phi, psi=psi, dy=0.02, dphi=0.1, dpsi=0.02)
        found, expected = moving(contact(w, SMOOTH, TANGENT, loads)), rail_actions(w, loads)
        if part != "normal load":
            found = moving(contact(w, SMOOTH, TANGENT, p)) - found
            expected = rail_actions(w, p) - expected
        gross = np.abs(expected).sum(axis=0)  # the two wheels may cancel
        tolerance = accuracy * gross + 1e-6 * gross.max()
        rounding = 1e-10 * P.vertical_rail_stiffness * 1e-3
        assert (np.abs(found - expected.sum(axis=0)) <= tolerance + rounding).all()


# ---------------------------------------------------------------------------- flange


def test_flange_force_is_monotone_odd_and_never_pulls_towards_the_rail():
    ys = np.concatenate(
        [np.linspace(-0.02, 0.02, 4001), P.flange_clearance + np.linspace(-1e-4, 1e-4, 401)]
    )
    forces = np.array([flange_force(y, P) for y in ys])
    noise = 1e-9  # N, rounding of the difference of both sides
    assert (forces * np.sign(ys) >= -noise).all()
    slopes = np.array([flange_force(complex(y, STEP), P).imag / STEP for y in ys])
    assert (slopes >= 0.0).all()
    assert (slopes <= P.lateral_rail_stiffness * (1.0 + 1e-12)).all()
    assert_allclose([flange_force(-y, P) for y in ys], -forces, rtol=0, atol=noise)


def test_flange_force_is_the_dead_band_spring_away_from_the_edge():
    K, delta = P.lateral_rail_stiffness, P.flange_clearance
    for d in (0.5e-3, 1e-3, 5e-3):
        for side in (+1, -1):
            assert flange_force(side * (delta + d), P) == pytest.approx(side * K * d, rel=2e-3)
            # inside, what is left of the blend is some newtons of tens of kilonewtons
            assert abs(flange_force(side * (delta - d), P)) < 2e-3 * K * d
    assert flange_force(delta + 5e-3, P) == pytest.approx(K * 5e-3, rel=1e-5)


def test_flange_resists_on_the_side_of_the_rail_that_is_touched():
    for y in (+0.012, -0.012):
        free, blocked = (
            contact(loaded(y=y), SMOOTH, TANGENT, SimpleNamespace(**{**vars(P), "flange_clearance": c}))
            for c in (1.0, P.flange_clearance)
        )
        push = blocked.force_y - free.force_y
        expected = -math.copysign(P.lateral_rail_stiffness * (0.012 - P.flange_clearance), y)
        assert push == pytest.approx(expected, rel=1e-4)
        assert blocked == free._replace(force_y=blocked.force_y)  # it acts at the wheelset's centre


# ------------------------------------------------------------------- rolling kinematics


def test_wheelset_on_the_rolling_line_of_a_curve_has_no_longitudinal_creep():
    # (r_L - r_R)/2 : r0 = a : R where both wheels roll; the outer rail of a positive curve is left
    for curvature in (1.0 / 1000.0, -1.0 / 3000.0):
        y = P.half_gauge * P.wheel_radius * curvature / P.conicity
        left, right = pair(loaded(y=y), Running(20.0, curvature, 0.0), p=NO_SPIN)
        straight, _ = pair(loaded(y=y), p=NO_SPIN)
        assert abs(straight.creep_x) > 1e3
        assert_allclose([left.creep_x, right.creep_x], 0.0, atol=1e-9 * abs(straight.creep_x))


def test_wheelset_that_rolls_where_it_points_has_no_lateral_creep():
    run = Running(40.0, 0.0, 0.0)
    psi = 2e-3
    for c in pair(loaded(psi=psi, dy=run.speed * psi), run, p=NO_SPIN):
        assert abs(c.creep_y) < 1e-9 * P.lateral_creep * psi
    for c in pair(loaded(psi=psi), run, p=NO_SPIN):
        assert c.creep_y == pytest.approx(P.lateral_creep * psi)  # it is driven where it points


def test_displaced_wheelset_steers_back_to_the_centre_line():
    # the outer wheel, on its larger radius, runs ahead: to the left, the wheelset turns right
    assert contact(loaded(y=3e-3), SMOOTH, TANGENT, P).yaw < -1e3
    assert contact(loaded(y=-3e-3), SMOOTH, TANGENT, P).yaw > 1e3


def test_creep_force_opposes_sliding():
    for rate in (0.01, 0.1):
        assert contact(loaded(dy=rate), SMOOTH, TANGENT, NO_SPIN).force_y < 0.0
        assert contact(loaded(dpsi=rate), SMOOTH, TANGENT, NO_SPIN).yaw < 0.0


def test_irregular_rails_count_for_radius_load_and_flange_as_displacements_of_the_wheelset():
    w = loaded(y=2e-3, phi=3e-4)
    moved = pair(w, rail=Rail(align=1e-3, vert=-2e-4, cross=1e-4))
    expected = pair(loaded(y=1e-3, z=-0.8e-3, phi=2e-4))
    for c, e, plain in zip(moved, expected, pair(w), strict=True):
        assert c.radius == pytest.approx(e.radius, rel=1e-15)
        assert c.normal_z == pytest.approx(e.normal_z, rel=1e-12)
        assert c.slope == plain.slope  # of the contact plane, which stays absolute
