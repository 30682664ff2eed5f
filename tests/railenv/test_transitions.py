"""Transition curves: each body has the curvature and cant of its own place."""

import gymnasium
import numpy as np
import pytest
from numpy.testing import assert_allclose

import railenv
from railenv.equations.coordinates import AT_REST, Running
from railenv.equations.elements import Arm, End, relative
from railenv.track import Track

SPEED, CURVATURE, BEND = 40.0, 1.0 / 900.0, 1.0 / 900.0 / 150.0
CANT, RAMP = 0.03, 0.09 / 150.0


@pytest.fixture(scope="module")
def coach():
    return railenv.Coach(railenv.HIGH_SPEED_COACH)


def at(s):
    """Return the running conditions at a place of a clothoid with its cant ramp."""
    return Running(SPEED, CURVATURE + BEND * s, CANT + RAMP * s, BEND, RAMP)


def of_a_beam(s, height):
    """Return the motion of a piece of a straight beam that moves along itself over a clothoid.

    The beam does not turn or roll; the track does, and so the piece does against it.
    """
    # the track's line is y(s) with y'' = -curvature
    line = -(CURVATURE * s**2 / 2 + BEND * s**3 / 6)
    direction = -(CURVATURE * s + BEND * s**2 / 2)
    here = at(s)
    return AT_REST._replace(
        y=-line + height * here.cant,
        psi=-direction,
        phi=-here.cant,
        dy=-direction * SPEED + height * RAMP * SPEED,
        dpsi=here.curvature * SPEED,
        dphi=-RAMP * SPEED,
    )


@pytest.mark.parametrize("places", [(-4.0, 7.0), (0.0, 9.0), (5.0, 5.0), (9.0, -1.2)])
@pytest.mark.parametrize("point", [-6.0, 0.0, 8.0])
def test_beam_that_goes_straight_is_not_stretched_on_a_clothoid_with_its_ramp(places, point):
    heights, above = (1.6, 0.5), 0.9  # of the bodies' centres and the attachment, over the rails
    ends = [
        End(Arm(point - s, 0.8, above - h), of_a_beam(s, h), at(s))
        for s, h in zip(places, heights, strict=True)
    ]
    seen = relative(*ends, above, 1)
    assert_allclose([seen.y, seen.roll, seen.pitch, seen.yaw], 0.0, atol=1e-13)
    assert_allclose([seen.dy, seen.droll, seen.dpitch, seen.dyaw], 0.0, atol=1e-13)
    assert_allclose([seen.x, seen.z, seen.dx, seen.dz], 0.0, atol=1e-13)
    if places[0] != places[1]:
        apart = relative(*ends, above, 0)
        assert abs(apart.yaw) > 1e-4
        assert abs(apart.roll) > 1e-4


def sites_of(model, run):
    """Return the numbers of all sites on a line where ``run(place)`` are the running conditions."""
    origin, found = run(0.0), []
    for place in model.sites.values():
        there = run(place)
        found += [
            there.curvature - origin.curvature,
            there.curvature_slope,
            there.cant - origin.cant,
            there.cant_slope,
        ]
    return found


def test_body_that_nothing_turns_is_turned_by_the_clothoid_under_it(coach):
    evaluator, x = coach.evaluator(), np.zeros(coach.n_states)
    rates = []
    for sites in (0.0, sites_of(coach, lambda s: Running(SPEED, 0.0, 0.0, BEND, 0.0))):
        evaluator.set(x, SPEED, sites=sites)
        rates.append(dict(zip(coach.state_names, evaluator.rhs(), strict=True)))
    # the springs do not see it: curvature itself is zero; in inertial space nothing turns
    assert rates[1]["dpsi_body"] - rates[0]["dpsi_body"] == pytest.approx(SPEED**2 * BEND, rel=1e-12)


def settled(model, speed, sites):
    """Return the state in which all is at rest up and down and in roll, with nothing moved aside."""
    evaluator = model.evaluator()
    x = railenv.find_equilibrium(model, speed=speed).state.copy()
    n = model.n_states // 2
    free = [i for i, name in enumerate(model.state_names[:n]) if name[0] in "zpt" and name[:3] != "psi"]
    for _ in range(20):
        evaluator.set(x, speed, sites=sites)
        rows = [n + i for i in free]
        jacobian = evaluator.jacobian()[np.ix_(rows, free)]
        step = np.linalg.solve(jacobian, -evaluator.rhs()[rows])
        x[free] += step
        if np.abs(step).max() < 1e-13:
            return x
    raise AssertionError("no steady state")


def test_twisted_track_unloads_wheels_as_springs_in_series_say(coach):
    # hand formulas know neither moments of springs across, nor of the load on a tilted axle or a cone
    v = coach.vehicle.replace(
        primary_lateral_stiffness=0.0, secondary_lateral_stiffness=0.0, gravity=0.5, conicity=1e-4
    )
    model, slope, speed = railenv.Coach(v), 1e-5, 1.0
    sites = sites_of(model, lambda s: Running(speed, 0.0, slope * s, 0.0, 0.0))
    level = settled(model, speed, np.zeros(4 * len(model.sites)))
    twisted = settled(model, speed, sites)

    def loads(x):
        return [w.normal.magnitude for pair in model.wheels(x, speed=speed) for w in pair]

    unloading = np.array(loads(twisted)) - loads(level)
    primary = 2.0 * v.primary_vertical_stiffness * v.primary_arm**2
    rails = 2.0 * v.vertical_rail_stiffness * v.half_gauge**2
    axle = 1.0 / (1.0 / primary + 1.0 / rails)
    secondary = 2.0 * v.secondary_vertical_stiffness * v.secondary_arm**2
    bogie = 1.0 / (1.0 / (2.0 * axle) + 1.0 / secondary)
    within, between = slope * v.half_wheelbase * axle, slope * v.half_pivot_distance * bogie / 2.0
    by_hand = [within + between, -within + between, within - between, -within - between]
    expected = np.array([[m, -m] for m in by_hand]).ravel() / (2.0 * v.half_gauge)
    assert_allclose(unloading, expected, rtol=0.01)


# ------------------------------------------------------------------------------- runs


TRACK = Track.into_curve(radius=1500.0, cant=0.06, straight=30.0, transition=60.0)


def test_slopes_of_a_track_are_those_of_its_curvature_and_cant():
    places = np.array([-5.0, 29.0, 31.0, 60.0, 89.0, 91.0, 500.0])
    step = 1e-3
    for values, slopes in (
        (TRACK.curvature_at, TRACK.curvature_slope_at),
        (TRACK.cant_at, TRACK.cant_slope_at),
    ):
        by_difference = (values(places + step) - values(places - step)) / (2 * step)
        assert_allclose(slopes(places), by_difference, atol=1e-12)
    assert_allclose(Track.circular(500.0, 0.05).curvature_slope_at([0.0, 10.0]), 0.0)


def test_kernel_drives_the_sites_as_the_solvers_of_scipy_do():
    bogie = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    runs = [
        railenv.simulate(bogie, speed=SPEED, track=TRACK, duration=3.0, method=method, step=2e-4)
        for method in ("RK4", "DOP853")
    ]
    assert_allclose(runs[0].outputs, runs[1].outputs, rtol=0.0, atol=2e-5)
    assert runs[0].input_labels[-4:] == [
        "curvature_at_b",
        "curvature_slope_at_b",
        "cant_at_b",
        "cant_slope_at_b",
    ]
    leading = runs[0].inputs[runs[0].input_labels.index("curvature_at_w1")]
    distance = SPEED * runs[0].time
    ahead = TRACK.curvature_at(distance + 1.2) - TRACK.curvature_at(distance)
    assert_allclose(leading, ahead, atol=1e-15)
    assert np.abs(leading).max() > 1e-6


def test_environment_runs_through_a_transition_as_a_simulation_does():
    env = gymnasium.make("railenv/Bogie-v1", track="curve", time_step=5e-4, duration=6.0)
    env.reset(seed=3, options={"speed": 60.0, "radius": 2500.0, "cant": 0.06, "offset": 0.0})
    fleet = env.unwrapped.fleet
    episode = fleet.episodes[0]
    start, into, end, out = episode.plan
    shape = (start, into, end, out)
    k, c = episode.curvature, episode.cant
    track = Track(shape, (0.0, k, k, 0.0), (0.0, c, c, 0.0))
    run = railenv.simulate(
        fleet.model, speed=60.0, track=track, duration=6.0, output_step=0.005, step=2.5e-4,
        initial_state=fleet.state(0),
    )  # fmt: skip
    for i in range(1, 1201):
        _, _, terminated, _, _ = env.step(np.zeros(1))
        assert not terminated
        if i % 100 == 0:
            assert_allclose(fleet.state(0)[:12], run.outputs[:12, i], atol=2e-6)


def test_nothing_moves_before_the_first_wheelset_is_on_the_transition(coach):
    run = railenv.simulate(coach, speed=20.0, track=TRACK, duration=3.0)
    first = run.time * 20.0 + coach.sites["w1"]
    before = first < 30.0
    lateral = [n for n in run.output_labels if n.startswith(("y_", "psi_", "phi_"))]
    moved = np.abs(np.array([run.outputs[run.output_labels.index(n)] for n in lateral]))
    assert np.ptp(moved[:, before]) < 1e-12
    assert moved[:, ~before].max() > 1e-4
