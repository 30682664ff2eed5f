"""What was drawn of the vehicle, in the observation on request."""

import gymnasium as gym
import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.memory import MemorySettings
from agents.controllers.network import Network, Normalization
from agents.evaluation.returns import episode_returns

RANGES = {"conicity": (0.05, 0.25), "creep_factor": (0.6, 1.0), "friction": (0.3, 0.3)}
OWN = {"observation": "sensors", "context": True, "randomize": RANGES, "duration": 0.5}
BOGIE = "railenv/Bogie-v1"


def policy(env, weight):
    """A policy that looks at the conicity alone."""
    readings = tuple(env.unwrapped.fleet.observation_table)
    row = np.zeros((1, len(readings)))
    row[0, [r.name for r in readings].index("conicity")] = weight
    width = len(readings)
    network = Network(
        (row,),
        (np.zeros(1),),
        "tanh",
        "none",
        Normalization(np.zeros(width), np.ones(width), 1e9),
        None,
    )
    return agents.LearnedPolicy(
        network=network,
        readings=readings,
        commands=("command_b",),
        limit=26e3,
        observation="sensors",
        memory=MemorySettings(),
    )


@pytest.fixture(scope="module")
def env():
    return gym.make(BOGIE, **OWN)


def test_entries_go_from_minus_one_to_one_over_the_ranges(env):
    names = env.unwrapped.fleet.observation_names
    assert names[-2:] == ("conicity", "creep_factor")  # friction has nothing to tell
    for seed in range(5):
        observation, info = env.reset(seed=seed)
        assert observation[-2] == pytest.approx((info["conicity"] - 0.15) / 0.1, abs=1e-6)
        assert observation[-1] == pytest.approx((info["creep_factor"] - 0.8) / 0.2, abs=1e-6)
        later = env.step(np.array([0.3], dtype=np.float32))[0]
        np.testing.assert_array_equal(later[-2:], observation[-2:])


def test_it_changes_nothing_else(env):
    plain = gym.make(BOGIE, **{**OWN, "context": False})
    told, _ = env.reset(seed=7)
    untold, _ = plain.reset(seed=7)
    np.testing.assert_array_equal(told[:-2], untold)


def test_pins_and_vector_environments_tell_it_too(env):
    observation, _ = env.reset(seed=0, options={"conicity": 0.1})
    assert observation[-2] == pytest.approx(-0.5, abs=1e-6)
    several = gym.make_vec(BOGIE, num_envs=3, **OWN)
    rows, infos = several.reset(seed=4)
    np.testing.assert_allclose(rows[:, -2], (infos["conicity"] - 0.15) / 0.1, atol=1e-6)
    assert env.reset(seed=5)[0] == pytest.approx(rows[1])


def test_with_nothing_drawn_it_raises():
    with pytest.raises(railenv.ParameterError, match="context is True, but nothing is drawn"):
        gym.make(BOGIE, context=True)
    with pytest.raises(railenv.ParameterError, match="context is True, but nothing is drawn"):
        gym.make(BOGIE, context=True, randomize={"conicity": (0.1, 0.1)})
    with pytest.raises(railenv.ParameterError, match="context is 'yes'"):
        gym.make(BOGIE, context="yes", randomize=RANGES)


def test_a_policy_reads_it_in_the_closed_loop_and_in_rollouts(env):
    """The steady command is what the network makes of the vehicle's own conicity."""
    reads = policy(env, 0.2)
    vehicle = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), "secondary")
    for conicity in (0.1, 0.2):
        own = vehicle.replace(conicity=conicity)
        loop = design.closed_loop(own, reads, speed=80.0)
        assert loop.commands[0] == pytest.approx(0.2 * (conicity - 0.15) / 0.1 * 26e3)
    run = agents.Rollout(vehicle, reads, [agents.Case(80.0, vehicle={"conicity": 0.2})])
    assert run.fleet.observations[0, -2] == pytest.approx(0.5, abs=1e-6)
    restored = agents.LearnedPolicy.from_file(reads.to_file())
    assert restored.readings == reads.readings


def test_what_a_policy_that_reads_it_earns(env):
    found = episode_returns(BOGIE, policy(env, 0.1), episodes=2, env_kwargs=OWN)
    idle = episode_returns(BOGIE, policy(env, 0.0), episodes=2, env_kwargs=OWN)
    none = episode_returns(BOGIE, None, episodes=2, env_kwargs=OWN)
    np.testing.assert_array_equal(idle.values, none.values)
    assert (found.values != idle.values).all()
