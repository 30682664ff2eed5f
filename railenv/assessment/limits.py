"""Limits of the quantities of a run: values of EN 14363 and UIC 518 practice."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, Self

from railenv import checks

KMH = 1.0 / 3.6

WHEEL_LOAD_CAPS = (
    (160.0 * KMH, 200e3),
    (200.0 * KMH, 190e3),
    (250.0 * KMH, 180e3),
    (300.0 * KMH, 170e3),
    (math.inf, 160e3),
)
"""Largest wheel load (N) up to each speed (m/s)."""

BODY_LATERAL = ((400.0, 2.6), (600.0, 2.8), (math.inf, 3.0))
"""Largest lateral acceleration (m/s^2) of the body for safety: below 400 m, and up to the others."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of a passenger vehicle with two levels of suspension, after EN 14363 and UIC 518.

    The numbers are those in use with these standards; the edition that binds an approval prevails.
    Ride values are guides there, not limits of safety.

    Attributes
    ----------
    track_shift_factor : float
        alpha of ``alpha (10 kN + 2 Q0 / 3)``: 1 for coaches, units and locomotives, 0.85 for wagons.
    y_over_q : float
        Of (Y/Q) over 2 m.
    quasi_static_wheel_load : float
        N.
    body_vertical_safety : float
        m/s^2; 5 with one level of suspension.
    ride_lateral, ride_vertical : float
        m/s^2, largest accelerations between 0.4 and 10 Hz.
    ride_lateral_rms, ride_vertical_rms : float
        m/s^2, their root mean squares.
    quasi_static_lateral : float
        m/s^2, of the body on the curve.

    Raises
    ------
    ParameterError
        If a value is not positive.
    """

    track_shift_factor: float = 1.0
    y_over_q: float = 0.8
    quasi_static_wheel_load: float = 145e3
    body_vertical_safety: float = 3.0
    ride_lateral: float = 2.5
    ride_vertical: float = 2.5
    ride_lateral_rms: float = 0.5
    ride_vertical_rms: float = 0.75
    quasi_static_lateral: float = 1.5

    def __post_init__(self) -> None:
        for f in dataclasses.fields(self):
            value = checks.number(f.name, getattr(self, f.name), low=0.0, open_low=True)
            object.__setattr__(self, f.name, value)

    def replace(self, **changes: Any) -> Self:
        """Return these limits with some changed.

        Raises
        ------
        UnknownNameError
            If there is no such limit.
        """
        checks.known("limit", changes, [f.name for f in dataclasses.fields(self)])
        return dataclasses.replace(self, **changes)

    def track_shift(self, static_wheel_load: float) -> float:
        """Return the largest sum of guiding forces (N) of a wheelset, alpha (10 kN + 2 Q0 / 3)."""
        return self.track_shift_factor * (10e3 + 2.0 * static_wheel_load / 3.0)

    def wheel_load(self, static_wheel_load: float, speed: float) -> float:
        """Return the largest wheel load (N): 90 kN + Q0, and at most what the speed (m/s) allows.

        The caps are those for static wheel loads up to 112.5 kN.
        """
        cap = next(load for up_to, load in WHEEL_LOAD_CAPS if speed <= up_to * (1.0 + 1e-9))
        return min(90e3 + static_wheel_load, cap)

    def quasi_static_guiding_force(self, radius: float) -> float | None:
        """Return the largest quasi-static guiding force (N); None (no limit) below 250 m."""
        if radius < 250.0:
            return None
        return 60e3 if radius >= 400.0 else 30e3 + 10500e3 / radius

    def frame_acceleration(self, bogie_mass: float) -> float:
        """Return the largest lateral acceleration (m/s^2) of the frame, 12 - M_b / 5 (M_b in t).

        ``bogie_mass`` (kg) is that of the bogie with its wheelsets.
        """
        return 12.0 - bogie_mass / 5e3

    def body_lateral_safety(self, radius: float) -> float:
        """Return the largest lateral acceleration (m/s^2) of the body for safety."""
        if radius < BODY_LATERAL[0][0]:
            return BODY_LATERAL[0][1]
        return next(limit for up_to, limit in BODY_LATERAL[1:] if radius <= up_to)
