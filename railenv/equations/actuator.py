"""Actuated yaw damper: force limit, second-order lag, and a passive damper in parallel.

An actuator is commanded a moment; its transport delay lies before the lag, in whoever commands it. Its
two states are the moment that it develops and that moment's rate.
"""

from __future__ import annotations

from typing import NamedTuple

from railenv.equations.functions import Scalar, sqrt, where_positive

TWO_PI = 6.283185307179586


class ActuatorState(NamedTuple):
    """Moment (N m) and its rate (N m/s) inside one actuator."""

    moment: Scalar
    rate: Scalar


def clamp(x: Scalar, limit: Scalar) -> Scalar:
    """``x`` within [-limit, limit]."""
    return where_positive(x - limit, limit, where_positive(-x - limit, -limit, x))


def actuator_rates(state: ActuatorState, command: Scalar, p: Scalar) -> list[Scalar]:
    """Time derivatives of an actuator's states: a second-order lag with a limited rate."""
    omega = TWO_PI * p.actuator_bandwidth
    acceleration = omega * (
        omega * (clamp(command, p.actuator_limit) - state.moment)
        - 2.0 * p.actuator_damping * state.rate
    )
    return [clamp(state.rate, p.actuator_rate_limit), acceleration]


def applied_moment(state: ActuatorState, p: Scalar) -> Scalar:
    """Moment (N m; of a lateral one N) that it applies; its lag may overshoot, its force may not."""
    return clamp(state.moment, p.actuator_limit)


def parallel_damper_moment(yaw_rate: Scalar, p: Scalar) -> Scalar:
    """Moment (N m) of the two passive dampers beside the actuators against a yaw rate (rad/s).

    Each is linear up to about its force limit, then flat.
    """
    linear = p.parallel_damping * p.actuator_arm * yaw_rate
    share = linear / p.parallel_force_limit
    return -2.0 * p.actuator_arm * linear / sqrt(1.0 + share * share)


def parallel_damper_force(speed: Scalar, p: Scalar) -> Scalar:
    """Force (N) of the passive damper beside a lateral actuator against a speed (m/s).

    It is linear up to about its force limit, then flat.
    """
    linear = p.parallel_damping * speed
    share = linear / p.parallel_force_limit
    return -linear / sqrt(1.0 + share * share)
