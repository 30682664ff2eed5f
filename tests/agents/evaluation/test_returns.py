"""What controllers earn in the environments."""

import gymnasium as gym
import numpy as np
import pytest

import agents
import railenv
from agents.evaluation.informed import InformedLQR
from agents.evaluation.returns import episode_returns
from design.linear.regulator import Weights

BOGIE = "railenv/Bogie-v1"
OWN = {"speed_range": (120.0, 150.0), "duration": 1.5, "initial_offset": 0.006}


@pytest.fixture(scope="module")
def vehicle():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), "secondary")


def test_they_are_those_of_the_single_environment(vehicle):
    controller = agents.YawRateFeedback.design(vehicle, gain=2e5)
    found = episode_returns(BOGIE, controller, episodes=3, seed=5, env_kwargs=OWN)
    env = gym.make(BOGIE, observation="sensors", **OWN)
    for i, value in enumerate(found.values):
        observation, _ = env.reset(seed=5 + i)
        controller.reset()
        total, done = 0.0, False
        while not done:
            observation, reward, terminated, truncated, _ = env.step(controller.act(observation))
            total, done = total + reward, terminated or truncated
        assert value == pytest.approx(total, rel=1e-12)
        assert found.derailed[i] == terminated
    assert "of at most 300 over 3 episodes" in str(found)


def test_who_knows_all_earns_more_than_who_knows_the_yaw_rate(vehicle):
    def knowing(fleet):
        return InformedLQR(fleet, Weights())

    gain = agents.YawRateFeedback.design(vehicle, gain=2e5)
    unknown = {**OWN, "randomize": {"conicity": (0.05, 0.3)}}
    best, constant, idle = (
        episode_returns(BOGIE, c, episodes=8, env_kwargs=unknown) for c in (knowing, gain, None)
    )
    assert best.mean > constant.mean > idle.mean
    assert best.mean > 0.95 * best.steps


def test_on_a_curve_it_acts_on_what_is_off_the_equilibrium_there():
    """Started at the equilibrium it has nothing to do, and transitions cost it no more than idling."""

    def knowing(fleet):
        return InformedLQR(fleet, Weights())

    own = {"speed_range": (60.0, 90.0), "duration": 2.0, "initial_offset": 0.0, "tangent_share": 0.0}
    steady = episode_returns(BOGIE, knowing, episodes=4, env_kwargs=own)
    np.testing.assert_allclose(steady.values, steady.steps, rtol=1e-3)
    curve = {**own, "track": "curve", "duration": 6.0}
    into = episode_returns(BOGIE, knowing, episodes=4, env_kwargs=curve)
    idle = episode_returns(BOGIE, None, episodes=4, env_kwargs=curve)
    assert (into.values > idle.values - 0.01 * into.steps).all()
    assert into.mean > 0.8 * into.steps


def test_a_controller_for_other_actuators_raises(vehicle):
    controller = agents.YawRateFeedback.design(vehicle, gain=2e5)
    with pytest.raises(railenv.ParameterError, match="command_b"):
        episode_returns(BOGIE, controller, episodes=1, env_kwargs={"actuator": "primary"})
    with pytest.raises(railenv.ParameterError, match="episodes is 0"):
        episode_returns(BOGIE, None, episodes=0)
