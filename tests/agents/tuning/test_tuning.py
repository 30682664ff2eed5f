"""Tuning: the families' growth rates and their gradient, and that tuning improves what it tunes."""

import dataclasses

import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.output_feedback import Filters, basis, terms_of
from agents.controllers.scheduled import readings_of
from agents.controllers.service import vehicles_of_service
from agents.tuning.family import Family
from agents.tuning.tuning_gradient import Goal, _Gains, _let_through, _Objective
from railenv.errors import ParameterError
from tests.pages import DOCS

CONICITIES, SPEEDS = (0.05, 0.3), (60.0, 110.0, 140.0)


@pytest.fixture(scope="module")
def coach():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


@pytest.fixture(scope="module")
def family(coach):
    signals = [reading.signal for reading in readings_of(coach, "sensors")]
    return Family.of(coach, signals, vehicles_of_service(coach, CONICITIES, (1.0,)), SPEEDS, 0.005)


@pytest.mark.parametrize("name", ["yaw-rate", "lqg-scheduled", "h-infinity", "output-feedback"])
def test_growth_rates_of_a_family_are_those_of_the_closed_loops(coach, family, name):
    controller = agents.shipped(name)
    expected = []
    for conicity in CONICITIES:
        for speed in SPEEDS:
            loop = design.closed_loop(coach.replace(conicity=conicity), controller, speed=speed)
            # the family has lateral motion only; the wheel on its rail decays at 4.3 1/s
            expected.append(loop.growth)
    growth = family.growth(controller.law, 0.005)
    np.testing.assert_allclose(np.maximum(growth, -4.0), np.maximum(expected, -4.0), atol=1e-4)


def actuated():
    """Return a bogie with three actuators and three bodies with sensors."""
    bogie = railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW)
    return railenv.Equipped(bogie, "both", sensed=("b", "w1", "w2"))


@pytest.mark.parametrize("several", [False, True])
def test_gradient_is_that_of_finite_differences(coach, several):
    model, filters = actuated() if several else coach, Filters(low_pass=(1.0, 6.0))
    readings = readings_of(model, "sensors")
    signals = [reading.signal for reading in readings]
    vehicles = vehicles_of_service(model, CONICITIES, (1.0,))
    family = Family.of(model, signals, vehicles, SPEEDS, 0.005)
    parts, gains = basis(model, readings, filters, 0.005), _Gains.of(model, filters, 0.005)
    objective = _Objective(family, parts, np.array([60.0, 140.0]), Goal(noise=1e-3), gains)
    rng = np.random.default_rng(3)
    size = 2 * gains.units.size
    x = 0.05 * rng.normal(size=size)
    value, gradient = objective(x, 0.005)
    for k in rng.choice(size, 12, replace=False):
        step = 1e-6 * np.eye(size)[k]
        difference = (objective(x + step, 0.005)[0] - objective(x - step, 0.005)[0]) / 2e-6
        assert gradient[k] == pytest.approx(difference, rel=1e-3, abs=1e-4 * abs(gradient).max())
    assert value > objective.rates(x, 0.005)[0].max()


def test_noise_of_terms_is_that_of_a_long_run(coach):
    filters = Filters(washout=0.005, low_pass=(1.0, 6.0))  # the tuning leaves the washout out
    terms = terms_of(coach, filters)
    expected = _let_through(coach, terms, 0.005)
    A, B, C, D = basis(coach, readings_of(coach, "sensors"), filters, 0.005)
    signals = [reading.signal for reading in readings_of(coach, "sensors")]
    noise = np.zeros((200_000, len(signals)))
    rng = np.random.default_rng(0)
    for name, level in (
        ("accel_b", coach.sensors.accelerometer_noise),
        ("gyro_b", coach.sensors.gyro_noise),
    ):
        noise[:, signals.index(name)] = level * rng.normal(size=len(noise))
    z, seen = np.zeros(len(A)), np.empty((len(noise), len(terms)))
    for k, y in enumerate(noise):
        seen[k] = C @ z + D @ y
        z = A @ z + B @ y
    sizes = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        np.cov(seen.T) / np.outer(sizes, sizes), expected / np.outer(sizes, sizes), atol=0.06
    )


def test_output_feedback_is_tuned_beyond_the_passive_robust_speed(coach):
    goal = Goal(vehicles=({"conicity": 0.05}, {"conicity": 0.4}), speeds=(20.0, 60.0, 90.0))
    tuned = agents.tune_output_feedback(
        coach, goal=goal, nodes=(20.0, 110.0), start=105.0, highest=105.0, iterations=30
    )
    assert tuned.target == 105.0
    for changes in goal.vehicles:
        loop = design.closed_loop(coach.replace(**changes), tuned.controller, speed=105.0)
        assert loop.growth < -0.9 * goal.decay
    with pytest.raises(ParameterError, match="start is 290 m/s"):
        agents.tune_output_feedback(coach, goal=goal, start=290.0, iterations=1)


def test_a_tuning_goes_on_from_given_gains(coach):
    """Two iterations are enough from gains that meet the goal, and are not from none."""
    goal = Goal(vehicles=({"conicity": 0.05}, {"conicity": 0.4}), speeds=(20.0, 90.0))
    given = {"goal": goal, "nodes": (20.0, 120.0), "start": 110.0, "highest": 110.0}
    first = agents.tune_output_feedback(coach, iterations=40, **given)
    gains = first.controller.about["gains"]
    again = agents.tune_output_feedback(coach, iterations=2, begin=gains, **given)
    assert again.target == 110.0
    assert again.evaluations < first.evaluations / 2
    with pytest.raises(ParameterError, match="cannot be kept stable"):
        agents.tune_output_feedback(coach, iterations=2, **given)
    with pytest.raises(ParameterError, match=r"begin has shape \(2, 4\); it must be \(2, 1, 4\)"):
        agents.tune_output_feedback(coach, begin=np.zeros((2, 4)), **given)


def test_actuated_wheelsets_are_tuned_beyond_what_a_moment_on_the_frame_can_reach():
    """On worn wheels a mode at 20 Hz grows from 129 m/s on, which the frame hardly moves."""
    bogie = railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW)
    model = railenv.Equipped(bogie, "primary", sensed=("w1", "w2"))
    goal = Goal(vehicles=({"conicity": 0.4, "creep_factor": 1.4},), speeds=(20.0, 60.0, 100.0, 130.0))
    tuned = agents.tune_output_feedback(
        model,
        filters=Filters(low_pass=(1.0, 6.0)),
        goal=goal,
        nodes=(20.0, 100.0, 160.0),
        start=160.0,
        highest=160.0,
        iterations=200,
    )
    worst = model.replace(**goal.vehicles[0])
    assert design.closed_loop(worst, tuned.controller, speed=160.0).growth < -0.9 * goal.decay


def test_yaw_rate_feedback_is_tuned_beyond_an_arbitrary_one(coach):
    tuned = agents.tune_yaw_rate(coach, generations=1, seed=1)
    plain = agents.YawRateFeedback.design(coach, gain=2e4)
    signals = tuned.input_labels
    ends = vehicles_of_service(coach, (0.05, 0.4), (1.0,))
    wide = Family.of(coach, signals, ends, (20.0, 60.0, 80.0, 100.0, 120.0), 0.005)
    assert wide.stable_up_to(tuned.law, 0.005, 0.3) > wide.stable_up_to(plain.law, 0.005, 0.3)


def test_shipped_h_infinity_holds_where_the_gain_of_the_actuator_is_off(coach):
    """That is what it is tuned for; an LQG tuned for exact actuators holds less."""
    shipped = agents.shipped("h-infinity")
    tolerance = shipped.about["tolerance"]
    signals = shipped.input_labels
    speeds = tuple(float(v) for v in range(20, 101, 10))
    family = Family.of(coach, signals, vehicles_of_service(coach, (0.05, 0.4)), speeds, 0.005)
    for gain in (1.0 - tolerance, 1.0, 1.0 + tolerance):
        off = dataclasses.replace(family, B=gain * family.B)
        assert (off.growth(shipped.law, 0.005) < 0.0).all()


def test_h_infinity_is_tuned_from_usual_values_and_says_how(coach):
    tuned = agents.tune_h_infinity(coach, speeds=(60.0,), generations=0)
    assert tuned.about["evaluations"] == 24
    assert tuned.about["design conicity"] == pytest.approx(0.1414, rel=1e-3)
    assert tuned.about["norms"][0] <= 1.001 * tuned.about["bounds"][0]
    assert isinstance(tuned, agents.HInfinity)
    with pytest.raises(ParameterError, match=r"tolerance is -0\.1"):
        agents.tune_h_infinity(coach, speeds=(60.0,), tolerance=-0.1)


def test_page_tells_the_budgets_and_limits_that_the_files_have():
    page = (DOCS / "controllers.md").read_text()
    for name in ("yaw-rate", "lqg", "h-infinity"):
        assert f"{agents.shipped(name).about['evaluations']} designs" in page
    families = agents.shipped("output-feedback").about["evaluations"]
    assert f"about {round(families, -2)} families" in page
    stored = agents.load_evaluations(DOCS / "leaderboard.json")[0]
    for curve in stored.curves[1:]:
        assert f"{curve.deficiency_limit:.1f} m/s" in page
