"""Metrics of an episode: amplitude and frequency of hunting, and readings of the standards."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from railenv.envs.fleet import Fleet

Array = NDArray[np.float64]

GRAVITY = 9.81
CFR_BAND = (0.5, 10.0)  # Hz
CFR_LIMIT = 0.3 * GRAVITY
"""m/s^2 rms over 2 s, of the truck's lateral acceleration (US 49 CFR 213.333)."""
EN_HALF_BAND = 2.0  # Hz, to either side of the dominating frequency
EN_DISTANCE = 100.0  # m

METRICS = (
    "hunting_amplitude",
    "hunting_frequency",
    "acceleration_rms",
    "acceleration_peak",
    "effort_rms",
    "distance",
    "cfr_213_333",
    "en_14363",
)
"""Names of the metrics of an episode."""

_FEWEST = 30  # samples for a reading to mean anything


def amplitude_and_frequency(displacement: Array, period: float) -> tuple[float, float]:
    """Return half the peak-to-peak value of a signal, and its frequency from zero crossings (Hz).

    The frequency is 0 if the signal does not complete a cycle.
    """
    if len(displacement) < 2:
        return 0.0, 0.0
    centred = displacement - displacement.mean()
    below, above = centred[:-1] < 0.0, centred[1:] >= 0.0
    k = np.flatnonzero(below & above)
    amplitude = float(np.ptp(displacement) / 2.0)
    if len(k) < 2:
        return amplitude, 0.0
    crossings = k - centred[k] / (centred[k + 1] - centred[k])
    return amplitude, float((len(k) - 1) / ((crossings[-1] - crossings[0]) * period))


def band_passed(signal: Array, band: tuple[float, float], period: float) -> Array:
    """Return a signal with only the frequencies (Hz) inside a band, its mean removed."""
    spectrum = np.fft.rfft(signal - signal.mean(axis=0), axis=0)
    frequency = np.fft.rfftfreq(len(signal), period)
    spectrum[(frequency < band[0]) | (frequency > band[1])] = 0.0
    return np.fft.irfft(spectrum, len(signal), axis=0)


def largest_sliding_rms(signal: Array, window: int) -> float:
    """Return the largest rms over any stretch of ``window`` samples (all, if there are fewer)."""
    window = min(window, len(signal))
    sums = np.concatenate([[0.0], np.cumsum(np.square(signal))])
    return float(np.sqrt(np.max(sums[window:] - sums[:-window]) / window))


def episode_metrics(fleet: Fleet, i: int) -> dict[str, float]:
    """Return the metrics of one environment's episode so far.

    Amplitude, frequency and the standards' readings are from the last seconds (at least two, and 100 m
    of track, if the episode is so long); rms, peak, effort and distance from the whole episode.

    Returns
    -------
    dict
        ``hunting_amplitude`` (m), ``hunting_frequency`` (Hz), ``acceleration_rms`` and
        ``acceleration_peak`` (m/s^2), ``effort_rms`` (share of the limit), ``distance`` (m),
        ``cfr_213_333`` and ``en_14363``: shares of the limits of the two standards; above 1 counts as
        unstable.
    """
    period = fleet.settings.control_period
    recent, n = fleet.recent(i), len(fleet.model.guided)
    _, guiding, forces = np.split(recent, [n, n + len(fleet.model.equipment.wheelsets)], axis=1)
    amplitude, frequency = amplitude_and_frequency(recent[:, 0], period)
    return {
        "hunting_amplitude": amplitude,
        "hunting_frequency": frequency,
        **fleet.totals(i),
        "cfr_213_333": max((_cfr(force, period) for force in forces.T), default=0.0),
        "en_14363": _en(fleet, i, guiding, frequency, period),
    }


def _cfr(acceleration: Array, period: float) -> float:
    """Return the reading of 49 CFR 213.333, as a share of its limit."""
    if len(acceleration) < _FEWEST:
        return 0.0
    filtered = band_passed(acceleration, CFR_BAND, period)
    return largest_sliding_rms(filtered, round(2.0 / period)) / CFR_LIMIT


def _en(fleet: Fleet, i: int, guiding: Array, frequency: float, period: float) -> float:
    """Return the reading of EN 14363: sum of guiding forces over 100 m, as a share of its limit."""
    if len(guiding) < _FEWEST or guiding.shape[1] == 0 or frequency <= 0.0:
        return 0.0
    speed = fleet.conditions(i)[0]
    band = (frequency - EN_HALF_BAND, frequency + EN_HALF_BAND)
    filtered = band_passed(guiding, band, period)
    window = max(1, round(EN_DISTANCE / speed / period))
    return max(largest_sliding_rms(axle, window) for axle in filtered.T) / en_limit(
        _axle_load(fleet, i)
    )


def _axle_load(fleet: Fleet, i: int) -> float:
    episode = fleet.episodes[i]
    assert episode is not None
    return episode.plant.axle_load


def en_limit(axle_load: float) -> float:
    """Return the limit (N) of the rms sum of guiding forces: half of 10 kN + P/3 (axle load P, N)."""
    return 0.5 * (10e3 + axle_load / 3.0)
