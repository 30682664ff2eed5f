"""Random actions in random episodes over the whole range of keywords."""

import math

import gymnasium as gym
import numpy as np
import pytest

import railenv
from railenv.envs import DERAILED
from railenv.envs.settings import RewardWeights
from tests.railenv.envs.runs import BOGIE, DUAL

KINDS = [(BOGIE, "secondary"), (BOGIE, "primary"), (BOGIE, "none"), (DUAL, "primary"), (DUAL, "none")]


def some_range(rng, low, high):
    return tuple(sorted(rng.uniform(low, high, 2)))


def keywords_of(rng, name, place):
    """Random keywords, each left out now and then."""
    period = float(rng.choice([0.002, 0.005, 0.01, 0.02]))
    fastest, slowest = (200.0, max(20.0, 0.03 / period)) if name == BOGIE else (80.0, 15.0)
    actuator = railenv.Actuator.secondary() if place == "secondary" else railenv.Actuator.primary()
    base = railenv.Sensors.standard()
    drawn = {
        "actuator_model": actuator.replace(
            delay=float(rng.choice([0.0, 0.005, 0.0123, 0.05, 0.2])),
            limit=float(rng.uniform(1e3, 1e5)),
            bandwidth=float(rng.uniform(2.0, 50.0)),
            damping=float(rng.uniform(0.1, 1.5)),
            rate_limit=float(rng.choice([1e5, 1e300])),
            parallel_damping=float(rng.choice([0.0, 1e5, 1e6])),
        ),
        "sensors": base.replace(accelerometer_noise=float(rng.uniform(0.0, 2.0)), gyro_bias=0.1),
        "observation": str(rng.choice(["state", "sensors"])),
        "history": int(rng.integers(0, 4)),
        "speed_range": some_range(rng, slowest, fastest),
        "cant_range": some_range(rng, 0.0, 0.15),
        "max_cant_deficiency": float(rng.uniform(0.1, 0.25)),
        "tangent_share": float(rng.choice([0.0, 0.3, 1.0])),
        "track": str(rng.choice(["constant", "curve"])),
        "irregularity": [None, "low", "high"][rng.integers(3)],
        "irregularity_factor": some_range(rng, 0.0, 3.0),
        "randomize": {
            key: some_range(rng, low, high)
            for key, low, high in (
                ("conicity", 0.035, 0.3),
                ("friction", 0.1, 0.6),
                ("creep_factor", 0.3, 1.2),
                ("body_mass", 2e4, 5e4),
            )
            if rng.random() < 0.5
        },
        "initial_offset": float(rng.uniform(0.0, 0.02)),
        "time_step": float(rng.choice([0.0005, 0.001])),
        "weights": RewardWeights(hunting=float(rng.uniform(0, 2)), change=float(rng.uniform(0, 1))),
    }
    chosen = {key: value for key, value in drawn.items() if rng.random() < 0.6}
    if place == "none":
        chosen.pop("actuator_model", None)
    chosen.setdefault("speed_range", (max(60.0 if name == BOGIE else 20.0, slowest), fastest))
    return {"actuator": place, "control_period": period, "duration": 60 * period, **chosen}


def check(env, observation, reward, terminated, info, space):
    assert observation.dtype == np.float32
    assert observation in space, "observation outside its space"
    assert math.isfinite(reward)
    assert all(0.0 <= info[t] <= 1.0 for t in ("hunting", "excursion", "ride", "effort"))
    assert (info["derailed"] > 0) == terminated
    assert type(info["derailed"]) is np.int64
    assert DERAILED[info["derailed"]] or not terminated


def episodes_of_single(rng, name, place, count):
    """Random episodes of one environment; returns how many derailed."""
    keywords = keywords_of(rng, name, place)
    env = gym.make(name, disable_env_checker=True, **keywords).unwrapped
    derailed = 0
    for _ in range(count):
        seed = int(rng.integers(2**31))
        observation, _ = env.reset(seed=seed)
        assert observation in env.observation_space, (name, seed, keywords)
        style, held = rng.integers(4), rng.uniform(-1.5, 1.5, env.action_space.shape)
        for k in range(60):
            random = rng.uniform(-1.0, 1.0, env.action_space.shape)
            bang = np.full(env.action_space.shape, 1.0 if k % 2 else -1.0)
            action = (random, held, bang, np.sign(random))[style]
            observation, reward, terminated, truncated, info = env.step(action)
            try:
                check(env, observation, reward, terminated, info, env.observation_space)
                if terminated:
                    assert not any(math.isnan(v) for v in info.values()), info
                else:
                    assert np.isfinite(env.fleet.state(0)).all()
            except AssertionError as error:
                raise AssertionError(f"{name} seed {seed} step {k}: {keywords}") from error
            if terminated or truncated:
                assert terminated or k == 59
                break
        derailed += terminated
    return derailed


def episodes_of_batch(rng, name, place, rounds):
    """Random episodes of a batch; returns how many ended, and how many of them derailed."""
    keywords = keywords_of(rng, name, place)
    vector = gym.make_vec(name, num_envs=8, autoreset_mode="SameStep", **keywords)
    vector.reset(seed=int(rng.integers(2**31)))
    ended = derailed = 0
    for _ in range(60 * rounds):
        action = rng.uniform(-1.0, 1.0, vector.action_space.shape)
        observations, rewards, terminated, truncated, info = vector.step(action)
        assert observations in vector.observation_space, (name, keywords)
        assert np.isfinite(rewards).all(), (name, keywords)
        if terminated.any():
            reasons = info["final_info"]["derailed"][terminated]
            assert set(reasons.tolist()) <= set(range(1, len(DERAILED))), (name, keywords)
        for i in np.flatnonzero(terminated | truncated):
            assert info["final_obs"][i] in vector.single_observation_space, (name, keywords)
        ended += (terminated | truncated).sum()
        derailed += terminated.sum()
    return int(ended), int(derailed)


@pytest.mark.parametrize(("name", "place"), KINDS)
def test_random_episodes(name, place):
    rng = np.random.default_rng(KINDS.index((name, place)))
    derailed = sum(episodes_of_single(rng, name, place, 3) for _ in range(20))
    assert 0 < derailed < 60


@pytest.mark.parametrize(("name", "place"), [(BOGIE, "secondary"), (DUAL, "primary")])
def test_random_batches(name, place):
    rng = np.random.default_rng(7)
    counts = np.sum([episodes_of_batch(rng, name, place, 1) for _ in range(8)], axis=0)
    assert counts[0] >= 8 * 8
    assert 0 < counts[1] < counts[0]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "place"), KINDS)
def test_two_thousand_random_episodes(name, place, capsys):
    """Ten thousand over all five kinds."""
    rng = np.random.default_rng(100 + KINDS.index((name, place)))
    derailed = sum(episodes_of_single(rng, name, place, 4) for _ in range(500))
    with capsys.disabled():
        print(f"\n{name} {place}: 2000 episodes, {derailed} derailed", end="")
