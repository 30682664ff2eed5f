import copy
import math

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import railenv
from railenv.envs import DERAILED
from railenv.envs.infos import TERM_NAMES
from railenv.envs.metrics import METRICS

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from agents.learning.sb3 import HuntingVecEnv

IDS = ("railenv/Bogie-v1", "railenv/DualWheelset-v1")
BOGIE, DUAL = IDS
N = 5
SHORT = {"duration": 0.1}  # 20 control steps


@pytest.fixture(params=IDS)
def any_id(request):
    return request.param


@pytest.fixture
def short(any_id):
    env = HuntingVecEnv.make(any_id, num_envs=N, seed=3, **SHORT)
    yield env
    env.close()


def actions_of(env, count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (count, env.num_envs, *env.action_space.shape)).astype(np.float32)


def vector_env(id, **keywords):
    return gym.make_vec(id, num_envs=N, autoreset_mode=AutoresetMode.SAME_STEP, **keywords)


def derail(env, i):
    """Put one environment's wheelsets where the next step finds them derailed."""
    fleet = env.vector_env.fleet
    state = fleet.state(i)
    state[[0, 4]] = 0.05
    fleet.set_state(i, state)


# ---------------------------------------------------------------------------- single environments


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize("keywords", [{}, {"observation": "sensors", "history": 2}])
def test_single_environments_pass_the_checker(any_id, keywords):
    check_env(gym.make(any_id, **SHORT, **keywords).unwrapped)


def test_passive_single_environments_pass_the_checker(any_id):
    check_env(gym.make(any_id, actuator="none", **SHORT).unwrapped)


# ---------------------------------------------------------------------------- what steps return


def test_shapes_and_types(short):
    single = short.vector_env.single_observation_space
    assert isinstance(short, VecEnv)
    assert short.observation_space == single
    assert short.action_space == short.vector_env.single_action_space
    observations = short.reset()
    assert observations.shape == (N, *single.shape)
    assert observations.dtype == np.float32
    for actions in actions_of(short, 20):
        observations, rewards, dones, infos = short.step(actions)
        assert observations.shape == (N, *single.shape)
        assert observations.dtype == np.float32
        assert rewards.shape == dones.shape == (N,)
        assert rewards.dtype == np.float32
        assert dones.dtype == bool
        assert len(infos) == N
        assert all(type(info) is dict for info in infos)
    assert dones.all()


def test_numbers_are_those_of_the_vector_environment(any_id):
    ours = HuntingVecEnv.make(any_id, num_envs=N, seed=3, **SHORT)
    theirs = vector_env(any_id, **SHORT)
    expected, _ = theirs.reset(seed=3)
    np.testing.assert_array_equal(ours.reset(), expected)
    returns = np.zeros(N)
    for actions in actions_of(ours, 45):
        observations, rewards, dones, infos = ours.step(actions)
        expected, their_rewards, terminated, truncated, found = theirs.step(actions)
        returns += their_rewards
        np.testing.assert_array_equal(observations, expected)
        np.testing.assert_array_equal(rewards, their_rewards.astype(np.float32))
        np.testing.assert_array_equal(dones, terminated | truncated)
        for i in range(N):
            if not dones[i]:
                assert infos[i] == {}
                continue
            last = found["final_info"]
            np.testing.assert_array_equal(infos[i]["terminal_observation"], found["final_obs"][i])
            for name in TERM_NAMES:
                assert infos[i][name] == last[name][i]
            for name in METRICS:
                value = infos[i][name]
                np.testing.assert_equal(value, last[name][i])
            assert infos[i]["episode"]["r"] == pytest.approx(returns[i], abs=1e-6)
            assert infos[i]["episode"]["l"] == 20
            returns[i] = 0.0


def test_a_single_environment_gives_the_last_observation_and_info(any_id):
    batch = HuntingVecEnv.make(any_id, num_envs=1, seed=8, **SHORT)
    single = Monitor(gym.make(any_id, **SHORT))
    batch.reset()
    single.reset(seed=8)
    for actions in actions_of(batch, 20):
        observations, _, dones, (info,) = batch.step(actions)
        final, _, _, truncated, expected = single.step(actions[0])
    assert truncated
    assert dones.all()
    np.testing.assert_array_equal(info.pop("terminal_observation"), final)
    assert info.pop("TimeLimit.truncated") is True
    ours, theirs = info.pop("episode"), expected.pop("episode")
    assert (ours["r"], ours["l"]) == (theirs["r"], theirs["l"])
    assert ours["t"] > 0.0
    np.testing.assert_equal(info, expected)
    first, reset_info = single.reset()
    np.testing.assert_array_equal(observations[0], first)
    np.testing.assert_equal(batch.reset_infos[0], reset_info)


def test_only_time_raises_the_time_limit_flag(any_id):
    env = HuntingVecEnv.make(any_id, num_envs=N, seed=0, **SHORT)
    env.reset()
    idle = np.zeros((N, *env.action_space.shape), dtype=np.float32)
    derail(env, 2)
    _, rewards, dones, infos = env.step(idle)
    assert dones.tolist() == [False, False, True, False, False]
    assert infos[2]["TimeLimit.truncated"] is False
    assert "30 mm" in DERAILED[infos[2]["derailed"]]
    assert infos[2]["derailment"] == 1.0
    assert infos[2]["episode"]["l"] == 1
    assert rewards[2] == 0.0
    for _ in range(18):
        _, _, dones, infos = env.step(idle)
        assert not dones.any()
        assert not any(infos)
    derail(env, 4)  # in the step in which time is over
    _, _, dones, infos = env.step(idle)
    assert dones.tolist() == [True, True, False, True, True]
    assert infos[0]["TimeLimit.truncated"] is True
    assert infos[0]["derailed"] == 0
    assert infos[4]["TimeLimit.truncated"] is False
    assert infos[4]["derailed"] > 0


def test_reward_terms_of_every_step_when_asked():
    env = HuntingVecEnv.make(BOGIE, num_envs=N, seed=3, reward_terms=True, **SHORT)
    weights = env.vector_env.settings.weights
    env.reset()
    derail(env, 1)
    for actions in actions_of(env, 20):
        _, rewards, _, infos = env.step(actions)
        for reward, info in zip(rewards, infos, strict=True):
            cost = sum(s * info[t] for s, t in zip(weights.shares, TERM_NAMES, strict=False))
            assert reward == pytest.approx(0.0 if info["derailment"] else 1.0 - cost, rel=1e-6)


def test_infos_and_observations_are_not_overwritten_later(short):
    first = short.reset()
    kept = first.copy()
    ended = [short.step(actions) for actions in actions_of(short, 20)][-1]
    copied = copy.deepcopy(ended)
    for actions in actions_of(short, 20):
        short.step(actions)
    np.testing.assert_array_equal(first, kept)
    np.testing.assert_equal(ended, copied)


def test_steps_need_actions_and_a_reset():
    env = HuntingVecEnv.make(BOGIE, num_envs=N, **SHORT)
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros((N, 1), dtype=np.float32))
    env.reset()
    with pytest.raises(gym.error.NoAsyncCallError, match="step_async"):
        env.step_wait()
    with pytest.raises(railenv.ParameterError, match="shape"):
        env.step(np.zeros((N + 1, 1), dtype=np.float32))


# ---------------------------------------------------------------------------- seeds and options


def test_same_seed_same_episodes(any_id):
    def run(seed):
        env = HuntingVecEnv.make(any_id, num_envs=N, seed=seed, **SHORT)
        return np.array([env.reset(), *(env.step(a)[0] for a in actions_of(env, 25))])

    np.testing.assert_array_equal(run(7), run(7))
    assert not np.array_equal(run(7), run(8))


def test_seeds_hold_for_one_reset(short):
    assert short.seed(11) == [11, 12, 13, 14, 15]
    first = short.reset()
    assert not np.array_equal(short.reset(), first)
    short.seed(11)
    np.testing.assert_array_equal(short.reset(), first)


def test_seeding_leaves_the_global_generator_alone(short):
    np.random.seed(0)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    seeds = short.seed()
    short.reset()
    short.step(actions_of(short, 1)[0])
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002
    assert seeds != short.seed()


def test_options_pin_the_next_reset(short):
    speeds = np.linspace(30.0, 50.0, N)
    short.vector_env.reset(seed=0)
    short.set_options({"speed": speeds, "radius": math.inf})
    short.reset()
    assert [info["speed"] for info in short.reset_infos] == speeds.tolist()
    assert all(info["curvature"] == 0.0 for info in short.reset_infos)
    short.reset()
    assert not any(info["speed"] in speeds for info in short.reset_infos)


def test_options_may_differ_between_environments(short):
    short.set_options([{"speed": 40.0}, {}, {"cant": 0.02}, {"speed": 41.0}, {}])
    short.seed(2)
    short.reset()
    conditions = list(short.reset_infos)
    assert (conditions[0]["speed"], conditions[3]["speed"]) == (40.0, 41.0)
    assert conditions[2]["cant"] == 0.02
    short.seed(2)
    short.reset()
    free = list(short.reset_infos)
    np.testing.assert_equal((free[1], free[4]), (conditions[1], conditions[4]))
    assert free[0]["speed"] != conditions[0]["speed"]


def test_wrong_options_raise(short):
    with pytest.raises(railenv.ParameterError, match="2 entries"):
        short.set_options([{}, {}])
    with pytest.raises(railenv.ParameterError, match="shape"):
        short.set_options({"speed": [40.0, 41.0]})
    short.set_options({"sped": 40.0})
    with pytest.raises(railenv.RailenvError, match="sped"):
        short.reset()


# ---------------------------------------------------------------------------- construction


def test_keywords_are_those_of_the_environment():
    env = HuntingVecEnv.make(BOGIE, num_envs=2, actuator="primary", observation="sensors", history=2)
    assert env.action_space.shape == (2,)
    with pytest.raises(railenv.UnknownNameError, match="durration"):
        HuntingVecEnv.make(BOGIE, durration=3.0)
    with pytest.raises(railenv.ParameterError, match="duration"):
        HuntingVecEnv.make(BOGIE, duration=-1.0)


def test_max_episode_steps_truncates():
    env = HuntingVecEnv.make(BOGIE, num_envs=2, seed=1, max_episode_steps=4)
    env.reset()
    *_, (_, _, dones, infos) = [env.step(actions) for actions in actions_of(env, 4)]
    assert dones.all()
    assert all(info["TimeLimit.truncated"] for info in infos)
    assert all(info["episode"]["l"] == 4 for info in infos)


def test_only_vector_environments_that_reset_in_the_same_step():
    assert HuntingVecEnv(vector_env(BOGIE)).num_envs == N
    with pytest.raises(railenv.ParameterError, match="SAME_STEP"):
        HuntingVecEnv(gym.make_vec(BOGIE, num_envs=2))
    with pytest.raises(railenv.ParameterError, match="wrappers"):
        HuntingVecEnv(gym.wrappers.vector.RecordEpisodeStatistics(vector_env(BOGIE)))
    with pytest.raises(railenv.ParameterError, match="vector environment"):
        HuntingVecEnv(gym.make(BOGIE))


def test_closes_twice(short):
    short.reset()
    short.close()
    short.close()


# ---------------------------------------------------------------------------- single environments' own


def test_a_state_moves_between_environments(any_id):
    env = HuntingVecEnv.make(any_id, num_envs=N, seed=5, **SHORT)
    env.reset()
    steps = actions_of(env, 30)
    for actions in steps[:7]:
        env.step(actions)
    (state,) = env.env_method("get_state", indices=3)
    (episode_metrics,) = env.env_method("episode_metrics", indices=[3])

    single = gym.make(any_id, **SHORT).unwrapped
    single.reset(seed=0)
    single.set_state(state)
    np.testing.assert_equal(single.episode_metrics(), episode_metrics)
    other = HuntingVecEnv.make(any_id, num_envs=2 * N, seed=77, **SHORT)
    other.reset()
    other.env_method("set_state", state, indices=[0, 8])
    untouched = HuntingVecEnv.make(any_id, num_envs=2 * N, seed=77, **SHORT)
    untouched.reset()

    for actions in steps[7:20]:
        observations, rewards, dones, infos = env.step(actions)
        one, *_ = single.step(actions[3])
        same = np.broadcast_to(actions[3], (2 * N, *actions[3].shape))
        there, their_rewards, _, their_infos = other.step(same)
        alone, *_ = untouched.step(same)
        if not dones[3]:
            for i in (0, 8):
                np.testing.assert_array_equal(there[i], observations[3])
                assert their_rewards[i] == rewards[3]
            np.testing.assert_array_equal(one, observations[3])
        np.testing.assert_array_equal(there[1:8], alone[1:8])
    assert dones[3]
    np.testing.assert_array_equal(one, infos[3]["terminal_observation"])
    np.testing.assert_array_equal(there[0], observations[3])  # the next episode, too
    for i in (0, 8):
        assert their_infos[i]["episode"]["l"] == 20
        assert their_infos[i]["episode"]["r"] == infos[3]["episode"]["r"]
        assert their_infos[i]["speed"] == infos[3]["speed"]


def test_a_state_of_other_settings_raises(short):
    short.reset()
    other = gym.make(BOGIE, observation="sensors").unwrapped
    other.reset(seed=0)
    with pytest.raises(railenv.ParameterError, match="same settings"):
        short.env_method("set_state", other.get_state())


def test_one_environment_resets_alone(short):
    short.reset()
    for actions in actions_of(short, 5):
        before, *_ = short.step(actions)
    ((observation, info),) = short.env_method("reset", seed=4, options={"cant": 0.01}, indices=1)
    assert info["cant"] == 0.01
    assert short.vector_env.fleet.steps.tolist() == [5, 0, 5, 5, 5]
    assert not np.array_equal(observation, before[1])
    for actions in actions_of(short, 15):
        _, _, dones, _ = short.step(actions)
    assert dones.tolist() == [True, False, True, True, True]


def test_methods_that_single_environments_have_not(short):
    with pytest.raises(AttributeError, match="episode_metrics"):
        short.env_method("compute_reward")
    with pytest.raises(IndexError):
        short.env_method("episode_metrics", indices=N)
    assert short.env_method("episode_metrics", indices=[]) == []


def test_attributes(short):
    short.reset()
    assert short.get_attr("action_space") == [short.action_space] * N
    assert short.get_attr("observation_space", indices=[0, -1]) == [short.observation_space] * 2
    assert short.get_attr("settings", indices=2) == [short.vector_env.settings]
    assert not short.has_attr("action_masks")
    draws = {generator.random() for generator in short.get_attr("np_random")}
    assert len(draws) == N
    (reading,) = short.get_attr("episode_metrics", indices=1)
    np.testing.assert_equal(reading(), short.env_method("episode_metrics", indices=1)[0])

    short.set_attr("level", 2, indices=[1, 3])
    assert short.get_attr("level") == [None, 2, None, 2, None]
    for name in ("speed_range", "num_envs", "render_mode"):
        with pytest.raises(railenv.ParameterError, match="does not change"):
            short.set_attr(name, 3)


def test_infos_are_those_of_monitor_and_of_no_other_wrapper(short):
    assert short.env_is_wrapped(Monitor) == [True] * N
    assert short.env_is_wrapped(gym.wrappers.TimeLimit, indices=0) == [False]


# ---------------------------------------------------------------------------- pictures


def test_images():
    pytest.importorskip("pygame")
    env = HuntingVecEnv.make(BOGIE, num_envs=2, seed=0, render_mode="rgb_array", **SHORT)
    env.reset()
    images = env.get_images()
    assert len(images) == 2
    height, width, colours = images[0].shape
    assert colours == 3
    assert env.render().shape in ((2 * height, width, 3), (height, 2 * width, 3))
    np.testing.assert_array_equal(env.env_method("render", indices=1)[0], env.get_images()[1])
    assert env.metadata["render_fps"] > 0
    env.close()
    env.close()


def test_no_images_without_a_render_mode(short):
    short.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert short.get_images() == [None] * N
    with pytest.warns(UserWarning, match="render"):
        assert short.render() is None


# ---------------------------------------------------------------------------- Stable-Baselines3


def learner(env, **keywords):
    network = {"net_arch": [8]}
    return PPO(
        "MlpPolicy",
        env,
        n_steps=32,
        batch_size=80,
        n_epochs=1,
        policy_kwargs=network,
        seed=0,
        device="cpu",
        **keywords,
    )


@pytest.mark.parametrize(
    "keywords", [{}, {"actuator": "none"}, {"observation": "sensors", "history": 1}]
)
def test_ppo_learns_on_the_batch(any_id, keywords):
    env = HuntingVecEnv.make(any_id, num_envs=N, **SHORT, **keywords)
    model = learner(env)
    model.learn(2 * 32 * N)
    assert model.num_timesteps == 2 * 32 * N
    assert len(model.ep_info_buffer) == 3 * N  # 64 steps, 20 for an episode
    assert all(0.0 < episode["r"] <= 20.0 for episode in model.ep_info_buffer)


def test_normalised_and_monitored():
    env = HuntingVecEnv.make(BOGIE, num_envs=N, seed=6, **SHORT)
    plain = HuntingVecEnv.make(BOGIE, num_envs=N, seed=6, **SHORT)
    normalised = VecNormalize(env)
    normalised.reset()
    plain.reset()
    for actions in actions_of(env, 20):
        normalised.step_async(actions)
        _, _, dones, infos = normalised.step_wait()
        expected, _, _, plain_infos = plain.step(actions)
    assert dones.all()
    np.testing.assert_array_equal(normalised.get_original_obs(), expected)
    for info, plain_info in zip(infos, plain_infos, strict=True):
        raw = plain_info["terminal_observation"]
        np.testing.assert_array_equal(info["terminal_observation"], normalised.normalize_obs(raw))
        assert info["episode"]["r"] == plain_info["episode"]["r"]
    learner(VecNormalize(env)).learn(32 * N)

    with pytest.warns(UserWarning, match="Monitor"):
        monitored = VecMonitor(plain, info_keywords=("TimeLimit.truncated",))
    plain.seed(6)
    monitored.reset()
    for actions in actions_of(env, 20):
        *_, infos = monitored.step(actions)
    for info, plain_info in zip(infos, plain_infos, strict=True):
        assert info["episode"]["r"] == pytest.approx(plain_info["episode"]["r"], rel=1e-5)
        assert info["episode"]["l"] == 20
        assert info["episode"]["TimeLimit.truncated"]


@pytest.mark.filterwarnings("error::UserWarning")
def test_evaluation_sees_returns_before_normalisation():
    env = VecNormalize(HuntingVecEnv.make(BOGIE, num_envs=N, seed=6, **SHORT))
    model = learner(env)
    env.training = False
    returns, lengths = evaluate_policy(model, env, n_eval_episodes=N, return_episode_rewards=True)
    assert lengths == [20] * N
    assert all(0.0 < r <= 20.0 for r in returns)
    assert all(round(r, 6) == r for r in returns)  # as the infos give them
