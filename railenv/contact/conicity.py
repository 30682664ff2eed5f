"""Equivalent conicity, by the kinematic motion (EN 15302) and by harmonic linearisation."""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError, shown

Array = NDArray[np.float64]

Method = Literal["EN 15302", "harmonic"]
METHODS: tuple[Method, ...] = get_args(Method)

_PHASES = 2000
_ZERO = 1e-12  # of an amplitude: differences that rounding makes


def equivalent_conicity(
    y: ArrayLike,
    rolling_radius_difference: ArrayLike,
    amplitude: ArrayLike,
    method: Method = "EN 15302",
) -> Any:
    """Return the equivalent conicity of a rolling-radius difference over the lateral shift.

    By EN 15302 it is the conicity of the coned wheelset whose kinematic motion has the same
    wavelength. A wheelset moves by y'' = -delta_r(y) / (2 e r0); the time between its turning points is
    an integral over its potential energy, exact for a table that is straight between its points, and e
    and r0 cancel. If the wheelset does not return across the centre, there is no such motion, and the
    conicity is 0.

    The harmonic conicity is the first Fourier coefficient of delta_r over a sine of the amplitude about
    y = 0, as a describing function has it.

    Parameters
    ----------
    y : array_like
        Lateral shift of the wheelset, m, rising.
    rolling_radius_difference : array_like
        Rolling radius of the wheel towards which it is shifted, minus the other's, m.
    amplitude : float or array_like
        Half the distance of the turning points, m.
    method : {"EN 15302", "harmonic"}

    Returns
    -------
    float or ndarray
        As ``amplitude``.

    Raises
    ------
    ParameterError
        If the table is invalid, or an amplitude is not positive or goes beyond it.
    """
    checks.choice("method", method, METHODS)
    places = checks.numbers("y", y, least=2)
    delta = checks.numbers("rolling_radius_difference", rolling_radius_difference, least=2)
    if places.shape != delta.shape:
        raise ParameterError(
            f"there are {len(places)} y and {len(delta)} rolling-radius differences; they must be "
            "equal in number"
        )
    if not (np.isfinite(places).all() and np.isfinite(delta).all()):
        raise ParameterError(
            "the table of the rolling-radius difference has entries that are not finite"
        )
    if not (np.diff(places) > 0.0).all():
        at = int(np.flatnonzero(np.diff(places) <= 0.0)[0])
        raise ParameterError(f"y goes from {places[at]:g} to {places[at + 1]:g} m; it must rise")
    wanted = amplitudes(amplitude)
    table = _Table(places, delta)
    if method == "harmonic":
        found = harmonic(places, 0.5 * delta, wanted)
    else:
        found = np.array([table.conicity(a) for a in wanted])
    return float(found[0]) if np.ndim(amplitude) == 0 else found


def amplitudes(value: ArrayLike) -> Array:
    """Return amplitudes (m) as a vector; they must be positive."""
    wanted = checks.numbers("amplitude", value)
    if not ((wanted > 0.0) & np.isfinite(wanted)).all():
        raise ParameterError(f"amplitude is {shown(value)} m; it must be positive and finite")
    return wanted


def harmonic(x: Array, f: Array, amplitude: Array) -> Array:
    """Return the slope of the sine that a function makes of a sine of some amplitudes about 0.

    Raises
    ------
    ParameterError
        If an amplitude goes beyond the table.
    """
    widest = min(-x[0], x[-1])
    if amplitude.max() > widest * (1.0 + 1e-9):
        raise ParameterError(
            f"amplitude is {amplitude.max():g} m; the table goes to {max(widest, 0.0):g} m on "
            "both sides"
        )
    sine = np.sin(np.pi * (np.arange(_PHASES) + 0.5) / _PHASES - 0.5 * np.pi)
    values = np.interp(amplitude[:, None] * sine, x, f)
    return 2.0 * (values * sine).mean(axis=1) / amplitude


class _Table:
    """Rolling-radius difference, straight between points, with its integral: a potential energy."""

    def __init__(self, y: Array, delta: Array) -> None:
        self.y, self.half = y, 0.5 * delta
        self.size = np.diff(y)
        self.bend = np.diff(self.half) / self.size
        self.energy = np.concatenate(
            [[0.0], np.cumsum(0.5 * (self.half[1:] + self.half[:-1]) * self.size)]
        )

    def potential(self, y: Array) -> Array:
        """Return the integral of half the difference, a parabola in every cell."""
        cell = np.clip(np.searchsorted(self.y, y, side="right") - 1, 0, len(self.size) - 1)
        t = y - self.y[cell]
        return self.energy[cell] + t * (self.half[cell] + 0.5 * t * self.bend[cell])

    def conicity(self, amplitude: float) -> float:
        """Return the conicity of the motion between turning points at twice the amplitude."""
        left = self._turning_point(amplitude)
        phase = np.pi * (np.arange(_PHASES) + 0.5) / _PHASES - 0.5 * np.pi
        y = left + amplitude * (1.0 + np.sin(phase))
        ends = self.potential(np.array([left, left + 2.0 * amplitude]))
        free = float(ends.min()) - self.potential(y)
        if free.min() <= 0.0:
            return 0.0  # it does not cross the centre
        # half a period, with a sine substituted, which removes the singular ends
        half_period = np.pi * (amplitude * np.cos(phase) / np.sqrt(2.0 * free)).mean()
        return float((np.pi / half_period) ** 2)

    def _turning_point(self, amplitude: float) -> float:
        """Return the left turning point: both have the same potential energy."""
        low, high = float(self.y[0]), float(self.y[-1]) - 2.0 * amplitude
        if high < low - _ZERO * amplitude:
            raise ParameterError(
                f"amplitude is {amplitude:g} m; the table goes from {self.y[0]:g} to {self.y[-1]:g} m, "
                f"which is enough for {0.5 * (self.y[-1] - self.y[0]):g} m"
            )
        tries = np.unique(
            np.clip(np.concatenate([self.y, self.y - 2.0 * amplitude]), low, max(low, high))
        )
        climb = self.potential(tries + 2.0 * amplitude) - self.potential(tries)
        scale = _ZERO * float(np.abs(self.energy).max())
        roots = tries[np.abs(climb) <= scale].tolist()
        for k in np.flatnonzero(climb[:-1] * climb[1:] < 0.0):
            roots.append(self._root(amplitude, float(tries[k]), float(tries[k + 1])))
        if not roots:
            raise ParameterError(
                f"amplitude is {amplitude:g} m; within the table, from {self.y[0]:g} to {self.y[-1]:g} "
                "m, the wheelset does not swing so far to both sides"
            )
        return float(min(roots, key=lambda root: abs(root + amplitude)))

    def _root(self, amplitude: float, low: float, high: float) -> float:
        """Return the place of equal potentials between two tries, where they are parabolas."""
        middle = 0.5 * (low + high)
        at = np.array([low, middle, high])
        f0, fm, f1 = (self.potential(at + 2.0 * amplitude) - self.potential(at)).tolist()
        a, b, c = 2.0 * (f0 - 2.0 * fm + f1), 4.0 * fm - 3.0 * f0 - f1, f0
        roots = np.roots([a, b, c]) if abs(a) > 1e-12 * abs(b) else np.array([-c / b])
        real = roots[np.abs(roots.imag) < 1e-6].real
        part = float(real[np.argmin(np.abs(real - 0.5))])
        return low + min(max(part, 0.0), 1.0) * (high - low)
