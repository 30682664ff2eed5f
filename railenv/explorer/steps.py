"""How finely the page computes, said once for its results and its scripts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from railenv.explorer.state import State

SPEEDS = 41
"""Of the eigenvalue locus."""

POINTS = 150
"""Most points of a branch of limit cycles."""

PIECE = 5
"""Points of it between two looks at whether it is still wanted."""

DIAGRAM_OFFSETS = (1e-3, 4e-3, 8e-3)
"""m, lateral, of all bodies at the start of the simulations of a closed loop's diagram."""

_DIAGRAM_SPEEDS = 20


def diagram_speeds(state: State) -> list[float]:
    """Return the speeds (m/s) at which a closed loop is simulated for its diagram."""
    low, high = state.speed_range
    return np.linspace(low, high, _DIAGRAM_SPEEDS).tolist()
