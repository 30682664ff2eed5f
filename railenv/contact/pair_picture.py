"""The content of a picture of a pair of profiles: both, and the places that touch at each shift."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from railenv.contact.pair import ProfilePair

Array = NDArray[np.float64]

CONTACTS = 0.0005
"""Distance (m) between two shifts whose contacts are joined by lines."""

FURTHEST = 0.010
"""Largest shift drawn, m."""

_BEYOND = 0.001  # m; how far beyond the flange's contact they go
_SHALLOW = 0.022  # m below the top of the rail that are drawn
_GAP = 0.006  # m by which the wheel is lifted in the picture
_POINTS = 2000  # of each profile


class PairPicture(NamedTuple):
    """Curves in m: outwards from the track's centre, and upwards from the contact at the shift 0.

    Attributes
    ----------
    wheel, rail : ndarray, shape (2, n)
        The wheel is lifted off the rail.
    contacts : ndarray, shape (2, 2, n_contacts)
        Outwards and upwards (first axis) of the place on the wheel and of that on the rail (second),
        for shifts from -``furthest`` to ``furthest``; the middle one is the shift 0.
    """

    wheel: Array
    rail: Array
    contacts: Array


def furthest_shift(pair: ProfilePair) -> float:
    """Return the largest shift (m) to both sides in pictures."""
    low, high = pair.reach
    return min(-low, high, FURTHEST, pair.flange_clearance + _BEYOND)


def picture(pair: ProfilePair, furthest: float, points: int = _POINTS) -> PairPicture:
    """Return both profiles, and the places that touch for shifts (m) up to the furthest."""
    wheel, rail, offset = pair.surfaces
    at = pair.tape_place
    start = pair.place(0.0, absolute=True)
    count = int(furthest / CONTACTS)
    eta = CONTACTS * np.arange(-count, count + 1)
    on_rail = pair.place(eta, absolute=True)
    on_wheel = on_rail - eta
    rail_z = rail(np.clip(on_rail - at - offset, rail.y[0], rail.y[-1])).z
    wheel_z = wheel(np.clip(on_wheel - at, wheel.y[0], wheel.y[-1])).z
    top = float(rail(np.array([start - at - offset])).z[0])
    lifted = wheel(np.array([start - at])).z[0] - _GAP
    yr = np.linspace(rail.y[0], rail.y[-1], points)
    zr = rail(yr).z - top
    seen = zr > -_SHALLOW
    yw = np.linspace(wheel.y[0], wheel.y[-1], points)
    return PairPicture(
        wheel=np.stack([yw + at, wheel(yw).z - lifted]),
        rail=np.stack([(yr + offset + at)[seen], zr[seen]]),
        contacts=np.stack(
            [np.stack([on_wheel, on_rail]), np.stack([wheel_z - lifted, rail_z - top])], axis=0
        ),
    )
