"""Kalker's linear theory of rolling contact: coefficients of the ellipse, and of the vehicle record.

Force and moment on the wheel, with the creepages xi_x, xi_y and the spin phi (1/m):
F_x = -G a b C11 xi_x, F_y = -G a b C22 xi_y - G (a b)^1.5 C23 phi,
M_z = G (a b)^1.5 C23 xi_y - G (a b)^2 C33 phi.
"""

from __future__ import annotations

import csv
import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.contact.hertz import LARGEST_RATIO, STEEL, Material

_TABLE = Path(__file__).resolve().parent / "data" / "kalker_coefficients.csv"
_RATIOS = ("0", "0.25", "0.5")  # Poisson's, as the columns of the table name them
_END = 0.1  # slenderness at which the table ends


class KalkerCoefficients(NamedTuple):
    """Creepage and spin coefficients, dimensionless."""

    c11: float
    c22: float
    c23: float
    c33: float


class CreepCoefficients(NamedTuple):
    """Creep coefficients of one wheel, named as the fields of the vehicle.

    Attributes
    ----------
    longitudinal_creep, lateral_creep : float
        f33 and f11, N.
    lateral_spin_creep : float
        f12, N m.
    spin_creep : float
        f22, N m^2.
    """

    longitudinal_creep: float
    lateral_creep: float
    lateral_spin_creep: float
    spin_creep: float


def kalker_coefficients(ratio: float, poissons_ratio: float) -> KalkerCoefficients:
    """Return Kalker's coefficients of an ellipse.

    Between the entries of the table (a/b from 0.1 to 10) the inverse coefficients, which are
    flexibilities, are interpolated: linearly over the slenderness (the smaller of a/b and b/a) and by a
    parabola over Poisson's ratio; C33 itself is interpolated because it is nearly linear in it. Beyond
    the table Kalker's asymptotic formulas hold, scaled to meet its end; the scale (at most 7 %,
    mostly below 3 %) fades with the slenderness.

    Parameters
    ----------
    ratio : float
        Semi-axis in the rolling direction over the lateral one, a/b, from 1/1000 to 1000.
    poissons_ratio : float
        From 0 to 0.5.

    Raises
    ------
    ParameterError
        If one of them is out of range.

    Notes
    -----
    C11, C22, C23: Kalker 1990, table E.3. C33 and the asymptotic formulas: Kalker 1967.
    """
    ratio = checks.number(
        "ratio of the semi-axes a/b", ratio, low=1.0 / LARGEST_RATIO, high=LARGEST_RATIO
    )
    nu = checks.number("poissons_ratio", poissons_ratio, low=0.0, high=0.5)
    across = ratio <= 1.0
    slenderness = ratio if across else 1.0 / ratio
    found = _interpolated(across, max(slenderness, _END), nu)
    if slenderness < _END:
        scale = found / _asymptotic(across, _END, nu)
        fading = 1.0 + (scale - 1.0) * slenderness / _END
        found = fading * _asymptotic(across, slenderness, nu)
    return KalkerCoefficients(*found.tolist())


def creep_coefficients(rolling: float, lateral: float, material: Material = STEEL) -> CreepCoefficients:
    """Return the creep coefficients of a contact between two bodies of one material.

    With the load of a Hertzian contact they grow as N^(2/3), the lateral/spin coefficient as N and the
    spin coefficient as N^(4/3).

    Parameters
    ----------
    rolling, lateral : float
        Semi-axes (m) in the rolling direction (a) and across it (b).
    material : Material

    Raises
    ------
    ParameterError
        If a semi-axis is not positive, or the ellipse too slender.
    """
    a = checks.number("rolling semi-axis", rolling, low=0.0, open_low=True, unit="m")
    b = checks.number("lateral semi-axis", lateral, low=0.0, open_low=True, unit="m")
    c = kalker_coefficients(a / b, material.poissons_ratio)
    stiffness, size = material.shear_modulus * a * b, math.sqrt(a * b)
    return CreepCoefficients(
        longitudinal_creep=stiffness * c.c11,
        lateral_creep=stiffness * c.c22,
        lateral_spin_creep=stiffness * size * c.c23,
        spin_creep=stiffness * size * size * c.c33,
    )


@lru_cache
def _table(across: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return slenderness (n,) and coefficients (n, 4, 3) of one half of the table."""
    with _TABLE.open(encoding="utf-8", newline="") as stream:
        rows = [r for r in csv.DictReader(stream) if r["which"] == ("a/b" if across else "b/a")]
    slenderness = np.array([float(r["ratio"]) for r in rows])
    names = KalkerCoefficients._fields
    values = np.array([[[float(r[f"{c}_nu{nu}"]) for nu in _RATIOS] for c in names] for r in rows])
    slenderness.setflags(write=False)
    values.setflags(write=False)
    return slenderness, values


def _interpolated(across: bool, slenderness: float, nu: float) -> NDArray[np.float64]:
    places, values = _table(across)
    parabola = np.array([(4 * nu - 1) * (2 * nu - 1), 8 * nu * (1 - 2 * nu), nu * (8 * nu - 2)])
    inverse = (1.0 / values) @ parabola
    inverse[:, 3] = 1.0 / (values[:, 3] @ parabola)
    return np.array([1.0 / np.interp(slenderness, places, column) for column in inverse.T])


def _asymptotic(across: bool, g: float, nu: float) -> NDArray[np.float64]:
    """Return Kalker's coefficients of a very slender ellipse."""
    if across:
        c11 = math.pi**2 / (4.0 * (1.0 - nu))
        c22 = math.pi**2 / 4.0
        c23 = math.pi * math.sqrt(g) / (3.0 * (1.0 - nu)) * (1.0 + nu * (math.log(16.0 / g) - 5.0))
        return np.array([c11, c22, c23, math.pi**2 / (16.0 * (1.0 - nu) * g)])
    long = math.log(16.0 / g**2)
    rolling, lateral = long - 2.0 * nu, (1.0 - nu) * long + 2.0 * nu
    spin = (1.0 - nu) * long - 2.0 + 4.0 * nu
    more = 3.0 - math.log(4.0)
    c11 = 2.0 * math.pi / (rolling * g) * (1.0 + more / rolling)
    c22 = 2.0 * math.pi / (lateral * g) * (1.0 + (1.0 - nu) * more / lateral)
    c23 = 2.0 * math.pi / (3.0 * g**1.5 * spin)
    return np.array([c11, c22, c23, math.pi / 4.0 * (1.0 - nu * (long - 2.0) / spin)])
