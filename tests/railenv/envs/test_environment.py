"""The single environments: Gymnasium's contract, and their keywords."""

import copy
import math
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from railenv.envs.environment import BogieEnv
from railenv.envs.settings import RewardWeights
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.envs.runs import BOGIE, DUAL, actions_of, both, make, roll

ALLOWED_WARNINGS: tuple[str, ...] = ()
"""Beginnings of the checker's warnings that are accepted, each with its reason beside it."""

# ---------------------------------------------------------------- Gymnasium's contract


@both
@pytest.mark.parametrize("keywords", [{}, {"observation": "sensors", "history": 2}])
def test_gymnasium_checker_is_satisfied(name, keywords):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(gym.make(name, **keywords).unwrapped, skip_render_check=True)
    messages = [str(w.message) for w in caught]
    assert [m for m in messages if not m.startswith(ALLOWED_WARNINGS or ("\0",))] == []


@both
def test_pickled_and_copied_environments_go_on_alike(name):
    env = make(name, observation="sensors", history=1, irregularity="low")
    env.reset(seed=5)
    actions = actions_of(env, 12)
    roll(env, actions[:4])
    copies = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    expected, following = roll(env, actions[4:]), env.reset()[0]
    for other in copies:
        np.testing.assert_array_equal(roll(other, actions[4:]), expected)
        np.testing.assert_array_equal(other.reset()[0], following)


def test_wrapped_environment_can_be_pickled():
    env = pickle.loads(pickle.dumps(gym.make(BOGIE, max_episode_steps=3)))
    env.reset(seed=0)
    assert [env.step(env.action_space.sample())[3] for _ in range(3)] == [False, False, True]


@both
def test_close_can_be_called_twice(name):
    env = gym.make(name)
    env.reset(seed=0)
    env.close()
    env.close()


@both
def test_global_generator_is_untouched(name):
    np.random.seed(3)  # noqa: NPY002 - the point of the test
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    env = make(name, irregularity="high", observation="sensors", randomize={"conicity": (0.05, 0.1)})
    env.reset(seed=1)
    roll(env, actions_of(env, 5))
    env.reset()
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


@both
def test_steps_need_a_reset(name):
    env = make(name, duration=0.01)
    action = env.action_space.sample()
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        env.step(action)
    env.reset(seed=0)
    assert env.step(action)[3] is False
    assert env.step(action)[3] is True
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        env.step(action)


@both
def test_duration_ends_an_episode_and_max_episode_steps_before_it(name):
    env = gym.make(name)
    assert env.spec.max_episode_steps == 2000
    assert env.unwrapped.settings.duration == 10.0
    assert env.unwrapped.settings.control_period == 0.005
    env = gym.make(name, duration=0.02, max_episode_steps=3)
    env.reset(seed=0)
    ends = [env.step(np.zeros(env.action_space.shape))[2:4] for _ in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]


@both
@pytest.mark.parametrize("action", [[np.nan] * 2, [0.0] * 3, [np.inf, 0.0]])
def test_impossible_actions_raise(name, action):
    env = make(name, actuator="primary")
    env.reset(seed=0)
    with pytest.raises(ParameterError, match="finite number"):
        env.step(np.array(action))


# ---------------------------------------------------------------- keywords


@both
def test_unknown_keywords_raise_with_a_suggestion(name):
    with pytest.raises(UnknownNameError, match=r"'speed_rang' \(did you mean 'speed_range'\?\)"):
        gym.make(name, speed_rang=(60.0, 80.0))


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"speed_range": 80.0}, "speed_range is 80.0; it must be a pair"),
        ({"speed_range": (90.0, 80.0)}, "the lowest must not exceed"),
        ({"speed_range": (1.0, 80.0)}, "at least 5 m/s"),
        ({"cant_range": (0.0, 0.9)}, "cant_range"),
        ({"history": -1}, "history is -1"),
        ({"duration": 0.001}, "at least one control period"),
        ({"duration": math.inf}, "duration"),
        ({"time_step": 0.0}, "time_step is 0 s"),
        ({"tangent_share": 1.5}, "tangent_share"),
        ({"initial_offset": 0.1}, "initial_offset"),
        ({"observation": "pixels"}, "allowed are state, sensors"),
        ({"actuator": "tertiary"}, "allowed are none, secondary, primary"),
        ({"track": "loop"}, "allowed are constant, curve"),
        ({"irregularity": "medium"}, "allowed are low, high"),
        ({"weights": 1.0}, "must be a RewardWeights or a mapping"),
        ({"weights": {"comfort": 1.0}}, "unknown field of weights: 'comfort'"),
        ({"weights": {"ride": -1.0}}, "reward weight ride"),
        ({"randomize": {"frictio": (0.1, 0.2)}}, "did you mean 'friction'"),
        ({"actuator_model": 3}, "must be a railenv.Actuator"),
        ({"sensors": 3}, "must be a railenv.Sensors"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_impossible_keywords_raise(keywords, message):
    with pytest.raises(ParameterError, match=message.replace("(", r"\(")):
        make(BOGIE, **keywords)


def test_dual_wheelset_has_no_secondary_actuator():
    with pytest.raises(ParameterError, match="'none', 'primary'"):
        make(DUAL, actuator="secondary")


def test_unknown_render_modes_raise():
    with pytest.raises(ParameterError, match="render_mode is 'ansi'"):
        BogieEnv(render_mode="ansi")


def test_unknown_and_negative_weights_raise():
    with pytest.raises(TypeError):
        RewardWeights(comfort=1.0)
    with pytest.raises(ParameterError, match="reward weight ride"):
        RewardWeights(ride=-1.0)
