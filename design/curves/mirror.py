"""The mirror image of a model: the states that change their sign."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from design.curves.plane import Plane
from design.cycles.shooting import Shooting
from railenv.errors import ParameterError

Array = NDArray[np.float64]

_SAME = 1e-6  # relative difference of slopes
_MIRRORED = 1e-2  # of the amplitude
_STILL = 1e-6  # of the model's scale


def mirror_signs(plane: Plane, states: Array, period: float) -> Array:
    """Return 1 for each state that a motion repeats after half a period, -1 for one it mirrors.

    The equations must be the same for the mirror image, within the ranges of both parameters. If that
    does not determine states at rest, their signs are those that bring a multiplier of half a period
    to -1.

    Parameters
    ----------
    plane : Plane
    states : ndarray, shape (steps + 1, n_states)
        One period of a motion that is its own mirror image half a period later, and may lose this.
    period : float
        s.

    Raises
    ------
    ParameterError
        If there is no such mirror image.
    """
    scale = plane.model.scale
    samples = states[:-1]
    half = (np.arange(len(samples)) + len(samples) / 2.0) % len(samples)
    at = np.arange(len(states))
    later = np.stack([np.interp(half, at, column) for column in states.T], axis=1)
    apart = [np.abs(later - sign * samples).max(axis=0) for sign in (1.0, -1.0)]
    signs = np.where(apart[0] <= apart[1], 1.0, -1.0)
    size = np.ptp(states, axis=0) + np.abs(states).max(axis=0)
    still = size < _STILL * scale
    if not (np.minimum(*apart) > _MIRRORED * size)[~still].any():
        choices = [np.where(still, sign, signs) for sign in (1.0, -1.0)]
        held = [choice for choice in choices if _holds(plane, choice, states)]
        if held:
            return min(held, key=lambda choice: _off_flip(plane, choice, states, period))
    raise ParameterError(
        f"{plane.model.name} and its mirror image do not obey the same equations in the whole plane of "
        f"{' and '.join(plane.parameters)}, so no curve of symmetry breaking points lies in it"
    )


def _holds(plane: Plane, signs: Array, states: Array) -> bool:
    """Return whether equations are the same for the mirror image, at the corners of the plane."""
    shooting = Shooting(plane, 1)
    rng = np.random.default_rng(0)
    for value in product(*plane.ranges):
        for x in (states[0], states[len(states) // 3]):
            x = x + 0.1 * plane.model.scale * rng.uniform(-1.0, 1.0, len(x))
            one, other = shooting.slope(x, value), signs * shooting.slope(signs * x, value)
            if not np.abs(one - other).max() <= _SAME * np.abs(one).max():
                return False
    return True


def _off_flip(plane: Plane, signs: Array, states: Array, period: float) -> float:
    """Return the distance of the multipliers of half a period and the mirror from -1."""
    shooting = Shooting(plane, max(1, (len(states) - 1) // 2))
    derived = shooting.shoot(states[0], period / 2.0, plane.start).derivatives
    multipliers = np.linalg.eigvals(signs[:, None] * derived[:, : len(signs)])
    return float(np.abs(multipliers + 1.0).min())
