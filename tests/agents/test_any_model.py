"""Controllers and evaluations of vehicles of all kinds, with actuators of all kinds."""

import math

import numpy as np
import pytest

import agents
import design
import railenv
from agents.evaluation.rollout import leading
from railenv.errors import ParameterError
from tests.vehicles import EQUIPPED, sprung_wheelset

SPEED = {"both": 140.0, "own": 20.0, "lateral": 36.0}
"""m/s, at which controllers are designed."""

RANGE = {"both": (110.0, 150.0), "own": (10.0, 40.0), "lateral": (30.0, 50.0)}
"""m/s."""

CONICITY = {"both": (0.09, 0.1), "own": (0.04, 0.06), "lateral": (0.04, 0.05)}


def short_plan(name):
    """Return a plan that takes a second."""
    return agents.Plan(
        speed_range=RANGE[name],
        curves=((math.inf, 0.0),),
        conicity=CONICITY[name],
        frictions=(0.2,),
        ride_speeds=(RANGE[name][0],),
        ride_duration=1.0,
        delays=(),
        noises=(),
    )


every = pytest.mark.parametrize("name", list(EQUIPPED))


@every
@pytest.mark.parametrize("kind", [agents.LQR, agents.LQG, agents.HInfinity])
def test_designs_command_every_actuator_within_its_own_limit(name, kind, tmp_path):
    model = EQUIPPED[name]()
    controller = kind.design(model, speed=SPEED[name])
    assert controller.commands == model.command_names
    np.testing.assert_array_equal(controller.limits, model.limits)
    closed = design.closed_loop(model, controller, speed=SPEED[name])
    assert closed.stable
    controller.save(tmp_path / "controller.npz")
    kept = agents.load(tmp_path / "controller.npz")
    np.testing.assert_array_equal(kept.limits, model.limits)
    assert str(kept) == str(controller)
    # what it does is what its linearisation says, in shares of each limit
    rng = np.random.default_rng(0)
    observation = 1e-3 * rng.standard_normal(len(controller.readings))
    observation[[reading.name for reading in controller.readings].index("speed")] = 0.2
    controller.reset()
    scales = np.array([reading.scale for reading in controller.readings])
    linear = controller.linearize(observation * scales)
    asked = controller.act(observation) * model.limits
    np.testing.assert_allclose(asked, linear.D @ (observation * scales), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", ["both", "own"])
def test_yaw_rate_feedback_of_several_actuators(name):
    model = EQUIPPED[name]()
    controller = agents.YawRateFeedback.design(model, gain=1e4)
    read = [controller.readings[k].signal for k in np.argmax(np.abs(controller.law.D[0]), axis=1)]
    assert read == [f"gyro_{model.sensed[0]}"] * len(model.command_names)
    assert agents.Passive.design(model).law.D.shape[1] == len(model.command_names)


def test_what_needs_other_actuators_says_what_there_is():
    lateral, both = EQUIPPED["lateral"](), EQUIPPED["both"]()
    with pytest.raises(ParameterError, match="lateral actuator w1 between w1 and ground"):
        agents.YawRateFeedback.design(lateral, gain=1.0)
    with pytest.raises(ParameterError, match=r"gains has shape \(1, 4\); it must be \(1, \d, \d+\)"):
        agents.OutputFeedback.design(lateral, speeds=[20.0], gains=np.zeros((1, 4)))
    with pytest.raises(ParameterError, match="commands command_b and reads accelerometer_b"):
        agents.Rollout(both, agents.shipped("lqg"), [agents.Case(60.0)])


def test_a_controller_for_a_bogie_says_that_it_is_not_for_a_coach():
    whole = railenv.Coach(railenv.HIGH_SPEED_COACH)
    told = "not for the actuators of coach_secondary: 'command_b'.*allowed are command_b1, command_b2$"
    with pytest.raises(ParameterError, match=told):
        agents.evaluate(agents.shipped("lqr"), whole)


def test_usual_equipment_of_any_vehicle():
    assert agents.equipped(sprung_wheelset()).command_names == ("command_w",)
    assert agents.equipped(railenv.CooperriderBogie()).command_names == ("command_b",)
    assert EQUIPPED["own"]().vehicle_name == "sprung_wheelset"
    assert EQUIPPED["both"]().vehicle_name == "HIGH_SPEED_COACH"


@pytest.mark.parametrize(
    "name", [n if n == "own" else pytest.param(n, marks=pytest.mark.slow) for n in EQUIPPED]
)
def test_evaluation(name):
    model = EQUIPPED[name]()
    controller = agents.LQR.design(model, speed=SPEED[name])
    found = agents.evaluate(controller, model, plan=short_plan(name))
    (curve,) = found.curves
    own = design.critical_speed(model, controller=controller, speed_range=RANGE[name])
    assert found.linear == (RANGE[name][1] if own.loss == "none" else own.speed)
    assert found.linear > SPEED[name]
    assert found.robust > RANGE[name][0]
    assert curve.disturbed is None or RANGE[name][0] <= curve.disturbed <= RANGE[name][1]
    assert list(curve.disturbed_by_friction) == ([] if name == "own" else ["0.2"])
    assert found.ride[0]["moment_rms"] <= found.ride[0]["moment_peak"] <= model.limits.max()
    assert (found.ride[0]["moment_peak"] > 0.0) == (name != "own")  # it has no rails that are uneven
    assert agents.Evaluation.from_summary(found.summary()) == found


@every
@pytest.mark.parametrize("kind", [agents.LQR, agents.LQG, agents.HInfinity])
def test_small_motion_in_the_environment_is_that_of_the_linear_loop(name, kind):
    """Limits, signs and delays of every command count in it."""
    model, speed, offset = EQUIPPED[name](), SPEED[name], 1e-5
    controller = kind.design(model, speed=speed)
    loop = design.closed_loop(model, controller, speed=speed)
    deviation = np.zeros(loop.system.nstates)
    deviation[[model.state_names.index(y) for y in model.lateral_states]] = offset
    run = agents.Rollout(model, controller, [agents.Case(speed, offset=offset)])
    motion = run.run(0.4, model.lateral_states)
    rest = loop.state[[model.state_names.index(y) for y in model.lateral_states]]
    for row in motion.states[:, 0] - rest:
        linear = deviation[[model.state_names.index(y) for y in model.lateral_states]]
        np.testing.assert_allclose(row, linear, atol=2e-3 * offset)
        deviation = loop.system.A @ deviation


def test_the_leading_wheelset_is_the_foremost():
    assert leading(EQUIPPED["lateral"]()) == "y_w1"
    assert leading(EQUIPPED["own"]()) == "y"
