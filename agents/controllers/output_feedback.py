"""Structured feedback of yaw rates and lateral accelerations, scheduled over speed.

Each reading loses its mean in a washout (a first-order high-pass filter) and goes to every command as
it is and through first-order low-pass filters. Low-passed at 1 Hz, the yaw rate is nearly the yaw angle
and the acceleration nearly the lateral velocity, so that the gains weigh angle, rate, velocity and
acceleration of each body with sensors. Gains are scheduled over speed;
:func:`agents.tune_output_feedback` finds them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import equipped
from agents.controllers.scheduled import (
    CONTROL_PERIOD,
    Law,
    ScheduledController,
    readings_of,
    sensor_rows,
)
from railenv import Equipped, Model, checks
from railenv.envs.observation import Reading
from railenv.errors import ParameterError, shown

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Filters:
    """Corner frequencies, Hz.

    Attributes
    ----------
    washout : float
        Frequency below which readings are not fed back.
    low_pass : tuple of float
        Corners of the low-pass filters of every reading.
    """

    washout: float = 0.2
    low_pass: tuple[float, ...] = (1.0,)

    def __post_init__(self) -> None:
        checks.number("corner frequency washout", self.washout, low=0.0, open_low=True, unit="Hz")
        given: Any = self.low_pass
        if not isinstance(given, (list, tuple)):
            raise ParameterError(f"low_pass is {shown(given)}; it must be frequencies in Hz")
        corners = [
            checks.number("corner of a low-pass filter", f, low=0.0, open_low=True, unit="Hz")
            for f in given
        ]
        object.__setattr__(self, "low_pass", tuple(corners))


@dataclass(frozen=True)
class Term:
    """A filtered reading that is multiplied by gains.

    Attributes
    ----------
    signal : str
        ``accel_b`` or ``gyro_b`` of a sensed body ``b``.
    corner : float or None
        Corner of the low-pass filter, Hz; None for the unfiltered reading.
    """

    signal: str
    corner: float | None

    def __str__(self) -> str:
        return self.signal if self.corner is None else f"{self.signal} below {self.corner:g} Hz"


def terms_of(model: Equipped, filters: Filters) -> tuple[Term, ...]:
    """Return the terms that a command's gains multiply, in their order: per m/s^2 and per rad/s."""
    corners = (None, *filters.low_pass)
    return tuple(Term(signal, corner) for signal in model.sensor_names for corner in corners)


class OutputFeedback(ScheduledController):
    """Scheduled gains on filtered yaw rates and lateral accelerations of the bodies with sensors."""

    @classmethod
    def design(
        cls,
        model: Model,
        *,
        speeds: ArrayLike,
        gains: ArrayLike,
        filters: Filters | None = None,
        period: float = CONTROL_PERIOD,
        about: dict[str, Any] | None = None,
    ) -> Self:
        """Return a controller with given gains.

        Parameters
        ----------
        model : Model
        speeds : array_like, shape (k,)
            m/s.
        gains : array_like, shape (k, m, t)
            Gains of each of m commands, N m (N for a lateral actuator) per m/s^2 and per rad/s, in the
            order of ``terms_of``: for each sensor, the accelerometers and gyros of all bodies in turn,
            the reading unfiltered and through each low-pass filter.
        filters : Filters, optional
        period : float
            Control period, s.
        about : dict, optional
            Record of how the gains were found, kept in the file.

        Raises
        ------
        ParameterError
            If the model has no actuators, or the gains have the wrong shape.
        """
        vehicle = equipped(model)
        f = Filters() if filters is None else filters
        nodes = np.atleast_1d(np.asarray(speeds, dtype=float))
        terms = terms_of(vehicle, f)
        shape = (len(nodes), len(vehicle.command_names), len(terms))
        K = np.asarray(gains, dtype=float)
        if K.shape != shape or not np.isfinite(K).all():
            raise ParameterError(
                f"gains has shape {K.shape}; it must be {shape} finite numbers: at each speed, for "
                f"each of {', '.join(vehicle.command_names)}, those of {'; '.join(map(str, terms))}"
            )
        readings = readings_of(vehicle, "sensors", period)
        A, B, C, D = basis(vehicle, readings, f, period)
        k = len(nodes)
        law = Law.of(nodes, A=np.tile(A, (k, 1, 1)), B=np.tile(B, (k, 1, 1)), C=K @ C, D=K @ D)
        corners = {"washout": f.washout, "low_pass": list(f.low_pass)}
        told = {"filters": corners, "gains": K.tolist(), **(about or {})}
        limits = vehicle.limits
        return cls(law, readings, vehicle.command_names, limits, "sensors", period, told)


def basis(
    model: Equipped, readings: tuple[Reading, ...], filters: Filters, period: float
) -> tuple[Array, Array, Array, Array]:
    """Return the filters as a linear system from the readings to the terms.

    Shapes (n, n), (n, p), (t, n) and (t, p).
    """
    signals = [reading.signal for reading in readings]
    corners = len(filters.low_pass)
    n, p = len(model.sensor_names) * (1 + corners), len(signals)  # a state for each term
    A, B, C, D = np.zeros((n, n)), np.zeros((n, p)), np.zeros((n, n)), np.zeros((n, p))
    washout = low_pass_share(filters.washout, period)
    for k, y in enumerate(sensor_rows(model, signals)):
        mean = k * (1 + corners)
        # mean' = mean + washout (y - mean); low' = low + share ((y - mean) - low)
        A[mean, mean], B[mean] = 1.0 - washout, washout * y
        C[mean, mean], D[mean] = -1.0, y
        for low, corner in enumerate(filters.low_pass, start=mean + 1):
            share = low_pass_share(corner, period)
            A[low, low], A[low, mean], B[low] = 1.0 - share, -share, share * y
            C[low, low] = 1.0
    return A, B, C, D


def low_pass_share(corner: float, period: float) -> float:
    """Return the share of its distance from its input that a first-order filter moves in a period."""
    return 1.0 - math.exp(-2.0 * math.pi * corner * period)
