"""Track irregularity along a line: synthesised with the ERRI B176 spectra, or measured.

A synthesised line is a periodic record of random phases whose amplitude at every wavelength is exactly
that of the spectrum. A measured one (:meth:`Line.from_file`) fades out at both ends and is zero beyond.
The trailing wheelset passes the same track as the leading one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from os import PathLike
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError, shown

Level = Literal["low", "high"]
Kind = Literal["align", "vert", "cross"]

# ERRI B176: wavenumbers in rad/m, levels in m rad
WAVENUMBER_C, WAVENUMBER_R, WAVENUMBER_S = 0.8246, 0.0206, 0.4380
LEVELS: Mapping[Level, Mapping[str, float]] = {
    "low": {"lateral": 2.119e-7, "vertical": 4.032e-7},
    "high": {"lateral": 6.125e-7, "vertical": 1.080e-6},
}
HALF_BASE = 0.75
"""Half the distance over which the cross-level angle is measured, m."""

FADE = 20.0
"""Distance (m) over which irregularity grows from 0, at the start of a run and the ends of a line."""

SPACING = 0.25
"""Distance between samples of a line, m."""

SHORTEST = 3.0
"""Shortest wavelength synthesised, m: the spectra hold above about this."""

SAMPLES = 2**17
"""Samples of a line, which is 32.8 km long and then repeats."""

_LINE_SEED = 176  # of the one line on which every run starts somewhere


def spectrum(kind: Kind, wavenumber: ArrayLike, level: Level) -> NDArray[np.float64]:
    """Return the one-sided power spectral density of an irregularity (ERRI B176).

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


@dataclass(frozen=True, eq=False)
class Line:
    """Irregularity along a line, linear between samples.

    Attributes
    ----------
    align, vert : ndarray, shape (samples,)
        Lateral and vertical displacement of the rails, m; positive to the left and up.
    cross : ndarray, shape (samples,)
        Cross-level angle, rad; positive where the left rail is the higher one.
    spacing : float
        Distance between samples, m.
    repeats : bool
        Whether the line starts again after its end. If not, it fades out over the first and the last
        20 m (:data:`FADE`) and is zero beyond, so that there is no jump.

    Raises
    ------
    ParameterError
        If the records differ in length or have a value that is not finite, or a line that does not
        repeat is shorter than its two fades.
    """

    align: NDArray[np.float64]
    vert: NDArray[np.float64]
    cross: NDArray[np.float64]
    spacing: float
    repeats: bool = True

    def __post_init__(self) -> None:
        spacing = checks.number("spacing", self.spacing, low=0.0, open_low=True, unit="m")
        object.__setattr__(self, "spacing", spacing)
        for kind in get_args(Kind):
            record = checks.numbers(f"{kind} of a line", getattr(self, kind), least=2)
            if not np.isfinite(record).all():
                raise ParameterError(f"{kind} of a line has a value that is not finite")
            object.__setattr__(self, kind, record)
        counts = {kind: len(getattr(self, kind)) for kind in get_args(Kind)}
        if len(set(counts.values())) > 1:
            listed = ", ".join(f"{kind} {count}" for kind, count in counts.items())
            raise ParameterError(f"records of a line have as many samples each; these have {listed}")
        if not self.repeats and self.length < 2.0 * FADE:
            raise ParameterError(
                f"a line that does not repeat has {self.length:g} m; it must have at least "
                f"{2.0 * FADE:g} m because it fades over {FADE:g} m at each end"
            )

    @classmethod
    def from_file(
        cls,
        path: str | PathLike[str],
        *,
        unit: Literal["m", "mm"],
        base: float = 2.0 * HALF_BASE,
        opposite: Sequence[str] = (),
        repeats: bool = False,
    ) -> Self:
        """Read a measured line from a CSV file.

        The first line after any comment lines, which start with ``#``, names the columns; columns are
        separated by commas, semicolons or tabs. They are ``distance`` (m, increasing), and either

        - ``align`` and ``vert`` (in ``unit``) and ``cross`` (rad), as the attributes of a line, or
        - ``alignment_left``, ``alignment_right``, ``level_left``, ``level_right`` of the rails (in
          ``unit``), and ``cross_level``, the height of the left rail above the right one without the
          design cant; when left out, ``level_left - level_right``.

        Displacements to the left and up are positive, for both rails. Alignment and level of the line
        are the means over the rails; variations of the gauge are not used. Other columns are ignored.
        The first row is distance 0 of the line. Rows at varying spacing are interpolated linearly to
        their median spacing.

        Parameters
        ----------
        path : path
        unit : {"m", "mm"}
            Unit of all lengths except the distance.
        base : float
            Distance across the track over which the cross level is measured, m; it gives the angle.
        opposite : sequence of str
            Columns with the opposite sign in the file.
        repeats : bool
            Whether the line starts again after its end; then the file's ends should match.

        Raises
        ------
        ParameterError
            If the file is not such a table; the message names file, column and row.
        UnknownNameError
            If a column in ``opposite`` is not read.
        """
        from railenv.irregularity_files import read

        records, spacing = read(path, unit=unit, base=base, opposite=opposite)
        return cls(records["align"], records["vert"], records["cross"], spacing, repeats)

    def to_file(self, path: str | PathLike[str]) -> None:
        """Write a CSV file of distance, align, vert (m) and cross (rad), which ``from_file`` reads."""
        from railenv.irregularity_files import write

        write(path, self.spacing, {kind: getattr(self, kind) for kind in get_args(Kind)})

    @property
    def length(self) -> float:
        """Length (m) after which the line repeats, or ends."""
        return self.spacing * (len(self.align) - (not self.repeats))

    def faded(self) -> Self:
        """Return the line as a repeating one, with its fades in the records: its ends are zero."""
        if self.repeats:
            return self
        places = self.spacing * np.arange(len(self.align))
        align, vert, cross = (self.at(kind, places) for kind in get_args(Kind))
        return type(self)(align, vert, cross, self.spacing)

    def at(self, kind: Kind, distance: ArrayLike) -> NDArray[np.float64]:
        """Return one irregularity at some distances (m), linear between samples."""
        checks.known("kind of irregularity", [kind], get_args(Kind))
        record = getattr(self, kind)
        place = np.asarray(distance, dtype=float)
        position = place / self.spacing
        if not self.repeats:
            fade = np.clip(np.minimum(place, self.length - place) / FADE, 0.0, 1.0)
            return fade * np.interp(position, np.arange(len(record)), record)
        floor = np.floor(position)
        cell = floor.astype(np.int64) % len(record)
        here, there = record[cell], record[(cell + 1) % len(record)]
        return here + (position - floor) * (there - here)


def given(value: Any) -> Line | None:
    """Return the line for a setting: a level of ERRI B176, a line, or None for none.

    Raises
    ------
    ParameterError
        If it is anything else.
    """
    if value is None or isinstance(value, Line):
        return value
    if not isinstance(value, str):
        raise ParameterError(
            f"irregularity is {shown(value)}; it must be the name of a level or a "
            "railenv.irregularity.Line"
        )
    checks.known("irregularity", [value], get_args(Level))
    level: Any = value
    return line(level)


def synthesise(level: Level, *, seed: int, samples: int = SAMPLES, spacing: float = SPACING) -> Line:
    """Synthesise a line with the ERRI B176 spectra and random phases.

    Parameters
    ----------
    level : {"low", "high"}
    seed : int
        Seed of the phases.
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
    """Return the line on which environments run at a level; always the same."""
    return synthesise(level, seed=_LINE_SEED)
