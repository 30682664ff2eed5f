"""The registered tasks: they can be made, say when they are solved, and leave something to learn."""

import json
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from railenv.tasks import TASKS

MEASURED = json.loads((Path(__file__).parents[3] / "docs" / "tasks.json").read_text())
QUICK = [t for t in TASKS if t.environment == "Bogie" and "contact" not in t.keywords]


def test_ids_are_registered_once():
    ids = [task.id for task in TASKS]
    assert len(set(ids)) == len(ids)
    for task in TASKS:
        spec = gym.spec(task.id)
        assert spec.reward_threshold == task.reward_threshold
        assert json.loads(json.dumps(spec.kwargs)) is not None  # plain values


@pytest.mark.parametrize("task", QUICK, ids=lambda task: task.id)
def test_a_task_is_made_runs_and_comes_back_from_its_spec(task):
    env = gym.make(task.id)
    first, _ = env.reset(seed=3)
    assert env.observation_space.contains(first)
    _, reward, *_ = env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    assert 0.0 <= reward <= 1.0
    assert env.spec.reward_threshold == task.reward_threshold
    assert env.spec.max_episode_steps == env.unwrapped.settings.steps
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    np.testing.assert_array_equal(again.reset(seed=3)[0], first)
    side_by_side = gym.make_vec(task.id, num_envs=2)
    np.testing.assert_array_equal(side_by_side.reset(seed=3)[0][0], first)


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.id)
def test_a_constant_gain_leaves_something_to_learn(task):
    """By what was measured: it loses clearly more than the best, and does not count as solving it."""
    row = MEASURED[task.id]
    gain, best = row["means"]["constant gain"], row["bound"]
    assert row["steps"] - gain > 1.5 * (row["steps"] - best)
    assert gain < task.reward_threshold < best
    assert row["means"]["idle"] <= gain


@pytest.mark.parametrize("task", QUICK, ids=lambda task: task.id)
def test_no_entry_of_an_observation_is_dead_or_far_off(task):
    """Over some episodes every entry of the present moment moves, and rests near 0."""
    env = gym.make_vec(task.id, num_envs=16)
    width = len(env.fleet.observation_names)
    seen = [env.reset(seed=0)[0][:, :width]]
    rng = np.random.default_rng(0)
    for _ in range(320 if env.settings.track == "curve" else 60):  # until the curve has come
        actions = rng.uniform(-0.3, 0.3, env.action_space.shape).astype(np.float32)
        seen.append(env.step(actions)[0][:, :width])
    values = np.array(seen).reshape(-1, width)
    names = env.fleet.observation_names
    dead = [n for n, spread in zip(names, values.std(axis=0), strict=True) if not spread > 1e-4]
    far = [n for n, mean in zip(names, values.mean(axis=0), strict=True) if not abs(mean) < 2.0]
    assert (dead, far) == ([], [])
