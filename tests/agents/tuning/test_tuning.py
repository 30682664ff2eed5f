"""Tuning: the families' growth rates and their gradient, and that tuning improves what it tunes."""

import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.output_feedback import Filters, basis
from agents.controllers.scheduled import readings_of
from agents.tuning.family import Family
from agents.tuning.tuning_gradient import Goal, _Objective
from railenv.errors import ParameterError
from tests.pages import DOCS

CONICITIES, SPEEDS = (0.05, 0.3), (60.0, 110.0, 140.0)


@pytest.fixture(scope="module")
def coach():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


@pytest.fixture(scope="module")
def family(coach):
    signals = [reading.signal for reading in readings_of(coach, "sensors")]
    return Family.of(coach, signals, CONICITIES, SPEEDS, 0.005)


@pytest.mark.parametrize("name", ["yaw-rate", "lqg-scheduled", "output-feedback"])
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


def test_gradient_is_that_of_finite_differences(coach, family):
    readings = readings_of(coach, "sensors")
    parts = basis(coach, readings, Filters(), 0.005)
    nodes = np.array([60.0, 140.0])
    noise = np.full(4, 1e-12)
    objective = _Objective(family, parts, nodes, Goal(), noise)
    x = 0.3 * np.random.default_rng(3).normal(size=8)
    value, gradient = objective(x, 0.005)
    for k in range(8):
        step = 1e-6 * np.eye(8)[k]
        difference = (objective(x + step, 0.005)[0] - objective(x - step, 0.005)[0]) / 2e-6
        assert gradient[k] == pytest.approx(difference, rel=1e-3, abs=1e-4 * abs(gradient).max())
    assert value > objective.rates(x, 0.005)[0].max()


def test_output_feedback_is_tuned_beyond_the_passive_robust_speed(coach):
    goal = Goal(conicities=(0.05, 0.4), speeds=(20.0, 60.0, 90.0))
    tuned = agents.tune_output_feedback(
        coach, goal=goal, nodes=(20.0, 110.0), start=105.0, highest=105.0, iterations=30
    )
    assert tuned.target == 105.0
    for conicity in goal.conicities:
        model = coach.replace(conicity=conicity)
        loop = design.closed_loop(model, tuned.controller, speed=105.0)
        assert loop.growth < -0.9 * goal.decay
    with pytest.raises(ParameterError, match="start is 290 m/s"):
        agents.tune_output_feedback(coach, goal=goal, start=290.0, iterations=1)


def test_yaw_rate_feedback_is_tuned_beyond_an_arbitrary_one(coach):
    tuned = agents.tune_yaw_rate(coach, generations=1, seed=1)
    plain = agents.YawRateFeedback.design(coach, gain=2e4)
    signals = tuned.input_labels
    wide = Family.of(coach, signals, (0.05, 0.4), (20.0, 60.0, 80.0, 100.0, 120.0), 0.005)
    assert wide.stable_up_to(tuned.law, 0.005, 0.3) > wide.stable_up_to(plain.law, 0.005, 0.3)


def test_page_tells_the_budgets_and_limits_that_the_files_have():
    page = (DOCS / "controllers.md").read_text()
    for name in ("yaw-rate", "lqg"):
        assert f"{agents.shipped(name).about['evaluations']} designs" in page
    families = agents.shipped("output-feedback").about["evaluations"]
    assert f"about {round(families, -2)} families" in page
    stored = agents.load_evaluations(DOCS / "leaderboard.json")[0]
    for curve in stored.curves[1:]:
        assert f"{curve.deficiency_limit:.1f} m/s" in page
