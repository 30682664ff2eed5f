"""Ride indices and weightings against their formulas and tables."""

import math

import numpy as np
import pytest

from railenv.assessment.ride import (
    comfort_weighting,
    continuous_comfort,
    mean_comfort,
    sperling_weighting,
    wz,
)

T = 0.005
TIME = np.arange(0.0, 20.0, T)

# gains of Wd in ISO 2631-1, by one-third octave
WD = {
    0.4: 0.713,
    0.5: 0.853,
    0.63: 0.944,
    0.8: 0.992,
    1.0: 1.011,
    1.25: 1.008,
    1.6: 0.968,
    2.0: 0.890,
    2.5: 0.776,
    3.15: 0.642,
    4.0: 0.512,
    5.0: 0.409,
    6.3: 0.323,
    8.0: 0.253,
    12.5: 0.161,
    16.0: 0.125,
    20.0: 0.100,
}


@pytest.mark.parametrize(("frequency", "gain"), WD.items())
def test_wd_has_the_gains_of_iso_2631(frequency, gain):
    assert abs(comfort_weighting("lateral", frequency)) == pytest.approx(gain, rel=0.01)


def test_wb_is_near_that_of_iso_2631_4_which_has_other_quality_factors():
    f = 10.0 ** np.arange(-0.3, 1.6, 0.1)
    s = 1j * f
    band = s**2 / (s**2 + s * 0.4 * math.sqrt(2) + 0.16) * 1e4 / (s**2 + s * 100 * math.sqrt(2) + 1e4)
    transition = (16.0 * s + 256.0) / (s**2 + s * 16.0 / 0.55 + 256.0)
    step = 1.024 * (s**2 + s * 2.5 / 0.9 + 6.25) / (s**2 + s * 4.0 / 0.95 + 16.0)
    expected = np.abs(band * transition * step)
    np.testing.assert_allclose(np.abs(comfort_weighting("vertical", f)), expected, rtol=0.15)
    assert abs(comfort_weighting("vertical", 1.2)) == pytest.approx(0.4, rel=0.05)  # below the step
    assert 0.95 < np.abs(comfort_weighting("vertical", f)).max() < 1.1  # above it


def test_sperling_weighting_at_1_hz_worked_out_by_hand():
    assert sperling_weighting("vertical", 1.0) == pytest.approx(0.588 * 0.83184, rel=1e-4)
    assert sperling_weighting("lateral", 1.0) == pytest.approx(0.737 * 0.83184, rel=1e-4)
    f = np.linspace(0.5, 30.0, 2000)
    assert 5.0 < f[np.argmax(sperling_weighting("vertical", f))] < 6.5  # where people feel most


@pytest.mark.parametrize("direction", ["lateral", "vertical"])
@pytest.mark.parametrize("frequency", [0.8, 1.5, 5.5, 12.0])
def test_wz_of_a_harmonic_is_its_formula(direction, frequency):
    acceleration = 0.4 * np.sin(2 * math.pi * frequency * TIME) + 0.7
    weighting = float(sperling_weighting(direction, frequency))
    assert wz(acceleration, T, direction) == pytest.approx((40.0 * weighting) ** (2 / 6.67), rel=1e-6)


def test_wz_of_two_harmonics_adds_their_powers():
    one, two = (0.3 * np.sin(2 * math.pi * f * TIME) for f in (1.2, 6.0))
    parts = sum(wz(a, T, "vertical") ** 6.67 for a in (one, two))
    assert wz(one + two, T, "vertical") == pytest.approx(parts ** (1 / 6.67), rel=1e-9)
    slow = 5.0 * np.sin(2 * math.pi * 0.2 * TIME)  # below the band
    assert wz(one + slow, T, "vertical") == pytest.approx(wz(one, T, "vertical"), rel=1e-9)


@pytest.mark.parametrize(("direction", "frequency"), [("lateral", 1.0), ("vertical", 6.0)])
def test_continuous_comfort_of_a_harmonic(direction, frequency):
    levels = continuous_comfort(0.6 * np.sin(2 * math.pi * frequency * TIME), T, direction)
    assert len(levels) == 4  # windows of 5 s
    expected = 0.6 / math.sqrt(2.0) * abs(comfort_weighting(direction, frequency))
    np.testing.assert_allclose(levels[1:-1], expected, rtol=0.01)


def test_mean_comfort_is_six_times_the_root_of_the_squares_of_the_95_percent_values():
    lateral, vertical = np.linspace(0.0, 0.3, 61), np.linspace(0.0, 0.4, 61)
    assert mean_comfort(lateral, vertical) == pytest.approx(6.0 * 0.95 * 0.5)
