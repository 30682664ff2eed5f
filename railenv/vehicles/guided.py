"""What analyses and environments know of a body that the rails guide."""

from __future__ import annotations

import math
from typing import NamedTuple

KINEMATIC_AMPLITUDE = 3e-3
"""m, lateral amplitude at which the conicity of a vehicle is told (EN 15302)."""


class Guided(NamedTuple):
    """A wheelset of a model: where it is, how far it may move, and which states and inputs are its own.

    Attributes
    ----------
    name : str
    x : float
        Place along the vehicle, m.
    clearance : float
        Flange clearance, m.
    half_gauge, wheel_radius, conicity : float
        m, m, 1.
    y, psi, dy : str
        States.
    rails : tuple of str
        Inputs that displace the rails under it: align, vert, cross; none where the model has none.
    """

    name: str
    x: float
    clearance: float
    half_gauge: float
    wheel_radius: float
    conicity: float
    y: str
    psi: str
    dy: str
    rails: tuple[str, ...]

    @property
    def wavelength(self) -> float:
        """Wavelength of its kinematic oscillation (Klingel), m."""
        return klingel_wavelength(self.half_gauge, self.wheel_radius, self.conicity)


def klingel_wavelength(half_gauge: float, wheel_radius: float, conicity: float) -> float:
    """Wavelength (m) of a free wheelset's kinematic oscillation, 2 pi sqrt(a r_0 / lambda)."""
    return 2.0 * math.pi * math.sqrt(half_gauge * wheel_radius / conicity)
