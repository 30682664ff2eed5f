"""Hertz: the ellipse in which wheel and rail touch.

The closed form is that of Hertz (1882) as in K. L. Johnson, Contact Mechanics (1985), chapter 4,
written with Carlson's elliptic integrals, which are regular for a circle too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from railenv import checks
from railenv.errors import ParameterError

LARGEST_RATIO = 1e3
"""Ratio of the semi-axes, or its inverse, beyond which the contact is a line, not an ellipse."""


@dataclass(frozen=True)
class Material:
    """Elastic material of both wheel and rail.

    Attributes
    ----------
    youngs_modulus : float
        Pa.
    poissons_ratio : float

    Raises
    ------
    ParameterError
        If the modulus is not positive, or Poisson's ratio not within 0 to 0.5.
    """

    youngs_modulus: float
    poissons_ratio: float

    def __post_init__(self) -> None:
        checks.number("youngs_modulus", self.youngs_modulus, low=0.0, open_low=True, unit="Pa")
        checks.number("poissons_ratio", self.poissons_ratio, low=0.0, high=0.5)

    @classmethod
    def from_shear_modulus(cls, shear_modulus: float, poissons_ratio: float) -> Material:
        """Return the material with a shear modulus in Pa."""
        shear = checks.number("shear_modulus", shear_modulus, low=0.0, open_low=True, unit="Pa")
        ratio = checks.number("poissons_ratio", poissons_ratio, low=0.0, high=0.5)
        return cls(2.0 * shear * (1.0 + ratio), ratio)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus, Pa."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poissons_ratio))

    @property
    def contact_modulus(self) -> float:
        """Modulus of the contact of two such bodies, Pa: half of E / (1 - nu^2)."""
        return self.youngs_modulus / (2.0 * (1.0 - self.poissons_ratio**2))


STEEL = Material.from_shear_modulus(82e9, 0.28)
"""Wheels and rails, as in the examples of CONTACT: E = 210 GPa."""


@dataclass(frozen=True)
class ContactEllipse:
    """A Hertzian contact.

    Attributes
    ----------
    rolling, lateral : float
        Semi-axes (m) in the rolling direction (a) and across it (b).
    approach : float
        Approach of distant points of the two bodies, m.
    maximum_pressure : float
        Pressure in the middle, Pa.
    """

    rolling: float
    lateral: float
    approach: float
    maximum_pressure: float


def contact_ellipse(
    load: float, rolling_curvature: float, lateral_curvature: float, material: Material = STEEL
) -> ContactEllipse:
    """Return the contact of two bodies of one material from their relative curvatures.

    Parameters
    ----------
    load : float
        Normal force, N.
    rolling_curvature, lateral_curvature : float
        Sum of the two bodies' curvatures (1/m) in the rolling direction and across it; convex bodies
        count positive. They are principal curvatures: the bodies are not skewed.
    material : Material

    Raises
    ------
    ParameterError
        If the load or a curvature is not positive, or the curvatures differ so much that one
        semi-axis is more than 1000 times the other.
    """
    from scipy.optimize import brentq
    from scipy.special import elliprd, elliprf

    load = checks.number("load", load, low=0.0, open_low=True, unit="N")
    curvatures = {"rolling_curvature": rolling_curvature, "lateral_curvature": lateral_curvature}
    for name, value in curvatures.items():
        checks.number(name, value, low=0.0, open_low=True, unit="1/m")

    # A point of the gap A x^2 + B y^2 feels the potential of the pressure, whose quadratic terms are
    # A = c R_D(0, b^2, a^2), B = c R_D(0, a^2, b^2): their ratio gives a/b, their size the rest.
    def excess(log_ratio: float) -> float:
        square = math.exp(2.0 * log_ratio)
        return math.log(elliprd(0.0, 1.0, square) / elliprd(0.0, square, 1.0)) - wanted

    wanted = math.log(rolling_curvature / lateral_curvature)
    end = math.log(LARGEST_RATIO)
    if not excess(end) < 0.0 < excess(-end):
        lowest, highest = (math.exp(excess(place) + wanted) for place in (end, -end))
        raise ParameterError(
            f"rolling_curvature over lateral_curvature is {rolling_curvature / lateral_curvature:g}; "
            f"it must be from {lowest:.3g} to {highest:.3g}"
        )
    ratio = math.exp(brentq(excess, -end, end, xtol=1e-14))
    modulus = material.contact_modulus
    lateral = math.cbrt(load * elliprd(0.0, ratio**2, 1.0) / (math.pi * modulus * lateral_curvature))
    rolling = ratio * lateral
    return ContactEllipse(
        rolling=rolling,
        lateral=lateral,
        approach=1.5 * load * float(elliprf(0.0, rolling**2, lateral**2)) / (math.pi * modulus),
        maximum_pressure=1.5 * load / (math.pi * rolling * lateral),
    )


def wheel_ellipse(
    load: float,
    rolling_radius: float,
    crown_radius: float,
    profile_radius: float = math.inf,
    material: Material = STEEL,
) -> ContactEllipse:
    """Return the contact of a wheel with a rail that is straight along the track.

    Parameters
    ----------
    load : float
        Normal force, N.
    rolling_radius : float
        Rolling radius of the wheel, m.
    crown_radius : float
        Radius of the rail's head in its cross-section, m.
    profile_radius : float
        Radius of the wheel's profile in its cross-section, m: positive for convex, negative for
        hollow, ``math.inf`` for straight.
    material : Material

    Raises
    ------
    ParameterError
        If a radius is out of range, or the profile's hollow is as tight as the crown.
    """
    rolling_radius = checks.number("rolling_radius", rolling_radius, low=0.0, open_low=True, unit="m")
    crown_radius = checks.number("crown_radius", crown_radius, low=0.0, open_low=True, unit="m")
    hollow = 0.0
    if profile_radius not in (math.inf, -math.inf):
        profile_radius = checks.number("profile_radius", profile_radius, unit="m")
        if -crown_radius <= profile_radius <= 0.0:
            raise ParameterError(
                f"profile_radius is {profile_radius:g} m; it must be positive, infinite or below the "
                f"negative crown_radius, {-crown_radius:g} m, so that the wheel touches at one place"
            )
        hollow = 1.0 / profile_radius
    return contact_ellipse(load, 1.0 / rolling_radius, 1.0 / crown_radius + hollow, material)
