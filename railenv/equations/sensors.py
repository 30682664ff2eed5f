"""What sensors on a body read: lateral specific force and yaw rate, through first-order filters."""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations.actuator import TWO_PI
from railenv.equations.coordinates import Motion, Running
from railenv.equations.functions import Scalar


class SensorState(NamedTuple):
    """Filtered readings: specific force (m/s^2) and yaw rate (rad/s)."""

    accelerometer: Scalar
    gyro: Scalar


def specific_force(lateral_acceleration: Scalar, body: Motion, run: Running, gravity: Scalar) -> Scalar:
    """Return the reading (m/s^2) of an ideal lateral accelerometer fixed to a rolling body."""
    uncompensated = run.speed * run.speed * run.curvature - gravity * run.cant
    return lateral_acceleration - uncompensated + gravity * body.phi


def inertial_yaw_rate(body: Motion, run: Running) -> Scalar:
    """Return the reading (rad/s) of an ideal yaw gyro: the track frame itself turns on a curve."""
    return body.dpsi - run.speed * run.curvature


def sensor_rates(state: SensorState, force: Scalar, rate: Scalar, p: Scalar) -> list[Scalar]:
    """Time derivatives of the filtered readings of a specific force and a yaw rate."""
    return [
        TWO_PI * p.accelerometer_bandwidth * (force - state.accelerometer),
        TWO_PI * p.gyro_bandwidth * (rate - state.gyro),
    ]
