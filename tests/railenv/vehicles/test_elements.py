"""Force elements: against physics that is not written with them."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import railenv
from railenv.equations.coordinates import AT_REST, Running, Wrench
from railenv.equations.elements import Arm, End, Relative, at_centre, opposite, relative
from railenv.vehicles.elements import (
    ELEMENTS,
    Body,
    Damper,
    FrictionElement,
    LateralForce,
    RollBar,
    SeriesDamper,
    Spring,
    Stop,
)
from tests.railenv.vehicles.assemblies import (
    energy_and_loss,
    everything,
    forces_between,
    inertias,
    numbers,
    random_state,
)

TANGENT = Running(40.0, 0.0, 0.0)
STEP = 1e-30


@pytest.fixture(scope="module")
def vehicle():
    return railenv.Assembled(everything(0))


def held(*elements, **fields):
    """A body of 1000 kg that elements hold to the ground."""
    body = Body(name="b", mass=1e3, roll_inertia=800.0, yaw_inertia=900.0, pitch_inertia=700.0)
    return railenv.Assembled(railenv.Assembly(name="held", bodies=(body,), elements=elements, **fields))


def law(e, **moved):
    """Wrench on a body from one element, for a displacement of the ground against it."""
    assembly = held(e, Spring(name="link", between=("b", "ground"), k_x=1.0)).assembly
    own = next(part for part in numbers(assembly).elements if part.name == e.name)
    seen = Relative(**{**dict.fromkeys(Relative._fields, 0.0), **moved})
    return own.law(own, seen, [], [])[0]


def forces_of(assembly, x, u, run):
    """Generalised forces on all coordinates."""
    n = sum(map(len, assembly.coordinates.values()))
    rates = railenv.Assembled(assembly).plain_rhs(x.tolist(), u.tolist(), *run[:3])
    return np.array(rates[n : 2 * n]) * inertias(numbers(assembly))


def by_name(model):
    return {name: i for i, name in enumerate(model.state_names)}


# ------------------------------------------------------------------- action = reaction


def test_random_vehicle_has_every_kind_of_element():
    assert {type(e) for e in everything(1).elements} == set(ELEMENTS)


@pytest.mark.parametrize("seed", range(4))
def test_forces_between_bodies_balance_about_a_common_point(seed):
    # What is tied to the ground is left out, and inputs count too: all forces are internal.
    assembly = everything(seed)
    inner = tuple(e for e in assembly.elements if "ground" not in e.between)
    assembly = dataclasses.replace(assembly, elements=inner)
    nothing = [Spring(name=f"null_{b}", between=(b, "ground"), k_x=0.0) for b in ("b", "c")]
    inputs = [e for e in inner if e.n_inputs]
    free = dataclasses.replace(assembly, elements=(*nothing, *inputs))
    rng = np.random.default_rng(seed)
    n = sum(map(len, assembly.coordinates.values()))
    for _ in range(5):
        x = random_state(assembly, rng)
        u = np.zeros(len(assembly.input_names))
        run = Running(50.0, 1.0 / 800.0, 0.05)
        alone = forces_of(free, x[: 2 * n], u, run)
        u[:2] = 2e4, 1e4  # the yaw moment, the lateral force
        acted = forces_of(assembly, x, u, run) - alone
        force, moment = np.zeros(3), np.zeros(3)
        at = iter(acted)
        for body in numbers(assembly).bodies:
            own = {c: next(at) for c in assembly.coordinates[body.name]}
            push = np.array([0.0, own["y"], own["z"]])
            force += push
            moment += [own["phi"], own.get("theta", 0.0), own["psi"]]
            moment += np.cross([body.x, 0.0, body.z], push)
        scale = np.abs(acted).max()
        assert np.abs(acted).min() > 0.0
        assert_allclose(force, 0.0, atol=1e-12 * scale)
        # about y a share is missing: wheelsets do not pitch
        assert_allclose(moment[[0, 2]], 0.0, atol=1e-12 * scale)


def test_wrench_about_the_centre_has_the_moment_of_its_arm():
    rng = np.random.default_rng(1)
    for _ in range(10):
        arm, f, m = rng.uniform(-1.0, 1.0, (3, 3))
        found = at_centre(Arm(*arm), Wrench(*f, *m))
        assert_allclose(found[:3], f)
        assert_allclose(found[3:], m + np.cross(arm, f), rtol=1e-14, atol=1e-15)
        assert_array_equal(opposite(found), -np.array(found))


def test_bodies_that_lie_along_a_circle_see_each_other_as_on_straight_track():
    # Rigid pieces of one straight beam: their coordinates, each from the track at its own place, are
    # those of the beam against a circle, and nothing between them is stretched.
    radius, psi, offset = 3000.0, 2e-3, 5e-3
    places = {"a": -4.0, "b": 7.0}

    def body(s):
        # the circle turns away to the right of the beam: it is s^2/2R further from its line
        return AT_REST._replace(y=offset + psi * s + s * s / (2 * radius), psi=psi + s / radius)

    for point in (-6.0, 1.0, 9.0):
        arms = [Arm(point - s, 0.3, 0.0) for s in places.values()]
        run = Running(0.0, 1.0 / radius, 0.0)
        ends = [End(arm, body(s), run) for arm, s in zip(arms, places.values(), strict=True)]
        seen = relative(*ends, 0.0, 1)
        assert_allclose([seen.y, seen.yaw, seen.x], 0.0, atol=1e-14)
        straight = relative(*ends, 0.0, 0)
        assert abs(straight.yaw) > 1e-3


# ------------------------------------------------------------------------- energy


@pytest.mark.parametrize("shifting", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_power_of_all_elements_is_what_leaves_their_store_and_what_is_lost(seed, shifting):
    assembly = dataclasses.replace(everything(seed), wheelbase_curving=0.0, shifting_loads=shifting)
    rng = np.random.default_rng(100 + seed)
    n = sum(map(len, assembly.coordinates.values()))
    u = np.zeros(len(assembly.input_names))
    for size in (0.3, 1.0, 3.0):
        x = random_state(assembly, rng, size)
        forces, rates = forces_between(assembly, x, u, TANGENT)
        power = forces @ x[n : 2 * n]
        moving = np.concatenate([x[n : 2 * n], np.zeros(n), rates[2 * n :]])
        h = 1e-6
        ahead, behind = (energy_and_loss(assembly, x + step * moving)[0] for step in (h, -h))
        gained = (ahead - behind) / (2 * h)
        _, lost = energy_and_loss(assembly, x)
        assert lost > 1.0
        assert power + gained + lost == pytest.approx(0.0, abs=1e-6 * (abs(power) + abs(gained)))


# --------------------------------------------------------------------------- springs


def test_spring_at_a_place_is_a_spring_of_its_point():
    # a single spring at (x, y, z) of a held body: stiffness matrix of the point that it pulls at
    k = np.array([2e5, 3e5, 5e5])
    place = (0.4, -0.3, 0.7)
    e = Spring(
        name="s",
        between=("b", "ground"),
        **dict(zip(("k_x", "k_y", "k_z"), k, strict=True)),
        **dict(zip("xyz", place, strict=True)),
    )
    model = held(e)
    A = model.jacobian(np.zeros(10), speed=10.0)[0]
    K = -A[5:, :5] * inertias(numbers(model.assembly))[:, None]
    X, Y, Z = place
    # displacement of the point for each of y, z, phi, theta, psi
    J = np.array([[0, 0, 0, Z, -Y], [1, 0, -Z, 0, X], [0, 1, Y, -X, 0]])
    assert_allclose(K, J.T @ np.diag(k) @ J, rtol=1e-12, atol=1e-9 * np.abs(K).max())


@pytest.mark.parametrize("pair", [False, True])
def test_roll_bar_resists_roll_and_nothing_else(pair):
    bars = [RollBar(name="bar", between=("b", "ground"), k=2e5, c=3e3, y=0.5, z=0.4, x=0.1)]
    A = held(*bars).jacobian(np.zeros(10), speed=10.0)[0]
    expected = np.zeros((5, 10))
    expected[2, [2, 7]] = -2e5 / 800.0, -3e3 / 800.0
    assert_allclose(A[5:], expected, rtol=1e-12)


# -------------------------------------------------------------------- series damper


@pytest.mark.parametrize("pair", [False, True])
def test_series_damper_has_the_complex_stiffness_of_maxwells_element(pair):
    k, c, count = 8e6, 2e5, 2 if pair else 1
    e = SeriesDamper(name="m", between=("b", "ground"), axis="y", pair=pair, y=1.2, k=k, c=c)
    model = held(e)
    assert model.n_states == 10 + count
    A = model.jacobian(np.zeros(model.n_states), speed=10.0)[0]
    force, rate = 1e3 * A[5], A[10:]  # N, of the row of dy; and the element's own states
    for omega in (1.0, k / c, 1e4):
        # y moves as exp(i omega t); the states follow, and the force is what it takes
        q = np.linalg.solve(1j * omega * np.eye(count) - rate[:, 10:], rate[:, 0] + 0j)
        dynamic = -(force[0] + force[10:] @ q)
        assert dynamic == pytest.approx(count * k * 1j * omega * c / (k + 1j * omega * c), rel=1e-12)


def test_series_damper_with_a_straight_table_is_one_with_a_constant():
    straight = SeriesDamper(
        name="m", between=("b", "ground"), axis="y", k=8e6, force=([0.0, 0.1, 0.4], [0.0, 2e4, 8e4])
    )
    constant = SeriesDamper(name="m", between=("b", "ground"), axis="y", k=8e6, c=2e5)
    x = np.linspace(-1e-3, 2e-3, 11)
    found = [held(e).rhs(x, speed=10.0) for e in (straight, constant)]
    assert_allclose(found[0], found[1], rtol=1e-12, atol=1e-12)


def test_stiff_rubber_leaves_the_damper_alone_after_a_while():
    # its own state settles within c/k, 25 microseconds here; then the force is c v
    e = SeriesDamper(name="m", between=("b", "ground"), axis="y", k=8e9, c=2e5)
    model = held(e)
    v = 0.02
    x = np.zeros(11)
    x[5], x[10] = v, v * 2e5 / 8e9  # stretched by the steady force: state = y - c v / k
    acceleration = model.rhs(x, speed=10.0)[5]
    assert abs(acceleration) == pytest.approx(2e5 * v / 1e3)


# ------------------------------------------------------------------------------ stop

_CLEARANCE = 0.02
_POINTS = ([_CLEARANCE, 0.025, 0.03, 0.045], [0.0, 696.0, 2107.0, 30096.0])


@pytest.mark.parametrize(("axis", "force"), [("x", "force_x"), ("y", "force_y"), ("z", "force_z")])
def test_stop_is_free_within_its_clearance_and_follows_its_table_beyond(axis, force):
    e = Stop(name="s", between=("b", "ground"), axis=axis, force=_POINTS)
    cell = np.diff(e.table("force").x).max()

    def of(d):
        return getattr(law(e, **{axis: d}), force)

    for d in np.linspace(0.0, _CLEARANCE - 1.01 * cell, 50):
        assert of(d) == 0.0
        assert of(-d) == 0.0
    assert 0.0 <= of(_CLEARANCE) < 1.0
    for d, expected in zip(*_POINTS, strict=True):
        assert of(d) == pytest.approx(expected, rel=2e-3, abs=1.0)
        assert of(-d) == pytest.approx(-of(d), rel=1e-12)
    deep = np.linspace(_CLEARANCE, 0.08, 500)
    assert (np.diff([of(d) for d in deep]) > 0.0).all()
    # beyond its last point it goes on with the last slope
    assert of(0.10) - of(0.09) == pytest.approx(of(0.07) - of(0.06), rel=1e-9)


def test_stops_of_a_pair_are_touched_one_by_one_as_the_body_rolls():
    e = Stop(name="s", between=("b", "ground"), axis="z", pair=True, y=1.0, force=_POINTS)
    one = Stop(name="s", between=("b", "ground"), axis="z", force=_POINTS)
    both = law(e, z=0.015, roll=0.015)  # the left one by 30 mm, the right one not at all
    single = law(one, z=0.03).force_z
    assert both.force_z == single
    assert both.roll == single


# ------------------------------------------------------------- dampers and friction


def test_damper_follows_its_table_both_ways():
    speeds, forces = [0.0, 0.1, 0.3], [0.0, 5880.0, 10800.0]
    e = Damper(name="d", between=("b", "ground"), force=(speeds, forces))
    for v, f in zip(speeds, forces, strict=True):
        assert law(e, dy=v).force_y == pytest.approx(f, rel=1e-3)
        assert law(e, dy=-v).force_y == pytest.approx(-f, rel=1e-3)


def test_pair_of_longitudinal_dampers_resists_yaw_by_its_arm():
    e = Damper(name="d", between=("b", "ground"), axis="x", pair=True, y=1.35, c=2e5)
    wrench = law(e, dyaw=0.01)
    assert wrench.yaw == pytest.approx(2 * 1.35**2 * 2e5 * 0.01)
    assert (wrench.force_x, wrench.force_y, wrench.roll) == (0.0, 0.0, 0)


def test_friction_opposes_sliding_and_is_bounded():
    e = FrictionElement(name="f", between=("b", "ground"), force=3e3, width=0.01)
    for v in (1e-5, 0.01, 1.0):
        force = law(e, dy=v).force_y
        assert 0.0 < force < 3e3
        assert law(e, dy=-v).force_y == -force
    assert law(e, dy=0.01).force_y == pytest.approx(3e3 / math.sqrt(2.0))
    assert law(e, dy=10.0).force_y == pytest.approx(3e3, rel=1e-5)


# ----------------------------------------------------------------- inputs, derivatives


def test_lateral_force_at_a_place_pushes_and_turns(vehicle):
    _, B = vehicle.jacobian(np.zeros(vehicle.n_states), speed=40.0)
    state, column = by_name(vehicle), vehicle.input_names.index("F")
    p = numbers(vehicle.assembly)
    e = next(e for e in p.elements if e.name == "F")
    assert isinstance(next(e for e in vehicle.assembly.elements if e.name == "F"), LateralForce)
    for sign, body in ((+1, p.body("b")), (-1, p.body("c"))):
        for rate, expected in (
            (f"dy_{body.name}", 1.0 / body.mass),
            (f"dphi_{body.name}", -(e.z - body.z) / body.roll_inertia),
            (f"dpsi_{body.name}", (e.x - body.x) / body.yaw_inertia),
        ):
            assert B[state[rate], column] == pytest.approx(sign * expected, rel=1e-12)


def test_compiled_jacobian_is_the_complex_step_of_every_element(vehicle):
    rng = np.random.default_rng(5)
    n, m = vehicle.n_states, vehicle.n_inputs
    for seed in range(4):
        model = railenv.Assembled(everything(seed))
        assert model.structure == vehicle.structure
        x, u = random_state(model.assembly, rng, 2.0), rng.uniform(-1e-4, 1e-4, m)
        point = [*x, *u, 40.0, 1.0 / 900.0, 0.04]
        expected = np.empty((n, n + m + 3))
        for j in range(n + m + 3):
            z = [complex(v, STEP * (i == j)) for i, v in enumerate(point)]
            rates = model.plain_rhs(z[:n], z[n : n + m], *z[n + m :])
            expected[:, j] = [complex(r).imag / STEP for r in rates]
        run = dict(zip(("speed", "curvature", "cant"), point[n + m :], strict=True))
        A, B = model.jacobian(x, u, **run)
        found = np.hstack([A, B, model.condition_jacobian(x, u, **run)])
        size = np.abs(expected).max(axis=1, keepdims=True)
        assert_allclose(found / size, expected / size, rtol=0, atol=1e-11)


def test_kernel_of_every_element_is_the_equations(vehicle):
    rng = np.random.default_rng(6)
    for size in (0.1, 1.0, 5.0):
        x = random_state(vehicle.assembly, rng, size)
        u = rng.uniform(-1e-4, 1e-4, vehicle.n_inputs)
        run = {"speed": 40.0, "curvature": -1e-3, "cant": -0.05}
        expected = np.array(vehicle.plain_rhs(x.tolist(), u.tolist(), *run.values()))
        found = vehicle.rhs(x, u, **run)
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()
