"""The speed at which a curve uses up all adhesion."""

from __future__ import annotations

import math

from design.reproduction.cases import Case


def adhesion_limit(case: Case, radius: float, cant: float) -> float:
    """Return the speed (m/s) at which the lateral load of a curve equals the friction of all wheels.

    V = sqrt(R (mu N / m + g cant)), with the vertical load N and the mass m that is pushed sideways
    summed over all bodies of the model. Beyond it no creep force holds a wheelset on the tread.
    """
    assembly = case.model.assembly
    vehicle = assembly.with_numbers(assembly.values)
    carrying = [body for body in vehicle.bodies if vehicle.coordinates[body.name]]
    vertical = sum(body.vertical_load_mass for body in carrying)
    lateral = sum(body.lateral_load_mass for body in carrying)
    friction = vehicle.wheelsets[0].friction
    return math.sqrt(radius * vehicle.gravity * (friction * vertical / lateral + cant))
