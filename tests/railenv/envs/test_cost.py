"""The cost for learning under constraints: shares of three limits."""

import gymnasium as gym
import numpy as np
import pytest

from railenv.envs import DERAILED
from railenv.envs.infos import SAFETY

BOGIE = "railenv/Bogie-v1"
STRAIGHT = {"radius": float("inf"), "offset": 0.0}


def infos(env, **pins):
    env.reset(seed=1, options={**STRAIGHT, **pins})
    found, done = [], False
    while not done:
        *_, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
        found.append(info)
        done = terminated or truncated
    return found


@pytest.fixture(scope="module")
def env():
    return gym.make(BOGIE, duration=8.0, disable_env_checker=True)


def column(found, name):
    return np.array([info[name] for info in found])


def test_it_is_the_largest_of_the_three_and_nothing_in_steady_running(env):
    found = infos(env, speed=70.0)
    parts = np.array([column(found, name) for name in SAFETY[1:]])
    np.testing.assert_array_equal(column(found, "cost"), parts.max(axis=0))
    np.testing.assert_allclose(column(found, "instability"), 0.0, atol=1e-6)
    assert column(found, "unloading").max() < 1e-3
    assert column(found, "nadal").max() < 0.2  # of the steady contact angle


def test_in_hunting_it_is_the_reading_of_the_standard(env):
    """The running rms over 100 m and that of the episode's metric differ by window and band only."""
    found = infos(env, speed=118.0, offset=0.004)
    last = found[-1]
    assert not last["derailed"]
    assert last["hunting_amplitude"] > 3e-3
    assert last["instability"] == pytest.approx(last["en_14363"], rel=0.15)
    assert last["cost"] >= last["instability"] > 0.2


def test_a_derailment_by_nadal_is_a_cost_above_one(env):
    found = infos(env, speed=150.0, offset=0.005)
    last = found[-1]
    assert DERAILED[last["derailed"]].startswith("Nadal")
    assert last["cost"] >= last["nadal"] > 1.0
    assert all(column(found[:-1], "nadal") <= 1.0)


def test_a_curve_unloads_the_inner_wheels():
    """By the couple of the load that moves over: h (V^2 / R) / (b g), over what a wheel may lose."""
    env = gym.make(BOGIE, duration=3.0, disable_env_checker=True)
    env.reset(seed=0, options={"speed": 50.0, "radius": 3000.0, "cant": 0.0, "offset": 0.0})
    for _ in range(400):
        *_, info = env.step(np.zeros(1, dtype=np.float32))
    fleet = env.unwrapped.fleet
    signals = fleet._view(fleet._blocks, 0)
    k, lanes = fleet._kernels, fleet._layout
    loads = [signals[lanes.o + k.N_SENSED + 2 * wheel + 1] for wheel in range(k.N_WHEELS)]
    static = fleet.model.axle_load / 2.0
    assert info["unloading"] == pytest.approx((1.0 - min(loads) / static) / 0.9, rel=1e-3)
    assert info["unloading"] > 0.02
