"""Speed loci: python-control's data, modes followed through crossings."""

import math

import numpy as np
import pytest
from control.pzmap import PoleZeroData
from scipy.optimize import linear_sum_assignment

import design
import railenv
from railenv.errors import ParameterError

SPEEDS = np.linspace(5.0, 200.0, 79)


def test_locus_is_pole_zero_data_of_the_eigenvalues_at_each_speed():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    locus = design.speed_locus(model, SPEEDS)
    assert isinstance(locus, PoleZeroData)
    np.testing.assert_array_equal(locus.gains, SPEEDS)
    for i in (0, 40, 78):
        poles = design.linearize(model, speed=SPEEDS[i]).poles()
        gaps = np.abs(locus.loci[i][:, None] - poles)
        pairs = linear_sum_assignment(gaps)
        assert gaps[pairs].max() < 1e-6 * np.abs(poles).max()


def test_least_damped_mode_of_the_coach_is_its_hunting_and_crosses_at_the_critical_speed():
    locus = design.speed_locus(railenv.Bogie(railenv.HIGH_SPEED_COACH), SPEEDS)
    hunting = locus.loci[:, locus.least_damped]
    crossing = np.interp(0.0, hunting.real[40:], SPEEDS[40:])
    assert crossing == pytest.approx(116.471, abs=0.1)
    assert locus.critical.speed == pytest.approx(116.471, rel=1e-3)
    # one mode, followed: its frequency grows steadily with speed
    assert (np.diff(hunting.imag) > 0).all()


def test_modes_are_followed_through_a_crossing():
    # two uncoupled oscillators whose frequencies cross at 50 m/s, told apart by damping
    model = railenv.Model("crossing", ["a", "b", "c", "d"], [], _crossing, {})
    locus = design.speed_locus(model, np.linspace(10.0, 90.0, 41))
    upper = [k for k in range(4) if locus.loci[0, k].imag > 0]
    for k in upper:
        np.testing.assert_allclose(locus.loci[:, k].real, locus.loci[0, k].real, atol=1e-9)
        slope = np.diff(locus.loci[:, k].imag)
        np.testing.assert_allclose(slope, slope[0], atol=1e-9)


def test_damping_ratio_and_frequency_follow_from_the_eigenvalues():
    model = railenv.DualWheelset(railenv.TABLE_1)
    locus = design.speed_locus(model, [20.0, design.critical_speed(model).speed])
    k = locus.least_damped
    assert locus.damping[1, k] == pytest.approx(0.0, abs=1e-5)
    assert locus.frequency[1, k] == pytest.approx(1.868, rel=1e-3)
    assert locus.damping[0, k] > 0


def test_locus_ends_with_a_warning_where_the_equilibrium_does():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(wheelbase_curving=False))
    with pytest.warns(UserWarning, match="ends early"):
        locus = design.speed_locus(model, np.linspace(10, 60, 51), radius=1000.0, cant=0.0873)
    assert locus.speeds[-1] == 48.0
    assert len(locus.loci) == len(locus.speeds) == len(locus.states)
    assert "fold" in locus.ended


@pytest.mark.parametrize("speeds", [[50.0], [50.0, 40.0], [0.0, 50.0], [50.0, math.nan]])
def test_bad_speeds_are_refused(speeds):
    with pytest.raises(ParameterError, match="speed"):
        design.speed_locus(railenv.Bogie(railenv.HIGH_SPEED_COACH), speeds)


def test_plot_marks_the_critical_speed_and_the_least_damped_mode():
    locus = design.speed_locus(railenv.Bogie(railenv.HIGH_SPEED_COACH), SPEEDS)
    axes = locus.plot().axes[0, 0]
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert texts == ["least damped mode", "critical speed 116.5 m/s"]


def _crossing(x, u, speed, curvature, cant, p):
    a, b, c, d = x
    return [
        -0.1 * a - 0.1 * speed * b,
        0.1 * speed * a - 0.1 * b,
        -0.3 * c - (10.0 - 0.1 * speed) * d,
        (10.0 - 0.1 * speed) * c - 0.3 * d,
    ]
