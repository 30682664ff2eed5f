"""Running equilibria and the branches they lie on."""

import math

import numpy as np
import pytest

import railenv
from railenv.equilibrium import Branch, SpeedPath, enter_curve, follow_speeds
from railenv.errors import EquilibriumError, ParameterError

CANT = 0.0873
MODELS = [
    railenv.Bogie(railenv.HIGH_SPEED_COACH),
    railenv.Bogie(railenv.TABLE_1),
    railenv.Bogie(railenv.TABLE_1_PRINTED_LOADS),
    railenv.DualWheelset(railenv.HIGH_SPEED_COACH),
    railenv.DualWheelset(railenv.TABLE_1),
]
# without wheelbase_curving the tread carries the wheelsets far into a curve, and the branch folds
PAPERS_CURVES = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(wheelbase_curving=False))


def label(model):
    return f"{model.name}-{model.vehicle.name}"


@pytest.mark.parametrize("model", MODELS, ids=label)
@pytest.mark.parametrize("radius", [math.inf, 10_000.0, 6250.0, 1500.0, 500.0, 250.0, -300.0])
def test_every_curve_has_an_equilibrium_at_low_speed(model, radius):
    cant = 0.0 if math.isinf(radius) else math.copysign(CANT, radius)
    found = railenv.find_equilibrium(model, speed=10.0, radius=radius, cant=cant)
    curvature = 0.0 if math.isinf(radius) else 1.0 / radius
    derivative = model.rhs(found.state, speed=10.0, curvature=curvature, cant=cant)
    assert np.abs(derivative).max() < 1e-9
    assert found.residual < 1e-9


def test_flange_carries_the_wheelset_on_a_tight_curve_and_not_on_a_wide_one():
    model = PAPERS_CURVES
    clearance = model.vehicle.flange_clearance
    tight = railenv.find_equilibrium(model, speed=20.0, radius=250.0, cant=CANT)
    wide = railenv.find_equilibrium(model, speed=20.0, radius=2500.0, cant=CANT)
    assert tight["y_w1"] > clearance
    assert 0.0 < wide["y_w1"] < 0.5 * clearance


def test_free_wheelset_rolls_purely_on_a_curve():
    # without suspension a wheelset takes the offset at which both wheels roll:
    # a r0 kappa / lambda at the level of the rails, where the roll of the axle adds to it
    loose = railenv.TABLE_1.replace(
        primary_longitudinal_stiffness=1.0,
        primary_lateral_stiffness=1.0,
        primary_longitudinal_damping=0.0,
        primary_lateral_damping=0.0,
        lateral_spin_creep=0.0,
        spin_creep=0.0,
        wheelset_pitch_inertia=0.0,
    )
    speed, radius = 20.0, 5000.0
    balanced = speed**2 / radius / 9.81  # cant at which no lateral force is left
    found = railenv.find_equilibrium(
        railenv.DualWheelset(loose), speed=speed, radius=radius, cant=balanced
    )
    v = loose
    at_rails = v.half_gauge * v.wheel_radius / radius / v.conicity
    by_roll = 1.0 - v.wheel_radius * v.conicity / v.half_gauge
    assert found["y_w1"] == pytest.approx(at_rails * by_roll, rel=3e-3)


@pytest.mark.parametrize("model", MODELS[:2] + MODELS[4:], ids=label)
def test_curve_of_the_other_hand_is_the_mirror_image(model):
    mirror = np.array([1.0 if n.lstrip("d").startswith("z") else -1.0 for n in model.state_names])
    right = railenv.find_equilibrium(model, speed=40.0, radius=1500.0, cant=CANT)
    left = railenv.find_equilibrium(model, speed=40.0, radius=-1500.0, cant=-CANT)
    np.testing.assert_allclose(left.state, mirror * right.state, atol=1e-12)


def test_branch_is_the_same_whatever_the_steps():
    model = PAPERS_CURVES
    direct = railenv.find_equilibrium(model, speed=80.0, radius=2500.0, cant=CANT).state
    for speeds in ([80.0], [5.0, 80.0], np.linspace(1.0, 80.0, 50)):
        *_, last = follow_speeds(model, speeds, radius=2500.0, cant=CANT)
        np.testing.assert_allclose(last.state, direct, atol=1e-12)


def test_tread_and_flange_equilibria_coexist_and_the_branch_stays_on_the_tread():
    model = PAPERS_CURVES
    tread = railenv.find_equilibrium(model, speed=45.0, radius=1000.0, cant=CANT)
    # the same curve at the same speed, reached around both folds of the branch
    branch = Branch(model, SpeedPath(1 / 1000.0, CANT), np.zeros(model.n_inputs))
    start = branch.start(enter_curve(model, 1 / 1000.0, CANT, np.zeros(9)), math.log(3.0))
    at_45 = []
    previous = start
    for point in branch.points(start, math.log(60.0)):
        if (previous.s - math.log(45.0)) * (point.s - math.log(45.0)) < 0:
            at_45.append(previous.state[0] + 0.5 * (point.state[0] - previous.state[0]))
        previous = point
    assert len(at_45) == 3  # tread, unstable, flange
    assert tread["y_w1"] == pytest.approx(at_45[0], abs=0.3e-3)
    assert at_45[2] > model.vehicle.flange_clearance > tread["y_w1"]


def test_beyond_the_fold_there_is_an_error_with_residual_and_speed_unless_folds_are_passed():
    model = PAPERS_CURVES
    with pytest.raises(EquilibriumError, match=r"turns back in a fold.*through_folds=True") as caught:
        railenv.find_equilibrium(model, speed=60.0, radius=1000.0, cant=CANT)
    assert caught.value.reached == pytest.approx(48.6, abs=0.1)
    assert caught.value.residual > 1.0
    beyond = railenv.find_equilibrium(model, speed=60.0, radius=1000.0, cant=CANT, through_folds=True)
    assert beyond["y_w1"] > model.vehicle.flange_clearance


def test_no_equilibrium_at_all_is_an_error_with_the_residual():
    model = railenv.Model("falling", ["q", "r"], [], _falling, {})
    with pytest.raises(EquilibriumError, match="falling has no running equilibrium") as caught:
        railenv.find_equilibrium(model, speed=10.0)
    assert caught.value.residual == pytest.approx(9.81, rel=0.01)


def test_constant_input_shifts_the_equilibrium():
    model = PAPERS_CURVES
    moment = np.zeros(9)
    moment[model.input_names.index("M_b")] = 1e3
    found = railenv.find_equilibrium(model, speed=50.0, inputs=moment)
    derivative = model.rhs(found.state, moment, speed=50.0)
    assert np.abs(derivative).max() < 1e-9
    assert found["psi_b"] > 0.0


def test_conditions_and_states_are_available_by_name():
    found = railenv.find_equilibrium(MODELS[0], speed=50.0, radius=2000.0, cant=0.05)
    assert (found.speed, found.radius, found.cant) == (50.0, 2000.0, 0.05)
    assert found["y_b"] == found.state[8]
    with pytest.raises(railenv.UnknownNameError, match="y_c"):
        found["y_c"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"speed": -5.0}, "speed is -5 m/s; it must be finite and greater than 0 m/s"),
        ({"speed": "fast"}, "speed is 'fast', which is not a number"),
        ({"speed": 50.0, "radius": 0.0}, "radius is 0 m; its magnitude must be at least 1 m"),
        ({"speed": 50.0, "cant": math.inf}, "cant is inf rad"),
        ({"speed": 50.0, "inputs": [math.nan] * 9}, "inputs entry M_w1 is nan"),
    ],
)
def test_bad_arguments_name_quantity_and_value(arguments, message):
    with pytest.raises(ParameterError, match=message):
        railenv.find_equilibrium(MODELS[0], **arguments)


def test_speeds_to_follow_must_increase():
    with pytest.raises(ParameterError, match="speeds must increase"):
        list(follow_speeds(MODELS[0], [50.0, 50.0]))


def test_cooperrider_bogie_is_refused_on_a_curve():
    with pytest.raises(ParameterError, match="tangent track only"):
        railenv.find_equilibrium(railenv.CooperriderBogie(), speed=50.0, radius=1000.0)


def _falling(x, u, speed, curvature, cant, p):
    return [x[1], -9.81]


def test_equilibrium_that_is_not_isolated_is_an_error_that_says_so():
    # nothing restores the angle, so every angle is an equilibrium
    model = railenv.Model("wheel", ["angle", "rate"], [], _free_wheel, {})
    with pytest.raises(EquilibriumError, match="not isolated"):
        railenv.find_equilibrium(model, speed=20.0)


def _free_wheel(x, u, speed, curvature, cant, p):
    return [x[1], -x[1]]
