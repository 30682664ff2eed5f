"""Data of a body guided by the rails, for analyses and environments."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from railenv.contact.laws import ContactLaw

KINEMATIC_AMPLITUDE = 3e-3
"""Lateral amplitude (m) at which the conicity of a vehicle is stated (EN 15302)."""


class Guided(NamedTuple):
    """A wheelset of a model: its place, its clearance, its states and its inputs.

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
        Inputs that displace the rails under it: align, vert, cross; none if the model has none.
    z, phi : str, optional
        Further states, if there are any.
    laws : tuple of ContactLaw, optional
        Contact laws of the left and right wheel, if known.
    friction : float, optional
        Friction coefficient of wheel and rail, if known.
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
    z: str | None = None
    phi: str | None = None
    laws: tuple[ContactLaw, ContactLaw] | None = None
    friction: float | None = None

    @property
    def wavelength(self) -> float:
        """Wavelength of its kinematic oscillation (Klingel), m."""
        return klingel_wavelength(self.half_gauge, self.wheel_radius, self.conicity)


def klingel_wavelength(half_gauge: float, wheel_radius: float, conicity: float) -> float:
    """Return the kinematic wavelength (m) of a free wheelset, 2 pi sqrt(a r_0 / lambda)."""
    return 2.0 * math.pi * math.sqrt(half_gauge * wheel_radius / conicity)
