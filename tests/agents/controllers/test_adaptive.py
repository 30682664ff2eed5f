"""The adaptive bank: what it can tell apart, that it is an LQG where it is sure, and its file."""

import dataclasses

import numpy as np
import pytest

import agents
import railenv
from agents.controllers.adaptive import Predictors
from agents.evaluation.growth import measured_critical_speed
from agents.evaluation.rollout import Track
from design.linear.regulator import (
    _REGULARIZATION,
    Disturbances,
    kalman,
    lateral_model,
    scales,
    sensor_noise,
)
from railenv.errors import ParameterError, UnknownNameError

CONICITIES = (0.05, 0.15, 0.4)
BANK = [{"conicity": c} for c in CONICITIES]
LINE = Disturbances(alignment=2e-4)


@pytest.fixture(scope="module")
def bogie():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


@pytest.fixture(scope="module")
def adaptive(bogie):
    return agents.AdaptiveLQG.design(bogie, speeds=[60.0, 100.0], vehicles=BANK, disturbances=LINE)


def test_new_and_worn_wheels_are_told_apart_on_an_irregular_line(bogie, adaptive):
    cases = [agents.Case(100.0, vehicle={"conicity": c}) for c in CONICITIES]
    rollout = agents.Rollout(bogie, adaptive, cases, Track("low", noise=True))
    seen = []
    for step in range(1000):
        rollout.step()
        if step > 400:
            seen.append(adaptive.estimate("conicity"))
    found = np.mean(seen, axis=0)
    assert found == pytest.approx(CONICITIES, abs=0.03)
    assert not rollout.derailed.any()


def test_before_anything_is_seen_all_are_alike_likely(adaptive):
    adaptive.reset(3)
    np.testing.assert_allclose(adaptive.likely, 1.0 / 3.0)
    assert adaptive.estimate("conicity") == pytest.approx([np.mean(CONICITIES)] * 3)
    with pytest.raises(UnknownNameError, match="wear"):
        adaptive.estimate("wear")


def test_a_bank_of_one_vehicle_twice_is_its_lqg(bogie):
    speeds = [80.0, 120.0]
    twice = agents.AdaptiveLQG.design(bogie, speeds=speeds, vehicles=[BANK[1]] * 2)
    single = agents.LQG.design(bogie.replace(**BANK[1]), speeds=speeds)
    rng = np.random.default_rng(0)
    twice.reset(4)
    single.reset(4)
    for _ in range(50):
        y = 0.1 * rng.normal(size=(4, len(single.readings)))
        y[:, 2] = 95.0 / single.readings[2].scale
        np.testing.assert_allclose(twice.act(y), single.act(y), rtol=1e-9, atol=1e-12)


def test_expected_errors_are_those_of_the_filters_own_vehicle(bogie):
    """Covariance of the errors of prediction, against a long run of the filter's own model."""
    own = bogie.replace(conicity=0.2)
    found = Predictors.of([own], [90.0], LINE, 0.005)
    rails = tuple(w.rails[0] for w in own.guided)
    system = lateral_model(own, speed=90.0, sensors=True, disturbances=rails)
    observer = kalman(own, speed=90.0, disturbances=LINE)
    rng, noise = np.random.default_rng(1), sensor_noise(own, LINE)
    n, m, p = system.nstates, len(own.command_names), system.noutputs
    x, z, errors, offset = np.zeros(n), np.zeros(len(observer.A)), [], np.zeros(p)
    drift = np.tile([LINE.accelerometer_drift, LINE.gyro_drift], p // 2)
    moment = LINE.moment * own.limits
    prompt = lateral_model(own, speed=90.0, sensors=True, delay=0.0).B
    # the filter reckons with a little noise on every state, too, in units of its scale
    floor = np.sqrt(_REGULARIZATION) * scales(own, system)
    for _ in range(40_000):
        offset = offset + drift * rng.normal(size=p)
        y = system.C @ x + offset + noise * rng.normal(size=p)
        error = y - observer.C @ z
        errors.append(error)
        z = observer.A @ (z + observer.M @ error)
        x = system.A @ x + system.B[:, m:] @ (LINE.alignment * rng.normal(size=len(rails)))
        x[: len(prompt)] += prompt @ (moment * rng.normal(size=m))
        x += floor * rng.normal(size=n)
    measured = np.cov(np.array(errors[500:]).T)
    expected = np.linalg.inv(found.weights[0, 0])
    sizes = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        measured / np.outer(sizes, sizes), expected / np.outer(sizes, sizes), atol=0.05
    )
    assert found.sizes[0, 0] == pytest.approx(np.log(np.linalg.det(expected)))


def test_it_is_stable_further_than_any_of_its_controllers(bogie):
    """Each LQG of the bank fails on some vehicle at a speed at which the bank holds all of them."""
    speeds = [float(v) for v in range(20, 161, 20)]
    bank = [{"conicity": c, "creep_factor": k} for c in (0.05, 0.4) for k in (0.6, 1.4)]
    adaptive = agents.AdaptiveLQG.design(bogie, speeds=speeds, vehicles=bank, disturbances=LINE)
    limits = (40.0, 125.0)
    reached = [measured_critical_speed(bogie, adaptive, limits, vehicle=one).speed for one in bank]
    assert reached == [125.0] * len(bank)
    for controller in adaptive.bank:
        alone = [measured_critical_speed(bogie, controller, limits, vehicle=one).speed for one in bank]
        assert min(speed or 0.0 for speed in alone) < 120.0


def test_a_file_gives_back_its_equal(adaptive, tmp_path):
    adaptive.save(tmp_path / "bank.npz")
    again = agents.load(tmp_path / "bank.npz")
    assert again.vehicles == adaptive.vehicles
    rng = np.random.default_rng(2)
    adaptive.reset(2)
    again.reset(2)
    for _ in range(20):
        y = 0.05 * rng.normal(size=(2, len(adaptive.readings)))
        y[:, 2] = 80.0 / adaptive.readings[2].scale
        np.testing.assert_array_equal(adaptive.act(y), again.act(y))
    content = again.to_file()
    broken = dataclasses.replace(content, arrays={**content.arrays, "A": content.arrays["A"][:1]})
    with pytest.raises(ParameterError, match="A has 1 entries; it must have 3"):
        agents.AdaptiveLQG.from_file(broken)


@pytest.mark.parametrize(
    ("vehicles", "told"),
    [
        ([{"conicity": 0.1}], "it must be two or more"),
        ([{"conicity": 0.1}, {"creep_factor": 1.0}], "changes of the same numbers"),
    ],
)
def test_a_bank_that_cannot_be_is_refused(bogie, vehicles, told):
    with pytest.raises(ParameterError, match=told):
        agents.AdaptiveLQG.design(bogie, speeds=[80.0], vehicles=vehicles)


def test_vehicles_that_the_model_has_not_are_refused(bogie):
    with pytest.raises(UnknownNameError, match="wear"):
        agents.AdaptiveLQG.design(bogie, speeds=[80.0], vehicles=[{"wear": 0.0}, {"wear": 1.0}])
