"""Actuators that fail while the vehicle runs."""

import gymnasium as gym
import numpy as np
import pytest

import railenv

BOGIE = "railenv/Bogie-v1"
OWN = {"actuator": "primary", "duration": 1.0, "initial_offset": 0.0}
PINS = {"speed": 80.0, "radius": float("inf")}


def moments(env):
    """Shares of the limits that the actuators give after each of 100 steps at full command."""
    rows = []
    for _ in range(100):
        env.step(np.full(2, 0.5, dtype=np.float32))
        rows.append(env.unwrapped.fleet.moments(0))
    return np.array(rows)


@pytest.fixture(scope="module")
def env():
    return gym.make(BOGIE, actuator_failure=1.0, **OWN)


def test_from_then_on_one_gives_nothing_and_the_other_goes_on(env):
    _, info = env.reset(seed=0, options={**PINS, "failed_actuator": 2, "failure_time": 0.25})
    assert (info["failed_actuator"], info["failure_time"]) == (2.0, 0.25)
    found = moments(env)
    env.reset(seed=0, options={**PINS, "failed_actuator": 0})
    whole = moments(env)
    arrives = 50 + 2  # after the delay of 10 ms
    np.testing.assert_allclose(found[:arrives], whole[:arrives], atol=1e-12)
    assert found[-1, 1] == pytest.approx(0.0, abs=1e-3)
    np.testing.assert_allclose(found[:, 0], whole[:, 0], atol=1e-9)


def test_how_often_which_and_when(env):
    drawn = [env.reset(seed=seed)[1] for seed in range(60)]
    assert {info["failed_actuator"] for info in drawn} == {1.0, 2.0}
    times = np.array([info["failure_time"] for info in drawn])
    assert 0.0 <= times.min() < 0.1
    assert 0.6 < times.max() <= 0.75
    half = gym.make(BOGIE, actuator_failure=0.5, **OWN)
    share = np.mean([half.reset(seed=seed)[1]["failed_actuator"] > 0 for seed in range(60)])
    assert 0.3 < share < 0.7


def test_without_it_nothing_fails_and_the_same_is_drawn(env):
    plain = gym.make(BOGIE, **OWN)
    for seed in range(3):
        with_it, without = env.reset(seed=seed)[1], plain.reset(seed=seed)[1]
        assert without["failed_actuator"] == without["failure_time"] == 0.0
        assert {n: v for n, v in with_it.items() if "fail" not in n} == {
            n: v for n, v in without.items() if "fail" not in n
        }


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"failed_actuator": 3}, "failed_actuator is 3"),
        ({"failed_actuator": 1.5}, r"failed_actuator is 1\.5"),
        ({"failed_actuator": 1, "failure_time": -1.0}, "failure_time is -1"),
    ],
)
def test_wrong_pins_raise(env, options, match):
    with pytest.raises(railenv.ParameterError, match=match):
        env.reset(options=options)


def test_wrong_settings_raise():
    with pytest.raises(railenv.ParameterError, match=r"actuator_failure is 1\.5"):
        gym.make(BOGIE, actuator_failure=1.5)
    with pytest.raises(railenv.ParameterError, match="has no actuators"):
        gym.make(BOGIE, actuator="none", actuator_failure=0.1)
