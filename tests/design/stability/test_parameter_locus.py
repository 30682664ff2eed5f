"""Loci over parameters and over gain: critical values, modes followed, names, pictures."""

import math

import control
import numpy as np
import pytest
from control.pzmap import PoleZeroData
from scipy.optimize import linear_sum_assignment

import design
import railenv
from railenv.errors import ParameterError, UnknownNameError

COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)
EQUIPPED = railenv.Equipped(COACH)


def yaw_damper(gain, inputs=("gyro_b",), outputs=("command_b",)):
    matrix = -gain * np.eye(len(outputs), len(inputs))
    return control.ss([], [], [], matrix, 0.005, inputs=list(inputs), outputs=list(outputs))


DAMPER = yaw_damper(2e5)


def gap(a, b):
    """Largest distance between two sets of numbers, paired as closely as possible."""
    distance = np.abs(np.asarray(a)[:, None] - np.asarray(b))
    return distance[linear_sum_assignment(distance)].max()


def test_conicity_at_which_stability_is_lost_has_the_speed_as_its_critical_speed():
    locus = design.parameter_locus(COACH, "conicity", np.linspace(0.01, 0.3, 12), speed=110.0)
    (point,) = locus.critical_points
    assert (point.parameter, point.stability) == ("conicity", "lost")
    critical = design.critical_speed(COACH.replace(conicity=point.value))
    assert critical.speed == pytest.approx(110.0, rel=1e-6)
    assert critical.frequency == pytest.approx(point.frequency, rel=1e-5)


def test_on_a_curve_too():
    where = {"radius": 6250.0, "cant": 0.0873}
    locus = design.parameter_locus(COACH, "conicity", np.linspace(0.03, 0.2, 6), speed=91.0, **where)
    assert [p.stability for p in locus.critical_points] == ["lost", "gained"]
    for point in locus.critical_points:
        critical = design.critical_speed(COACH.replace(conicity=point.value), **where)
        assert critical.speed == pytest.approx(91.0, rel=1e-6)
        assert critical.frequency == pytest.approx(point.frequency, rel=1e-5)
    assert locus.states.shape == (6, COACH.n_states)
    assert np.abs(locus.states[0]).max() > 1e-4


def test_gain_of_a_controller_agrees_with_the_controller_of_that_gain():
    locus = design.parameter_locus(
        EQUIPPED, "gain", np.linspace(0.0, 5.0, 11), speed=130.0, controller=DAMPER
    )
    assert [p.stability for p in locus.critical_points] == ["gained", "lost"]
    for point in locus.critical_points:
        loop = design.closed_loop(EQUIPPED, yaw_damper(point.value * 2e5), speed=130.0)
        assert loop.spectral_radius == pytest.approx(1.0, abs=1e-8)
    multipliers = np.exp(locus.loci[2] * 0.005)
    expected = design.closed_loop(EQUIPPED, DAMPER, speed=130.0).multipliers
    assert locus.values[2] == 1.0
    assert gap(multipliers, expected) < 1e-6


def test_delay_changes_the_size_of_the_map_and_the_locus_follows():
    locus = design.parameter_locus(
        EQUIPPED, "delay", np.linspace(0.0, 0.1, 15), speed=130.0, controller=DAMPER
    )
    (point,) = locus.critical_points
    late = design.closed_loop(EQUIPPED, DAMPER, speed=130.0, delay=point.value)
    assert late.spectral_radius == pytest.approx(1.0, abs=1e-8)
    assert locus.unit == "s"


def test_stability_lost_and_gained_between_two_values_is_found():
    # growth rate 0.5 - (p - 2.1)^2: positive between 1.39 and 2.81 only; no value of the grid is there
    def equations(x, u, speed, curvature, cant, p):
        rate = 0.5 - (p.q - 2.1) ** 2
        return [rate * x[0] - 3.0 * x[1], 3.0 * x[0] + rate * x[1]]

    model = railenv.Model("bump", ["a", "b"], [], equations, {"q": 0.0})
    locus = design.parameter_locus(model, "q", [-1.0, 0.0, 1.2, 3.0, 4.0], speed=10.0)
    assert (locus.growth <= 0.0).all()
    lost, gained = locus.critical_points
    assert (lost.stability, gained.stability) == ("lost", "gained")
    assert lost.value == pytest.approx(2.1 - math.sqrt(0.5), abs=1e-6)
    assert gained.value == pytest.approx(2.1 + math.sqrt(0.5), abs=1e-6)
    assert lost.frequency == pytest.approx(3.0 / (2.0 * math.pi))


def test_narrow_range_of_a_mode_that_is_not_the_least_damped_is_found_between_values():
    # growth rates -0.05, and -1 + 3 / (1 + ((p - 2.03) / 0.05)^2): positive from 1.9593 to 2.1007
    def equations(x, u, speed, curvature, cant, p):
        a, b, c, d = x
        away = (p.q - 2.03) / 0.05
        rate = -1.0 + 3.0 / (1.0 + away * away)
        return [rate * a - 3.0 * b, 3.0 * a + rate * b, -0.05 * c - 7.0 * d, 7.0 * c - 0.05 * d]

    model = railenv.Model("narrow", ["a", "b", "c", "d"], [], equations, {"q": 0.0})
    locus = design.parameter_locus(model, "q", np.linspace(0.2, 4.2, 11), speed=10.0)
    assert locus.growth.max() == pytest.approx(-0.05)
    lost, gained = locus.critical_points
    half = 0.05 * math.sqrt(2.0)
    assert (lost.value, gained.value) == pytest.approx((2.03 - half, 2.03 + half), abs=1e-8)
    assert lost.frequency == pytest.approx(3.0 / (2.0 * math.pi))


def test_modes_are_followed_through_a_crossing_of_a_parameter():
    def equations(x, u, speed, curvature, cant, p):
        a, b, c, d = x
        return [
            -0.1 * a - p.q * b,
            p.q * a - 0.1 * b,
            -0.3 * c - (10.0 - p.q) * d,
            (10.0 - p.q) * c - 0.3 * d,
        ]

    model = railenv.Model("crossing", ["a", "b", "c", "d"], [], equations, {"q": 1.0})
    locus = design.parameter_locus(model, "q", np.linspace(1.0, 9.0, 41), speed=10.0)
    first = locus.loci[0]
    assert np.abs(locus.loci.real - first.real).max() < 1e-9
    slope = np.diff(locus.loci.imag, axis=0)
    assert np.abs(slope - slope[0]).max() < 1e-9
    # a mode keeps its shape: oscillator a, b does not move in the modes of c, d
    for k in range(4):
        still = slice(2, 4) if first[k].real > -0.2 else slice(0, 2)
        assert np.abs(locus.modes[:, still, k]).max() < 1e-9
        assert locus.mode(5.0, mode=k).eigenvalue.real == pytest.approx(first[k].real)


@pytest.mark.parametrize(
    ("name", "controller"), [("conicty", None), ("gain", None), ("speed", None), ("gian", DAMPER)]
)
def test_unknown_parameters_raise(name, controller):
    with pytest.raises(UnknownNameError, match=name):
        design.parameter_locus(EQUIPPED, name, [0.1, 0.2], speed=100.0, controller=controller)


@pytest.mark.parametrize("values", [[0.1], [0.2, 0.1], [0.1, math.nan]])
def test_bad_values_are_refused(values):
    with pytest.raises(ParameterError, match="values"):
        design.parameter_locus(COACH, "conicity", values, speed=100.0)


def test_locus_ends_with_a_warning_where_the_equilibrium_does():
    # on this curve the equilibrium on the tread folds at 48.6 m/s; a longer bogie's does earlier
    with pytest.warns(UserWarning, match="ends early"):
        locus = design.parameter_locus(
            COACH.replace(wheelbase_curving=False),
            "half_wheelbase",
            [1.19, 1.2, 1.3],
            speed=48.0,
            radius=1000.0,
            cant=0.0873,
        )
    assert locus.values.tolist() == [1.19, 1.2]
    assert "fold" in locus.ended


def test_single_loop_agrees_with_python_control_in_continuous_and_discrete_time():
    plant = control.ss(control.tf([1.0, 2.0], [1.0, 3.0, 4.0, 1.0, 0.0]))
    gains = np.linspace(0.0, 20.0, 41)
    for loop in (plant, control.sample_system(plant, 0.1)):
        found, expected = design.gain_locus(loop, gains), control.root_locus_map(loop, gains)
        assert isinstance(found, PoleZeroData)
        assert max(gap(a, b) for a, b in zip(found.loci, expected.loci, strict=True)) < 1e-6
        assert gap(found.poles, expected.poles) < 1e-9
        assert gap(found.zeros, expected.zeros) < 1e-6
        (point,) = found.critical_points
        closed = control.feedback(point.value * loop, 1)
        poles = closed.poles()
        edge = np.abs(poles).max() - 1.0 if loop.isdtime() else poles.real.max()
        assert edge == pytest.approx(0.0, abs=1e-7)


def test_critical_gain_by_hand():
    # s (s + 1) (s + 2) + g: Routh's limit is g = 6, at sqrt(2) rad/s
    loop = control.ss(control.tf([1.0], [1.0, 3.0, 2.0, 0.0]))
    (point,) = design.gain_locus(loop, [0.0, 1.0, 5.0, 10.0]).critical_points
    assert point.value == pytest.approx(6.0, rel=1e-8)
    assert point.frequency == pytest.approx(math.sqrt(2.0) / (2.0 * math.pi), rel=1e-7)


def test_gain_locus_of_the_open_loop_is_the_locus_over_the_controllers_gain():
    gains = np.linspace(0.0, 5.0, 11)
    loop = design.open_loop(EQUIPPED, DAMPER, speed=130.0)
    found = design.gain_locus(loop, gains)
    other = design.parameter_locus(EQUIPPED, "gain", gains, speed=130.0, controller=DAMPER)
    for a, b in zip(found.critical_points, other.critical_points, strict=True):
        assert a.value == pytest.approx(b.value, rel=1e-7)
    assert found.sys is loop
    assert found.dt == 0.005
    np.testing.assert_allclose(found.growth[2].max(), other.growth[2].max(), atol=1e-6)


def test_several_loops_get_the_same_gain():
    rng = np.random.default_rng(3)
    A = rng.normal(size=(4, 4)) - 3.0 * np.eye(4)
    B, C, D = rng.normal(size=(4, 2)), rng.normal(size=(2, 4)), 0.2 * rng.normal(size=(2, 2))
    loop = control.ss(A, B, C, D)
    found = design.gain_locus(loop, [0.0, 0.7, 1.3])
    for gain, poles in zip(found.gains, found.loci, strict=True):
        closed = control.feedback(loop, gain * control.ss([], [], [], np.eye(2)))
        assert gap(poles, closed.poles()) < 1e-9


@pytest.mark.parametrize("loop", [control.tf([1.0], [1.0, 1.0]), control.ss([], [], [], [[1.0]]), None])
def test_only_square_state_space_loops(loop):
    with pytest.raises(ParameterError, match="loop"):
        design.gain_locus(loop)


def test_singular_gain_is_named():
    with pytest.raises(ParameterError, match="gain is 2"):
        design.gain_locus(control.ss([[-1.0]], [[1.0]], [[1.0]], [[-0.5]]), [0.0, 2.0])


def test_speed_locus_of_a_closed_loop():
    locus = design.speed_locus(EQUIPPED, np.linspace(60.0, 260.0, 11), controller=DAMPER)
    (point,) = locus.critical_points
    expected = design.critical_speed(EQUIPPED, controller=DAMPER, speed_range=(60.0, 260.0))
    assert point.value == pytest.approx(expected.speed, rel=1e-6)
    assert locus.critical.speed == expected.speed
    assert point.value > design.critical_speed(EQUIPPED).speed
    assert locus.period == 0.005


def test_scaled_controller_remembers_its_own_commands():
    # with the factor 1 the closed loop is the same, though the memory moved into the controller
    K = control.ss(
        [[0.5]],
        [[1.0, 2e-6]],
        [[-1e5]],
        [[-1e5, -0.3]],
        0.005,
        inputs=["gyro_b", "command_b[-2]"],
        outputs=["command_b"],
    )
    scaled = design.ScaledFeedback(design.LinearFeedback(K), 1.0)
    assert scaled.input_labels == ["gyro_b"]
    plain, same = (design.closed_loop(EQUIPPED, c, speed=120.0).multipliers for c in (K, scaled))
    plain, same = (m[np.abs(m) > 1e-3] for m in (plain, same))
    assert gap(plain, same) < 1e-9


def test_scaled_controller_settles_at_scaled_commands():
    # u = 10 + 0.5 u[-1] settles at 20
    law = design.StaticFeedback(
        lambda s: [10.0 + 0.5 * s[1]],
        lambda s: [[0.0, 0.5]],
        ["gyro_b", "command_b[-1]"],
        ["command_b"],
    )
    assert design.ScaledFeedback(law, 3.0).steady(np.array([0.0])) == pytest.approx([60.0])


def test_pictures(tmp_path):
    over_speed = design.speed_locus(COACH, np.linspace(20.0, 160.0, 15))
    over_gain = design.parameter_locus(
        EQUIPPED, "gain", np.linspace(0.0, 5.0, 11), speed=130.0, controller=DAMPER
    )
    root = design.gain_locus(design.open_loop(EQUIPPED, DAMPER, speed=130.0), np.linspace(0.0, 5.0, 11))
    for k, locus in enumerate((over_speed, over_gain, root)):
        drawn, damping = locus.plot(), locus.plot_damping()
        said = [text.get_text() for text in drawn.axes[0, 0].get_legend().get_texts()]
        assert said[0] == "least damped mode"
        assert len(said) >= 1 + len(locus.critical_points)
        assert damping.axes.shape == (2, 1)
        for name, figure in (("locus", drawn.figure), ("damping", damping.figure)):
            file = tmp_path / f"{name}{k}.png"
            figure.savefig(file)
            assert file.stat().st_size > 1000
