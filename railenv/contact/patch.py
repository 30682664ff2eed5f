"""A loaded contact patch between wheel and rail, for which creep forces are computed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from railenv import checks
from railenv.contact.hertz import LARGEST_RATIO, STEEL, Material, wheel_ellipse
from railenv.contact.kalker import (
    CreepCoefficients,
    KalkerCoefficients,
    creep_coefficients,
    kalker_coefficients,
)
from railenv.errors import ParameterError

_LARGEST_FRICTION = 2.0


@dataclass(frozen=True)
class ContactPatch:
    """An elliptic contact with its load and friction.

    Attributes
    ----------
    rolling, lateral : float
        Semi-axes (m) in the rolling direction (a) and across it (b).
    load : float
        Normal force, N.
    friction : float
        Friction coefficient, the same for sticking and sliding.
    material : Material
        Material of both bodies.

    Raises
    ------
    ParameterError
        If a number is out of range, or one semi-axis more than 1000 times the other.
    """

    rolling: float
    lateral: float
    load: float
    friction: float
    material: Material = STEEL

    def __post_init__(self) -> None:
        for name in ("rolling", "lateral"):
            checks.number(f"{name} semi-axis", getattr(self, name), low=0.0, open_low=True, unit="m")
        checks.number("load", self.load, low=0.0, open_low=True, unit="N")
        checks.number("friction", self.friction, low=0.0, high=_LARGEST_FRICTION, open_low=True)
        ratio = self.rolling / self.lateral
        if not 1.0 / LARGEST_RATIO <= ratio <= LARGEST_RATIO:
            raise ParameterError(
                f"rolling over lateral semi-axis is {ratio:g}; it must be from "
                f"{1.0 / LARGEST_RATIO:g} to {LARGEST_RATIO:g}"
            )

    @classmethod
    def of_wheel(
        cls,
        load: float,
        rolling_radius: float,
        crown_radius: float,
        friction: float,
        profile_radius: float = math.inf,
        material: Material = STEEL,
    ) -> ContactPatch:
        """Return the patch of :func:`railenv.contact.hertz.wheel_ellipse`, with its arguments."""
        ellipse = wheel_ellipse(load, rolling_radius, crown_radius, profile_radius, material)
        return cls(ellipse.rolling, ellipse.lateral, load, friction, material)

    @property
    def adhesion(self) -> float:
        """Largest force that the contact transmits, mu N, in N."""
        return self.friction * self.load

    @property
    def kalker(self) -> KalkerCoefficients:
        """Kalker's coefficients of the ellipse."""
        return kalker_coefficients(self.rolling / self.lateral, self.material.poissons_ratio)

    @property
    def creep_coefficients(self) -> CreepCoefficients:
        """Creep coefficients, named as the fields of a vehicle."""
        return creep_coefficients(self.rolling, self.lateral, self.material)
