"""Wheel-rail contact: conservative normal forces, laws, adhesion, flange and kinematics of rolling."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import fsolve

import railenv
from railenv.equations import creep
from railenv.equations.contact import (
    Normal,
    Wheel,
    contact,
    creep_magnitude,
    creepages,
    flange_force,
    kalker,
    point,
    rail_forces,
    saturation,
    wheel,
)
from railenv.equations.coordinates import Motion, Rail, Running
from tests.railenv.contacts import (
    HALF_GAUGE,
    LAWS,
    SMOOTH,
    STEP,
    TANGENT,
    assert_hunts_from,
    critical_speed,
    hollow,
    jacobian,
    laws,
    loaded,
    moving,
    numbers,
    on_round_rail,
    other,
    pair,
    rail_energy,
    rest,
    straight,
    without_creep,
)

P = numbers()
NO_SPIN = other(P, lateral_spin_creep=0.0, spin_creep=0.0)
TABLE_1, COACH = railenv.TABLE_1, railenv.HIGH_SPEED_COACH


def random_wheelsets(rng, count):
    """Draw wheelsets pressed in or lifted, on one side or both, creeping little up to sliding."""
    for _ in range(count):
        violence = 10.0 ** rng.uniform(-4.0, 1.5)
        displacements = rng.uniform(-1.0, 1.0, 4) * [2e-2, 2e-3, 8e-3, 5e-2]
        run = Running(rng.uniform(1.0, 150.0), rng.uniform(-4e-3, 4e-3), 0.1)
        yield Motion(*displacements, *(violence * rng.uniform(-1.0, 1.0, 4))), run


# --------------------------------------------------------------- the normal contact's energy

ON_THE_WAY = (0.0, -1e-3, 0.0, 0.0)  # y, z, phi, psi about which the loops below go
TREAD = np.array([2e-3, 2e-4, 3e-4, 5e-3])
UP_THE_FLANGE = np.array([1.4e-2, 3e-4, 5e-4, 5e-3])


def along_a_loop(place, p, points=4000):
    """Work (J) of the rails' forces round a closed path, and that of its forward parts alone."""
    turn = 2.0 * np.pi * np.arange(points) / points
    # each coordinate to a rhythm of its own, so that the path encloses areas in all planes
    path, slope = [], []
    for centre, size, rhythm, start in zip(
        ON_THE_WAY, place, (1, 2, 1, 3), (0, 1, 2, 0.5), strict=True
    ):
        path.append(centre + size * np.sin(rhythm * turn + start))
        slope.append(size * rhythm * np.cos(rhythm * turn + start))
    power = np.array(
        [
            moving(contact(Motion(*q, 0.0, 0.0, 0.0, 0.0), SMOOTH, TANGENT, p)) @ dq
            for q, dq in zip(np.transpose(path), np.transpose(slope), strict=True)
        ]
    )
    step = 2.0 * np.pi / points
    return power.sum() * step, np.maximum(power, 0.0).sum() * step


@pytest.mark.parametrize("place", [TREAD, UP_THE_FLANGE], ids=["tread", "flange"])
@pytest.mark.parametrize("law", LAWS)
def test_rails_without_friction_do_no_work_round_a_closed_path(law, place):
    p = without_creep(numbers(laws()[law]), flange_clearance=6e-3)
    round_it, one_way = along_a_loop(place, p)
    assert one_way > 5.0
    assert abs(round_it) < 1e-5 * one_way


def test_path_of_the_flange_reaches_it():
    # what the test above rests on: springs and steep profiles are touched
    p = without_creep(numbers(laws()["profiles"]))
    steep = point(+1, loaded(y=1.3e-2), SMOOTH, p).touch.slope
    assert steep > 1.5
    spring = flange_force(1.3e-2, other(P, flange_clearance=6e-3))
    assert spring > 1e4


@pytest.mark.parametrize("law", LAWS)
def test_forces_of_the_rails_are_the_slope_of_their_energy(law):
    p = without_creep(numbers(laws()[law]))
    rail = Rail(4e-4, 2e-4, -3e-4)
    rng = np.random.default_rng(2)
    for _ in range(25):
        q = (rng.uniform(-1.0, 1.0, 4) * [2.5e-2, 6e-4, 1.5e-3, 1e-2] + ON_THE_WAY).tolist()
        found = moving(contact(Motion(*q, 0.0, 0.0, 0.0, 0.0), rail, TANGENT, p))
        expected = []
        for i in range(4):
            moved = [complex(value, STEP * (i == j)) for j, value in enumerate(q)]
            expected.append(-np.imag(rail_energy(moved, p, rail)) / STEP)
        assert_allclose(found, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())


# ------------------------------------------------------------------------ laws in the limit


def cones(conicity):
    """Return every law with the numbers that make it a cone."""
    pair = on_round_rail(straight(conicity), math.atan(conicity), 0.05)
    return {
        "linear": railenv.LinearProfile(conicity, conicity, 0.0),
        "arcs": railenv.ArcProfile(conicity, 1e13, 0.0),
        "hollow": railenv.HollowTread(conicity, conicity, 1e-12),
        "profiles": pair,
        "family": railenv.ProfileFamily(pair, pair, 0.5),
    }


CONICITY = 0.1
STEEP = cones(CONICITY)
# no flange, since profiles here have none and a spring's blend has a tail; rails stiff to the side
BARE = COACH.replace(
    half_gauge=HALF_GAUGE, wheel_radius=0.46, flange_clearance=1e4, lateral_rail_stiffness=1e18
)


@pytest.mark.parametrize("law", STEEP)
def test_every_law_becomes_the_cone(law, operations):
    plain = BARE.replace(conicity=CONICITY)
    cone, found = (railenv.Bogie(v) for v in (plain, plain.replace(contact=STEEP[law])))
    for o in operations(cone, 15, seed=3):
        o.x[[0, 4]] = np.clip(o.x[[0, 4]], -8e-3, 8e-3)  # as far as the profiles go
        expected = np.array(cone.plain_rhs(*o.arguments))
        assert_allclose(
            found.plain_rhs(*o.arguments), expected, rtol=0, atol=1e-10 * np.abs(expected).max()
        )


@pytest.mark.parametrize("law", STEEP)
def test_every_law_becomes_the_cone_in_the_critical_speed(law):
    cone = critical_speed(railenv.Bogie(BARE.replace(conicity=CONICITY)), near=108.6)
    found = critical_speed(railenv.Bogie(BARE.replace(contact=STEEP[law])), near=108.6)
    assert found == pytest.approx(cone, rel=1e-9)


@pytest.mark.parametrize("wheel_radius", [0.33, 0.4, 0.5])
def test_sampled_arcs_hunt_as_arcs_in_closed_form(wheel_radius):
    # on a pair of profiles roll does not move the contact round the rail's head, on arcs it does
    angle, rail_radius = 0.05, 0.3
    points = hollow(wheel_radius, math.atan(angle))
    sampled = on_round_rail(points, math.atan(angle), rail_radius, width=1e-6, step=5e-6)
    arcs = railenv.ArcProfile(angle, wheel_radius, rail_radius)
    exact = critical_speed(
        railenv.Bogie(BARE.replace(contact=arcs)), {0.33: 57.4, 0.4: 89.7, 0.5: 103.2}[wheel_radius]
    )
    assert critical_speed(railenv.Bogie(BARE.replace(contact=sampled)), exact) == pytest.approx(
        exact, rel=0.01
    )


# --------------------------------------------------------------- arcs against their geometry


def rolling_rates(p):
    """Return what both wheels on rigid rails do over a lateral shift of the wheelset.

    Rates of the roll, of half the radius difference, and of half the difference of the contact
    angles against the track: Wickens' roll, conicity and contact-angle parameter (1/m, 1, 1/m).
    """

    def moved(y=0.0, z=0.0, phi=0.0):
        w = Motion(y, z, phi, 0.0, 0.0, 0.0, 0.0, 0.0)
        left, right = (point(side, w, SMOOTH, p) for side in (+1, -1))
        angles = [c.touch.slope for c in (left, right)]
        return left.compression - right.compression, 0.5 * (left.radius - right.radius), angles

    def by(**shift):
        name = next(iter(shift))
        gap, radius, slopes = moved(**{name: complex(0.0, STEP)})
        turns = [np.imag(s) / STEP / (1.0 + np.real(s) ** 2) for s in slopes]
        return np.array([np.imag(gap), np.imag(radius), 0.5 * STEP * (turns[0] - turns[1])]) / STEP

    by_y, by_roll = by(y=1.0), by(phi=1.0)
    roll = -by_y[0] / by_roll[0]
    conicity, angle = by_y[1:] + roll * by_roll[1:]
    return roll, conicity, angle + roll


@pytest.mark.parametrize("wheel_radius", [0.33, 0.5, 5.0])
@pytest.mark.parametrize("slope", [0.01, 0.05, 0.2])
def test_arcs_are_those_of_wickens(slope, wheel_radius):
    rail = 0.3
    p = numbers(railenv.ArcProfile(slope, wheel_radius, rail))
    a, r = p.half_gauge, p.wheel_radius
    sine = slope / math.hypot(1.0, slope)
    cosine = sine / slope
    apart = wheel_radius - rail
    lever = (a + rail * sine) / (a - r * slope)
    roll = slope / (a - r * slope)
    conicity = wheel_radius * slope / apart * lever
    angle = lever / (apart * cosine) + roll
    assert_allclose(rolling_rates(p), (roll, conicity, angle), rtol=1e-9)


def test_flat_arcs_are_the_textbook_formulas_of_small_angles():
    d, wheel_radius, rail = 1e-4, 0.33, 0.3
    p = numbers(railenv.ArcProfile(d, wheel_radius, rail))
    a, r = p.half_gauge, p.wheel_radius
    apart = wheel_radius - rail
    roll, conicity, angle = rolling_rates(p)
    textbook = wheel_radius * d / apart * (a + rail * d) / (a - r * d)
    assert conicity == pytest.approx(textbook, rel=1e-6)
    assert a * roll == pytest.approx(d * a / (a - r * d), rel=1e-6)
    assert a * angle == pytest.approx(a / apart * (a + wheel_radius * d) / (a - r * d), rel=1e-6)


def test_hollow_treads_are_the_linear_part_of_arcs_told_by_their_conicity():
    slope, rail, wheel_radius = 0.034, 0.3, 0.36
    conicity = slope * wheel_radius / (wheel_radius - rail)
    hollow_tread = railenv.HollowTread(conicity, slope, rail)
    arcs = railenv.ArcProfile(slope, wheel_radius, rail)
    # but for the third power of the cosine
    assert_allclose(hollow_tread.linear(), arcs.linear(), rtol=2e-3)
    alike = numbers(railenv.LinearProfile(*hollow_tread.linear()))
    found = numbers(hollow_tread)
    for y in (-4e-3, 0.0, 2e-3, 8e-3):
        w = loaded(y=y, phi=3e-4, psi=2e-3, dy=0.01)
        expected = moving(contact(w, SMOOTH, TANGENT, alike))
        assert_allclose(moving(contact(w, SMOOTH, TANGENT, found)), expected, rtol=1e-10)


@pytest.mark.parametrize("y", [1e-3, 3e-3])
def test_a_wheelset_on_arcs_stands_where_rigid_circles_let_it(y):
    """Two circles of each side that touch, moved as a rigid body: nothing of the laws is in it."""
    slope, wheel_radius, rail = 0.05, 0.35, 0.3
    p = numbers(railenv.ArcProfile(slope, wheel_radius, rail))
    a, r, angle = p.half_gauge, p.wheel_radius, math.atan(slope)
    down = {s: np.array([s * math.sin(angle), -math.cos(angle)]) for s in (+1, -1)}
    heads = {s: np.array([s * a, -r]) + rail * down[s] for s in (+1, -1)}
    treads = {s: np.array([s * a, -r]) + wheel_radius * down[s] for s in (+1, -1)}

    def turned(phi):
        return np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]])

    def centre(s, z, phi):
        return np.array([y, z]) + turned(phi) @ treads[s]

    def apart(q):
        return [(math.dist(centre(s, *q), heads[s]) - (wheel_radius - rail)) * 1e6 for s in (+1, -1)]

    z, phi = fsolve(apart, [0.0, 0.0], xtol=1e-11)
    w = Motion(y, z, phi, 0.0, 0.0, 0.0, 0.0, 0.0)
    for s in (+1, -1):
        out = (centre(s, z, phi) - heads[s]) / (wheel_radius - rail)  # from the rail's centre down
        touching = heads[s] - rail * out
        local = turned(-phi) @ (touching - [y, z])
        found = point(s, w, SMOOTH, p)
        assert abs(found.compression) < 1e-8
        assert found.radius == pytest.approx(-local[1], abs=2e-6)
        assert found.arm == pytest.approx(touching[0] - y, abs=2e-5)
        # out leans outwards where the plane rises towards the flange
        assert found.incline == pytest.approx(s * out[0] / -out[1], rel=2e-3, abs=2e-5)


# -------------------------------------------------------------- kinematic motion and weight


@pytest.mark.parametrize(("conicity", "wavelength"), [(0.05, 16.100), (0.2, 8.050), (0.4, 5.692)])
def test_free_wheelset_hunts_at_klingels_wavelength(conicity, wavelength):
    springs = [n for n in TABLE_1.parameters() if n.startswith(("primary_", "yaw_damper_"))]
    springs.remove("primary_arm")
    vehicle = TABLE_1.replace(
        conicity=conicity,
        body_mass=0.0,
        lateral_spin_creep=0.0,
        spin_creep=0.0,
        wheelset_pitch_inertia=0.0,
        vertical_rail_stiffness=1e10,
        **dict.fromkeys(springs, 0.0),
    )
    model, speed = railenv.DualWheelset(vehicle), 0.5
    x = rest(model, speed)
    eigenvalues = np.linalg.eigvals(jacobian(model, x, speed))
    hunting = eigenvalues[(eigenvalues.imag > 1e-3) & (np.abs(eigenvalues) < 20.0)]
    assert len(hunting) == 2  # one for each of the two wheelsets
    found = 2.0 * math.pi * speed / hunting.imag
    assert_allclose(found, wavelength, rtol=2e-3)
    assert_allclose(found, vehicle.klingel_wavelength, rtol=2e-3)
    assert_allclose(hunting.real, 0.0, atol=1e-2 * hunting.imag.min())


@pytest.mark.parametrize(("conicity", "times"), [(0.05, 2.10), (0.2, 2.51), (0.4, 3.43)])
def test_gravitational_stiffness_is_that_of_a_rigid_wheelset_on_rigid_rails(conicity, times):
    weight = 1e5
    p = without_creep(numbers(railenv.Cone(conicity)), vertical_rail_stiffness=1e12)
    p.flange_clearance = 1e6
    q = [0.0, -0.5 * weight / p.vertical_rail_stiffness / 1.0, 0.0, 0.0]
    columns = []
    for i in range(3):
        moved = [complex(value, STEP * (i == j)) for j, value in enumerate(q)]
        force = moving(contact(Motion(*moved, 0.0, 0.0, 0.0, 0.0), SMOOTH, TANGENT, p))
        columns.append(-np.imag(force[:3]) / STEP)
    K = np.array(columns).T
    held = K[0, 0] - K[0, 1:] @ np.linalg.solve(K[1:, 1:], K[1:, 0])  # as height and roll follow
    unit = weight * conicity / p.half_gauge
    k = p.wheel_radius * conicity / p.half_gauge
    closed = 2.0 / (1.0 - k) + (k + conicity**2) / (1.0 - k) ** 2
    assert held / unit == pytest.approx(closed, rel=1e-4)
    assert held / unit == pytest.approx(times, rel=2e-3)


@pytest.mark.parametrize(
    ("model", "speed", "frequency"),
    [
        (railenv.Bogie(TABLE_1), 12.460, 0.7627),
        (railenv.DualWheelset(TABLE_1), 34.175, 1.8681),
        (railenv.Bogie(COACH), 116.471, 3.1134),
        (railenv.Bogie(COACH.replace(conicity=0.2)), 103.489, 6.4254),
        (railenv.Bogie(COACH.replace(contact=railenv.LinearProfile(0.2, 0.03, 13.6))), 92.08, 6.193),
    ],
    ids=["Table 1", "dual wheelset", "coach", "coach, conicity 0.2", "coach, linear profile"],
)
def test_critical_speeds_are_those_of_an_independent_program(model, speed, frequency):
    assert_hunts_from(model, speed, frequency)


# -------------------------------------------------------------------------- adhesion


def wheels_with(beta, load=5e4):
    """Return two alike wheels whose linear creep forces are beta times the adhesion limit."""
    normal = Normal(load, 0.0, 0.0, 0.0, load)
    return [
        Wheel(point(s, loaded(), SMOOTH, P), normal, beta * P.friction * load, 0.0, 0.0)
        for s in (+1, -1)
    ]


def share(beta, p=P):
    """Return the share of the linear creep forces that wheels transmit."""
    left, right = saturation(*wheels_with(beta), p)
    assert left == right
    return left


OPTIONS = {
    "heuristic": P,
    "heuristic, wheel": numbers(saturation_of="wheel"),
    "polach": numbers(saturation="polach", polach_adhesion=0.8, polach_slip=0.4),
    "polach, wheel": numbers(saturation="polach", saturation_of="wheel"),
    "load": numbers(load_dependent_creep=True),
    "profiles, load, wheel": numbers(
        laws()["profiles"], load_dependent_creep=True, saturation_of="wheel"
    ),
}


@pytest.mark.parametrize("p", OPTIONS.values(), ids=OPTIONS)
def test_creep_forces_never_exceed_the_adhesion(p):
    rng = np.random.default_rng(1)
    usage, lifted = [], 0
    for w, run in random_wheelsets(rng, 1500):
        wheels = pair(w, p, run)
        alphas = saturation(*wheels, p)
        force = [
            alpha * math.hypot(c.creep_x, c.creep_y) for c, alpha in zip(wheels, alphas, strict=True)
        ]
        limit = [p.friction * c.normal.magnitude for c in wheels]
        assert all(0.0 < alpha <= 1.0 for alpha in alphas)
        if p.saturation_of == "wheelset":
            force, limit = [sum(force)], [sum(limit)]
        for f, most in zip(force, limit, strict=True):
            assert f <= most * (1.0 + 1e-12)
            usage.append(f / most if most else 0.0)
        lifted += (wheels[0].normal.magnitude == 0.0) != (wheels[1].normal.magnitude == 0.0)
    # the sample has to reach the limit, stay far from it, and lift single wheels
    assert max(usage) > 0.99
    assert np.quantile(usage, 0.05) < 0.5
    assert lifted > 50


@pytest.mark.parametrize("p", OPTIONS.values(), ids=OPTIONS)
def test_all_that_creep_does_to_a_wheelset_is_within_adhesion(p):
    """The resultant of the rails less that without friction, in its three directions."""
    rng = np.random.default_rng(2)
    for _ in range(40):
        y, phi, psi = rng.uniform(-1.0, 1.0, 3) * [4e-3, 5e-4, 5e-3]
        huge = 10.0 ** rng.uniform(0.0, 4.0)
        rates = huge * rng.uniform(-1.0, 1.0, 4)
        w = loaded(y=y, phi=phi, psi=psi, dy=rates[0], dz=rates[1], dphi=rates[2], dpsi=rates[3])
        wheels = rail_forces(w, SMOOTH, TANGENT, p)
        normal = rail_forces(w, SMOOTH, TANGENT, without_creep(p))
        limits = [p.friction * c.normal.magnitude for c in pair(w, p)]
        sizes = [
            math.hypot(f.force_x - n.force_x, f.force_y - n.force_y, f.force_z - n.force_z)
            for f, n in zip(wheels, normal, strict=True)
        ]
        wide = math.hypot(1.0, psi)  # what small angles of yaw add
        if p.saturation_of == "wheel":
            assert all(f <= most * wide * (1 + 1e-9) for f, most in zip(sizes, limits, strict=True))
        assert sum(sizes) <= sum(limits) * wide * (1 + 1e-9)
        assert sum(sizes) > 0.9 * sum(limits)  # it slides


def test_wheels_saturated_alone_keep_their_own_adhesion():
    # one wheel nearly off the rail: together they lend it the other's adhesion, alone not
    w = loaded(phi=1.35e-3, dy=1.0)
    together, alone = P, OPTIONS["heuristic, wheel"]
    for p, lends in ((together, True), (alone, False)):
        wheels = pair(w, p)
        light = min(range(2), key=lambda i: wheels[i].normal.magnitude)
        alphas = saturation(*wheels, p)
        force = alphas[light] * creep_magnitude(wheels[light])
        assert (force > 1.01 * p.friction * wheels[light].normal.magnitude) == lends


def test_saturation_joins_smoothly_where_sliding_sets_in():
    below, above = 3.0 - 1e-9, 3.0 + 1e-9
    assert share(below) == pytest.approx(1.0 / 3.0, abs=1e-9)
    assert share(above) == pytest.approx(1.0 / 3.0, abs=1e-9)
    slopes = [share(complex(b, STEP)).imag / STEP for b in (below, above)]
    # -1/3 + 2 beta/27 and -1/beta^2 at beta = 3
    assert_allclose(slopes, -1.0 / 9.0, atol=1e-8)


def test_saturation_follows_the_cubic_law_and_then_slides():
    for beta in (0.1, 1.0, 2.5, 2.95, 2.99):
        # force over adhesion, the law as Vermeulen and Johnson have it
        assert beta * share(beta) == pytest.approx(1.0 - (1.0 - beta / 3.0) ** 3, rel=1e-10)
    for beta in (3.01, 3.5, 10.0, 1e4):
        assert beta * share(beta) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    "law", [creep.heuristic, lambda beta: creep.polach(beta, 1.0, 1.0)], ids=["heuristic", "polach"]
)
def test_saturation_laws_are_monotone_and_their_force_never_falls(law):
    betas = np.linspace(1e-3, 6.0, 1201)
    alphas = np.array([law(b) for b in betas])
    assert (np.diff(alphas) < 0.0).all()
    assert (np.diff(betas * alphas) > -1e-12).all()
    assert betas[-1] * law(betas[-1]) <= 1.0 + 1e-12


def test_polach_starts_with_the_slope_of_the_heuristic_law_and_ends_at_adhesion():
    small = 1e-6
    assert creep.polach(small, 1.0, 1.0) == pytest.approx(1.0, abs=1e-6)
    assert creep.heuristic(small) == pytest.approx(1.0, abs=1e-6)
    assert creep.polach(small, 0.6, 0.2) == pytest.approx(0.4, abs=1e-6)
    assert 1e6 * creep.polach(1e6, 0.6, 0.2) == pytest.approx(1.0, rel=1e-4)
    polach = OPTIONS["polach"]
    beta = 1.7
    assert share(beta, polach) == pytest.approx(creep.polach(beta, 0.8, 0.4), rel=1e-8)
    # the closed form as printed: 2/pi (k_A e/(1 + (k_A e)^2) + atan(k_S e)), e = pi beta/4
    e = math.pi * beta / 4.0
    printed = 2.0 / math.pi * (0.8 * e / (1.0 + (0.8 * e) ** 2) + math.atan(0.4 * e))
    assert beta * share(beta, polach) == pytest.approx(printed, rel=1e-8)


def test_derivatives_are_finite_at_zero_creep():
    left, right = wheels_with(complex(0.0, STEP))
    assert all(alpha.imag == 0.0 for alpha in saturation(left, right, P))
    assert creep_magnitude(left).imag == 0.0


def test_all_creep_is_saturated_alike():
    # forces in all directions and the spin moment: what alpha multiplies is everything
    w = loaded(y=3e-3, psi=2e-3, dy=4.0, dpsi=2.0)
    normal, steep = (numbers(railenv.Cone(0.4), **{}) for _ in range(2))
    normal = without_creep(normal)
    run = TANGENT
    left, right = rail_forces(w, SMOOTH, run, steep)
    bare = rail_forces(w, SMOOTH, run, normal)
    wheels = pair(w, steep)
    alphas = saturation(*wheels, steep)
    assert alphas[0] < 0.2
    for c, alpha, f, n in zip(wheels, alphas, (left, right), bare, strict=True):
        rise = c.point.side * c.point.incline / c.point.stretch
        assert f.force_z - n.force_z == pytest.approx(alpha * c.creep_y * rise, rel=1e-9)


# ---------------------------------------------------------------------- load-dependent creep


def test_creep_coefficients_follow_the_load_as_hertz_says():
    p = OPTIONS["load"]
    at_rest = p.creep_load
    assert at_rest == pytest.approx(TABLE_1.static_wheel_load)
    xi = creepages(point(+1, loaded(), SMOOTH, p), loaded(dy=0.01, dpsi=0.02), TANGENT, p)
    constants = without_growth = other(p, creep_load=None)
    by_coefficient = {
        "longitudinal_creep": (0, 2.0 / 3.0),
        "lateral_creep": (1, 2.0 / 3.0),
        "lateral_spin_creep": (2, 1.0),
        "spin_creep": (2, 4.0 / 3.0),
    }
    for name, (index, power) in by_coefficient.items():
        only = {n: 0.0 for n in by_coefficient if n != name}
        for times in (0.3, 1.0, 2.7):
            load = Normal(times * at_rest, 0.0, 0.0, 0.0, times * at_rest)
            found = kalker(xi, load, other(p, **only))[index]
            plain = kalker(xi, load, other(without_growth, **only))[index]
            assert plain != 0.0
            assert found == pytest.approx(plain * times**power, rel=1e-12)
    assert constants.creep_load is None


def test_load_dependent_creep_changes_nothing_at_the_static_load():
    load = OPTIONS["load"].creep_load
    # on a wheel that stands straight, whose normal force has the static load
    c = point(+1, loaded(), SMOOTH, P)
    w = loaded(z=-load / c.stretch / P.vertical_rail_stiffness, dy=0.05, dpsi=0.01)
    expected = moving(contact(w, SMOOTH, TANGENT, P))
    assert_allclose(moving(contact(w, SMOOTH, TANGENT, OPTIONS["load"])), expected, rtol=1e-12)
    heavier = w._replace(z=2.0 * w.z)
    now, then = (moving(contact(heavier, SMOOTH, TANGENT, p)) for p in (OPTIONS["load"], P))
    assert abs(now[0]) > 1.3 * abs(then[0])


# ------------------------------------------------------------------- loss of contact


@pytest.mark.parametrize("p", [P, OPTIONS["profiles, load, wheel"]], ids=["cone", "profiles"])
@pytest.mark.parametrize(("roll", "lifted"), [(5e-3, 0), (-5e-3, 1)])
def test_lifted_wheel_has_neither_load_nor_creep(roll, lifted, p):
    # rolling to the right (phi > 0) raises the left wheel
    w = loaded(phi=roll, dy=3.0, dpsi=0.2)
    wheels = pair(w, p)
    off, on = wheels[lifted], wheels[1 - lifted]
    assert off.point.compression < 0.0
    assert_allclose(off.normal, 0.0, atol=0.0)
    assert (off.creep_x, off.creep_y, off.creep_moment) == (0.0, 0.0, 0.0)
    assert creep_magnitude(off) == 0.0
    assert on.normal.vertical > 0.0
    assert abs(on.creep_y) > 0.0
    # and the wheel that remains has only its own adhesion
    alpha = saturation(*wheels, p)[1 - lifted]
    assert alpha * creep_magnitude(on) == pytest.approx(p.friction * on.normal.magnitude, rel=1e-9)


@pytest.mark.parametrize("p", OPTIONS.values(), ids=OPTIONS)
def test_wheelset_in_the_air_feels_no_force(p):
    w = loaded(z=5e-3, phi=1e-3, psi=0.01, dy=2.0, dphi=1.0, dpsi=-1.0)
    wheels = pair(w, p)
    assert all(0.0 < alpha <= 1.0 for alpha in saturation(*wheels, p))
    resultant = contact(w, SMOOTH, TANGENT, p)
    # the flange's blend has a tail of K w^2/(4 delta) per side, the same on both where y = 0
    assert_allclose(moving(resultant), 0.0, atol=0.0)


@pytest.mark.parametrize("law", LAWS)
def test_load_sets_in_continuously(law):
    p = numbers(laws()[law])
    lift = [wheel(+1, loaded(z=z), SMOOTH, TANGENT, p).normal.vertical for z in (-1e-12, 0.0, 1e-12)]
    zero = point(+1, loaded(z=0.0), SMOOTH, p).compression
    assert abs(zero) < 1e-8  # of tables, which have no cell's border at 0
    first = p.vertical_rail_stiffness * 1e-12
    assert_allclose(np.diff(lift), 0.0, atol=1.0001 * first)
    expected = [max(p.vertical_rail_stiffness * (zero - z), 0.0) for z in (-1e-12, 0.0, 1e-12)]
    assert_allclose(lift, expected, rtol=1e-9, atol=1e-12)


def test_normal_load_stands_at_right_angles_to_the_contact_plane():
    left, right = pair(loaded(y=2e-3, phi=4e-4), P)
    for c in (left, right):
        normal = c.normal
        assert -c.point.side * normal.lateral / normal.vertical == pytest.approx(c.point.incline)
        assert math.hypot(normal.lateral, normal.vertical) == pytest.approx(normal.magnitude)
    assert left.normal.lateral < 0.0 < right.normal.lateral  # the cones centre the wheelset
    assert left.point.incline - right.point.incline == pytest.approx(2.0 * 4e-4)


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
    the contact planes, which yaw with the wheelset. The rail stays where it is.
    """
    rows = []
    for c in pair(w, p):
        plane = turned("x", c.point.side * math.atan(c.point.incline))
        creep = turned("z", w.psi) @ plane
        F = creep @ [c.creep_x, c.creep_y, 0.0] + plane @ [0.0, 0.0, c.normal.magnitude]
        arm = [-c.point.side * p.half_gauge * w.psi, c.point.arm, -c.point.radius]
        M = np.cross(arm, F) + creep @ [0.0, 0.0, c.creep_moment]
        rows.append([F[1], F[2], M[0], M[2]])
    return np.array(rows)


@pytest.mark.parametrize("law", ["cone", "steep cone", "arcs", "profiles"])
@pytest.mark.parametrize("part", ["normal load", "lateral_creep", "longitudinal_creep", "spin_creep"])
def test_forces_of_the_rails_add_up_as_their_geometry_says(part, law):
    # One force law at a time, far from the flange, and so weak that nothing saturates. What the normal
    # loads alone give is then taken away again.
    loads = without_creep(numbers(laws()[law]), flange_clearance=1e3)
    p = other(loads, **{part: 1.0})
    # normal forces of higher order are left out; that of profiles follows no roll round the rail's head
    accuracy, small = 1e-5, 1e-6
    if part == "normal load":
        accuracy, small = (0.02 if law == "profiles" else 2e-3), 1e-5
    rng = np.random.default_rng(3)
    for _ in range(20):
        y, phi, psi = rng.uniform(-1.0, 1.0, 3) * [3e-3, 1e-3, 3e-3]
        w = loaded(y=y, phi=phi, psi=psi, dy=0.02, dphi=0.1, dpsi=0.02)
        found, expected = moving(contact(w, SMOOTH, TANGENT, loads)), rail_actions(w, loads)
        if part != "normal load":
            found = moving(contact(w, SMOOTH, TANGENT, p)) - found
            expected = rail_actions(w, p) - expected
        gross = np.abs(expected).sum(axis=0)  # the two wheels may cancel
        tolerance = accuracy * gross + small * gross.max()
        rounding = 1e-14 * P.vertical_rail_stiffness * 1e-3
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
            contact(loaded(y=y), SMOOTH, TANGENT, other(P, flange_clearance=c))
            for c in (1.0, P.flange_clearance)
        )
        push = blocked.force_y - free.force_y
        expected = -math.copysign(P.lateral_rail_stiffness * (0.012 - P.flange_clearance), y)
        assert push == pytest.approx(expected, rel=1e-4)
        assert blocked == free._replace(force_y=blocked.force_y)  # it acts at the wheelset's centre


@pytest.mark.parametrize("law", ["profiles", "family"])
def test_profiles_hold_the_wheelset_by_their_own_flange_and_no_spring(law):
    p = numbers(laws()[law])
    assert flange_force(0.02, p) == 0.0
    for y in (1.6e-2, -1.6e-2):
        w = loaded(y=y)
        c = point(int(np.sign(y)), w, SMOOTH, p)
        assert c.touch.slope > 2.0
        push = moving(contact(w, SMOOTH, TANGENT, without_creep(p)))[0]
        assert push * np.sign(y) < -5e4


def test_flange_of_profiles_is_as_stiff_as_the_rail_to_the_side():
    pair, lateral, load = laws()["profiles"], TABLE_1.lateral_rail_stiffness, 57e3
    assert load / pair.rail_yield == pytest.approx(lateral, rel=0.01)
    rigid = dataclasses.replace(pair, rail_yield=0.0)
    eta = np.linspace(4e-3, 1.3e-2, 1801)
    soft, firm = (
        np.array([made.table("profiles")(e, 1, 1) for e in eta]) * load for made in (pair, rigid)
    )
    # thrust over shift; rail and profile yield one after the other
    slope = np.array([pair.table("profiles")(e, 0, 1) for e in eta])
    climbing = (slope > 0.5) & (slope < 2.0)
    assert 0.9 * lateral < np.median(soft[climbing]) < 1.02 * lateral
    assert firm.max() > 5.0 * lateral


# ------------------------------------------------------------------- rolling kinematics


def test_wheelset_on_the_rolling_line_of_a_curve_has_no_longitudinal_creep():
    # r_L : r_R = (R + a) : (R - a) where both wheels roll; the outer rail of a positive curve is left
    for curvature in (1.0 / 1000.0, -1.0 / 3000.0):
        y = P.half_gauge * P.wheel_radius * curvature / CONE
        left, right = pair(loaded(y=y), NO_SPIN, Running(20.0, curvature, 0.0))
        straight_on, _ = pair(loaded(y=y), NO_SPIN)
        assert abs(straight_on.creep_x) > 1e3
        # left over is the product of the shift and the curvature
        left_over = NO_SPIN.longitudinal_creep * abs(y * curvature)
        assert_allclose([left.creep_x, right.creep_x], 0.0, atol=1.001 * left_over)


CONE = TABLE_1.conicity


def test_wheelset_that_rolls_where_it_points_has_no_lateral_creep():
    run = Running(40.0, 0.0, 0.0)
    psi = 2e-3
    for c in pair(loaded(psi=psi, dy=run.speed * psi), NO_SPIN, run):
        assert abs(c.creep_y) < 1e-9 * P.lateral_creep * psi
    for c in pair(loaded(psi=psi), NO_SPIN, run):
        # it is driven where it points, faster along the inclined plane than across the track
        assert c.creep_y == pytest.approx(P.lateral_creep * psi * math.hypot(1.0, CONE))


@pytest.mark.parametrize("law", ["steep cone", "profiles"])
def test_creepages_lie_in_the_contact_plane(law):
    p = numbers(laws()[law])
    w, run = loaded(y=1.6e-2, psi=2e-3, dy=0.1, dphi=0.02, dpsi=0.03), Running(25.0, 1e-3, 0.0)
    c = point(+1, w, SMOOTH, p)
    gamma = math.atan(c.touch.slope)
    assert gamma > (1.0 if law == "profiles" else 0.3)
    xi = creepages(c, w, run, p)
    across = (w.dy + c.radius * w.dphi) / run.speed - w.psi
    assert xi.y == pytest.approx(across / math.cos(gamma), rel=1e-12)
    turning = w.dpsi / run.speed - run.curvature
    assert xi.spin == pytest.approx(turning * math.cos(gamma) - math.sin(gamma) / c.radius, rel=1e-12)
    assert xi.x == pytest.approx(1.0 - c.radius / p.wheel_radius - c.arm * turning, rel=1e-12)
    there = loaded(y=-1.6e-2, psi=-2e-3)
    mirrored = creepages(point(-1, there, SMOOTH, p), there, TANGENT, p)
    assert mirrored.spin == pytest.approx(math.sin(gamma) / c.radius, rel=1e-9)


def test_displaced_wheelset_steers_back_to_the_centre_line():
    # the outer wheel, on its larger radius, runs ahead: to the left, the wheelset turns right
    assert contact(loaded(y=3e-3), SMOOTH, TANGENT, P).yaw < -1e3
    assert contact(loaded(y=-3e-3), SMOOTH, TANGENT, P).yaw > 1e3


def test_creep_force_opposes_sliding():
    for rate in (0.01, 0.1):
        assert contact(loaded(dy=rate), SMOOTH, TANGENT, NO_SPIN).force_y < 0.0
        assert contact(loaded(dpsi=rate), SMOOTH, TANGENT, NO_SPIN).yaw < 0.0


@pytest.mark.parametrize("law", LAWS)
def test_irregular_rails_count_as_displacements_of_the_wheelset(law):
    p = numbers(laws()[law])
    w = loaded(y=2e-3, phi=3e-4)
    moved = pair(w, p, rail=Rail(align=1e-3, vert=-2e-4, cross=0.0))
    expected = pair(loaded(y=1e-3, z=-0.8e-3, phi=3e-4), p)
    for c, e in zip(moved, expected, strict=True):
        assert c.point.radius == pytest.approx(e.point.radius, rel=1e-15)
        assert c.point.arm == pytest.approx(e.point.arm, rel=1e-12)
        assert_allclose(c.normal, e.normal, rtol=1e-11, atol=1e-9)
    # cross-level raises the left rail and lowers the right one; the contact plane stays absolute
    for c, plain in zip(pair(w, p, rail=Rail(0.0, 0.0, 1e-4)), pair(w, p), strict=True):
        raised = c.point.side * p.half_gauge * 1e-4
        assert c.point.compression == pytest.approx(plain.point.compression + raised, rel=1e-12)
        assert c.point.incline == plain.point.incline


# ----------------------------------------------------------------- wheels that are not alike


def wheelset(**changes):
    """Return a wheelset of an assembly, as the equations read it."""
    assembly = railenv.DualWheelset(TABLE_1).assembly
    first = next(b for b in assembly.bodies if b.name == "w1")
    one = dataclasses.replace(first, **{"contact": first.contact, "conicity": None, **changes})
    bodies = tuple(one if b is first else b for b in assembly.bodies)
    made = dataclasses.replace(assembly, bodies=bodies)
    return made.with_numbers({**made.values, **made.tables}).wheelsets[0]


PAIRS = [("cone", "steep cone"), ("hollow", "profiles"), ("linear", "arcs")]


@pytest.mark.parametrize(("one", "two"), PAIRS, ids=["-".join(p) for p in PAIRS])
def test_a_wheelset_with_its_wheels_exchanged_is_the_mirror_image(one, two):
    given = {"contact": laws()[one], "right_contact": laws()[two], "radius_difference": 1e-3}
    back = {"contact": laws()[two], "right_contact": laws()[one], "radius_difference": -1e-3}
    p, q = wheelset(**given), wheelset(**back)
    mirror = np.array([-1.0, 1.0, -1.0, -1.0])
    rng = np.random.default_rng(4)
    for w, run in random_wheelsets(rng, 40):
        w = w._replace(y=0.4 * w.y)
        there = Motion(*(mirror * w[:4]), *(mirror * w[4:8]))
        rail = Rail(5e-4, 2e-4, 3e-4)
        found = moving(contact(w, rail, run, p))
        mirrored = contact(
            there, Rail(-5e-4, 2e-4, -3e-4), Running(run.speed, -run.curvature, -run.cant), q
        )
        assert_allclose(moving(mirrored), mirror * found, rtol=1e-9, atol=1e-9 * np.abs(found).max())
        unlike = moving(contact(w, rail, run, q))
        assert w.z > 0.0 or np.abs(unlike - found).max() > 1.0


def test_same_law_on_both_sides_is_the_law_of_the_wheelset():
    law = laws()["hollow"]
    w = loaded(y=2e-3, phi=2e-4, psi=1e-3, dy=0.02)
    alike = contact(w, SMOOTH, TANGENT, wheelset(contact=law))
    assert contact(w, SMOOTH, TANGENT, wheelset(contact=law, right_contact=law)) == alike
    assert contact(w, SMOOTH, TANGENT, wheelset(contact=law, radius_difference=0.0)) == alike


def test_wheels_of_different_radius_roll_aside_of_the_centre():
    d, conicity = 4e-4, 0.1
    p = other(wheelset(contact=railenv.Cone(conicity), radius_difference=d))
    y = -d / (2.0 * conicity)
    left, right = pair(loaded(y=y), p)
    assert left.point.radius == pytest.approx(right.point.radius, rel=1e-12)
    assert contact(loaded(y=y), SMOOTH, TANGENT, p).yaw == pytest.approx(0.0, abs=1.0)
    assert abs(contact(loaded(), SMOOTH, TANGENT, p).yaw) > 1e3
