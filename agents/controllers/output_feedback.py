"""Structured feedback of what a bogie can measure: yaw rate and lateral acceleration, scheduled.

Each reading loses its mean in a washout (a first-order high-pass filter) and goes to the command twice,
as it is and through a first-order low-pass filter. Low-passed, the yaw rate is nearly the yaw angle and
the acceleration nearly the lateral velocity, so that the four gains weigh angle, rate, velocity and
acceleration of the frame. Gains are scheduled over speed; :func:`tune_output_feedback` finds them.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.controllers.controller import equipped, sensed_bodies
from agents.controllers.scheduled import CONTROL_PERIOD, Law, ScheduledController, readings_of
from railenv import Equipped, Model, checks
from railenv.envs.observation import Reading
from railenv.errors import ParameterError

Array = NDArray[np.float64]

GAINS = ("acceleration", "low-passed acceleration", "yaw rate", "low-passed yaw rate")
"""What the four gains of each actuator multiply: per m/s^2 and per rad/s."""


@dataclass(frozen=True, kw_only=True)
class Filters:
    """Corner frequencies, Hz.

    Attributes
    ----------
    washout : float
        Below it readings are not fed back.
    acceleration, yaw_rate : float
        Of the low-pass filters.
    """

    washout: float = 0.2
    acceleration: float = 1.0
    yaw_rate: float = 1.0

    def __post_init__(self) -> None:
        for name in ("washout", "acceleration", "yaw_rate"):
            checks.number(f"corner frequency {name}", getattr(self, name), low=0.0, open_low=True)


class OutputFeedback(ScheduledController):
    """Four scheduled gains on filtered yaw rate and lateral acceleration of the frame."""

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
        """Return one with given gains.

        Parameters
        ----------
        model : Model
            With yaw actuators only, and sensors on a body that each acts on (or on a single body).
        speeds : array_like, shape (k,)
            m/s.
        gains : array_like, shape (k, 4)
            N m per m/s^2 and per rad/s, in the order of ``GAINS``.
        filters : Filters, optional
        period : float
            Control period, s.
        about : dict, optional
            How the gains were found, kept in the file.

        Raises
        ------
        ParameterError
            If the model has other actuators or sensors, or the gains another shape.
        """
        vehicle = equipped(model)
        f = Filters() if filters is None else filters
        nodes = np.atleast_1d(np.asarray(speeds, dtype=float))
        K = np.atleast_2d(np.asarray(gains, dtype=float))
        if K.shape != (len(nodes), len(GAINS)) or not np.isfinite(K).all():
            raise ParameterError(
                f"gains has shape {K.shape}; it must be ({len(nodes)}, {len(GAINS)}) finite numbers: "
                f"{', '.join(GAINS)} at each speed"
            )
        readings = readings_of(vehicle, "sensors", period)
        A, B, C, D = basis(vehicle, readings, f, period)
        k = len(nodes)
        law = Law.of(
            nodes,
            A=np.tile(A, (k, 1, 1)),
            B=np.tile(B, (k, 1, 1)),
            C=np.einsum("ki,imn->kmn", K, C),
            D=np.einsum("ki,imn->kmn", K, D),
        )
        limits = vehicle.limits
        told = {"filters": asdict(f), "gains": K.tolist(), **(about or {})}
        return cls(law, readings, vehicle.command_names, limits, "sensors", period, told)


def basis(
    model: Equipped, readings: tuple[Reading, ...], filters: Filters, period: float
) -> tuple[Array, Array, Array, Array]:
    """Return the filters' A and B, and for each gain the C and D that it multiplies.

    Shapes (n, n), (n, p), (4, m, n) and (4, m, p).
    """
    signals = [reading.signal for reading in readings]
    m, p = len(model.command_names), len(signals)
    n = 4 * m
    gravity = model.gravity
    washout = _share(filters.washout, period)
    A, B = np.zeros((n, n)), np.zeros((n, p))
    C, D = np.zeros((len(GAINS), m, n)), np.zeros((len(GAINS), m, p))
    for c, body in enumerate(sensed_bodies(model, "output feedback")):
        for s, (kind, corner) in enumerate(
            (("accel", filters.acceleration), ("gyro", filters.yaw_rate))
        ):
            y = np.zeros(p)
            y[signals.index(f"{kind}_{body}")] = 1.0
            if kind == "accel":  # what cant deficiency puts in is known
                y[signals.index("cant_deficiency")] = gravity
            mean, low = 4 * c + 2 * s, 4 * c + 2 * s + 1
            share = _share(corner, period)
            # mean' = mean + washout (y - mean); low' = low + share ((y - mean) - low)
            A[mean, mean], B[mean] = 1.0 - washout, washout * y
            A[low, low], A[low, mean], B[low] = 1.0 - share, -share, share * y
            C[2 * s, c, mean], D[2 * s, c] = -1.0, y
            C[2 * s + 1, c, low] = 1.0
    return A, B, C, D


def _share(corner: float, period: float) -> float:
    """Return what a first-order filter moves by in a period, of its distance from its input."""
    return 1.0 - math.exp(-2.0 * math.pi * corner * period)
