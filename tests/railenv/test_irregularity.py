"""Synthesised track irregularity has the spectrum and the rms of ERRI B176."""

# ruff: noqa: NPY002 - the legacy generator is looked at on purpose

import math

import numpy as np
import pytest
from scipy import integrate, signal

from railenv import irregularity
from railenv.errors import ParameterError, UnknownNameError
from railenv.irregularity import Line, spectrum, synthesise

KINDS = ("align", "vert", "cross")


@pytest.mark.parametrize("level", ["low", "high"])
@pytest.mark.parametrize("kind", KINDS)
def test_welch_estimate_follows_the_erri_spectrum(kind, level):
    line = synthesise(level, seed=3, samples=2**17)
    frequency, density = signal.welch(
        getattr(line, kind), fs=1.0 / line.spacing, nperseg=4096, window="hann"
    )
    wavenumber = 2 * math.pi * frequency
    inside = (wavenumber > 2 * math.pi / 100.0) & (wavenumber < 2 * math.pi / 3.3)
    estimate = density[inside] / (2 * math.pi)  # per rad/m
    # about 64 segments: smooth over bands before comparing
    ratio = estimate / spectrum(kind, wavenumber[inside], level)
    bands = np.array_split(ratio, 12)
    assert all(abs(band.mean() - 1.0) < 0.1 for band in bands)


@pytest.mark.parametrize(("level", "rms"), [("low", 0.714e-3), ("high", 1.213e-3)])
def test_rms_of_alignment_over_3_to_25_m_is_that_of_erri(level, rms):
    low, high = 2 * math.pi / 25.0, 2 * math.pi / 3.0
    power, _ = integrate.quad(lambda w: float(spectrum("align", w, level)), low, high)
    assert math.sqrt(power) == pytest.approx(rms, rel=2e-3)
    line = irregularity.line(level)
    transform = np.fft.rfft(line.align) / len(line.align)
    wavenumber = 2 * math.pi * np.fft.rfftfreq(len(line.align), line.spacing)
    inside = (wavenumber > low) & (wavenumber < high)
    assert math.sqrt(2 * np.sum(np.abs(transform[inside]) ** 2)) == pytest.approx(rms, rel=0.05)


def test_kinds_are_independent_and_have_no_mean():
    line = synthesise("low", seed=1)
    for kind in KINDS:
        record = getattr(line, kind)
        assert abs(record.mean()) < 1e-12
        for other in KINDS:
            if other != kind:
                assert abs(np.corrcoef(record, getattr(line, other))[0, 1]) < 0.15


def test_same_seed_same_line_and_another_seed_another():
    a, b, c = (synthesise("low", seed=s, samples=4096) for s in (5, 5, 6))
    np.testing.assert_array_equal(a.align, b.align)
    assert np.abs(a.align - c.align).max() > 1e-4


def test_line_is_linear_between_samples_and_repeats():
    line = Line(np.array([0.0, 1.0, 4.0, 2.0]), np.zeros(4), np.zeros(4), 0.5)
    np.testing.assert_allclose(
        line.at("align", [0.0, 0.25, 0.75, 1.75, 2.0, 2.25]), [0, 0.5, 2.5, 1, 0, 0.5]
    )
    assert line.length == 2.0


def test_global_generator_is_untouched():
    np.random.seed(0)
    before = np.random.get_state()[1].copy()
    synthesise("high", seed=2, samples=256)
    np.testing.assert_array_equal(np.random.get_state()[1], before)


def test_bad_arguments_name_quantity_and_value():
    with pytest.raises(UnknownNameError, match="irregularity level: 'medium'"):
        spectrum("align", 1.0, "medium")
    with pytest.raises(UnknownNameError, match="'gauge'"):
        irregularity.line("low").at("gauge", 0.0)
    with pytest.raises(ParameterError, match="samples is 5"):
        synthesise("low", seed=0, samples=5)
    with pytest.raises(ParameterError, match="spacing is 0 m"):
        synthesise("low", seed=0, spacing=0.0)
