"""The whole coach beside its bogie under a body at rest, for the claims on the body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from design.reproduction.cases import COACH
from design.reproduction.store import Piece
from design.stability.critical_speed import critical_speed
from design.stability.mode_shape import ModeShape
from design.stability.mode_table import modes
from railenv.models import Bogie, Coach
from railenv.vehicles import Vehicle

LOW_SPEED = 20.0
"""m/s, far below any critical speed."""

LOW_CONICITY = 0.02
"""Conicity of wheels on which the coach's body hunts."""

DAMPING = (0.0, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Secondary lateral damping, as multiples of the coach's own."""


def body_moves() -> Piece:
    """Return critical speeds and the hunting mode at low speed, with the body at rest and moving."""
    inputs = {"vehicle": COACH.vehicle, "low_speed": LOW_SPEED}
    return Piece("body-moves", beside_body_at_rest, inputs, "the body's part in hunting")


def body_damping() -> Piece:
    """Return the speeds at which the coach on low conicity hunts, over its secondary damping."""
    vehicle = COACH.vehicle.replace(conicity=LOW_CONICITY)
    inputs = {"vehicle": vehicle, "factors": list(DAMPING)}
    return Piece("body-damping", over_damping, inputs, "body hunting over damping")


def beside_body_at_rest(vehicle: Vehicle, low_speed: float) -> dict[str, dict[str, Any]]:
    """Compare a bogie under a body at rest with the whole vehicle, tangent track.

    Returns
    -------
    dict
        By "at rest" and "moving": speed (m/s) and frequency (Hz) at which hunting sets in; frequency
        and damping ratio of the hunting mode at the low speed, the least damped one.
    """
    return {
        name: {
            **_onset(model),
            **_hunting_mode([m for m in modes(model, speed=low_speed) if "hunting" in m.name]),
        }
        for name, model in (("at rest", Bogie(vehicle)), ("moving", Coach(vehicle)))
    }


def over_damping(vehicle: Vehicle, factors: Sequence[float]) -> list[dict[str, Any]]:
    """Find the speeds at which a vehicle starts to hunt with multiples of its secondary damping.

    Returns
    -------
    list of dict
        speed (m/s; None if it does not hunt), frequency (Hz), mode (its name).
    """
    own = vehicle.secondary_lateral_damping
    return [_onset(Coach(vehicle.replace(secondary_lateral_damping=k * own))) for k in factors]


def _onset(model: Bogie | Coach) -> dict[str, Any]:
    found = critical_speed(model)
    shape = found.mode_shape
    return {
        "speed": found.speed,
        "frequency": found.frequency,
        "mode": None if shape is None else shape.name,
    }


def _hunting_mode(shapes: Sequence[ModeShape]) -> dict[str, float]:
    least = min(shapes, key=lambda shape: shape.damping)
    return {"low_frequency": least.frequency, "low_damping": least.damping}
