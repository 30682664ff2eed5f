"""What must hold whatever the numbers: symmetry, weight, moment balance and rolling without forces."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import railenv
from railenv.equations import creep
from railenv.equations.coordinates import Running

CANT = 0.0873  # rad, 131 mm over 1.5 m
RADIUS = 6250.0  # m

CURVING = railenv.HIGH_SPEED_COACH.replace(wheelbase_curving=True, secondary_longitudinal_damping=2e5)
MIRRORED = {
    "bogie": railenv.Bogie(railenv.TABLE_1),
    "bogie, printed loads": railenv.Bogie(railenv.TABLE_1_PRINTED_LOADS),
    "bogie, wheelbase curving": railenv.Bogie(CURVING),
    "dual wheelset": railenv.DualWheelset(railenv.TABLE_1),
    "dual wheelset, printed loads": railenv.DualWheelset(railenv.TABLE_1_PRINTED_LOADS),
    "dual wheelset, wheelbase curving": railenv.DualWheelset(CURVING),
    "cooperrider": railenv.CooperriderBogie(),
}


def signs(names):
    """Sign of each signal in the mirror image; what is vertical stays as it is."""
    return np.array([1.0 if "z_" in n or n.startswith("vert") else -1.0 for n in names])


def rail_loads(model, equilibrium):
    """Vertical force of the rails on the left and right wheel of each wheelset (N)."""
    run = Running(equilibrium.speed, 1.0 / equilibrium.radius, equilibrium.cant)
    p = SimpleNamespace(**model.parameters, **model.tables)
    still = [0.0] * model.n_inputs
    forces = model.equations.guiding_forces(equilibrium.state.tolist(), still, run, p)
    return np.reshape(forces, (-1, 2, 2))[:, :, 1]


# -------------------------------------------------------------------------- symmetry


@pytest.mark.parametrize("model", MIRRORED.values(), ids=MIRRORED)
def test_curve_of_the_other_hand_is_the_mirror_image(model, operations):
    mirror_x, mirror_u = signs(model.state_names), signs(model.input_names)
    for o in operations(model, 25, seed=1):
        here = model.rhs(o.x, o.u, **o.conditions)
        there = model.rhs(
            mirror_x * o.x, mirror_u * o.u, speed=o.speed, curvature=-o.curvature, cant=-o.cant
        )
        # left and right are summed in another order
        assert_allclose(there, mirror_x * here, rtol=1e-12, atol=1e-13 * np.abs(here).max())


@pytest.mark.parametrize("kind", [railenv.Bogie, railenv.DualWheelset])
def test_wheelbase_curving_acts_on_a_curve(kind, operations):
    # without this the mirror image of a switch without effect would prove nothing
    on, off = kind(CURVING), kind(CURVING.replace(wheelbase_curving=False))
    o = operations(on, 1, seed=2)[0]
    difference = on.rhs(o.x, o.u, **o.conditions) - off.rhs(o.x, o.u, **o.conditions)
    assert np.abs(difference).max() > 1.0


@pytest.mark.parametrize("direction", ["lateral", "vertical"])
def test_displacing_track_and_vehicle_together_changes_nothing(bogie, operations, direction):
    # Table 1 has no secondary suspension, so nothing but the rails says where the bogie is
    state, rail, far = {"lateral": ("y_", "align", 0.7), "vertical": ("z_", "vert", -0.3)}[direction]
    shift_x = far * np.array([name.startswith(state) for name in bogie.state_names])
    shift_u = far * np.array([name.startswith(rail) for name in bogie.input_names])
    for o in operations(bogie, 10, seed=3):
        here = bogie.rhs(o.x, o.u, **o.conditions)
        there = bogie.rhs(o.x + shift_x, o.u + shift_u, **o.conditions)
        # the last digit of 0.7 m, 1e-16 m, times the stiffness of the rails remains
        assert_allclose(there, here, rtol=1e-9, atol=1e-9 * np.abs(here).max())
        alone = bogie.rhs(o.x + shift_x, o.u, **o.conditions)
        assert np.abs(alone - here).max() > 1.0


def test_bogie_with_its_frame_held_is_the_dual_wheelset_but_for_the_load(bogie, dual, operations):
    # the bogie's frame passes its load on through the springs, the dual wheelset carries it itself
    v = bogie.vehicle
    names = bogie.state_names
    held = [i for i, name in enumerate(names) if name.endswith("_b")]
    kept = [i for i, name in enumerate(names) if not name.endswith("_b")]
    rails = [i for i, name in enumerate(bogie.input_names) if name != "M_b"]
    assert tuple(names[i] for i in kept) == dual.state_names
    for o in operations(bogie, 20, seed=4):
        x = o.x.copy()
        x[held] = 0.0
        both = bogie.rhs(x, o.u, **o.conditions)[kept]
        alone = dual.rhs(x[kept], o.u[rails], **o.conditions)
        share = v.external_load / 2.0 / v.gravity / v.wheelset_mass
        deficiency = o.speed**2 * o.curvature - v.gravity * o.cant
        weight = v.gravity + o.speed**2 * o.curvature * o.cant
        load = np.array([share * deficiency, -share * weight, 0.0, 0.0] * 2)
        expected = both + np.concatenate([np.zeros(8), load])
        assert_allclose(alone, expected, rtol=1e-11, atol=1e-13 * np.abs(both).max())


# ------------------------------------------------------------------ inputs and couplings


def test_primary_actuator_turns_its_wheelset_and_reacts_on_the_frame(any_model):
    n = any_model.n_states
    _, B = any_model.jacobian(np.full(n, -1e-4), speed=20.0)
    p = any_model.parameters
    names, inputs = any_model.state_names, any_model.input_names
    for w in ("w1", "w2"):
        column = B[:, inputs.index(f"M_{w}")]
        expected = np.zeros(n)
        expected[names.index(f"dpsi_{w}")] = 1.0 / p["wheelset_yaw_inertia"]
        if "dpsi_b" in names:
            expected[names.index("dpsi_b")] = -1.0 / p["frame_yaw_inertia"]
        assert_allclose(column, expected, rtol=1e-12)


@pytest.mark.parametrize("model", ["bogie", "cooperrider"])
def test_secondary_actuator_turns_the_frame_alone(model, request):
    model = request.getfixturevalue(model)
    _, B = model.jacobian(np.full(model.n_states, -1e-4), speed=20.0)
    expected = np.zeros(model.n_states)
    expected[model.state_names.index("dpsi_b")] = 1.0 / model.parameters["frame_yaw_inertia"]
    assert_allclose(B[:, model.input_names.index("M_b")], expected, rtol=1e-12)


def test_wheelsets_of_the_dual_wheelset_have_no_influence_on_each_other(dual, operations):
    def of(names, wheelset):
        return [i for i, name in enumerate(names) if name.endswith(wheelset)]

    for o in operations(dual, 10, seed=5):
        A, B = dual.jacobian(o.x, o.u, **o.conditions)
        for one, other in (("w1", "w2"), ("w2", "w1")):
            rows = of(dual.state_names, one)
            assert not A[np.ix_(rows, of(dual.state_names, other))].any()
            assert not B[np.ix_(rows, of(dual.input_names, other))].any()
            assert A[np.ix_(rows, rows)].any()


def test_trailing_wheelset_of_the_dual_wheelset_moves_alike_to_the_bit_whatever_the_leading_one_does(
    dual,
):
    runs = [
        railenv.simulate(
            dual,
            speed=30.0,
            radius=1500.0,
            cant=0.05,
            initial_state=railenv.find_equilibrium(dual, speed=30.0).state,
            perturbation={"y_w1": kick, "y_w2": 1e-3},
            inputs={"M_w1": 1e5 * kick},
            step=2e-4,
            duration=0.5,
        ).states
        for kick in (0.0, 0.012)
    ]
    leading = [i for i, name in enumerate(dual.state_names) if name.endswith("w1")]
    trailing = [i for i, name in enumerate(dual.state_names) if name.endswith("w2")]
    assert np.abs(runs[0][leading] - runs[1][leading]).max() > 1e-3
    assert (runs[0][trailing] == runs[1][trailing]).all()


@pytest.mark.parametrize("kind", [railenv.Bogie, railenv.DualWheelset])
def test_spinning_axles_resist_being_turned_as_their_angular_momentum_says(kind, operations):
    # The momentum I_wy V/r0 lies along the axle, which points to the left: turned by yaw it tips
    # forward, turned by roll upward. On a curve the track itself turns, to the right where the
    # curvature is positive.
    with_spin = kind(railenv.TABLE_1)
    without = with_spin.replace(wheelset_pitch_inertia=0.0)
    v, names = with_spin.vehicle, with_spin.state_names
    for o in operations(with_spin, 10, seed=6):
        moment = with_spin.rhs(o.x, o.u, **o.conditions) - without.rhs(o.x, o.u, **o.conditions)
        spin = v.wheelset_pitch_inertia * o.speed / v.wheel_radius
        for w in ("w1", "w2"):
            rate = {c: o.x[names.index(f"d{c}_{w}")] for c in ("phi", "psi")}
            roll = v.wheelset_roll_inertia * moment[names.index(f"dphi_{w}")]
            yaw = v.wheelset_yaw_inertia * moment[names.index(f"dpsi_{w}")]
            assert roll == pytest.approx(spin * (rate["psi"] - o.speed * o.curvature), abs=1e-6)
            # the turning of a canted track adds some 1e-5 to the spin, which is not worth a sign here
            assert yaw == pytest.approx(-spin * rate["phi"], rel=1e-3, abs=1e-6)


# ---------------------------------------------------------------------------- weight


@pytest.mark.parametrize("vehicle", railenv.PRESETS, ids=lambda v: v.name)
def test_wheels_of_the_bogie_carry_its_weight(vehicle):
    model = railenv.Bogie(vehicle)
    loads = rail_loads(model, railenv.find_equilibrium(model, speed=20.0))
    carried = vehicle.frame_mass + vehicle.body_mass / 2.0
    if vehicle.load_bookkeeping == "printed":
        # the print: W_ext on each wheelset, and the frame's own weight once more
        weight = 2.0 * (vehicle.wheelset_mass + carried) + vehicle.frame_mass
    else:
        weight = 2.0 * vehicle.wheelset_mass + carried
    assert loads.sum() == pytest.approx(weight * vehicle.gravity, rel=1e-9)
    assert_allclose(loads, loads.mean(), rtol=1e-9)  # on tangent track all four alike


@pytest.mark.parametrize("vehicle", railenv.PRESETS, ids=lambda v: v.name)
def test_wheels_of_the_dual_wheelset_carry_its_weight_less_what_the_springs_to_the_frame_take(vehicle):
    model = railenv.DualWheelset(vehicle)
    equilibrium = railenv.find_equilibrium(model, speed=20.0)
    loads = rail_loads(model, equilibrium)
    axles = 2.0 if vehicle.load_bookkeeping == "once" else 1.0
    weight = vehicle.wheelset_mass * vehicle.gravity + vehicle.external_load / axles
    springs = -2.0 * vehicle.primary_vertical_stiffness * equilibrium["z_w1"]
    assert springs > 0.0
    assert_allclose(loads.sum(axis=1), weight - springs, rtol=1e-9)
    # two springs side by side: rails and suspension share the load as their stiffnesses
    share = vehicle.primary_vertical_stiffness / (
        vehicle.primary_vertical_stiffness + vehicle.vertical_rail_stiffness
    )
    assert springs == pytest.approx(share * weight, rel=1e-3)


def test_axle_load_of_table_1_is_115_8_kN_in_both_models(bogie, dual):
    both = rail_loads(bogie, railenv.find_equilibrium(bogie, speed=20.0)).sum(axis=1)
    assert_allclose(both, 115.758e3, rtol=1e-6)  # (1800 + 3000/2 + 34000/4) kg * 9.81 m/s^2
    alone = rail_loads(dual, railenv.find_equilibrium(dual, speed=20.0)).sum(axis=1)
    assert_allclose(alone, 115.758e3 * (1.0 - 0.012), rtol=1e-4)  # 1.2 % hangs in the springs
    assert railenv.TABLE_1.external_load == pytest.approx(196.2e3)


def test_normal_loads_are_the_weight_less_what_spin_creep_carries(bogie):
    # spin lambda/r0 of the two cones makes a lateral creep force f12 lambda/r0 in each inclined
    # contact plane, whose vertical parts f12 lambda^2/r0 add up; hardly any of it is saturated
    v = bogie.vehicle
    equilibrium = railenv.find_equilibrium(bogie, speed=20.0)
    normal = sum(
        c.normal.vertical for pair in bogie.wheels(equilibrium.state, speed=20.0) for c in pair
    )
    weight = 2.0 * v.wheelset_mass * v.gravity + v.external_load
    plane = 1.0 + v.conicity**2
    each = v.lateral_spin_creep * v.conicity / v.wheel_radius / math.sqrt(plane)
    share = creep.heuristic(each / (v.friction * normal / 4.0 * math.sqrt(plane)))
    lifting = 4.0 * share * each * v.conicity / math.sqrt(plane)
    assert weight - normal == pytest.approx(lifting, rel=1e-5)
    assert normal == pytest.approx(weight, rel=2e-4)


@pytest.mark.parametrize("hand", [+1, -1], ids=["left rail outside", "right rail outside"])
@pytest.mark.parametrize("speed", [60.0, 70.0, 80.0, 85.0])
def test_cant_deficiency_shifts_load_to_the_outer_rail_as_the_moment_balance_says(bogie, speed, hand):
    # Balance speed of this curve is 73.2 m/s. Moments about the track's centre line on rail level:
    # each mass at its height, and the gyroscopic moment of the axles that the curve turns.
    v = bogie.vehicle
    equilibrium = railenv.find_equilibrium(bogie, speed=speed, radius=hand * RADIUS, cant=hand * CANT)
    loads = rail_loads(bogie, equilibrium)
    shift = v.half_gauge * (loads[:, 0] - loads[:, 1]).sum()
    deficiency = speed**2 / RADIUS - v.gravity * CANT
    on_frame = v.frame_mass + v.body_mass / 2.0
    heights = 2.0 * v.wheelset_mass * v.wheel_radius + on_frame * (v.wheel_radius + v.frame_height)
    gyroscopic = 2.0 * v.wheelset_pitch_inertia * speed**2 / (v.wheel_radius * RADIUS)
    # wheelsets stand aside of the centre line with all that they carry; springs are linear, so a frame
    # that stands aside of them weighs in their middle
    down = v.gravity + speed**2 / RADIUS * CANT
    aside = (v.wheelset_mass + on_frame / 2.0) * (equilibrium["y_w1"] + equilibrium["y_w2"])
    expected = heights * deficiency + gyroscopic + hand * aside * down
    # left over are products of displacements with loads, 1 mm times some kilonewtons
    assert hand * shift == pytest.approx(expected, abs=15.0)
    assert np.sign(shift) == hand * np.sign(deficiency)
    weight = (2.0 * v.wheelset_mass + on_frame) * (v.gravity + speed**2 / RADIUS * CANT)
    assert loads.sum() == pytest.approx(weight, rel=1e-9)


@pytest.mark.parametrize("hand", [+1, -1])
def test_dual_wheelset_loads_the_outer_rail_above_balance_speed_and_the_inner_one_below(dual, hand):
    shifts = []
    for speed in (65.0, 80.0):
        equilibrium = railenv.find_equilibrium(
            dual, speed=speed, radius=hand * RADIUS, cant=hand * CANT
        )
        loads = rail_loads(dual, equilibrium)
        shifts.append(hand * (loads[:, 0] - loads[:, 1]).sum())
    below, above = shifts
    assert below < -500.0
    assert above > 500.0


# --------------------------------------------------------------------------- Klingel


CONICAL = [v for v in railenv.PRESETS if isinstance(v.contact, railenv.Cone)]


@pytest.mark.parametrize("vehicle", CONICAL, ids=lambda v: v.name)
def test_klingel_wavelength_of_the_shipped_cones_is_16_10_m(vehicle):
    assert vehicle.klingel_wavelength == pytest.approx(16.10, abs=0.005)
