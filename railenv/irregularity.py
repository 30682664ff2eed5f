"""Track irregularity with the ERRI B176 spectra, synthesised along a line.

A line is a periodic record of random phases whose amplitude at every wavelength is exactly that of the
spectrum. A run starts anywhere on it; the trailing wheelset passes the same track as the leading one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError

Level = Literal["low", "high"]
Kind = Literal["align", "vert", "cross"]

# ERRI B176: wavenumbers in rad/m, levels in m rad
WAVENUMBER_C, WAVENUMBER_R, WAVENUMBER_S = 0.8246, 0.0206, 0.4380
LEVELS: Mapping[Level, Mapping[str, float]] = {
    "low": {"lateral": 2.119e-7, "vertical": 4.032e-7},
    "high": {"lateral": 6.125e-7, "vertical": 1.080e-6},
}
HALF_BASE = 0.75
"""m, half the distance over which the cross-level angle is measured."""

SPACING = 0.25
"""m between samples of a line."""

SHORTEST = 3.0
"""m, the shortest wavelength synthesised: the spectra hold from about here on."""

SAMPLES = 2**17
"""Samples of a line, which is 32.8 km long and then repeats."""

_LINE_SEED = 176  # the one line that every run starts somewhere on


def spectrum(kind: Kind, wavenumber: ArrayLike, level: Level) -> NDArray[np.float64]:
    """One-sided power spectral density of an irregularity (ERRI B176).

    Parameters
    ----------
    kind : {"align", "vert", "cross"}
        Lateral alignment, vertical profile (m^2/(rad/m)), or cross-level angle (rad^2/(rad/m)).
    wavenumber : array_like
        Omega = 2 pi / wavelength, rad/m.
    level : {"low", "high"}
    """
    checks.known("kind of irregularity", [kind], get_args(Kind))
    checks.known("irregularity level", [level], get_args(Level))
    omega2 = np.square(np.asarray(wavenumber, dtype=float))
    common = WAVENUMBER_C**2 / ((omega2 + WAVENUMBER_R**2) * (omega2 + WAVENUMBER_C**2))
    if kind == "align":
        return LEVELS[level]["lateral"] * common
    if kind == "vert":
        return LEVELS[level]["vertical"] * common
    turned = omega2 / (omega2 + WAVENUMBER_S**2) / HALF_BASE**2
    return LEVELS[level]["vertical"] * common * turned


@dataclass(frozen=True)
class Line:
    """Irregularity along a line that repeats after its length.

    Attributes
    ----------
    align, vert : ndarray, shape (samples,)
        Lateral and vertical displacement of the rails, m.
    cross : ndarray, shape (samples,)
        Cross-level angle, rad.
    spacing : float
        Distance between samples, m.
    """

    align: NDArray[np.float64]
    vert: NDArray[np.float64]
    cross: NDArray[np.float64]
    spacing: float

    @property
    def length(self) -> float:
        """Length (m) after which the line repeats."""
        return self.spacing * len(self.align)

    def at(self, kind: Kind, distance: ArrayLike) -> NDArray[np.float64]:
        """Return one irregularity at some distances (m), linear between samples."""
        checks.known("kind of irregularity", [kind], get_args(Kind))
        record = getattr(self, kind)
        position = np.asarray(distance, dtype=float) / self.spacing
        return np.interp(position, np.arange(len(record)), record, period=len(record))


def synthesise(level: Level, *, seed: int, samples: int = SAMPLES, spacing: float = SPACING) -> Line:
    """Synthesise a line with the ERRI B176 spectra and random phases.

    Parameters
    ----------
    level : {"low", "high"}
    seed : int
        Of the phases.
    samples : int
        Even number of samples.
    spacing : float
        Distance between them, m.
    """
    if samples < 4 or samples % 2:
        raise ParameterError(f"samples is {samples}; it must be an even number of at least 4")
    spacing = checks.number("spacing", spacing, low=0.0, open_low=True, unit="m")
    step = 2.0 * math.pi / (samples * spacing)
    wavenumber = step * np.arange(1, samples // 2)
    generator = np.random.default_rng(seed)
    records = {}
    for kind in get_args(Kind):
        # a cosine of amplitude a carries the power a^2/2 = S dOmega
        density = spectrum(kind, wavenumber, level) * (wavenumber <= 2.0 * math.pi / SHORTEST)
        amplitude = np.sqrt(2.0 * density * step)
        phase = generator.uniform(0.0, 2.0 * math.pi, len(wavenumber))
        half = np.zeros(samples // 2 + 1, dtype=complex)
        half[1:-1] = 0.5 * samples * amplitude * np.exp(1j * phase)
        records[kind] = np.fft.irfft(half, samples)
    return Line(records["align"], records["vert"], records["cross"], spacing)


@cache
def line(level: Level) -> Line:
    """Return the line of a level that environments run on; always the same."""
    return synthesise(level, seed=_LINE_SEED)
