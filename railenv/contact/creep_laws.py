"""Creep forces of one contact patch by the laws that a vehicle uses, and by FASTSIM."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.contact.fastsim import CreepForces, creepages, fastsim
from railenv.contact.patch import ContactPatch
from railenv.equations.creep import heuristic, polach

Law = Literal["kalker", "heuristic", "polach", "fastsim"]
"""Kalker's linear theory, the paper's heuristic law (eqs 2 and 3), Polach's with both reductions 1, and
FASTSIM."""

LAWS: tuple[Law, ...] = get_args(Law)

_CELLS = 400  # of a strip of FASTSIM, whose slope is 1/400 too steep then
_SMALLEST = 1e-9  # beta: Polach's law divides by it


def creep_forces(
    law: Law,
    longitudinal_creepage: ArrayLike,
    lateral_creepage: ArrayLike,
    spin: ArrayLike,
    patch: ContactPatch,
) -> CreepForces:
    """Return the creep forces on the wheel by one of the laws.

    All laws but FASTSIM take Kalker's linear forces of the patch times the share that
    ``railenv.equations.creep`` gives.

    Parameters
    ----------
    law : {"kalker", "heuristic", "polach", "fastsim"}
    longitudinal_creepage, lateral_creepage : array_like
        Dimensionless.
    spin : array_like
        1/m. The three are broadcast against each other.
    patch : ContactPatch

    Raises
    ------
    ParameterError
        If the law is unknown, a creepage is not finite or the shapes do not match.
    """
    checks.choice("law", law, LAWS)
    if law == "fastsim":
        return fastsim(longitudinal_creepage, lateral_creepage, spin, patch, cells=_CELLS)
    along, across, turning = creepages(longitudinal_creepage, lateral_creepage, spin)
    f = patch.creep_coefficients
    longitudinal = -f.longitudinal_creep * along
    lateral = -f.lateral_creep * across - f.lateral_spin_creep * turning
    if law == "kalker":
        return CreepForces(longitudinal, lateral)
    share = _share(law, np.hypot(longitudinal, lateral) / patch.adhesion)
    return CreepForces(share * longitudinal, share * lateral)


def _share(law: Law, beta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share entry by entry, by a law written for scalars."""
    one: Callable[[float], float]
    if law == "heuristic":
        one = heuristic
    else:

        def one(value: float) -> float:
            return polach(max(value, _SMALLEST), 1.0, 1.0)

    return np.array([one(value) for value in beta.ravel().tolist()]).reshape(beta.shape)
