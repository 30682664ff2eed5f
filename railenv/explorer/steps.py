"""The resolution of the page's results and of its scripts, set once for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from railenv.explorer.state import State

SPEEDS = 41
"""Number of speeds of the eigenvalue locus."""

POINTS = 150
"""Largest number of points of a branch of limit cycles."""

PIECE = 5
"""Points of it between two checks whether it is still wanted."""

DIAGRAM_OFFSETS = (1e-3, 4e-3, 8e-3)
"""Lateral displacements (m) of all bodies at the start of simulations for a closed loop's diagram."""

_DIAGRAM_SPEEDS = 20


def diagram_speeds(state: State) -> list[float]:
    """Return the speeds (m/s) at which a closed loop is simulated for its diagram."""
    low, high = state.speed_range
    return np.linspace(low, high, _DIAGRAM_SPEEDS).tolist()
