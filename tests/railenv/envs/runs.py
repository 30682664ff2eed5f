"""Runs of single environments, as several tests do them."""

import gymnasium as gym
import numpy as np
import pytest

from railenv.envs.environment import TERM_NAMES

IDS = ("railenv/Bogie-v1", "railenv/DualWheelset-v1")
BOGIE, DUAL = IDS

both = pytest.mark.parametrize("name", IDS)


def make(name, **keywords):
    return gym.make(name, disable_env_checker=True, **keywords).unwrapped


def actions_of(env, count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (count, *env.action_space.shape)).astype(np.float32)


def roll(env, actions):
    """Everything that some steps return, and the states, as one array."""
    rows = []
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        terms = [info[k] for k in TERM_NAMES]
        rows.append([*observation, reward, terminated, truncated, *terms, *env.fleet.state(0)])
        if terminated or truncated:
            break
    return np.array(rows, dtype=float)
