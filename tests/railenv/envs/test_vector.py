"""The vector environments: rows are the single environments, all three modes of autoreset."""

import copy
import math
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

import railenv
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.envs.runs import BOGIE, DUAL, both

modes = pytest.mark.parametrize("mode", list(AutoresetMode), ids=lambda m: m.value)

VARIED = {
    "defaults": {},
    "state": {
        "irregularity": "high",
        "irregularity_factor": (0.5, 2.0),
        "randomize": {"conicity": (0.05, 0.1), "creep_factor": (0.7, 1.0)},
        "history": 2,
        "track": "curve",
    },
    "sensors": {
        "observation": "sensors",
        "irregularity": "low",
        "randomize": {"friction": (0.2, 0.4), "body_mass": (3e4, 4e4)},
        "history": 1,
        "control_period": 0.004,
    },
}
varied = pytest.mark.parametrize("keywords", VARIED.values(), ids=VARIED)


def make_vec(name, n, **keywords):
    return gym.make_vec(name, num_envs=n, **keywords)


def sync(name, n, mode, **keywords):
    def one():
        return gym.make(name, disable_env_checker=True, **keywords)

    return SyncVectorEnv([one] * n, autoreset_mode=mode)


def assert_same_info(ours, theirs):
    """The same entries, each where its mask says that it is there."""
    entries = {k for k in theirs if not k.startswith("_")}
    present = {k for k in ours if not k.startswith("_") and np.any(ours.get(f"_{k}", True))}
    assert present == entries
    for key in entries:
        mask = theirs.get(f"_{key}")
        if mask is None:
            raise AssertionError(f"{key} has no mask")
        np.testing.assert_array_equal(ours[f"_{key}"], mask, err_msg=key)
        if isinstance(theirs[key], dict):
            assert_same_info(ours[key], theirs[key])
            continue
        assert ours[key].dtype == theirs[key].dtype, key
        for a, b in zip(ours[key], theirs[key], strict=True):
            np.testing.assert_array_equal(a, b, err_msg=key)


def assert_same_step(ours, theirs):
    for a, b in zip(ours[:-1], theirs[:-1], strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    assert_same_info(ours[-1], theirs[-1])


# ---------------------------------------------------------------- rows


@both
@varied
@pytest.mark.parametrize("n", [3, 70])
def test_single_environment_is_a_row_of_the_batch_to_the_bit(name, keywords, n):
    vector = make_vec(name, n, duration=0.1, **keywords)
    first, infos = vector.reset(seed=20)
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (12, *vector.action_space.shape)).astype(np.float32)
    steps = [(vector.step(a), [vector.fleet.state(i) for i in range(n)]) for a in actions]
    for i in {0, 1, n // 2, n - 1}:
        env = gym.make(name, disable_env_checker=True, duration=0.1, **keywords).unwrapped
        observation, info = env.reset(seed=20 + i)
        np.testing.assert_array_equal(observation, first[i])
        for key, value in info.items():
            np.testing.assert_equal(infos[key][i], value, err_msg=key)
        for action, (batch, states) in zip(actions, steps, strict=True):
            observation, reward, terminated, truncated, info = env.step(action[i])
            np.testing.assert_array_equal(env.fleet.state(0), states[i])
            np.testing.assert_array_equal(observation, batch[0][i])
            assert reward == batch[1][i]
            assert terminated == batch[2][i]
            assert truncated == batch[3][i]
            for key, value in info.items():
                np.testing.assert_equal(batch[4][key][i], value, err_msg=key)
            if terminated or truncated:
                break


@both
@modes
@pytest.mark.parametrize("keywords", VARIED.values(), ids=VARIED)
def test_autoreset_is_that_of_gymnasium(name, mode, keywords):
    # starts on the flange, so that some of the episodes derail and the others run out of time
    steep = {"initial_offset": 0.02, "duration": 0.05, **keywords}
    n = 5
    ours = make_vec(name, n, autoreset_mode=mode, **steep)
    theirs = sync(name, n, mode, **steep)
    a, b = ours.reset(seed=3), theirs.reset(seed=3)
    np.testing.assert_array_equal(a[0], b[0])
    assert_same_info(a[1], b[1])
    rng = np.random.default_rng(2)
    ends = 0
    for _ in range(60):
        action = rng.uniform(-1, 1, ours.action_space.shape).astype(np.float32)
        a, b = ours.step(action), theirs.step(action)
        assert_same_step(a, b)
        done = a[2] | a[3]
        ends += done.sum()
        if mode is AutoresetMode.DISABLED and done.any():
            a, b = (e.reset(options={"reset_mask": done.copy()}) for e in (ours, theirs))
            np.testing.assert_array_equal(a[0], b[0])
            assert_same_info(a[1], b[1])
    assert ends >= 4 * n


@both
@modes
def test_derailments_are_those_of_gymnasium(name, mode):
    ours = make_vec(name, 4, autoreset_mode=mode, duration=0.05)
    theirs = sync(name, 4, mode, duration=0.05)
    ours.reset(seed=1)
    theirs.reset(seed=1)
    derailed = 0
    for k in range(30):
        if k % 7 == 3:  # off the rails, in a row that is running
            i = k % 4
            state = theirs.envs[i].unwrapped.fleet.state(0)
            state[0] = 0.05
            theirs.envs[i].unwrapped.fleet.set_state(0, state)
            ours.fleet.set_state(i, state)
        action = np.zeros(ours.action_space.shape, np.float32)
        a, b = ours.step(action), theirs.step(action)
        assert_same_step(a, b)
        derailed += a[2].sum()
        if a[2].any():
            info = a[4]["final_info"] if mode is AutoresetMode.SAME_STEP else a[4]
            assert info["derailed"][a[2]][0]
        done = a[2] | a[3]
        if mode is AutoresetMode.DISABLED and done.any():
            a, b = (e.reset(options={"reset_mask": done.copy()}) for e in (ours, theirs))
            assert_same_info(a[1], b[1])
    assert derailed >= 3


def test_final_info_is_of_ended_environments_only():
    vector = make_vec(BOGIE, 3, autoreset_mode=AutoresetMode.SAME_STEP, duration=0.02)
    vector.reset(seed=0)
    for _ in range(2):
        vector.step(np.zeros((3, 1)))
    state = vector.get_state()
    state["fleet"]["steps"][:] = [3, 0, 3]
    vector.set_state(state)
    *_, truncated, info = vector.step(np.zeros((3, 1)))
    np.testing.assert_array_equal(truncated, [True, False, True])
    np.testing.assert_array_equal(info["_final_obs"], truncated)
    assert [o is not None for o in info["final_obs"]] == truncated.tolist()
    for key in ("hunting", "distance"):
        np.testing.assert_array_equal(info["final_info"][f"_{key}"], truncated)
        assert info[f"_{key}"].all()
    np.testing.assert_array_equal(info["final_info"]["distance"] > 0.0, truncated)
    assert not info["distance"].any()


@both
def test_max_episode_steps_of_make_vec(name):
    ours = make_vec(name, 2, max_episode_steps=3)
    theirs = sync(name, 2, AutoresetMode.NEXT_STEP, max_episode_steps=3)
    ours.reset(seed=0)
    theirs.reset(seed=0)
    action = np.zeros(ours.action_space.shape, np.float32)
    for k in range(8):
        a, b = ours.step(action), theirs.step(action)
        np.testing.assert_array_equal(a[3], b[3])
        assert a[3].all() == (k in (2, 6))
    with pytest.raises(ParameterError, match="max_episode_steps"):
        make_vec(name, 2, max_episode_steps=0)


# ---------------------------------------------------------------- the contract


@both
def test_is_a_vector_environment_with_its_own_entry_point(name):
    vector = make_vec(name, 4)
    assert isinstance(vector, VectorEnv)
    assert not isinstance(vector, SyncVectorEnv)
    assert vector.num_envs == 4
    assert vector.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    reference = sync(name, 4, AutoresetMode.NEXT_STEP)
    for space in ("action_space", "observation_space", "single_action_space"):
        assert getattr(vector, space) == getattr(reference, space)
    assert vector.single_observation_space == reference.single_observation_space
    observations, infos = vector.reset(seed=0)
    assert observations in vector.observation_space
    assert observations.dtype == np.float32
    assert isinstance(infos, dict)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(3):
            observations, rewards, terminated, truncated, _ = vector.step(vector.action_space.sample())
            assert observations in vector.observation_space
            assert rewards.shape == terminated.shape == truncated.shape == (4,)
            assert rewards.dtype == np.float64
            assert terminated.dtype == truncated.dtype == np.bool_
    vector.close()
    vector.close()


@modes
def test_mode_of_autoreset_can_be_named(mode):
    vector = make_vec(BOGIE, 2, autoreset_mode=mode.value)
    assert vector.autoreset_mode is mode
    assert vector.metadata["autoreset_mode"] is mode
    assert type(vector).metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


def test_single_environments_of_the_same_id_can_be_batched():
    vector = gym.make_vec(DUAL, num_envs=2, vectorization_mode="sync")
    assert isinstance(vector, SyncVectorEnv)
    vector.reset(seed=0)
    vector.step(vector.action_space.sample())


@both
def test_returned_arrays_are_not_reused(name):
    vector = make_vec(name, 2)
    first, _ = vector.reset(seed=0)
    kept = first.copy()
    second = vector.step(vector.action_space.sample())
    copies = [a.copy() for a in second[:4]]
    vector.step(vector.action_space.sample())
    np.testing.assert_array_equal(first, kept)
    for a, b in zip(second[:4], copies, strict=True):
        np.testing.assert_array_equal(a, b)


@both
def test_seeds_may_be_a_list(name):
    vector = make_vec(name, 3)
    one, _ = vector.reset(seed=[5, 9, 5])
    np.testing.assert_array_equal(one[0], one[2])
    assert not np.array_equal(one[0], one[1])
    two, _ = vector.reset(seed=[9, 5, 5])
    np.testing.assert_array_equal(two, one[[1, 0, 2]])
    with pytest.raises(ParameterError, match="seed has 2 entries"):
        vector.reset(seed=[1, 2])


@both
def test_some_rows_are_reset_and_the_others_left(name):
    vector = make_vec(name, 3)
    vector.reset(seed=0)
    vector.step(vector.action_space.sample())
    before = [vector.fleet.state(i) for i in range(3)]
    mask = np.array([False, True, False])
    options = {"reset_mask": mask, "speed": 50.0, "radius": math.inf}
    _, infos = vector.reset(options=options)
    assert set(options) == {"reset_mask", "speed", "radius"}
    np.testing.assert_array_equal(infos["_speed"], mask)
    np.testing.assert_array_equal(vector.fleet.state(0), before[0])
    np.testing.assert_array_equal(vector.fleet.state(2), before[2])
    assert not np.array_equal(vector.fleet.state(1), before[1])
    assert vector.fleet.steps.tolist() == [1, 0, 1]


@pytest.mark.parametrize(
    "mask", [[True, False], np.array([1, 0]), np.array([True]), np.zeros(2, bool)], ids=range(4)
)
def test_impossible_reset_masks_raise(mask):
    vector = make_vec(BOGIE, 2)
    vector.reset(seed=0)
    with pytest.raises(ParameterError, match="reset_mask"):
        vector.reset(options={"reset_mask": mask})


def test_disabled_and_same_step_ask_for_a_reset():
    vector = make_vec(BOGIE, 2, autoreset_mode="Disabled", duration=0.005)
    with pytest.raises(gym.error.ResetNeeded):
        vector.step(np.zeros((2, 1)))
    vector.reset(seed=0)
    vector.step(np.zeros((2, 1)))
    with pytest.raises(gym.error.ResetNeeded, match="reset_mask"):
        vector.step(np.zeros((2, 1)))


@pytest.mark.parametrize("shape", [(2,), (2, 2), (3, 1)])
def test_actions_of_another_shape_raise(shape):
    vector = make_vec(BOGIE, 2)
    vector.reset(seed=0)
    with pytest.raises(ParameterError, match=r"of shape \(2, 1\)"):
        vector.step(np.zeros(shape))
    with pytest.raises(ParameterError, match="finite"):
        vector.step(np.full((2, 1), np.nan))


@both
def test_passive_rows(name):
    vector = make_vec(name, 3, actuator="none")
    assert vector.single_action_space == gym.spaces.Discrete(1)
    assert vector.action_space == gym.spaces.MultiDiscrete([1, 1, 1])
    env = gym.make(name, actuator="none").unwrapped
    vector.reset(seed=2)
    env.reset(seed=3)
    for _ in range(10):
        observations, *_ = vector.step(vector.action_space.sample())
        np.testing.assert_array_equal(observations[1], env.step(0)[0])


def test_unknown_keywords_and_numbers_of_environments():
    with pytest.raises(UnknownNameError, match="did you mean 'observation'"):
        make_vec(BOGIE, 2, observations="state")
    for n in (0, 1.5):
        with pytest.raises(ParameterError, match="num_envs"):
            type(make_vec(BOGIE, 1).unwrapped)(num_envs=n)


# ---------------------------------------------------------------- options


@both
def test_options_are_numbers_or_arrays(name):
    vector = make_vec(name, 3, irregularity="low")
    speeds = np.array([40.0, 41.0, 42.0])
    options = {"speed": speeds, "radius": math.inf, "offset": np.array([0.0, 1e-3, 2e-3])}
    _, infos = vector.reset(seed=0, options=options)
    np.testing.assert_array_equal(infos["speed"], speeds)
    np.testing.assert_array_equal(infos["curvature"], [0.0] * 3)
    np.testing.assert_array_equal(infos["offset"], options["offset"])
    with pytest.raises(ParameterError, match=r"option speed has shape \(2,\)"):
        vector.reset(options={"speed": np.array([40.0, 41.0])})
    with pytest.raises(UnknownNameError, match="did you mean 'radius'"):
        vector.reset(options={"radios": 300.0})


def test_impossible_options_leave_the_batch_as_it_was():
    vector = make_vec(BOGIE, 2)
    vector.reset(seed=0)
    before = [vector.fleet.state(i) for i in range(2)]
    with pytest.raises(ParameterError, match="speed is 1 m/s"):
        vector.reset(options={"speed": np.array([70.0, 1.0])})
    for i in range(2):
        np.testing.assert_array_equal(vector.fleet.state(i), before[i])


# ---------------------------------------------------------------- resume and copies


def record(vector, actions):
    rows = []
    for action in actions:
        observations, rewards, terminated, truncated, _ = vector.step(action)
        rows.append(np.column_stack([observations, rewards, terminated, truncated]))
    return np.array(rows)


@both
@varied
def test_state_is_resumed_exactly(name, keywords):
    actuator = railenv.Actuator.primary().replace(delay=0.0123)
    settings = {"actuator": "primary", "actuator_model": actuator, "duration": 0.06, **keywords}
    vector = make_vec(name, 3, **settings)
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (40, *vector.action_space.shape)).astype(np.float32)
    vector.reset(seed=1)
    record(vector, actions[:6])
    kept = vector.get_state()
    expected = record(vector, actions[6:])
    for other in (vector, make_vec(name, 3, **settings)):
        other.set_state(kept)
        np.testing.assert_array_equal(record(other, actions[6:]), expected)


@both
def test_pickled_and_copied_batches_go_on_alike(name):
    vector = make_vec(name, 3, duration=0.04).unwrapped
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (30, *vector.action_space.shape)).astype(np.float32)
    vector.reset(seed=1)
    record(vector, actions[:6])
    copies = [copy.deepcopy(vector), pickle.loads(pickle.dumps(vector))]
    expected = record(vector, actions[6:])
    for other in copies:
        np.testing.assert_array_equal(record(other, actions[6:]), expected)


def test_global_generator_is_untouched():
    before = np.random.get_state()[1].copy()  # noqa: NPY002 - the point of the test
    vector = make_vec(DUAL, 3, duration=0.02, observation="sensors")
    vector.reset(seed=1)
    for _ in range(10):
        vector.step(vector.action_space.sample())
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_metrics_of_every_environment():
    vector = make_vec(BOGIE, 2)
    vector.reset(seed=0)
    vector.step(np.zeros((2, 1)))
    metrics = vector.unwrapped.episode_metrics()
    assert [m["distance"] > 0.0 for m in metrics] == [True, True]
