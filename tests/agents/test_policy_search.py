"""Policy search: it improves on its base, begins as it, and repeats itself."""

import numpy as np
import pytest

import agents
import design
import railenv
from agents.memory import MemorySettings
from agents.policy_search import Lessons, _Search, search_policy

pytest.importorskip("cma", reason="needs the extra rl")

SHORT = Lessons(conicities=(0.05, 0.3), speeds=(90.0, 150.0), duration=1.5)


@pytest.fixture(scope="module")
def coach():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


def search(coach, **changes):
    base = agents.YawRateFeedback.design(coach, gain=5e4)
    return search_policy(
        coach,
        base,
        lessons=SHORT,
        memory=MemorySettings(corners=(1.0,)),
        population=6,
        judge_every=100,
        **{"generations": 8, "seed": 1, **changes},
    )


def test_search_improves_on_its_first_generation_and_repeats_itself(coach):
    first = search(coach)
    assert first.mean[-3:].mean() > first.mean[0]
    assert first.best[-1] > first.best[0]
    assert first.episodes == 8 * 6 * 4
    again = search(coach)
    np.testing.assert_array_equal(first.mean, again.mean)
    assert search(coach, seed=2).mean[0] != first.mean[0]


def test_without_generations_the_policy_is_its_base(coach):
    found = search(coach, generations=0)
    base = agents.YawRateFeedback.design(coach, gain=5e4)
    alone = design.critical_speed(coach, controller=base, speed_range=(20.0, 300.0))
    policy = design.critical_speed(coach, controller=found.policy, speed_range=(20.0, 300.0))
    assert policy.speed == pytest.approx(alone.speed, rel=1e-6)
    assert found.robust[0, 0] == 0


def test_policy_adds_nothing_to_its_base_at_rest_on_a_curve(coach):
    base = agents.YawRateFeedback.design(coach, gain=5e4)
    inner = _Search(coach, base, SHORT, MemorySettings(corners=(0.3, 1.0)), 0.5, 0.005)
    weights = 0.01 * np.random.default_rng(0).normal(size=inner.dimension)
    policy = inner.policy(weights, {})
    assert np.abs(policy.network.weights[0]).max() > 1e-3
    at = {"speed": 80.0, "radius": 8000.0, "cant": 0.05}
    learned = design.closed_loop(coach, policy, **at)
    alone = design.closed_loop(coach, base, **at)
    assert learned.commands[0] == pytest.approx(alone.commands[0], abs=1e-3)
    np.testing.assert_allclose(learned.state[:24], alone.state[:24], atol=1e-9)


def test_impossible_lessons_are_refused():
    with pytest.raises(railenv.ParameterError, match="worst is 2"):
        Lessons(worst=2.0)
