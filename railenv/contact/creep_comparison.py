"""Comparison of creep laws with FASTSIM on one patch: forces over creepage, and deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.contact.creep_laws import LAWS, Law, creep_forces
from railenv.contact.patch import ContactPatch
from railenv.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Direction = Literal["longitudinal", "lateral"]

_SPINS = (0.0, 0.5, 2.0)  # 1/m: none, a worn tread (contact angle 0.23 rad), a flange of 66 degrees
_WIDEST = 3.0  # largest creepage, over the one where the linear theory reaches the adhesion limit


@dataclass(frozen=True)
class CreepComparison:
    """Creep forces by all laws over creepage and spin.

    Attributes
    ----------
    patch : ContactPatch
    creepage : (n,) array
        Dimensionless, from a negative largest value to the positive one.
    spin : (m,) array
        1/m.
    longitudinal : mapping of str to (m, n) array
        By law: longitudinal force (N) over longitudinal creepage, without lateral creepage.
    lateral : mapping of str to (m, n) array
        By law: lateral force (N) over lateral creepage, without longitudinal creepage.
    """

    patch: ContactPatch
    creepage: NDArray[np.float64]
    spin: NDArray[np.float64]
    longitudinal: Mapping[str, NDArray[np.float64]]
    lateral: Mapping[str, NDArray[np.float64]]

    def deviation(self, law: Law, direction: Direction, spin: float) -> float:
        """Return the largest difference of a law from FASTSIM, over the adhesion limit mu N.

        Parameters
        ----------
        law : {"kalker", "heuristic", "polach", "fastsim"}
        direction : {"longitudinal", "lateral"}
            Of creepage and force.
        spin : float
            One of those compared, 1/m.

        Raises
        ------
        ParameterError
            If one of them was not compared.
        """
        checks.choice("law", law, LAWS)
        checks.choice("direction", direction, ("longitudinal", "lateral"))
        found = np.flatnonzero(self.spin == spin)
        if not found.size:
            allowed = ", ".join(f"{value:g}" for value in self.spin)
            raise ParameterError(f"spin is {spin:g} 1/m; it must be one of those compared: {allowed}")
        forces = self.longitudinal if direction == "longitudinal" else self.lateral
        difference = forces[law][found[0]] - forces["fastsim"][found[0]]
        return float(np.abs(difference).max() / self.patch.adhesion)

    def plot(self) -> Figure:
        """Draw the forces over creepage: longitudinal without spin, and lateral at each spin."""
        from railenv.contact.creep_plots import plot_comparison

        return plot_comparison(self)


def compare_creep_laws(
    patch: ContactPatch,
    spin: Sequence[float] = _SPINS,
    *,
    largest: float | None = None,
    points: int = 61,
) -> CreepComparison:
    """Compute creep forces by all laws over creepage.

    Parameters
    ----------
    patch : ContactPatch
    spin : sequence of float
        1/m.
    largest : float, optional
        Largest creepage; by default three times that at which the linear force reaches the adhesion
        limit.
    points : int
        Of each curve.

    Raises
    ------
    ParameterError
        If an argument is out of range.
    """
    spins = checks.numbers("spin", spin)
    points = checks.whole("points", points, low=2)
    if largest is None:
        f = patch.creep_coefficients
        largest = _WIDEST * patch.adhesion / min(f.longitudinal_creep, f.lateral_creep)
    largest = checks.number("largest", largest, low=0.0, open_low=True)
    creepage = np.linspace(-largest, largest, points)
    turning = spins[:, None]
    return CreepComparison(
        patch,
        creepage,
        spins,
        {law: creep_forces(law, creepage, 0.0, turning, patch).longitudinal for law in LAWS},
        {law: creep_forces(law, 0.0, creepage, turning, patch).lateral for law in LAWS},
    )
