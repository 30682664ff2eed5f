"""Policy search: it improves on its base, begins as it, and repeats itself."""

import numpy as np
import pytest

import agents
import design
import railenv
from agents.controllers.memory import MemorySettings
from agents.controllers.scheduled import readings_of
from agents.evaluation.rollout import Case
from agents.learning.candidates import Candidates
from agents.learning.designs import SEED
from agents.learning.lessons import TINY, Lessons
from agents.learning.policy_search import _best, _Judged, search_policy
from agents.learning.policy_start import Aim, Target, _plant, _slowest
from agents.tuning.family import Family

pytest.importorskip("cma", reason="needs the extra rl")

SHORT = Lessons(
    small=tuple(
        Case(v, offset=TINY, vehicle={"conicity": c}) for v in (90.0, 150.0) for c in (0.05, 0.3)
    ),
    large=(Case(140.0, offset=6e-3),),
    rides=(Case(80.0),),
    duration=2.0,
    decay=2.0,
)
NOWHERE = Aim(targets=(Target(conicities=(0.05,), speeds=(60.0,)),), decay=0.0, size=1.0)
MEMORY = MemorySettings(corners=(0.5, 4.0), past_commands=1, schedule=(60.0, 180.0))


@pytest.fixture(scope="module")
def coach():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))


@pytest.fixture(scope="module")
def base(coach):
    return agents.YawRateFeedback.design(coach, gain=5e4)


def search(coach, base, **changes):
    return search_policy(
        coach,
        base,
        lessons=SHORT,
        memory=MEMORY,
        population=6,
        judge_every=100,
        **{"generations": 8, "seed": 1, "aim": NOWHERE, **changes},
    )


def test_search_improves_on_its_start_and_repeats_itself(coach, base):
    first = search(coach, base)
    assert first.mean[-3:].mean() > first.mean[0]
    assert first.judged[-1, 2] > first.judged[0, 2]
    assert first.episodes == 8 * 6 * 6
    again = search(coach, base)
    np.testing.assert_array_equal(first.mean, again.mean)
    np.testing.assert_array_equal(first.policy.network.weights[0], again.policy.network.weights[0])
    assert search(coach, base, seed=2, generations=1).mean[0] != first.mean[0]
    assert first.plot().axes[0, 0].get_xlabel() == "generation"


def test_without_aim_and_generations_the_policy_is_its_base(coach, base):
    found = search(coach, base, generations=0)
    alone = design.critical_speed(coach, controller=base, speed_range=(20.0, 300.0))
    policy = design.critical_speed(coach, controller=found.policy, speed_range=(20.0, 300.0))
    assert policy.speed == pytest.approx(alone.speed, rel=1e-6)
    assert found.judged[0, 0] == 0


def test_start_makes_the_family_decay(coach, base):
    aim = Aim(
        targets=(
            Target(conicities=(0.05, 0.3), speeds=(60.0, 120.0, 150.0)),
            Target(conicities=(0.05,), speeds=(180.0,), weight=0.1),
            Target(conicities=(0.3,), speeds=(110.0,), creep_factor=0.7),
            Target(conicities=(0.05,), speeds=(110.0,), radius=8000.0, cant=0.0873),
        )
    )
    found = search(coach, base, generations=0, aim=aim)
    for conicity, speed in ((0.05, 60.0), (0.3, 150.0), (0.05, 180.0)):
        vehicle = coach.replace(conicity=conicity)
        rate = {
            kind: np.log(design.closed_loop(vehicle, law, speed=speed).spectral_radius) / 0.005
            for kind, law in (("base", base), ("policy", found.policy))
        }
        assert rate["policy"] < -0.4
    assert rate["base"] > 0.0
    curving = design.closed_loop(coach, found.policy, speed=110.0, radius=8000.0, cant=0.0873)
    assert np.log(curving.spectral_radius) / 0.005 < -0.4


def test_of_policies_robust_enough_the_best_score_is_chosen():
    rows = [_Judged(0, np.zeros(1), 163.0, -80.0), _Judged(12, np.zeros(1), 159.5, 2.0)]
    rows.append(_Judged(24, np.zeros(1), 159.4, 3.0))
    assert [_best(rows, wanted).generation for wanted in (159.45, 160.0, 170.0)] == [12, 0, 0]


@pytest.mark.slow
def test_the_shipped_policys_search_begins_as_its_file_tells():
    shipped = agents.shipped("learned")
    coach = agents.equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))
    found = search_policy(coach, agents.shipped("output-feedback"), generations=1, seed=SEED)
    np.testing.assert_allclose(found.judged[0], shipped.about["judged"][0], rtol=1e-3)
    assert found.mean[0] == pytest.approx(shipped.about["means"][0], rel=1e-2)


def test_slopes_of_growth_rates_are_those_of_finite_differences(coach, base):
    inner = Candidates(coach, base, SHORT, MEMORY, 0.5, 0.005)
    signals = [reading.signal for reading in readings_of(coach, "sensors")]
    family = Family.of(coach, signals, [{"conicity": 0.3}], (150.0,), 0.005)
    plant = _plant(family, 0, signals, lambda w: inner.policy(w, {}), inner.dimension)
    weights = 0.05 * np.random.default_rng(0).normal(size=inner.dimension)
    _, slopes = _slowest(*plant, weights, 0.005)
    for k in range(0, inner.dimension, 3):
        step = 1e-6 * np.eye(inner.dimension)[k]
        up, down = (_slowest(*plant, weights + s, 0.005)[0] for s in (step, -step))
        assert slopes[0, k] == pytest.approx((up - down)[0] / 2e-6, rel=1e-4, abs=1e-5)


def test_policy_adds_nothing_to_its_base_at_rest_on_a_curve(coach, base):
    inner = Candidates(coach, base, SHORT, MEMORY, 0.5, 0.005)
    weights = 0.01 * np.random.default_rng(0).normal(size=inner.dimension)
    policy = inner.policy(weights, {})
    assert np.abs(policy.network.weights[0]).max() > 1e-3
    at = {"speed": 80.0, "radius": 8000.0, "cant": 0.05}
    learned = design.closed_loop(coach, policy, **at)
    alone = design.closed_loop(coach, base, **at)
    assert learned.commands[0] == pytest.approx(alone.commands[0], abs=1e-3)
    np.testing.assert_allclose(learned.state[:24], alone.state[:24], atol=1e-9)


# ---------------------------------------------------------------------------- lessons


def test_rates_of_lessons_are_the_growth_rates_of_the_linear_loop(coach):
    """A vehicle that hunts, one that decays, and one in a limit cycle from a large offset."""
    speeds = (100.0, 125.0)
    lessons = Lessons(
        duration=8.0,  # the large motion has settled by half of it
        small=tuple(Case(v, offset=TINY) for v in speeds),
        large=(Case(110.0, offset=9e-3),),
        rides=(Case(80.0),),
        decay=0.0,
        ride=0.0,
    )
    rates = [
        np.log(design.closed_loop(coach, agents.Passive.design(coach), speed=v).spectral_radius) / 0.005
        for v in speeds
    ]
    assert rates[0] < 0.0 < rates[1]
    score = lessons.scores(coach, agents.Passive.design(coach))[0]
    assert rates[1] > 0.1  # it costs 1 more that it grows
    assert np.cbrt(-score - 1.0) == pytest.approx(rates[1], rel=0.03)


def test_growth_into_a_limit_cycle_is_worse_than_slow_growth(coach):
    passive = agents.Passive.design(coach)

    def score(speed):
        case = Case(speed, offset=1e-4)  # at 150 m/s it is a limit cycle within a second or two
        lessons = Lessons(
            small=(case,), large=(Case(60.0, offset=1e-3),), rides=(Case(60.0),), ride=0.0
        )
        return lessons.scores(coach, passive)[0]

    assert score(150.0) < score(118.0) < score(90.0)


def test_policies_side_by_side_get_the_scores_they_get_alone(coach, base):
    inner = Candidates(coach, base, SHORT, MEMORY, 0.5, 0.005)
    candidates = 0.02 * np.random.default_rng(1).normal(size=(3, inner.dimension))
    together = inner.scores(candidates)
    alone = [inner.scores(row[None])[0] for row in candidates]
    np.testing.assert_allclose(together, alone, rtol=1e-9)
    assert len(set(together)) == 3


def test_a_policy_of_several_actuators_makes_all_of_them_decay():
    """From linear models alone: beyond what a moment on the frame reaches on worn wheels."""
    bogie = railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW)
    model = railenv.Equipped(bogie, "primary", sensed=("w1", "w2"))
    base = agents.YawRateFeedback.design(model, gain=2e4)
    aim = Aim(targets=(Target(conicities=(0.4,), speeds=(60.0, 120.0, 150.0), creep_factor=1.4),))
    found = search_policy(model, base, lessons=SHORT, memory=MEMORY, aim=aim, generations=0)
    worn = model.replace(conicity=0.4, creep_factor=1.4)
    loops = [design.closed_loop(worn, law, speed=150.0) for law in (base, found.policy)]
    assert loops[0].growth > 0.0
    assert loops[1].growth < -0.4
    policy = found.policy
    assert policy.act(np.zeros(len(policy.readings))).shape == (2,)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"duration": 0.1}, "duration is 0.1"),
        ({"rides": ()}, "rides is empty"),
        ({"small": (Case(80.0),)}, "no offset"),
        ({"decay": float("nan")}, "decay is nan"),
    ],
)
def test_impossible_lessons_are_refused(changes, match):
    with pytest.raises(railenv.ParameterError, match=match):
        Lessons(**changes)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Aim(targets=()), "targets of an aim is empty"),
        (lambda: Target(conicities=(), speeds=(60.0,)), "at least one conicity"),
        (lambda: Target(conicities=(0.1,), speeds=(60.0,), weight=-1.0), "weight of a target is -1"),
        (lambda: Aim(decay=float("nan")), "decay is nan"),
    ],
)
def test_impossible_aims_are_refused(make, match):
    with pytest.raises(railenv.ParameterError, match=match):
        make()
