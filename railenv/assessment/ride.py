"""Ride: weightings of accelerations by frequency, Sperling's Wz and the comfort of EN 12299.

Weightings are applied in the frequency domain, exact up to half the sampling rate.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Direction = Literal["lateral", "vertical"]

WZ_BAND = (0.5, 30.0)
"""Frequencies (Hz) that count for Wz."""

COMFORT_WINDOW = 5.0
"""Length (s) of one root mean square of continuous comfort (EN 12299)."""

COMFORT_WINDOWS = 60
"""Windows of mean comfort: five minutes (EN 12299)."""

_WZ_SCALE = {"vertical": 0.588, "lateral": 0.737}
_WZ_EXPONENT = 1.0 / 6.67
_CENTIMETRES = 100.0

# EN 12299 and UIC 513 as open implementations have them; ISO 2631-4 has other Q for nearly the same Wb
_BAND, _BAND_Q = (0.4, 100.0), 1.0 / math.sqrt(2.0)
_TRANSITION = {"lateral": (2.0, 2.0, 0.63), "vertical": (16.0, 16.0, 0.63)}  # f3, f4 (Hz), Q2
_STEP = (2.5, 0.8, 4.0, 0.8, 0.4)  # f5, Q3, f6, Q4, K of Wb


def sperling_weighting(direction: Direction, frequency: ArrayLike) -> Array:
    """Return Sperling's weighting B of an acceleration.

    Parameters
    ----------
    direction : {"lateral", "vertical"}
    frequency : array_like
        Hz.
    """
    f2 = np.square(np.asarray(frequency, dtype=float))
    above = 1.911 * f2 + np.square(0.25 * f2)
    below = np.square(1.0 - 0.277 * f2) + f2 * np.square(1.563 - 0.0368 * f2)
    return np.asarray(_WZ_SCALE[direction] * np.sqrt(above / below))


def wz(acceleration: Array, period: float, direction: Direction) -> float:
    """Return Sperling's ride index Wz, (2 mean (100 B a)^2)^(1/6.67) with a in m/s^2.

    For a harmonic of amplitude A in cm/s^2 it is (A^2 B^2)^(1/6.67). About 1: just noticeable; 2:
    clearly noticeable; 2.5: more pronounced, not unpleasant; 3: strong, tolerable; 3.25: very
    irregular; 4: harmful.

    Parameters
    ----------
    acceleration : ndarray, shape (samples,)
        m/s^2.
    period : float
        s between samples.
    direction : {"lateral", "vertical"}
    """
    n = len(acceleration)
    spectrum = np.fft.rfft(acceleration - acceleration.mean()) / n
    frequency = np.fft.rfftfreq(n, period)
    inside = (frequency >= WZ_BAND[0]) & (frequency <= WZ_BAND[1])
    power = 2.0 * np.square(np.abs(spectrum))  # mean square of each line
    weighting = np.square(_CENTIMETRES * sperling_weighting(direction, frequency))
    return float((2.0 * np.sum((power * weighting)[inside])) ** _WZ_EXPONENT)


def comfort_weighting(direction: Direction, frequency: ArrayLike) -> NDArray[np.complex128]:
    """Return the weighting of EN 12299: Wd of lateral, Wb of vertical accelerations.

    A band pass, a transition from acceleration to velocity and, in Wb, an upward step.

    Parameters
    ----------
    direction : {"lateral", "vertical"}
    frequency : array_like
        Hz.
    """
    s = 1j * np.asarray(frequency, dtype=float)  # in units of 2 pi
    f1, f2 = _BAND
    f3, f4, q2 = _TRANSITION[direction]
    weighting = s**2 / (s**2 + s * f1 / _BAND_Q + f1**2)
    weighting = weighting * f2**2 / (s**2 + s * f2 / _BAND_Q + f2**2)
    weighting = weighting * (s * f4**2 / f3 + f4**2) / (s**2 + s * f4 / q2 + f4**2)
    if direction == "vertical":
        f5, q3, f6, q4, gain = _STEP
        upper = s**2 / f5**2 + s / (q3 * f5) + 1.0
        weighting = weighting * gain * upper / (s**2 / f6**2 + s / (q4 * f6) + 1.0)
    return np.asarray(weighting)


def continuous_comfort(acceleration: Array, period: float, direction: Direction) -> Array:
    """Return the root mean square (m/s^2) of a weighted acceleration in each whole window of 5 s.

    Parameters are those of :func:`wz`.
    """
    n = len(acceleration)
    padded = 2 * n  # so that the end does not run into the start
    spectrum = np.fft.rfft(acceleration - acceleration.mean(), padded)
    frequency = np.fft.rfftfreq(padded, period)
    weighted = np.fft.irfft(spectrum * comfort_weighting(direction, frequency), padded)[:n]
    window = round(COMFORT_WINDOW / period)
    windows = weighted[: n // window * window].reshape(-1, window)
    return np.asarray(np.sqrt(np.mean(np.square(windows), axis=1)))


def mean_comfort(lateral: Array, vertical: Array) -> float:
    """Return N_MV, 6 sqrt(ay95^2 + az95^2), of continuous comfort (m/s^2) lateral and vertical.

    The 95 % values of at least :data:`COMFORT_WINDOWS` windows. The longitudinal acceleration, which
    the models do not have, is left out. Below 1.5 is very comfortable, above 4.5 very uncomfortable.
    """
    squares = (np.percentile(values, 95.0) ** 2 for values in (lateral, vertical))
    return float(6.0 * math.sqrt(sum(squares)))
