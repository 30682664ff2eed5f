"""Filters and means over distance against closed forms."""

import math

import numpy as np
import pytest

from railenv.assessment.filters import (
    band_pass,
    dominating_frequency,
    extreme,
    low_pass,
    percentiles,
    sliding_mean,
    sliding_rms,
)
from railenv.errors import ParameterError

T = 0.005
TIME = np.arange(0.0, 20.0, T)
MIDDLE = slice(len(TIME) // 4, -len(TIME) // 4)  # away from both ends


def gain(filtered, frequency):
    """Amplitude and phase of a filtered unit sine, fitted in the middle."""
    basis = np.stack([f(2 * math.pi * frequency * TIME[MIDDLE]) for f in (np.sin, np.cos)], axis=1)
    (a, b), *_ = np.linalg.lstsq(basis, filtered[MIDDLE], rcond=None)
    return math.hypot(a, b), math.atan2(b, a)


def sine(frequency):
    return np.sin(2 * math.pi * frequency * TIME)


@pytest.mark.parametrize("frequency", [2.0, 10.0, 20.0, 40.0, 60.0])
def test_low_pass_has_the_gain_of_two_butterworth_runs_and_no_phase(frequency):
    amplitude, phase = gain(low_pass(sine(frequency), 20.0, T), frequency)
    share = math.tan(math.pi * frequency * T) / math.tan(math.pi * 20.0 * T)
    assert amplitude == pytest.approx(1.0 / (1.0 + (math.sqrt(2.0) - 1.0) * share**4), rel=1e-6)
    assert phase == pytest.approx(0.0, abs=1e-6)


def test_cut_off_is_where_the_gain_is_3_db_down_and_the_slope_is_24_db_per_octave():
    at, beyond, further = (gain(low_pass(sine(f), 4.0, T), f)[0] for f in (4.0, 16.0, 32.0))
    assert at == pytest.approx(1.0 / math.sqrt(2.0), rel=1e-6)
    assert 20.0 * math.log10(beyond / further) > 24.0
    assert low_pass(np.ones(1000), 4.0, T) == pytest.approx(1.0)


@pytest.mark.parametrize("band", [(0.4, 10.0), (1.1, 5.1), (3.0, 7.0)])
def test_band_pass_is_3_db_down_at_both_edges(band):
    for edge in band:
        amplitude, _ = gain(band_pass(sine(edge), band, T), edge)
        assert amplitude == pytest.approx(1.0 / math.sqrt(2.0), rel=2e-3)
    inside = math.sqrt(band[0] * band[1])
    amplitude, phase = gain(band_pass(sine(inside), band, T), inside)
    assert amplitude == pytest.approx(1.0, rel=0.01)
    assert phase == pytest.approx(0.0, abs=0.01)
    assert np.abs(band_pass(np.full(4000, 7.0), band, T)).max() < 0.01


def test_filters_take_all_rows_at_once():
    rows = np.array([[sine(3.0), sine(30.0)], [sine(1.0), sine(20.0)]])
    np.testing.assert_allclose(low_pass(rows, 20.0, T)[1, 0], low_pass(rows[1, 0], 20.0, T))


def test_too_few_samples_for_a_filter_are_told_with_the_interval_needed():
    with pytest.raises(ParameterError, match=r"every 0.02 s; a filter of 20 Hz .* output_step=0.01"):
        low_pass(np.zeros(100), 20.0, 0.02)
    with pytest.raises(ParameterError, match=r"a filter of 10 Hz"):
        band_pass(np.zeros(100), (0.4, 10.0), 0.05)
    low_pass(np.zeros(100), 20.0, 0.01)


@pytest.mark.parametrize("wavelength", [3.0, 10.0, 47.0])
def test_mean_over_2_m_of_a_sine_is_smaller_by_the_sinc(wavelength):
    distance = np.concatenate([np.arange(0.0, 60.0, 0.02), np.arange(60.0, 120.0, 0.013)])
    k = 2.0 * math.pi / wavelength
    places, means = sliding_mean(distance, np.sin(k * distance), 2.0, 0.5)
    np.testing.assert_allclose(means, math.sin(k) / k * np.sin(k * places), atol=3e-4)
    np.testing.assert_allclose(np.diff(places), 0.5)
    assert places[0] == 1.0
    assert distance[-1] - 1.5 < places[-1] <= distance[-1] - 1.0


def test_mean_is_exact_for_what_is_linear_between_samples():
    distance = np.array([0.0, 0.7, 1.6, 2.0, 3.1])
    places, means = sliding_mean(distance, np.stack([2.0 * distance - 1.0, 0.0 * distance]), 2.0, 0.25)
    np.testing.assert_allclose(means, [2.0 * places - 1.0, 0.0 * places], atol=1e-14)
    peak = np.array([0.0, 1.0, 0.0])
    assert sliding_mean(np.array([0.0, 1.0, 2.0]), peak, 2.0, 0.5)[1] == pytest.approx([0.5])
    assert sliding_mean(np.array([0.0, 1.0, 2.0]), peak, 1.5, 0.5)[1] == pytest.approx(
        [0.875 / 1.5] * 2
    )
    with pytest.raises(ParameterError, match="the track is 2 m long; it must be at least 100 m"):
        sliding_mean(np.array([0.0, 2.0]), np.zeros(2), 100.0, 10.0)


def test_sliding_rms_of_a_sine():
    distance = np.arange(0.0, 400.0, 0.1)
    places, rms = sliding_rms(distance, 3.0 * np.sin(2 * math.pi * distance / 20.0), 100.0, 10.0)
    np.testing.assert_allclose(rms, 3.0 / math.sqrt(2.0), rtol=1e-3)
    assert places[0] == 50.0


def test_percentiles_of_a_known_signal():
    ramp = np.random.default_rng(1).permutation(np.linspace(-1.0, 3.0, 4001))
    assert percentiles(ramp) == pytest.approx((-1.0 + 0.006, 3.0 - 0.006))
    assert extreme(-ramp) == pytest.approx(2.994)


def test_dominating_frequency_is_that_of_the_largest_power_within_the_band():
    signals = np.stack([3.0 * sine(0.2) + sine(4.3), 1.4 * sine(4.3) + sine(7.1)])
    assert dominating_frequency(signals, T, (0.5, 10.0)) == pytest.approx(4.3, abs=0.02)
    assert dominating_frequency(signals, T, (5.0, 10.0)) == pytest.approx(7.1, abs=0.02)
