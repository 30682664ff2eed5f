"""What episodes run on: drawn and pinned conditions, track profiles, irregularity."""

import math

import numpy as np
import pytest

import railenv
from railenv import irregularity
from railenv.errors import ParameterError, UnknownNameError
from tests.railenv.envs.runs import BOGIE, both, make

GRAVITY = 9.81


def conditions(env, seeds, **options):
    drawn = [env.reset(seed=seed, options=options)[1] for seed in seeds]
    return {key: np.array([c[key] for c in drawn]) for key in drawn[0]}


def deficiency(c):
    return c["speed"] ** 2 * c["curvature"] / GRAVITY - c["cant"]


@both
def test_conditions_are_drawn_from_their_ranges(name):
    env = make(name)
    env.reset(seed=0)
    c = conditions(env, [None] * 300)
    low, high = env.settings.speed_range
    assert low <= c["speed"].min() < low + 0.05 * (high - low)
    assert high - 0.05 * (high - low) < c["speed"].max() <= high
    tangent = c["curvature"] == 0.0
    assert 0.17 < tangent.mean() < 0.33
    assert (c["cant"][tangent] == 0.0).all()
    curved = {key: values[~tangent] for key, values in c.items()}
    assert 0.4 < (curved["curvature"] > 0.0).mean() < 0.6
    assert (np.sign(curved["curvature"]) == np.sign(curved["cant"])).all()
    assert np.abs(curved["cant"]).max() <= 0.0873
    assert np.abs(curved["curvature"]).max() <= (1.0 + 1e-9) / 250.0
    assert np.abs(deficiency(curved)).max() <= 0.1 * (1.0 + 1e-9)
    inwards = deficiency(curved) * np.sign(curved["curvature"])
    assert inwards.min() < -0.03
    assert inwards.max() > 0.06
    assert np.abs(c["offset"]).max() <= 0.003
    assert np.abs(c["offset"]).max() > 0.0025
    assert np.ptp(c["conicity"]) == np.ptp(c["friction"]) == np.ptp(c["body_mass"]) == 0.0
    assert (c["irregularity_factor"] == 0.0).all()


def test_narrow_ranges_are_kept():
    env = make(
        BOGIE,
        speed_range=(80.0, 80.0),
        cant_range=(0.05, 0.05),
        max_cant_deficiency=0.03,
        tangent_share=0.0,
        initial_offset=0.0,
    )
    c = conditions(env, range(20))
    assert (c["speed"] == 80.0).all()
    assert (np.abs(c["cant"]) == 0.05).all()
    assert np.abs(deficiency(c)).max() <= 0.02 * (1.0 + 1e-9)
    assert (c["offset"] == 0.0).all()
    assert not conditions(make(BOGIE, tangent_share=1.0), range(20))["curvature"].any()


PINS = {
    "speed": 70.0,
    "radius": -9000.0,
    "cant": 0.03,
    "offset": -0.001,
    "irregularity_factor": 0.7,
    "conicity": 0.07,
    "friction": 0.31,
    "creep_factor": 0.8,
    "body_mass": 3.1e4,
}


@both
@pytest.mark.parametrize("pin", PINS)
def test_each_quantity_can_be_pinned_and_the_others_stay_drawn(name, pin):
    env = make(name, irregularity="low", speed_range=(50.0, 90.0))
    c = conditions(env, range(8), **{pin: PINS[pin]})
    found = 1.0 / c["curvature"] if pin == "radius" else c[pin]
    np.testing.assert_allclose(found, PINS[pin], rtol=1e-12)
    free = conditions(env, range(8))
    for other in ("offset", "irregularity_factor", "conicity", "friction", "body_mass"):
        if other != pin:
            np.testing.assert_array_equal(c[other], free[other])


@both
def test_pinned_quantities_reach_the_vehicle(name):
    env = make(name)
    env.reset(seed=0, options={"conicity": 0.08, "friction": 0.25, "creep_factor": 0.5})
    vehicle, plain = env.fleet.episodes[0].plant.vehicle, env.settings.vehicle
    assert (vehicle.conicity, vehicle.friction) == (0.08, 0.25)
    for field in ("lateral_creep", "lateral_spin_creep", "spin_creep", "longitudinal_creep"):
        assert getattr(vehicle, field) == pytest.approx(0.5 * getattr(plain, field))
    layout = env.fleet._layout
    w = env.fleet._view(env.fleet._blocks, 0)
    expected = type(env.fleet.model.plant)(vehicle).parameters
    np.testing.assert_array_equal(w[layout.p : layout.p + len(expected)], list(expected.values()))


@both
def test_everything_pinned_at_once(name):
    env = make(name, irregularity="high")
    pins = {**PINS, "speed": 50.0, "radius": 4000.0, "offset": 0.0}
    pins |= {"failed_actuator": 1, "failure_time": 2.5}
    if name == BOGIE:  # on hollow treads
        pins |= {"contact_angle": 0.03, "rail_profile_radius": 0.25}
    _, info = env.reset(seed=0, options=pins)
    expected = {n: v for n, v in pins.items() if n != "radius"} | {"curvature": 1.0 / 4000.0}
    conditions = env.fleet.episodes[0].conditions()
    assert conditions == pytest.approx(expected)
    assert conditions == {n: info[n] for n in expected}
    assert env.fleet.conditions(0) == pytest.approx((50.0, 1.0 / 4000.0, 0.03))


@both
def test_conditions_of_an_info_pin_the_same_episode(name):
    env = make(name, irregularity="low", randomize={"friction": (0.1, 0.4)})
    for seed in range(8):  # on curves and on tangent track
        observation, info = env.reset(seed=seed)
        pins = env.fleet.episodes[0].conditions()
        again, same = env.reset(seed=seed, options={n: info[n] for n in pins})
        np.testing.assert_array_equal(again, observation)
        assert same == info


def test_a_curve_is_pinned_by_radius_or_curvature():
    env = make(BOGIE)
    one, first = env.reset(seed=0, options={"radius": -4000.0})
    two, second = env.reset(seed=0, options={"curvature": -1.0 / 4000.0})
    np.testing.assert_array_equal(one, two)
    assert first == second
    assert env.reset(seed=0, options={"curvature": 0.0})[1]["curvature"] == 0.0
    with pytest.raises(ParameterError, match="options pin radius and curvature"):
        env.reset(options={"radius": 4000.0, "curvature": 1.0 / 4000.0})
    with pytest.raises(ParameterError, match="curvature is 2 1/m"):
        env.reset(options={"curvature": 2.0})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speed": 1.0}, "speed is 1 m/s"),
        ({"speed": math.nan}, "speed is nan"),
        ({"speed": "fast"}, "speed"),
        ({"radius": 0.0}, "radius is 0 m"),
        ({"radius": 200.0, "speed": 100.0}, "cant deficiency cannot be kept"),
        ({"radius": 200.0}, "cant deficiency cannot be kept"),
        ({"radius": math.inf, "cant": 0.2}, "cant deficiency cannot be kept"),
        ({"cant": 0.7}, "cant is 0.7 rad"),
        ({"offset": 0.5}, "offset is 0.5 m"),
        ({"conicity": -0.1}, "conicity"),
        ({"friction": 0.0}, "friction"),
        ({"creep_factor": 0.0}, "creep_factor is 0"),
        ({"irregularity_factor": -1.0}, "irregularity_factor is -1"),
    ],
)
def test_impossible_pins_raise(options, message):
    env = make(BOGIE)
    with pytest.raises(ParameterError, match=message):
        env.reset(seed=0, options=options)


def test_unknown_pins_raise_with_a_suggestion():
    with pytest.raises(UnknownNameError, match=r"'sped' \(did you mean 'speed'\?\)"):
        make(BOGIE).reset(seed=0, options={"sped": 80.0})


@pytest.mark.parametrize(
    "pins", [{"speed": 100.0, "radius": 6250.0}, {"radius": 3000.0}, {"radius": -5000.0}]
)
def test_possible_pins_never_raise(pins):
    """What is not pinned is drawn such that it goes with what is."""
    env = make(BOGIE)
    for seed in range(30):
        c = env.reset(seed=seed, options=pins)[1]
        assert abs(deficiency(c)) <= 0.1 * (1.0 + 1e-9)


def test_ranges_that_allow_episodes_never_raise():
    env = make(BOGIE, speed_range=(5.0, 20.0), max_cant_deficiency=0.01)
    for seed in range(50):
        env.reset(seed=seed)


@both
def test_randomised_vehicles(name):
    ranges = {
        "conicity": (0.05, 0.12),
        "friction": (0.2, 0.4),
        "creep_factor": (0.6, 1.0),
        "body_mass": (3.0e4, 4.0e4),
    }
    env = make(name, randomize=ranges)
    c = conditions(env, range(60))
    for key, (low, high) in ranges.items():
        assert low <= c[key].min() < low + 0.2 * (high - low)
        assert high - 0.2 * (high - low) < c[key].max() <= high
    assert abs(np.corrcoef(c["conicity"], c["friction"])[0, 1]) < 0.5


# ---------------------------------------------------------------- track


def test_track_runs_through_tangent_clothoid_curve_clothoid():
    env = make(BOGIE, track="curve", duration=10.0, tangent_share=0.0)
    complete = 0
    for seed in range(8):
        _, info = env.reset(seed=seed, options={"speed": 70.0, "offset": 0.0})
        curvature, cant = info["curvature"], info["cant"]
        start, full, leave, end = env.fleet.episodes[0].plan
        assert 0.0 < start < full < leave < end
        assert full - start == pytest.approx(end - leave)
        assert env.fleet.conditions(0)[1:] == (0.0, 0.0)
        done = False
        while not done:
            *_, terminated, truncated, _ = env.step([0.0])
            done = terminated or truncated
            s = env.episode_metrics()["distance"] if done else 70.0 * 0.005 * env.fleet.steps[0]
            share = np.interp(s, [start, full, leave, end], [0.0, 1.0, 1.0, 0.0])
            _, k, c = env.fleet.conditions(0)
            assert k == pytest.approx(share * curvature, abs=1e-9 * abs(curvature))
            assert c == pytest.approx(share * cant, abs=1e-9)
        complete += s > end
    assert complete >= 1


@both
def test_constant_track_stays(name):
    env = make(name)
    env.reset(seed=1)
    before = env.fleet.conditions(0)
    for _ in range(20):
        env.step(np.zeros(env.action_space.shape))
    assert env.fleet.conditions(0) == before


# ---------------------------------------------------------------- irregularity


def line_at(record, distance):
    """A record of samples that repeats, linear between them."""
    position = distance / irregularity.SPACING
    cell = np.floor(position).astype(int)
    part = position - cell
    return (1.0 - part) * record[cell % len(record)] + part * record[(cell + 1) % len(record)]


@both
@pytest.mark.parametrize("level", ["low", "high"])
def test_rails_are_the_lines_and_the_trailing_wheelset_sees_them_later(name, level):
    env = make(name, irregularity=level)
    factor = 0.5
    # 2 L is a whole number of control steps
    half = env.settings.vehicle.half_wheelbase
    speed = 2.0 * half / (10 * 0.005)
    pins = {"speed": speed, "radius": math.inf, "irregularity_factor": factor, "offset": 0.0}
    env.reset(seed=4, options=pins)
    fleet, line = env.fleet, irregularity.line(level)
    start = fleet.episodes[0].line_offset
    seen = []
    for k in range(1, 150):
        env.step(np.zeros(env.action_space.shape))
        w = fleet._view(fleet._blocks, 0)
        rails = w[fleet._layout.c - 6 : fleet._layout.c].copy()
        np.testing.assert_array_equal(rails[:2], fleet.rails(0))
        s = k * 0.005 * speed
        fade = factor * min(s / 20.0, 1.0)
        for j, kind in enumerate(("align", "vert", "cross")):
            expected = fade * line_at(getattr(line, kind), start + s + np.array([half, -half]))
            np.testing.assert_allclose(rails[2 * j : 2 * j + 2], expected, rtol=1e-6, atol=1e-10)
        seen.append(rails)
    seen = np.array(seen)
    steady = math.ceil(20.0 / (speed * 0.005))
    for j in (0, 2, 4):
        ahead, behind = seen[steady:-10, j], seen[steady + 10 :, j + 1]
        np.testing.assert_allclose(behind, ahead, rtol=1e-6, atol=1e-9)
        assert np.ptp(ahead) > 0.0


def test_rails_are_straight_without_irregularity():
    env = make(BOGIE, irregularity=None, irregularity_factor=(2.0, 3.0))
    _, info = env.reset(seed=0)
    for _ in range(5):
        env.step([0.0])
    assert (env.fleet.rails(0) == 0.0).all()
    assert info["irregularity_factor"] == 0.0


def test_episodes_start_all_over_the_line():
    env = make(BOGIE, irregularity="low")
    starts = []
    for seed in range(100):
        env.reset(seed=seed)
        starts.append(env.fleet.episodes[0].line_offset)
    length = irregularity.line("low").length
    assert min(starts) < 0.1 * length
    assert max(starts) > 0.9 * length


def test_vehicle_keyword():
    env = make(BOGIE, vehicle=railenv.TABLE_1)
    env.reset(seed=0)
    assert env.fleet.episodes[0].plant.vehicle is railenv.TABLE_1
