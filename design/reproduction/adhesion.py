"""The speed at which a curve uses up all adhesion."""

from __future__ import annotations

import math

from design.reproduction.cases import Case


def adhesion_limit(case: Case, radius: float, cant: float) -> float:
    """Return the speed (m/s) at which the lateral load of a curve equals the friction of all wheels.

    V = sqrt(R (mu N / m + g cant)), with the vertical load N and the mass m that is pushed sideways
    summed over all bodies of the model. Beyond it no creep force holds a wheelset on the tread.
    """
    model = case.model
    moving = [
        body
        for body in model.equations.assembly.with_numbers(model.parameters).bodies
        if body.name in model.body_names
    ]
    ratio = sum(b.vertical_load_mass for b in moving) / sum(b.lateral_load_mass for b in moving)
    return math.sqrt(radius * model.gravity * (case.vehicle.friction * ratio + cant))
