"""Metrics of an episode: hunting, readings of the standards, totals."""

import math

import numpy as np
import pytest

from railenv.envs import metrics
from tests.railenv.envs.runs import BOGIE, both, make

NAMES = {
    "hunting_amplitude",
    "hunting_frequency",
    "acceleration_rms",
    "acceleration_peak",
    "effort_rms",
    "distance",
    "cfr_213_333",
    "en_14363",
}


def run(env, seconds, action=0.0):
    info = {}
    for _ in range(round(seconds / env.settings.control_period)):
        *_, terminated, truncated, info = env.step(np.full(env.action_space.shape, action))
        if terminated or truncated:
            break
    return info


def dominant_frequency(signal, period):
    spectrum = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(signal)), 16384))
    return np.argmax(spectrum) / (16384 * period)


@pytest.fixture(scope="module")
def hunting():
    env = make(BOGIE, duration=30.0)
    env.reset(seed=0, options={"speed": 118.0, "radius": math.inf, "offset": 0.009})
    return env, run(env, 30.0)


def test_amplitude_and_frequency_of_an_established_cycle(hunting):
    _, info = hunting
    found = info
    assert info["derailed"] == 0
    assert found["hunting_amplitude"] == pytest.approx(12.4e-3, abs=0.5e-3)
    # on the flanges the cycle is faster than the linear mode of 4.71 Hz
    assert found["hunting_frequency"] == pytest.approx(4.88, abs=0.05)


def test_frequency_is_where_the_spectrum_has_its_peak(hunting):
    env, info = hunting
    peak = dominant_frequency(env.fleet.recent(0)[:, 0], 0.005)
    assert info["hunting_frequency"] == pytest.approx(peak, abs=0.1)


def test_hunting_exceeds_the_limit_of_the_acceleration(hunting):
    assert hunting[1]["cfr_213_333"] > 1.0


def test_hunting_nears_the_limit_of_the_guiding_forces(hunting):
    # not above it in this cycle, but three orders above steady running
    assert hunting[1]["en_14363"] > 0.8


def test_readings_of_a_steady_cycle_hardly_depend_on_its_phase(hunting):
    env = hunting[0]
    kept = env.get_state()
    env.reset(seed=0, options={"speed": 118.0, "radius": math.inf, "offset": 0.009})
    run(env, 10.0)
    readings = []
    for _ in range(25):
        run(env, 0.02)
        found = env.episode_metrics()
        readings.append([found["cfr_213_333"], found["en_14363"]])
    env.set_state(kept)
    spread = np.ptp(readings, axis=0) / np.mean(readings, axis=0)
    assert (spread < 0.1).all(), spread


def test_steady_running_is_within_all_limits():
    env = make(BOGIE)
    env.reset(seed=0, options={"speed": 100.0, "radius": math.inf, "offset": 0.003})
    found = run(env, 10.0)
    assert found["hunting_amplitude"] < 2e-4
    assert found["cfr_213_333"] < 0.1
    assert found["en_14363"] < 0.1
    assert found["effort_rms"] == 0.0


@both
def test_metrics_are_there_at_any_step_and_in_the_last_info(name):
    env = make(name, duration=0.1)
    env.reset(seed=0)
    assert set(env.episode_metrics()) == NAMES
    for k in range(20):
        *_, truncated, info = env.step(env.action_space.sample())
        found = env.episode_metrics()
        assert set(found) == NAMES
        assert np.isfinite(list(found.values())).all()
        assert min(found.values()) >= 0.0
        assert (info["distance"] == 0.0) == (not truncated) == (k < 19)
        assert truncated or not any(info[name] for name in NAMES)
    assert {name: info[name] for name in NAMES} == found


@both
def test_totals_are_those_of_the_steps(name):
    env = make(name)
    env.reset(seed=3, options={"speed": 50.0, "radius": math.inf})
    rng = np.random.default_rng(0)
    squares, efforts = [], []
    for _ in range(100):
        *_, info = env.step(rng.uniform(-1, 1, env.action_space.shape))
        ride = info["ride"] / (1.0 - info["ride"])
        squares.append((ride * 0.1 * 9.81) ** 2)
        efforts.append(info["effort"])
    found = env.episode_metrics()
    assert found["acceleration_rms"] == pytest.approx(math.sqrt(np.mean(squares)), rel=1e-6)
    assert found["acceleration_peak"] == pytest.approx(math.sqrt(max(squares)), rel=1e-6)
    assert found["effort_rms"] == pytest.approx(math.sqrt(np.mean(efforts)), rel=1e-9)
    assert found["distance"] == pytest.approx(50.0 * 0.5, rel=1e-9)


def test_recent_signals_are_those_of_the_states():
    env = make(BOGIE, speed_range=(60.0, 60.0))
    env.reset(seed=1, options={"radius": math.inf})
    seen = []
    for _ in range(700):  # more than the ring holds
        env.step([0.2])
        seen.append(env.fleet.state(0)[[0, 4]] - env.fleet.equilibrium(0)[[0, 4]])
    recent = env.fleet.recent(0)
    assert len(recent) == 400
    np.testing.assert_allclose(recent[:, :2], seen[-400:], atol=1e-12)


def test_amplitude_and_frequency_of_a_sine():
    t = 0.005 * np.arange(400)
    signal = 0.003 + 0.008 * np.sin(2.0 * math.pi * 3.3 * t + 0.4)
    amplitude, frequency = metrics.amplitude_and_frequency(signal, 0.005)
    assert amplitude == pytest.approx(0.008, rel=1e-3)
    assert frequency == pytest.approx(3.3, rel=2e-3)
    assert metrics.amplitude_and_frequency(signal[:1], 0.005) == (0.0, 0.0)
    assert metrics.amplitude_and_frequency(np.linspace(0, 1, 50), 0.005)[1] == 0.0


def test_band_pass_keeps_its_band():
    t = 0.005 * np.arange(4000)
    for frequency, gain in ((3.0, 1.0), (0.02, 0.0), (60.0, 0.0)):
        signal = np.sin(2.0 * math.pi * frequency * t)
        filtered = metrics.band_passed(signal, metrics.CFR_BAND, 0.005)[1000:-1000]
        assert filtered.std() * math.sqrt(2.0) == pytest.approx(gain, abs=0.02)


def test_largest_sliding_rms():
    rng = np.random.default_rng(0)
    signal = rng.standard_normal(100)
    expected = max(math.sqrt(np.mean(signal[i : i + 30] ** 2)) for i in range(71))
    assert metrics.largest_sliding_rms(signal, 30) == pytest.approx(expected)
    assert metrics.largest_sliding_rms(signal, 500) == pytest.approx(math.sqrt(np.mean(signal**2)))


def test_limit_of_guiding_forces():
    env = make(BOGIE)
    env.reset(seed=0)
    vehicle = env.settings.vehicle
    axle = vehicle.wheelset_mass * vehicle.gravity + vehicle.external_load / 2.0
    loads = env.fleet.model.signals(
        env.fleet.state(0), speed=env.fleet.conditions(0)[0]
    )  # Y and Q of each wheel after the frame's force
    assert metrics.en_limit(env.fleet.model.axle_load) == pytest.approx(0.5 * (10e3 + axle / 3.0))
    assert loads[[2, 4]].sum() == pytest.approx(axle, rel=0.25)
