"""Problems: what they are made of, that their passive dampers are the best, and what ratings tell."""

import dataclasses
import json
import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import agents
import design
from agents.problems import (
    PROBLEMS,
    PrimaryDamper,
    Rating,
    YawDamper,
    problem,
    rate,
    rate_passive,
    tuned_damper,
)
from agents.problems.rate import _Frozen
from agents.problems.table import COLUMNS, markdown, row
from agents.problems.tuned import RATES, STIFFNESSES, robust_speed
from railenv.errors import ParameterError, UnknownNameError

BOGIE = problem("bogie-secondary-v1")
DUAL = problem("dual-wheelset-v1")
LIGHT = [p for p in PROBLEMS if p.kind != "coach"]


@pytest.mark.parametrize("one", LIGHT, ids=lambda p: p.name)
def test_a_problem_gives_a_vehicle_that_can_do_what_it_asks(one):
    model = one.model()
    assert model.sensed == one.sensed
    assert set(one.ranges) <= set(model.variable_names)
    assert one.name.endswith("-v1")
    assert one.asks.endswith(".")
    assert one.passive(None).plant.parameters.keys() <= model.parameters.keys()
    with pytest.raises(UnknownNameError, match="problem"):
        problem(one.name.removesuffix("-v1"))


def test_a_damper_gives_its_rate_up_to_where_its_valves_open_and_little_beyond():
    damper = YawDamper(2e5, 5e6)
    speeds, forces = np.array(damper.on(BOGIE.vehicle()).secondary_yaw_damper_force)
    slopes = np.diff(forces) / np.diff(speeds)
    assert slopes[0] == pytest.approx(2e5)
    assert forces[1] == pytest.approx(9.8e3)
    assert slopes[1] == pytest.approx(0.02 * 2e5)
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(ParameterError, match="rate of a yaw damper"):
            YawDamper(wrong, 5e6)
    assert PrimaryDamper(3e4).on(DUAL.vehicle()).yaw_damper_c1 == 3e4


def test_a_soft_end_makes_a_damper_a_spring_and_none_of_it_is_no_damper():
    """Limits: a damper whose rate vanishes does nothing, nor one on ends that give way."""
    bare = robust_speed(BOGIE, None)
    assert robust_speed(BOGIE, YawDamper(1.0, 1e7)) == pytest.approx(bare, rel=1e-3)
    assert robust_speed(BOGIE, YawDamper(1e9, 1.0)) == pytest.approx(bare, rel=1e-3)


@pytest.mark.parametrize("one", [BOGIE, DUAL], ids=lambda p: p.name)
def test_no_damper_nearby_is_better_than_the_best(one):
    best = robust_speed(one, one.damper)
    assert best > robust_speed(one, None) + 2.0
    fields = dataclasses.asdict(one.damper)
    for name, value in fields.items():
        for factor in (0.7, 1.4):
            low, high = {"rate": RATES, "stiffness": STIFFNESSES}[name]
            if one is DUAL:
                high = 1e5
            other = dataclasses.replace(one.damper, **{name: min(high, max(low, factor * value))})
            assert robust_speed(one, other) < best + 0.3


@pytest.mark.slow
@pytest.mark.parametrize("one", PROBLEMS, ids=lambda p: p.name)
def test_the_search_finds_no_better_damper(one):
    found = tuned_damper(one)
    assert found.speed < robust_speed(one, one.damper) + 0.3


@pytest.fixture(scope="module")
def quick():
    """The bogie's problem up to a moderate speed, which takes seconds."""
    return dataclasses.replace(BOGIE, speed_range=(60.0, 150.0), ride_speeds=(80.0,))


@pytest.fixture(scope="module")
def rated(quick):
    return rate(agents.shipped("output-feedback"), quick, name="output feedback")


def test_a_rating_says_what_the_analyses_say(rated, quick):
    model, controller = quick.model(), agents.shipped("output-feedback")
    robust = design.robust_critical_speed(model, controller, quick.ranges, samples=12,
                                          speed_range=quick.speed_range)  # fmt: skip
    assert rated.robust == robust.speed
    assert min(loss.speed for loss in rated.losses) == pytest.approx(robust.speed, rel=1e-3)
    worst = rated.lowest("hunting")
    assert worst.vehicle == {"conicity": 0.4, "creep_factor": 1.4}
    # the environment changes from decay to growth where the linear loop does
    measured = agents.simulated_critical_speed(model, controller, worst.speed, vehicle=worst.vehicle)
    assert measured == pytest.approx(worst.speed, rel=0.005)
    margins = design.margins(model, controller, speed=80.0)
    assert rated.margin.gain == margins.channels[0].gain_margin


def test_what_actuators_do_is_moment_by_turning(rated):
    assert len(rated.ride) == 2
    for ride in rated.ride:
        assert 0.0 < ride.moment < ride.peak <= 1.0
        assert 0.0 < ride.power < 26e3 * 0.1  # limit by 0.1 rad/s
        assert ride.energy == pytest.approx(ride.power / ride.speed)


def test_a_passive_vehicle_neither_commands_nor_fails(quick):
    rating = rate_passive(quick, damped=True)
    assert {ride.power for ride in rating.ride} == {0.0}
    assert rating.margin is None
    assert rating.failures.lost == rating.robust
    assert rating.robust > 120.0


def test_ratings_are_kept_as_json_and_told_as_tables_and_pictures(rated):
    data = json.loads(json.dumps(rated.summary(), allow_nan=False))
    assert (data["problem"], data["robust"]) == (BOGIE.name, rated.robust)
    again = Rating.from_summary(data)
    assert again.summary() == rated.summary()
    assert row(again) == row(rated)
    with pytest.raises(ParameterError, match="not a rating of the layout"):
        Rating.from_summary({**data, "schema": "railenv rating 0"})
    assert len(row(rated)) == len(COLUMNS)
    assert markdown([rated]).count("\n") == 3
    drawn = rated.plot()
    assert np.ravel(drawn.axes)[0].get_title("left") == BOGIE.name
    plt.close(drawn.figure)


def test_sensors_that_stand_still_give_what_they_gave(quick):
    controller = agents.shipped("output-feedback")
    frozen = _Frozen(controller, quick.model())
    frozen.reset()
    rng = np.random.default_rng(0)
    for _ in range(400):
        held = rng.normal(size=4)
        frozen.act(held)
    # what comes after does not matter but for the speed and the cant deficiency
    first = frozen.act(np.full(4, 0.3))
    again = _Frozen(controller, quick.model())
    again.reset()
    rng = np.random.default_rng(0)
    for _ in range(400):
        again.act(rng.normal(size=4))
    sensors = again._sensors
    other = np.full(4, 0.3)
    other[sensors] = -5.0
    np.testing.assert_array_equal(first, again.act(other))
