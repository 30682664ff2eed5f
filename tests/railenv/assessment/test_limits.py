"""Limits at the values of the standards."""

import pytest

from railenv.assessment import Limits
from railenv.errors import ParameterError, UnknownNameError

KMH = 1.0 / 3.6


def test_limits_of_a_coach_worked_out_by_hand():
    limits = Limits()
    assert limits.track_shift(60e3) == pytest.approx(50e3)
    assert limits.replace(track_shift_factor=0.85).track_shift(60e3) == pytest.approx(42.5e3)
    assert limits.frame_acceleration(5800.0) == pytest.approx(10.84)


@pytest.mark.parametrize(
    ("speed", "load"),
    [(160, 200e3), (161, 190e3), (200, 190e3), (250, 180e3), (300, 170e3), (301, 160e3)],
)
def test_wheel_load_is_capped_by_speed(speed, load):
    assert Limits().wheel_load(112.5e3, speed * KMH) == load
    assert Limits().wheel_load(55e3, speed * KMH) == 145e3


@pytest.mark.parametrize(
    ("radius", "force"), [(1e4, 60e3), (400.0, 60e3), (350.0, 60e3), (250.0, 72e3), (249.0, None)]
)
def test_quasi_static_guiding_force_by_radius(radius, force):
    assert Limits().quasi_static_guiding_force(radius) == force


@pytest.mark.parametrize(
    ("radius", "limit"), [(float("inf"), 3.0), (601.0, 3.0), (600.0, 2.8), (400.0, 2.8), (399.0, 2.6)]
)
def test_lateral_acceleration_of_the_body_by_radius(radius, limit):
    assert Limits().body_lateral_safety(radius) == limit


def test_impossible_limits_are_refused():
    with pytest.raises(ParameterError, match="y_over_q is 0"):
        Limits(y_over_q=0.0)
    with pytest.raises(UnknownNameError, match="limit: 'y_q'; allowed are"):
        Limits().replace(y_q=1.2)
