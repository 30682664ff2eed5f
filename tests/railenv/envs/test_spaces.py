"""Spaces and observations of the single environments."""

import math

import gymnasium as gym
import numpy as np
import pytest

import railenv
from tests.railenv.envs.runs import BOGIE, DUAL, actions_of, both, make


@both
def test_without_actuators_the_environment_is_passive(name):
    env = make(name, actuator="none")
    assert env.action_space == gym.spaces.Discrete(1)
    env.reset(seed=2)
    armed = make(name)
    armed.reset(seed=2)
    n = env.fleet.model.plant.n_states
    for _ in range(50):
        _, reward, *_ = env.step(0)
        _, other, *_ = armed.step(np.zeros(armed.action_space.shape))
        assert reward == pytest.approx(other, rel=1e-8, abs=1e-12)
    passive, active = env.fleet.state(0)[:n], armed.fleet.state(0)[:n]
    np.testing.assert_allclose(passive, active, rtol=1e-8, atol=1e-12)


def test_action_spaces():
    for name, place, n in ((BOGIE, "secondary", 1), (BOGIE, "primary", 2), (DUAL, "primary", 2)):
        assert make(name, actuator=place).action_space == gym.spaces.Box(-1, 1, (n,), np.float32)


@both
@pytest.mark.parametrize("kind", ["state", "sensors"])
def test_observations_are_those_of_the_table(name, kind):
    quiet = railenv.Sensors.standard().replace(
        accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_bias=0.0, gyro_bias=0.0
    )
    env = make(name, observation=kind, sensors=quiet, irregularity="low")
    env.reset(seed=3)
    actions = actions_of(env, 9)
    observation = None
    for action in actions:
        observation, *_ = env.step(action)
    fleet = env.fleet
    table = fleet.observation_table
    assert env.observation_space.shape == (len(table),)
    assert np.isfinite(env.observation_space.low).all()
    assert np.isfinite(env.observation_space.high).all()
    assert (env.observation_space.low == -10).all()
    assert (env.observation_space.high == 10).all()
    speed, curvature, cant = fleet.conditions(0)
    known = dict(zip(fleet.model.state_names, fleet.state(0), strict=True))
    known |= {"speed": speed, "cant": cant}
    known["cant_deficiency"] = speed**2 * curvature / fleet.settings.vehicle.gravity - cant
    for body in fleet.model.equipment.sensed:
        known[f"accelerometer_{body}"] = known[f"accel_{body}"]
        known[f"gyro_{body}"] = known[f"gyro_{body}"]
    for j, body in enumerate(fleet.model.equipment.actuated):
        for age in range(1, 4):
            command = fleet.model.actuator.limit * float(actions[-age, j])
            known[f"command_{body}[-{age}]"] = command
    for value, (entry, unit, scale, _, rest, _) in zip(observation, table, strict=True):
        assert unit
        assert scale > 0.0
        assert value == np.float32((known[entry] - rest) / scale), entry


def test_observations_are_clipped_at_their_bounds():
    env = make(BOGIE)
    env.reset(seed=0, options={"radius": math.inf})
    state = env.fleet.state(0)
    state[env.fleet.model.state_names.index("dT_b")] = 1e12
    env.fleet.set_state(0, state)
    observation, *_ = env.step([0.0])
    assert np.abs(observation).max() == 10.0
    assert observation in env.observation_space


def test_noise_and_bias_are_as_set():
    sensors = railenv.Sensors.standard()
    env = make(BOGIE, observation="sensors", sensors=sensors)
    errors, biases = [], []
    for seed in range(40):
        env.reset(seed=seed, options={"radius": math.inf, "offset": 0.0, "speed": 60.0})
        run = np.array([env.step([0.0])[0][:2] for _ in range(100)]) * [5.0, 0.2]
        biases.append(run.mean(axis=0))
        errors.append(run - run.mean(axis=0))
    spread = np.concatenate(errors).std(axis=0) * math.sqrt(100 / 99)
    np.testing.assert_allclose(spread, [sensors.accelerometer_noise, sensors.gyro_noise], rtol=0.05)
    # of 40 biases the standard deviation is known to 11 %, beside the noise's mean
    expected = np.hypot(
        [sensors.accelerometer_bias, sensors.gyro_bias], np.array(spread) / math.sqrt(100)
    )
    np.testing.assert_allclose(np.std(biases, axis=0), expected, rtol=0.4)
    flat = np.concatenate(errors)
    lag = (flat[1:] * flat[:-1]).mean(axis=0) / flat.var(axis=0)
    assert (np.abs(lag) < 0.05).all()


@both
@pytest.mark.parametrize("kind", ["state", "sensors"])
def test_history_stacks_past_observations_newest_first(name, kind):
    plain, stacked = (make(name, observation=kind, history=k) for k in (0, 3))
    first, _ = plain.reset(seed=6)
    past = [first] * 4
    np.testing.assert_array_equal(stacked.reset(seed=6)[0], np.concatenate(past))
    for action in actions_of(plain, 6):
        past = [plain.step(action)[0], *past[:3]]
        np.testing.assert_array_equal(stacked.step(action)[0], np.concatenate(past))
    assert stacked.observation_space.shape == (4 * len(first),)
