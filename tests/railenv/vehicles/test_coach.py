"""Whole vehicles: a body on two bogies."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import railenv
from railenv.equations.bodies import gyroscopic
from railenv.equations.contact import contact
from railenv.equations.coordinates import Rail, Running
from railenv.errors import EquilibriumError, ParameterError
from tests.vehicles import mirrored

COACHES = {
    "HIGH_SPEED_COACH": railenv.HIGH_SPEED_COACH,
    "MANCHESTER_1": railenv.MANCHESTER_1,
    "CRH380A": railenv.CRH380A,
}
COACH = railenv.Coach(railenv.HIGH_SPEED_COACH)
every_coach = pytest.mark.parametrize("vehicle", COACHES.values(), ids=COACHES)


def random_state(model, rng):
    """Millimetres and milliradians, with the wheels loaded and all stops open."""
    n = model.n_states
    x = 1e-3 * rng.standard_normal(n)
    for i, name in enumerate(model.state_names):
        if name.startswith("z_"):
            x[i] = -1.5e-3 + 1e-4 * rng.standard_normal()
        elif name.startswith("d"):
            x[i] *= 10.0
    return x


# ---------------------------------------------------------------------- what it is made of


def test_whole_vehicle_has_31_degrees_of_freedom():
    names = COACH.state_names
    assert len(names) == 62
    assert names[:8] == ("y_w1", "z_w1", "phi_w1", "psi_w1", "y_w2", "z_w2", "phi_w2", "psi_w2")
    assert names[16:31] == tuple(f"{c}_{b}" for b in ("b1", "b2", "body") for c in _ALL)
    assert COACH.body_places == {
        "w1": 10.2, "w2": 7.8, "w3": -7.8, "w4": -10.2, "b1": 9.0, "b2": -9.0, "body": 0.0,
    }  # fmt: skip


_ALL = ("y", "z", "phi", "theta", "psi")


@every_coach
def test_parts_and_their_own_states_are_those_that_the_vehicle_has(vehicle):
    elements = {e.name for e in railenv.Coach(vehicle).assembly.elements}
    of_bogie = {e.name for e in railenv.Bogie(vehicle).assembly.elements}
    for part, group in {
        "roll_bar": "roll bar",
        "traction_rod": "traction rod",
        "lateral_stop": "lateral stop",
        "yaw_damper": "secondary yaw damper",
        "lateral_damper": "lateral damper",
        "secondary_bending": "secondary bending",
    }.items():
        for bogie in (1, 2):
            assert (f"{part}_{bogie}" in elements) == (group in vehicle.groups)
        without_effect = part in ("traction_rod", "lateral_stop")
        assert (part in of_bogie) == (group in vehicle.groups and not without_effect)


def test_assembly_of_a_whole_vehicle_reads_back_from_its_file(tmp_path):
    for vehicle in (railenv.CRH380A, railenv.MANCHESTER_1):
        model = railenv.Coach(vehicle)
        model.assembly.to_toml(tmp_path / "v.toml")
        again = railenv.Assembly.from_toml(tmp_path / "v.toml")
        assert again == model.assembly
        x = random_state(model, np.random.default_rng(0)).tolist()
        u = [0.0] * model.n_inputs
        assert railenv.Assembled(again).plain_rhs(x, u, 40.0) == model.plain_rhs(x, u, 40.0)


def test_vehicle_without_a_body_or_with_the_prints_loads_is_refused():
    with pytest.raises(ParameterError, match=r"TABLE_1 has no body.*body_roll_inertia"):
        railenv.Coach(railenv.TABLE_1)
    printed = railenv.HIGH_SPEED_COACH.replace(load_bookkeeping="printed")
    with pytest.raises(ParameterError, match="must be 'once'"):
        railenv.Coach(printed)
    with pytest.raises(ParameterError, match="has no body_height"):
        railenv.TABLE_1.replace(overturning=True)
    with pytest.raises(ParameterError, match="frame of a dual wheelset stands still"):
        railenv.DualWheelset(railenv.HIGH_SPEED_COACH.replace(overturning=True))


# ------------------------------------------------------------------ the bogie in the coach


def in_coach(name):
    """Return what a state of the bogie alone is called in the leading bogie of the coach."""
    owner = name.partition("_")[2]
    if owner == "b":
        return f"{name}1"
    return name.replace("damper_", "damper_1_") if owner.startswith(("yaw_", "lateral_")) else name


def both(vehicle, speed, curvature, cant):
    """Return rates of the bogie alone and of the leading one in the coach, by names of the coach.

    The body of the coach stands such that its springs hand its half of weight and lateral force over
    to the leading frame, and that this frame sees no turn of it.
    """
    bogie, coach = railenv.Bogie(vehicle), railenv.Coach(vehicle)
    # the bogie of the paper knows no loads that shift
    coach = railenv.Assembled(dataclasses.replace(coach.assembly, shifting_loads=False))
    x = random_state(bogie, np.random.default_rng(3))
    state = dict.fromkeys(coach.state_names, 0.0)
    state |= {in_coach(name): value for name, value in zip(bogie.state_names, x, strict=True)}
    v, at = vehicle, vehicle.half_pivot_distance
    lateral = v.body_mass / 2.0 * (speed**2 * curvature - v.gravity * cant)
    weight = v.body_mass / 2.0 * (v.gravity + speed**2 * curvature * cant)
    state["z_body"] = state["z_b1"] - weight / (2.0 * v.secondary_vertical_stiffness)
    state["psi_body"] = -curvature * at
    state["y_body"] = lateral / (2.0 * v.secondary_lateral_stiffness) + curvature * at * at / 2.0
    where = (speed, curvature, cant)
    rates = coach.plain_rhs([*state.values()], [0.0] * coach.n_inputs, *where)
    alone = bogie.plain_rhs(x.tolist(), [0.0] * bogie.n_inputs, *where)
    names = [in_coach(name) for name in bogie.state_names]
    found = dict(zip(coach.state_names, rates, strict=True))
    return np.array(alone), np.array([found[name] for name in names])


@every_coach
def test_leading_bogie_under_a_body_that_is_held_is_the_bogie_alone(vehicle):
    alone, within = both(vehicle, 55.0, 0.0, 0.0)
    assert_allclose(within, alone, rtol=1e-10, atol=1e-10 * np.abs(alone).max())


def test_so_it_is_on_a_curve_where_springs_hand_the_load_over_at_the_frames_centre():
    without_stop = railenv.HIGH_SPEED_COACH.replace(lateral_stop_force=None, lateral_stop_height=None)
    alone, within = both(without_stop, 55.0, 1.0 / 2500.0, 0.06)
    assert_allclose(within, alone, rtol=1e-10, atol=1e-10 * np.abs(alone).max())


# ----------------------------------------------------------------------------- invariants


@every_coach
def test_lateral_and_vertical_momentum_change_by_what_the_rails_and_loads_do_alone(vehicle):
    model = railenv.Coach(vehicle)
    rng, where = np.random.default_rng(1), {"speed": 60.0, "curvature": 1.0 / 3000.0, "cant": 0.05}
    x = random_state(model, rng)
    rates = dict(zip(model.state_names, model.rhs(x, **where), strict=True))
    masses = {name: own["y"] for name, own in model.body_inertias.items()}
    forces = railenv.Equipped(model, "none")
    signals = dict(zip(forces.signal_names, forces.signals(np.concatenate(
        [x, np.zeros(forces.n_states - model.n_states)]), **where), strict=True))  # fmt: skip
    wheelsets = ("w1", "w2", "w3", "w4")
    lateral = sum(signals[f"Y_right_{w}"] - signals[f"Y_left_{w}"] for w in wheelsets)
    vertical = sum(signals[f"Q_{side}_{w}"] for w in wheelsets for side in ("left", "right"))
    total, gravity = sum(masses.values()), vehicle.gravity
    pull = where["speed"] ** 2 * where["curvature"] - gravity * where["cant"]
    press = gravity + where["speed"] ** 2 * where["curvature"] * where["cant"]
    moved = sum(m * rates[f"dy_{name}"] for name, m in masses.items())
    lifted = sum(m * rates[f"dz_{name}"] for name, m in masses.items())
    assert moved == pytest.approx(lateral + total * pull, rel=1e-9)
    assert lifted == pytest.approx(vertical - total * press, rel=1e-9)


@every_coach
def test_whole_vehicle_in_a_curve_of_the_other_hand_is_the_mirror_image(vehicle):
    model = railenv.Coach(vehicle)
    x = random_state(model, np.random.default_rng(5))
    here = model.rhs(x, speed=70.0, curvature=1.0 / 2000.0, cant=0.07)
    there = model.rhs(mirrored(model, x), speed=70.0, curvature=-1.0 / 2000.0, cant=-0.07)
    assert_allclose(there, mirrored(model, here), rtol=1e-10, atol=1e-11 * np.abs(here).max())


_TURNED = {"w1": "w4", "w2": "w3", "b1": "b2", "body": "body"}
_TURNED |= {there: here for here, there in _TURNED.items()}


def turned_round(model, x):
    """Return a state seen by one who faces the other way: back is front, right is left."""
    names = list(model.state_names)
    image = np.empty(len(names))
    for i, name in enumerate(names):
        kind, _, body = name.partition("_")
        sign = 1.0 if kind.removeprefix("d") in ("z", "psi") else -1.0
        image[names.index(f"{kind}_{_TURNED[body]}")] = sign * x[i]
    return image


def test_springs_and_dampers_do_not_know_which_end_is_the_front():
    # what runs is not the same backwards; so the contact is left out, as the difference of two coaches
    vehicle = railenv.HIGH_SPEED_COACH
    stiff, soft = (
        railenv.Coach(vehicle.replace(**{
            f"{level}_{along}_{what}": factor * getattr(vehicle, f"{level}_{along}_{what}") + factor
            for level in ("primary", "secondary")
            for along in ("longitudinal", "lateral", "vertical")
            for what in ("stiffness", "damping")
        }))
        for factor in (1.0, 0.0)
    )  # fmt: skip
    x = random_state(stiff, np.random.default_rng(9))
    where = {"speed": 50.0, "curvature": 1.0 / 1500.0, "cant": 0.0}
    back = {**where, "curvature": -where["curvature"]}
    y = turned_round(stiff, x)
    here = stiff.rhs(x, **where) - soft.rhs(x, **where)
    there = stiff.rhs(y, **back) - soft.rhs(y, **back)
    assert np.abs(here).max() > 1.0
    assert_allclose(there, turned_round(stiff, here), rtol=1e-9, atol=1e-10 * np.abs(here).max())


# ----------------------------------------------------------------------------- curving

CURVE = {"radius": 3000.0, "cant": 0.06}


def forces(model, **where):
    """Return Y and Q of all wheels in the running equilibrium, shape (wheelsets, 2, 2)."""
    found = railenv.find_equilibrium(model, **where)
    carrier = railenv.Equipped(model, "none")
    run = {"speed": where["speed"], "curvature": 1.0 / where["radius"], "cant": where["cant"]}
    return found, carrier.signals(carrier.steady_state(found.state, **run), **run)[-16:].reshape(
        4, 2, 2
    )


@pytest.mark.parametrize(
    "vehicle", [railenv.HIGH_SPEED_COACH, railenv.MANCHESTER_1], ids=lambda v: v.name
)
@pytest.mark.parametrize("speed", [20.0, 50.0])
def test_wheels_carry_the_weight_and_the_cant_deficiency(vehicle, speed):
    model = railenv.Coach(vehicle)
    _, found = forces(model, speed=speed, **CURVE)
    mass = model.axle_load * 4.0 / vehicle.gravity
    unbalanced = speed**2 / CURVE["radius"] - vehicle.gravity * CURVE["cant"]
    assert np.sum(found[:, 0, 0] - found[:, 1, 0]) == pytest.approx(mass * unbalanced, rel=1e-6)
    assert found[..., 1].sum() == pytest.approx(
        mass * (vehicle.gravity + speed**2 / CURVE["radius"] * CURVE["cant"]), rel=1e-6
    )


def leaning(vehicle, unbalanced):
    """Return shift (m) and roll (rad) of a body on the springs of frames that stand still.

    Springs across and in roll, ``lever`` below the body's centre; its weight bears on the springs
    through their middle, and tilts them and itself.
    """
    v = vehicle
    lever = v.body_height - (v.frame_height if v.secondary_height is None else v.secondary_height)
    lateral = 4.0 * v.secondary_lateral_stiffness
    rolling = 4.0 * v.secondary_vertical_stiffness * v.secondary_arm**2
    weight = v.body_mass * v.gravity
    # unknown: d, the shift of the springs' tops, and the roll p; the body's centre is at d - lever p
    # across: lateral d - weight p / 2 = force; roll about the springs, with half of the weight's couple
    force = v.body_mass * unbalanced
    matrix = [[lateral, weight / 2.0], [weight / 2.0, rolling - weight * lever]]
    d, p = np.linalg.solve(matrix, [force, -lever * force])
    return d - lever * p, p


STIFF = {
    "primary_vertical_stiffness": 1e9,
    "primary_lateral_stiffness": 1e9,
    "vertical_rail_stiffness": 1e10,
    "lateral_stop_force": ((1.0, 2.0), (0.0, 1.0)),  # never reached
    "conicity": 1e-3,  # wheelsets that move aside do not roll
}


def test_body_leans_out_of_the_curve_as_by_hand():
    vehicle, speed = railenv.HIGH_SPEED_COACH.replace(**STIFF), 45.0
    where = {"radius": 4000.0, "cant": 0.03}
    state = railenv.find_equilibrium(railenv.Coach(vehicle), speed=speed, **where)
    unbalanced = speed**2 / where["radius"] - vehicle.gravity * where["cant"]
    shift, roll = leaning(vehicle, unbalanced)
    # between the pivots the track lies outside the line from frame to frame
    under = (state["y_b1"] + state["y_b2"]) / 2.0 - vehicle.half_pivot_distance**2 / (2.0 * 4000.0)
    frames = (state["phi_b1"] + state["phi_b2"]) / 2.0
    assert state["phi_body"] - frames == pytest.approx(roll, rel=0.01)
    assert state["y_body"] - under == pytest.approx(shift, rel=0.01)


def moment_of_masses(model, state, speed, radius, cant):
    """Return the moment (N m) of all masses about the line through the bogies' places on the track."""
    v = model.vehicle
    across = speed**2 / radius - v.gravity * cant
    down = v.gravity + speed**2 / radius * cant
    outside = dict.fromkeys(model.body_inertias, 0.0)
    outside["body"] = (v.half_pivot_distance**2 + v.half_wheelbase**2) / (2.0 * radius)
    outside["b1"] = outside["b2"] = v.half_wheelbase**2 / (2.0 * radius)
    moment = 0.0
    for name, own in model.body_inertias.items():
        height = model.body_heights[name] + v.wheel_radius
        moment += own["y"] * (across * height + down * (state[f"y_{name}"] + outside[name]))
    return moment


def moment_of_wheels(model, state, speed, radius, cant):
    """Return the moment (N m) of all wheels about the middle of the track at rail level."""
    run = Running(speed, 1.0 / radius, cant)
    vehicle = model.assembly.with_numbers({**model.parameters, **model.tables})
    found = 0.0
    for w in vehicle.wheelsets:
        moving = model.equations.motions(state.state.tolist())[w.name]
        on = contact(moving, Rail(0.0, 0.0, 0.0), run, w)
        found += on.roll - w.wheel_radius * on.force_y + moving.y * on.force_z
        found += gyroscopic(moving, run, w).roll
    return found


@pytest.mark.parametrize("vehicle", [railenv.MANCHESTER_1, railenv.CRH380A], ids=lambda v: v.name)
@pytest.mark.parametrize("speed", [25.0, 45.0])
def test_wheels_bear_the_moment_of_all_masses_where_they_have_moved_to(vehicle, speed):
    # only with flanges in the profiles: the spring of the others acts at the height of the axle
    model, radius, cant = railenv.Coach(vehicle), 2500.0, 0.05
    state, found = forces(model, speed=speed, radius=radius, cant=cant)
    moment = moment_of_masses(model, state, speed, radius, cant)
    assert moment_of_wheels(model, state, speed, radius, cant) == pytest.approx(moment, rel=2e-3)
    difference = found[:, 0, 1].sum() - found[:, 1, 1].sum()
    assert difference * vehicle.half_gauge == pytest.approx(moment, rel=0.2)


def test_wheels_of_cones_are_unloaded_as_by_hand():
    model, speed, radius, cant = railenv.Coach(railenv.HIGH_SPEED_COACH), 60.0, 9000.0, 0.01
    state, found = forces(model, speed=speed, radius=radius, cant=cant)
    clearance = model.vehicle.flange_clearance
    assert max(abs(state[w.y]) for w in model.guided) < clearance  # not on the flange
    v, moment = model.vehicle, moment_of_masses(model, state, speed, radius, cant)
    moment += 4.0 * v.wheelset_pitch_inertia * speed**2 / v.wheel_radius / radius  # of turning axles
    unloading = (found[:, 0, 1] - found[:, 1, 1]).sum()
    assert unloading == pytest.approx(moment / model.vehicle.half_gauge, rel=0.01)


def test_at_the_balance_of_cant_what_lies_outside_and_axles_that_turn_load_the_outer_rail():
    vehicle, radius, cant = railenv.HIGH_SPEED_COACH, 6000.0, 0.05
    model, speed = railenv.Coach(vehicle), math.sqrt(railenv.HIGH_SPEED_COACH.gravity * cant * radius)
    state, found = forces(model, speed=speed, radius=radius, cant=cant)
    # the wheelsets run some millimetres outside, where a cone of their own radius does, and all on them
    masses = moment_of_masses(model, state, speed, radius, cant)
    axles = 4.0 * vehicle.wheelset_pitch_inertia * speed**2 / vehicle.wheel_radius / radius
    unloading = (found[:, 0, 1] - found[:, 1, 1]).sum()
    assert masses > 0.0
    assert unloading == pytest.approx((masses + axles) / vehicle.half_gauge, rel=0.02)
    assert moment_of_wheels(model, state, speed, radius, cant) == pytest.approx(
        moment_of_masses(model, state, speed, radius, cant), rel=0.01
    )


def test_too_fast_in_a_tight_curve_the_vehicle_overturns_and_does_not_run():
    model = railenv.Coach(railenv.HIGH_SPEED_COACH)
    with pytest.raises(EquilibriumError) as caught:
        railenv.find_equilibrium(model, speed=85.0, radius=250.0, cant=0.15)
    # inner wheels leave the rail where the moment of the centrifugal force equals that of the weight
    assert caught.value.reached < 60.0


def test_overturning_of_the_bogie_alone_is_that_of_half_a_body_at_its_height():
    on, off = (
        railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(overturning=switch)) for switch in (True, False)
    )
    v, where = on.vehicle, {"speed": 40.0, "curvature": 1.0 / 3000.0, "cant": 0.0}
    x = np.zeros(24)
    difference = dict(zip(on.state_names, on.rhs(x, **where) - off.rhs(x, **where), strict=True))
    lever = v.body_height - v.frame_height
    moment = -v.body_mass / 2.0 * where["speed"] ** 2 * where["curvature"] * lever
    assert difference.pop("dphi_b") == pytest.approx(moment / v.frame_roll_inertia, rel=1e-12)
    assert not any(difference.values())


# --------------------------------------------------------------------------- the presets


def test_manchester_coach_stands_on_its_wheels_as_published():
    model = railenv.Coach(railenv.MANCHESTER_1)
    # 32 t body, two frames of 2615 kg, four wheelsets of 1813 kg
    assert model.axle_load == pytest.approx((32000 + 2 * 2615 + 4 * 1813) * 9.81 / 4, rel=1e-12)
    _, found = forces(model, speed=5.0, radius=math.inf, cant=0.0)
    assert_allclose(found[..., 1], model.axle_load / 2.0, rtol=1e-6)


@pytest.mark.parametrize(
    ("field", "knee", "before", "beyond"),
    [
        ("primary_damper_force", 0.1, 19.6e3, 14.7e3),
        ("secondary_yaw_damper_force", 0.004, 2.4525e6, 49.95e3),
        ("lateral_damper_force", 0.1, 58.8e3, 24.6e3),
    ],
)
def test_dampers_of_the_crh380a_have_the_slopes_of_their_source(field, knee, before, beyond):
    (_, x, end), (_, y, last) = getattr(railenv.CRH380A, field)
    assert x == knee
    assert y / x == pytest.approx(before, rel=1e-12)
    assert (last - y) / (end - x) == pytest.approx(beyond, rel=1e-12)
