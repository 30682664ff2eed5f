"""Single environments do the same with the same seed, and go on from a kept state."""

import gymnasium as gym
import numpy as np
import pytest

import railenv
from railenv.errors import ParameterError
from tests.railenv.envs.runs import BOGIE, actions_of, both, make, roll


def everything():
    return {
        "observation": "sensors",
        "history": 1,
        "irregularity": "low",
        "irregularity_factor": (0.5, 1.5),
        "randomize": {"conicity": (0.05, 0.1), "creep_factor": (0.7, 1.0)},
        "track": "curve",
    }


@both
@pytest.mark.parametrize("keywords", [{}, everything()], ids=["defaults", "everything"])
def test_same_seed_same_trajectory_and_others_differ(name, keywords):
    def run(seed):
        env = make(name, **keywords)
        first, _ = env.reset(seed=seed)
        return first, roll(env, actions_of(env, 20))

    (o1, a), (o2, b), (o3, c) = run(4), run(4), run(5)
    np.testing.assert_array_equal(o1, o2)
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(o1, o3)
    assert not np.array_equal(a, c)


@both
def test_a_seed_means_the_same_whatever_ran_before(name):
    used = make(name)
    used.reset(seed=1000)
    for seed in range(5):
        fresh = make(name)
        fresh.reset(seed=seed)
        used.reset(seed=seed)
        np.testing.assert_array_equal(fresh.fleet.state(0), used.fleet.state(0))
        np.testing.assert_array_equal(fresh.fleet.equilibrium(0), used.fleet.equilibrium(0))


@both
@pytest.mark.parametrize("keywords", [{}, everything()], ids=["defaults", "everything"])
def test_state_can_be_kept_and_resumed_exactly(name, keywords):
    model = railenv.Actuator.primary().replace(delay=0.0123)
    env = make(name, actuator="primary", actuator_model=model, **keywords)
    actions = actions_of(env, 30)
    env.reset(seed=8)
    roll(env, actions[:7])
    kept = env.get_state()
    expected = roll(env, actions[7:])
    following = env.reset()[0]
    for other in (env, make(name, actuator="primary", actuator_model=model, **keywords)):
        other.set_state(kept)
        np.testing.assert_array_equal(roll(other, actions[7:]), expected)
        np.testing.assert_array_equal(other.reset()[0], following)


def test_state_of_an_ended_episode_stays_ended():
    env = make(BOGIE, duration=0.01)
    env.reset(seed=0)
    before = env.get_state()
    env.step([0.0])
    env.step([0.0])
    after = env.get_state()
    env.set_state(before)
    env.step([0.0])
    env.set_state(after)
    with pytest.raises(gym.error.ResetNeeded):
        env.step([0.0])


def test_state_of_another_size_is_refused():
    one, other = make(BOGIE), make(BOGIE, actuator="primary")
    one.reset(seed=0)
    other.reset(seed=0)
    before = one.fleet.state(0)
    with pytest.raises(ParameterError, match="same settings"):
        one.set_state(other.get_state())
    np.testing.assert_array_equal(one.fleet.state(0), before)
