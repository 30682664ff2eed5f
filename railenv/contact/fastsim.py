"""FASTSIM: Kalker's algorithm for the simplified theory of rolling contact, for many cases at once.

The patch is cut into strips along the rolling direction, each into cells of equal length. From the
leading edge on, the stress of a strip grows with the rigid slip over a flexibility; wherever it
exceeds the traction bound it is cut down to it: the cell slips. There are three flexibilities, one for
each creepage, as in the published results of CONTACT; one mean flexibility would be wrong by a quarter
where lateral creepage and spin oppose each other. Their price: where longitudinal and lateral creepage
slide together, the force lies off their direction, F_x / F_y by the factor C11 / C22.

J. J. Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11
(1982) 1-13.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.contact.patch import ContactPatch
from railenv.errors import ParameterError, shown

Array = NDArray[np.float64]

Bound = Literal["parabolic", "elliptic"]
"""Traction bound. The parabolic one is Kalker's standard: it gives the right area of sticking. The
elliptic one is the Hertzian pressure times the friction coefficient."""


class CreepForces(NamedTuple):
    """Forces on the wheel in its contact plane, N, in the shape of the creepages."""

    longitudinal: Array
    lateral: Array


@dataclass(frozen=True)
class StressField:
    """Stresses in the contact, by strip and cell.

    Attributes
    ----------
    x, y : (n_strips, n_cells) arrays
        Middle of the cell (m): towards the leading edge, and lateral.
    longitudinal, lateral : (n_strips, n_cells) arrays
        Tangential stress on the wheel, Pa.
    bound : (n_strips, n_cells) array
        Largest stress that friction allows, Pa.
    slips : (n_strips, n_cells) array of bool
    """

    x: Array
    y: Array
    longitudinal: Array
    lateral: Array
    bound: Array
    slips: NDArray[np.bool_]


def fastsim(
    longitudinal_creepage: ArrayLike,
    lateral_creepage: ArrayLike,
    spin: ArrayLike,
    patch: ContactPatch,
    *,
    strips: int = 50,
    cells: int = 100,
    bound: Bound = "parabolic",
) -> CreepForces:
    """Return creep forces by FASTSIM.

    Signs are those of the linear theory: F_x = -f33 xi_x, F_y = -f11 xi_y - f12 spin for small
    creepages. The stress of a cell is that at its trailing end, as in Kalker's program, so that this
    slope comes out 1/``cells`` too steep.

    Parameters
    ----------
    longitudinal_creepage, lateral_creepage : array_like
        Dimensionless.
    spin : array_like
        1/m. The three are broadcast against each other.
    patch : ContactPatch
    strips, cells : int
        Strips of the patch, and cells of each.
    bound : {"parabolic", "elliptic"}

    Returns
    -------
    CreepForces
        N, as arrays in the broadcast shape.

    Raises
    ------
    ParameterError
        If a creepage is not a finite number, the shapes do not match, or an option is unknown.
    """
    found = creepages(longitudinal_creepage, lateral_creepage, spin)
    shape = found[0].shape
    flat = [c.reshape(-1, 1) for c in found]
    longitudinal, lateral = np.zeros(flat[0].size), np.zeros(flat[0].size)
    for column in _columns(flat, patch, strips, cells, bound):
        longitudinal += (column.longitudinal * column.area).sum(axis=1)
        lateral += (column.lateral * column.area).sum(axis=1)
    return CreepForces(longitudinal.reshape(shape), lateral.reshape(shape))


def stress_field(
    longitudinal_creepage: float,
    lateral_creepage: float,
    spin: float,
    patch: ContactPatch,
    *,
    strips: int = 50,
    cells: int = 100,
    bound: Bound = "parabolic",
) -> StressField:
    """Return the stresses of one case; arguments and errors are those of :func:`fastsim`."""
    values = {
        "longitudinal_creepage": longitudinal_creepage,
        "lateral_creepage": lateral_creepage,
        "spin": spin,
    }
    flat = [np.array([[checks.number(name, value)]]) for name, value in values.items()]
    columns = list(_columns(flat, patch, strips, cells, bound))
    longitudinal, lateral, slips = (
        np.stack([getattr(c, name)[0] for c in columns], axis=1)
        for name in ("longitudinal", "lateral", "slips")
    )
    x, limit = (np.stack([getattr(c, name) for c in columns], axis=1) for name in ("x", "bound"))
    y = np.repeat(columns[0].y[:, None], len(columns), axis=1)
    return StressField(x, y, longitudinal, lateral, limit, slips)


class _Column(NamedTuple):
    """One cell of every strip, at the same number from the leading edge, for all cases."""

    x: Array
    y: Array
    area: Array
    longitudinal: Array
    lateral: Array
    bound: Array
    slips: NDArray[np.bool_]


def _columns(
    cases: list[Array],
    patch: ContactPatch,
    strips: int,
    cells: int,
    bound: str,
) -> Iterator[_Column]:
    """Go through the patch from its leading edge; each creepage has the shape (n_cases, 1)."""
    strips, cells = checks.whole("strips", strips), checks.whole("cells", cells)
    checks.choice("bound", bound, get_args(Bound))
    a, b = patch.rolling, patch.lateral
    width = 2.0 * b / strips
    y = width * (np.arange(strips, dtype=np.float64) + 0.5) - b
    edge = a * np.sqrt(1.0 - (y / b) ** 2)
    length = 2.0 * edge / cells
    for_x, for_y, for_spin = _flexibilities(patch)
    along, across, turning = cases[0] / for_x, cases[1] / for_y, cases[2] / for_spin
    largest = patch.adhesion / (math.pi * a * b) * (2.0 if bound == "parabolic" else 1.5)
    power = 1.0 if bound == "parabolic" else 0.5
    longitudinal = lateral = np.zeros((len(cases[0]), strips))
    for i in range(cells):
        x = edge - (i + 0.5) * length
        limit = largest * np.maximum(1.0 - (x / a) ** 2 - (y / b) ** 2, 0.0) ** power
        longitudinal = longitudinal - length * (along - y * turning)
        lateral = lateral - length * (across + x * turning)
        size = np.hypot(longitudinal, lateral)
        slips = size > limit
        kept = np.where(slips, limit / np.where(slips, size, 1.0), 1.0)
        longitudinal, lateral = kept * longitudinal, kept * lateral
        yield _Column(x, y, width * length, longitudinal, lateral, limit, slips)


def _flexibilities(patch: ContactPatch) -> tuple[float, float, float]:
    """Return Kalker's three flexibilities (m/Pa), which give the slopes of the linear theory."""
    a, b, shear = patch.rolling, patch.lateral, patch.material.shear_modulus
    c = patch.kalker
    return (
        8.0 * a / (3.0 * c.c11 * shear),
        8.0 * a / (3.0 * c.c22 * shear),
        math.pi * a * math.sqrt(a / b) / (4.0 * c.c23 * shear),
    )


def creepages(longitudinal: ArrayLike, lateral: ArrayLike, spin: ArrayLike) -> list[Array]:
    """Return creepages as arrays of one shape.

    Raises
    ------
    ParameterError
        If an entry is not a finite number, or the shapes do not match.
    """
    named = {"longitudinal_creepage": longitudinal, "lateral_creepage": lateral, "spin": spin}
    found = []
    for name, value in named.items():
        try:
            numbers = np.asarray(value, dtype=float)
        except (OverflowError, TypeError, ValueError):
            raise ParameterError(
                f"{name} is {shown(value)}, which is not an array of numbers"
            ) from None
        if not np.isfinite(numbers).all():
            raise ParameterError(f"{name} is {shown(value)}; every entry must be finite")
        found.append(numbers)
    try:
        return list(np.broadcast_arrays(*found))
    except ValueError:
        shapes = ", ".join(f"{n} {v.shape}" for n, v in zip(named, found, strict=True))
        raise ParameterError(f"shapes are {shapes}; they must go together") from None
