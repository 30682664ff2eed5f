"""Filters of signals in time, and means over distance.

The filters are Butterworth filters of second order that run over the signal forwards and backwards. So
they are in effect of fourth order (24 dB per octave, the least that test standards require) and do not
shift peaks in time or place. Their cut-off frequencies are moved so that the gain of both runs together
is -3 dB (1/sqrt 2) there, as the standards define a cut-off.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from railenv.errors import ParameterError

Array = NDArray[np.float64]
Band = tuple[float, float]

OVERSAMPLING = 5.0
"""Least number of samples per period of a cut-off frequency."""

_ORDER = 2
_NARROWING = (math.sqrt(2.0) - 1.0) ** (1.0 / (2 * _ORDER))
"""Cut-off of two runs, over that of one: x where 1/(1 + x^4) is 1/sqrt 2."""


def check_sampling(period: float, cutoff: float) -> None:
    """Raise ParameterError unless samples every ``period`` (s) are enough for a cut-off (Hz)."""
    longest = 1.0 / (OVERSAMPLING * cutoff)
    if period > longest * (1.0 + 1e-9):
        raise ParameterError(
            f"the response has a sample every {period:g} s; a filter of {cutoff:g} Hz needs one every "
            f"{longest:g} s at least, so simulate with output_step={longest:g}"
        )


def low_pass(signal: Array, cutoff: float, period: float) -> Array:
    """Return a signal without its content above a cut-off frequency.

    Parameters
    ----------
    signal : ndarray, shape (..., samples)
    cutoff : float
        Hz; the gain is 1/sqrt 2 there.
    period : float
        s between samples.

    Raises
    ------
    ParameterError
        If samples are too far apart for the cut-off.
    """
    check_sampling(period, cutoff)
    return _both_ways(signal, _warped(cutoff, period) / _NARROWING, "lowpass", period, cutoff)


def band_pass(signal: Array, band: Band, period: float) -> Array:
    """Return the content of a signal between two frequencies (Hz); see :func:`low_pass`."""
    check_sampling(period, band[1])
    low, high = (_warped(edge, period) for edge in band)
    # a band pass is a low pass in (w^2 - low high) / (w (high - low))
    half_width = (high - low) / (2.0 * _NARROWING)
    centre = math.sqrt(low * high + half_width**2)
    edges = np.array([centre - half_width, centre + half_width])
    return _both_ways(signal, edges, "bandpass", period, band[0])


def _warped(frequency: float, period: float) -> float:
    """Return the frequency of the analog filter that the bilinear transform turns into this one."""
    return math.tan(math.pi * frequency * period)


def _both_ways(
    signal: Array, warped: float | Array, kind: Literal["lowpass", "bandpass"], T: float, slowest: float
) -> Array:
    from scipy import signal as signals

    share = 2.0 * np.arctan(warped) / math.pi  # of half the sampling rate
    sections = signals.butter(_ORDER, share, kind, output="sos")
    # beyond both ends the signal is taken as mirrored, over the memory of the filter
    beyond = min(signal.shape[-1] - 1, math.ceil(1.0 / (slowest * T)))
    return np.asarray(signals.sosfiltfilt(sections, signal, padlen=beyond))


def sliding_mean(distance: Array, signal: Array, window: float, step: float) -> tuple[Array, Array]:
    """Return means over stretches of track, exact for signals linear between samples.

    Parameters
    ----------
    distance : ndarray, shape (samples,)
        Where each sample was taken, m; increasing.
    signal : ndarray, shape (..., samples)
    window, step : float
        Length of a stretch, and the distance from one to the next, m.

    Returns
    -------
    places : ndarray, shape (stretches,)
        Middle of each stretch, m.
    means : ndarray, shape (..., stretches)

    Raises
    ------
    ParameterError
        If the track is shorter than a stretch.
    """
    length = float(distance[-1] - distance[0])
    if length < window * (1.0 - 1e-9):
        raise ParameterError(f"the track is {length:g} m long; it must be at least {window:g} m")
    starts = distance[0] + step * np.arange(int(max(length - window, 0.0) / step + 1e-9) + 1)
    ends = np.minimum(starts + window, distance[-1])
    total = _integral(distance, signal, ends) - _integral(distance, signal, starts)
    return starts + window / 2.0, total / window


def _integral(distance: Array, signal: Array, places: Array) -> Array:
    """Return the integral over distance from the first sample up to some places."""
    steps = np.diff(distance)
    cells = steps * (signal[..., 1:] + signal[..., :-1]) / 2.0
    sums = np.concatenate([np.zeros((*signal.shape[:-1], 1)), np.cumsum(cells, axis=-1)], axis=-1)
    i = np.clip(np.searchsorted(distance, places, side="right") - 1, 0, len(steps) - 1)
    into = places - distance[i]
    slope = (signal[..., i + 1] - signal[..., i]) / steps[i]
    return sums[..., i] + into * (signal[..., i] + 0.5 * slope * into)


def sliding_rms(distance: Array, signal: Array, window: float, step: float) -> tuple[Array, Array]:
    """Return root mean squares over stretches of track; parameters: see :func:`sliding_mean`."""
    places, means = sliding_mean(distance, np.square(signal), window, step)
    return places, np.sqrt(np.maximum(means, 0.0))


def dominating_frequency(signals: Array, period: float, band: Band) -> float:
    """Return the frequency (Hz) within a band at which the signals together have the most power.

    Parameters
    ----------
    signals : ndarray, shape (count, samples)
    period : float
        s between samples.
    band : (float, float)
        Hz.
    """
    samples = signals.shape[-1]
    centred = signals - signals.mean(axis=-1, keepdims=True)
    padded = 4 * samples  # a finer grid of frequencies
    power = np.square(np.abs(np.fft.rfft(centred * np.hanning(samples), padded))).sum(axis=0)
    frequency = np.fft.rfftfreq(padded, period)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    return float(frequency[inside][np.argmax(power[inside])])


def percentiles(signal: Array) -> tuple[float, float]:
    """Return the values below which 0.15 % and 99.85 % of a signal lie (EN 14363)."""
    low, high = np.percentile(signal, [0.15, 99.85])
    return float(low), float(high)


def extreme(signal: Array) -> float:
    """Return the larger magnitude of the 0.15 % and the 99.85 % value."""
    return max(map(abs, percentiles(signal)))
