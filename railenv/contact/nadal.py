"""Nadal's limit: the Y/Q up to which a wheel does not climb its flange."""

from __future__ import annotations

import math

from railenv.contact.laws import ContactLaw


def nadal(flange_angle: float, friction: float) -> float:
    """Return Nadal's limit of Y/Q, (tan g - mu) / (1 + mu tan g), for a flange angle g (rad).

    >>> import math
    >>> round(nadal(math.radians(70.0), 0.36), 2)
    1.2
    """
    steep = math.tan(flange_angle)
    return (steep - friction) / (1.0 + friction * steep)


def angle_of_flange(law: ContactLaw) -> float | None:
    """Return the angle (rad) of a wheel's flange; None if its contact law has no flange."""
    if law.flange_angle is None or not math.isfinite(law.flange_clearance or math.inf):
        return None
    return law.flange_angle
