"""Narrow ranges of instability, all crossings of a range, and what was sampled; by exact answers."""

import math

import control
import numpy as np
import pytest

import design
import railenv
from design.loop.dynamics import dynamics
from design.stability.samples import BranchLine
from design.stability.search import Search
from design.stability.spectra import Spectra
from railenv.equations.functions import exp
from railenv.equilibrium import Branch, SpeedPath, find_equilibrium
from railenv.errors import EquilibriumError, ParameterError

WINDOW = (49.573, 50.427)  # m/s


def _two_oscillators(x, u, speed, curvature, cant, p):
    """Growth rates: -a1 + b1 / (1 + ((V - c1) / w1)^2) + e1 exp(-((V - c1) / w1)^2), and a line."""
    q, r, c, d = x
    away = (speed - p.c1) / p.w1
    first = -p.a1 + p.b1 / (1.0 + away * away) + p.e1 * exp(-away * away)
    second = -p.a2 + p.slope * (speed - p.c2)
    return [
        first * q - p.omega1 * r + u[0],
        p.omega1 * q + first * r,
        second * c - p.omega2 * d,
        p.omega2 * c + second * d,
    ]


OWN = railenv.Model(
    "two oscillators",
    ["q", "r", "c", "d"],
    ["force"],
    _two_oscillators,
    {
        "a1": 1.0, "b1": 3.0, "c1": 50.0, "w1": 0.3, "e1": 0.0, "omega1": 5.0,
        "a2": 0.05, "slope": 0.0, "c2": 50.0, "omega2": 3.0,
    },
)  # fmt: skip


def with_window(low, high, height=3.0, **more):
    """Return the model with an unstable range of its first mode, under a bump ``height`` times a1."""
    width = (high - low) / 2.0 / math.sqrt(height - 1.0)
    return OWN.replace(c1=(low + high) / 2.0, w1=width, b1=height * OWN.parameters["a1"], **more)


# --------------------------------------------------------------------- ranges of instability


@pytest.mark.parametrize("speeds", [(3.0, 400.0), (40.0, 60.0), (3.0, 52.0)])
def test_range_of_0_85_metres_a_second_is_found_without_further_ado(speeds):
    found = design.critical_speed(with_window(*WINDOW), speed_range=speeds)
    assert found.loss == "hunting"
    assert found.speed == pytest.approx(WINDOW[0], rel=1e-8)
    assert found.frequency == pytest.approx(5.0 / (2.0 * math.pi), rel=1e-8)


def test_neither_mode_needs_to_be_the_least_damped_beside_the_range():
    # the other mode always has -0.05; that with the range has less than -0.9 three metres a second off
    model = with_window(*WINDOW)
    for speed in (47.0, 53.0):
        assert design.linearize(model, speed=speed).poles().real.max() == pytest.approx(-0.05)
    lost, gained = design.hopf_points(model)
    assert (lost.speed, gained.speed) == pytest.approx(WINDOW, rel=1e-8)


def test_random_ranges_of_1_7_percent_of_the_speed_are_found():
    rng = np.random.default_rng(4)
    for _ in range(20):
        middle, height = math.exp(rng.uniform(math.log(8.0), math.log(200.0))), rng.uniform(1.2, 10.0)
        ends = middle * np.array([1.0 - 0.0085, 1.0 + 0.0085])
        lost, gained = design.hopf_points(with_window(*ends, height=height))
        assert (lost.speed, gained.speed) == pytest.approx(tuple(ends), rel=1e-7)


def test_narrower_range_is_found_with_a_shorter_step_and_the_answer_says_what_was_sampled():
    model = with_window(49.95, 50.05)
    usual = design.critical_speed(model)
    assert usual.loss == "none"
    assert str(usual) == (
        f"stable from 3 to 400 m/s (seen at {len(usual.sampled)} speeds, at most 16.2% apart)"
    )
    closer = design.critical_speed(model, longest_step=0.01)
    assert closer.speed == pytest.approx(49.95, rel=1e-7)
    assert closer.largest_step < math.exp(0.01) - 1.0 + 1e-9
    assert closer.summary()["sampled_speeds"] == len(closer.sampled) > 5 * len(usual.sampled) / 2


def test_bump_without_tails_is_seen_where_a_sample_meets_it():
    # unstable from 49.72 to 50.28 m/s, and two metres a second off nothing is left of the bump
    gaussian = OWN.replace(b1=0.0, e1=3.0, w1=0.27)
    edge = 50.0 - 0.27 * math.sqrt(math.log(3.0))
    assert design.critical_speed(gaussian).loss == "none"
    found = design.critical_speed(gaussian, longest_step=0.01)
    assert found.speed == pytest.approx(edge, rel=1e-7)


def damper(gain):
    """Return a controller of the first mode, 100 times a second."""
    return control.ss([], [], [], [[-gain]], 0.01, inputs=["q"], outputs=["force"])


def test_sampled_controller_has_the_same_ranges():
    found = design.critical_speed(with_window(*WINDOW), controller=damper(0.0))
    assert found.speed == pytest.approx(WINDOW[0], rel=1e-7)
    assert found.largest_step < math.exp(0.06) - 1.0 + 1e-9
    damped = design.critical_speed(with_window(*WINDOW), controller=damper(0.4))
    assert WINDOW[0] < damped.speed < 50.0
    loop = design.closed_loop(with_window(*WINDOW), damper(0.4), speed=damped.speed)
    assert loop.spectral_radius == pytest.approx(1.0, abs=1e-8)


def test_searches_that_ask_often_pass_the_step_on():
    model = with_window(49.95, 50.05)
    narrow = {"speed_range": (20.0, 80.0), "longest_step": 0.01}
    assert design.curve_sweep(model, [math.inf], **narrow).speed == pytest.approx([49.95], rel=1e-6)
    box = {"a2": (0.05, 0.06)}
    robust = design.robust_critical_speed(model, None, box, samples=2, **narrow)
    assert robust.speed == pytest.approx(49.95, rel=1e-6)
    axes = {"a2": [0.05, 0.06], "omega2": [3.0, 4.0]}
    mapped = design.stability_map(model, axes, n_jobs=1, **narrow)
    assert mapped.critical_speed == pytest.approx(np.full((2, 2), 49.95), rel=1e-6)


@pytest.mark.parametrize("step", [0.0, -0.1, 2.0, math.nan])
def test_bad_steps_are_refused(step):
    with pytest.raises(ParameterError, match="longest_step"):
        design.critical_speed(OWN, longest_step=step)


# -------------------------------------------------------------------------- all crossings


def test_every_pair_that_crosses_is_found_whichever_way_and_whatever_else_is_unstable():
    # the second mode is unstable from 49.8 m/s on, within the range of the first
    model = with_window(*WINDOW, a2=0.0, slope=0.02, c2=49.8)
    points = design.hopf_points(model)
    assert [p.speed for p in points] == pytest.approx([WINDOW[0], 49.8, WINDOW[1]], rel=1e-8)
    assert [p.unstable for p in points] == [0, 2, 2]
    assert [p.frequency * 2.0 * math.pi for p in points] == pytest.approx([5.0, 3.0, 5.0])
    width, half = model.parameters["w1"], 0.427
    steep = 6.0 * half / width**2 / (1.0 + (half / width) ** 2) ** 2
    assert [p.growth_slope for p in points] == pytest.approx([steep, 0.02, -steep], rel=1e-3)
    for p in points:
        A, _ = model.jacobian(p.state, speed=p.speed)
        np.testing.assert_allclose(A @ p.mode, p.eigenvalue * p.mode, atol=1e-9)
        assert p.loss == "hunting"
        assert p.multiplicity == 1
    told = [str(p) for p in points]
    assert told == [
        "hunting from 49.5730 m/s at 0.7958 Hz",
        "hunting from 49.8000 m/s at 0.4775 Hz, where others are unstable",
        "hunting up to 50.4270 m/s at 0.7958 Hz, where others are unstable",
    ]
    assert np.array_equal(points[0].sampled, points[-1].sampled)


def test_range_below_the_usual_one_is_searched_as_well():
    model = OWN.replace(b1=0.0, a2=0.0, slope=1.0, c2=2.0)
    assert design.critical_speed(model, speed_range=(1.0, 5.0)).speed == pytest.approx(2.0, rel=1e-8)
    assert design.critical_speed(model).loss == "unstable at start"
    (point,) = design.hopf_points(model, speed_range=(1.0, 5.0))
    assert point.speed == pytest.approx(2.0, rel=1e-8)
    assert design.hopf_points(model) == ()


def test_pair_of_equal_modes_is_one_crossing():
    (point, *_) = design.hopf_points(railenv.DualWheelset(railenv.TABLE_1), speed_range=(3.0, 60.0))
    assert point.multiplicity == 2
    assert point.unstable == 0
    assert point.speed == pytest.approx(34.175, rel=1e-3)
    assert design.critical_speed(railenv.DualWheelset(railenv.TABLE_1)).speed == point.speed


def test_first_crossing_of_the_bogie_is_its_critical_speed_and_no_growth_is_missed():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    points = design.hopf_points(model, speed_range=(3.0, 250.0))
    critical = design.critical_speed(model)
    assert points[0].speed == pytest.approx(critical.speed, rel=1e-8)
    # the number of unstable eigenvalues on a fine grid changes at these speeds and nowhere else
    grid = np.arange(100.0, 250.0, 0.5)
    counts = [int((design.linearize(model, speed=v).poles().real > 0.0).sum()) for v in grid]
    changes = [2 * round(np.sign(p.growth_slope)) for p in points]
    expected = [sum(c for c, p in zip(changes, points, strict=True) if p.speed < v) for v in grid]
    assert counts == expected


# --------------------------------------------------------- eigenvalues that meet, or do not move


def _meeting(x, u, speed, curvature, cant, p):
    """One oscillator of damping a and stiffness k, lines over the speed."""
    q, r = x
    damping = p.a * (p.no_damping - speed) / 100.0
    stiffness = p.k * (p.no_stiffness - speed) / 100.0
    return [r, -stiffness * q - 2.0 * damping * r]


MEETING = railenv.Model(
    "meeting", ["q", "r"], [], _meeting,
    {"a": 1.0, "k": 0.01, "no_damping": 60.0, "no_stiffness": 200.0},
)  # fmt: skip


def test_two_real_eigenvalues_that_become_a_pair_hunt_where_the_damping_ends():
    found = design.critical_speed(MEETING)
    assert found.loss == "hunting"
    assert found.speed == pytest.approx(60.0, rel=1e-8)
    assert found.frequency == pytest.approx(math.sqrt(0.01 * 1.4) / (2.0 * math.pi), rel=1e-7)
    assert len(found.sampled) < 60


def test_pair_that_becomes_two_real_eigenvalues_diverges_where_the_stiffness_ends():
    found = design.critical_speed(MEETING.replace(a=0.02, no_damping=500.0, no_stiffness=80.0))
    assert found.loss == "divergence"
    assert found.speed == pytest.approx(80.0, rel=1e-8)
    assert len(found.sampled) < 60
    assert design.hopf_points(MEETING.replace(a=0.02, no_damping=500.0, no_stiffness=80.0)) == ()


def test_mode_that_is_never_damped_is_not_looked_at_ever_closer():
    model = OWN.replace(a1=0.0, b1=0.0, a2=0.0, slope=0.01, c2=50.0)
    found = design.critical_speed(model)
    assert found.speed == pytest.approx(50.0, rel=1e-8)
    assert len(found.sampled) < 45


# ---------------------------------------------------------------- where there is no more to see


def test_pairs_that_cross_before_a_fold_are_found_and_those_beyond_it_are_not():
    # the bogie on the tread folds at 48.6 m/s on this curve; in the fold a real eigenvalue crosses
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(wheelbase_curving=False))
    where = {"radius": 1000.0, "cant": 0.0873}
    assert design.critical_speed(model, **where).loss == "fold"
    assert design.hopf_points(model, **where) == ()


class _Faulty:
    """Dynamics that have no linear system beyond some speed."""

    period = None

    def __init__(self, model, limit, error):
        self.own, self.limit, self.error = dynamics(model, None, None), limit, error

    def matrix_at(self, point, conditions):
        if conditions[0] > self.limit:
            raise self.error
        return self.own.matrix_at(point, conditions)


@pytest.mark.parametrize("error", [EquilibriumError("lost", 1.0), np.linalg.LinAlgError("not finite")])
def test_what_fails_beyond_the_loss_does_not_hide_it(error):
    model = OWN.replace(b1=0.0, a2=0.0, slope=0.01, c2=50.0)

    def search(limit):
        where = (3.0, 400.0)
        faulty = _Faulty(model, limit, error)
        return Search.of(model, math.inf, 0.0, where, None, None, faulty).first_loss()

    assert search(70.0).speed == pytest.approx(50.0, rel=1e-8)
    with pytest.raises(type(error)):
        search(40.0)


# ------------------------------------------------------------------ what the search stands on


@pytest.mark.parametrize("n", [6, 48])
def test_derivatives_of_eigenvalues_are_those_of_differences(n):
    rng = np.random.default_rng(n)
    matrix, change = rng.standard_normal((2, n, n))
    apart = np.arange(n) % 3 == 0
    matrix[np.ix_(apart, ~apart)] = matrix[np.ix_(~apart, apart)] = 0.0
    change[np.ix_(apart, ~apart)] = change[np.ix_(~apart, apart)] = 0.0
    h = 1e-6
    (found,) = Spectra().of([matrix], [change])
    for k, (value, rate) in enumerate(zip(found.values, found.rates, strict=True)):
        ahead, behind = (np.linalg.eigvals(matrix + step * change) for step in (h, -h))
        ends = [values[np.argmin(np.abs(values - value))] for values in (ahead, behind)]
        assert rate == pytest.approx((ends[0] - ends[1]) / (2.0 * h), rel=1e-5, abs=1e-6)
        np.testing.assert_allclose(matrix @ found.vector(k), value * found.vector(k), atol=1e-11)
    # of each pair, the eigenvalue in the upper half plane stands before the other
    upper = np.flatnonzero(found.values.imag > 0.0)
    np.testing.assert_allclose(found.values[upper + 1], found.values[upper].conj())


def test_eigenvalues_that_meet_have_a_finite_rate():
    # a delay line: three multipliers are zero, with one eigenvector
    matrix = np.diag([1.0, 1.0, 0.0], -1) + np.diag([0.0, 0.0, 0.0, 0.5])
    (found,) = Spectra().of([matrix], [np.ones((4, 4))])
    assert np.isfinite(found.rates).all()
    assert np.sort(np.abs(found.values)) == pytest.approx([0.0, 0.0, 0.0, 0.5], abs=1e-4)


def test_parts_that_begin_to_move_each_other_are_solved_together():
    rng = np.random.default_rng(8)
    first = np.zeros((48, 48))
    first[:24, :24], first[24:, 24:] = rng.standard_normal((2, 24, 24))
    second = first + 0.1 * rng.standard_normal((48, 48))
    found = Spectra().of([first, second], [first, first])
    for matrix, spectrum in zip((first, second), found, strict=True):
        gap = np.abs(np.linalg.eigvals(matrix)[:, None] - spectrum.values)
        assert gap.min(axis=0).max() < 1e-11


def test_rates_along_a_branch_and_between_its_points_are_those_of_differences():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    path = SpeedPath(1.0 / 6250.0, 0.0873)
    branch = Branch(model, path, np.zeros(model.n_inputs))
    line = BranchLine(branch, path, dynamics(model, None, None), model.n_states)
    start = find_equilibrium(model, speed=40.0, radius=6250.0, cant=0.0873)
    points = [
        p
        for p, _ in zip(
            branch.points(branch.start(start.state, math.log(40.0)), 6.0), "12", strict=False
        )
    ]
    a, b = line.samples(points)
    h = 1e-5
    for end, pace, at in ((a, line.paces(a, b)[0], h), (b, line.paces(a, b)[1], 1.0 - h)):
        near = line.between(a, b, at)
        moved = (near.point.position - end.point.position) / (at - round(at))
        np.testing.assert_allclose(
            moved,
            pace * end.point.tangent * end.point.scale,
            rtol=1e-3,
            atol=1e-6 * np.abs(moved).max(),
        )
        k = int(np.argmax(np.where(end.values.imag > 0.0, end.growth, -np.inf)))
        j = int(np.argmin(np.abs(near.values - end.values[k])))
        change = (near.values[j] - end.values[k]) / (at - round(at))
        assert pace * end.rates[k] == pytest.approx(change, rel=1e-3)
