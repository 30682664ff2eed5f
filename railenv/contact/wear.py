"""Wear of a wheel's tread by a plain rule: the wheel loses material where it runs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.contact.pair import ProfilePair
from railenv.contact.profiles import Curve, Profile
from railenv.contact.search import Search, Surfaces
from railenv.errors import ParameterError

Array = NDArray[np.float64]

PATCH = 2e-3
"""Standard deviation (m) that smooths wear: that of the pressure of a patch 9 mm wide."""

LARGEST_STEP = 2e-5
"""Largest depth (m) worn off between two searches of the contact."""

_STEP = 5e-5  # m, of the search
_SPREADS = 3.5  # standard deviations of the shift that are included
_GRID = 2e-4  # m, of the worn profile
_TREAD = (-0.030, 0.045)  # m from the tape circle: where the depth is measured
_DEEPEST = 5e-3  # m; more than any limit of maintenance
_WIDEST_SPREAD = 1e-2  # m; clearances are smaller


def worn(pair: ProfilePair, *, depth: float, spread: float, patch: float = PATCH) -> ProfilePair:
    """Return a pair with a worn wheel.

    The lateral shift is normally distributed about the centre, so that a wheel and its mirror image
    wear the same. Each shift removes material at its contact, in proportion to the weights of the
    contact, smoothed over a patch. The wheel loses it in small steps, with a new search of the contact
    after each, until the deepest place of the tread has lost ``depth``. The rail does not wear. The
    worn profile is given from its own tape circle again, so its nominal radius is that of the worn
    wheel.

    The rule ignores forces and creepage: it gives treads as hollow as measured ones and their
    conicity, not mileage. Flanges hardly wear, unless the spread is as wide as the clearance.

    Parameters
    ----------
    pair : ProfilePair
    depth : float
        Wear of the tread, m.
    spread : float
        Standard deviation of the lateral shift, m.
    patch : float
        Standard deviation of the smoothing, m.

    Raises
    ------
    ParameterError
        If a value is out of range, or the wheel would run where it has no points.
    """
    depth = checks.number("depth", depth, low=0.0, high=_DEEPEST, open_low=True, unit="m")
    spread = checks.number("spread", spread, low=1e-4, high=_WIDEST_SPREAD, unit="m")
    patch = checks.number("patch", patch, low=2e-4, high=1e-2, unit="m")
    new = pair.wheel
    y = np.arange(math.ceil(new.y[0] / _GRID), math.floor(new.y[-1] / _GRID) + 1) * _GRID
    lost = np.zeros(len(y))
    steps = max(1, math.ceil(depth / LARGEST_STEP))
    surfaces = pair.surfaces
    start = surfaces.wheel(y).z
    tread = (y > _TREAD[0]) & (y < _TREAD[1])
    for k in range(1, steps + 1):
        rate = _rate(
            surfaces._replace(wheel=Curve.through(y, start + lost)), y, pair.width, spread, patch
        )
        lost += rate * _until(lost[tread], rate[tread], depth * k / steps)
    ends = np.concatenate([[new.y[0]], y, [new.y[-1]]])
    z = np.interp(ends, new.y, new.z)
    z[1:-1] = start + lost
    z -= np.interp(0.0, ends, z)
    said = (
        f"{new.name} worn {1e3 * depth:g} mm deep on {pair.rail.name}, gauge {1e3 * pair.gauge:g} mm, "
        f"by lateral shifts with a standard deviation of {1e3 * spread:g} mm"
    )
    points = np.stack([ends, z], axis=1)
    wheel = Profile.of(points, kind="wheel", name=f"{new.name} worn {1e3 * depth:g} mm", source=said)
    return replace(pair, wheel=wheel)


def _rate(surfaces: Surfaces, y: Array, width: float, spread: float, patch: float) -> Array:
    """Return the frequency of contact of places of the wheel, per length, smoothed over a patch."""
    search = Search(surfaces, step=_STEP, width=width, reach=_SPREADS * spread)
    likely = np.exp(-0.5 * (search.eta / spread) ** 2)
    likely /= likely.sum()
    hits = np.zeros(len(search.Yw))
    for block in search.weights():
        rows = likely[block.first : block.first + len(block.values), None]
        hits += np.bincount(
            block.wheel.ravel(), weights=(rows * block.values).ravel(), minlength=len(hits)
        )
    outside = (search.Yw < y[0]) | (search.Yw > y[-1])
    if hits[outside].sum() > 1e-6:
        raise ParameterError(
            f"wheel runs beyond its points with a spread of {spread:g} m; give a smaller spread"
        )
    reach = math.ceil(4.0 * patch / _STEP)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) * _STEP / patch) ** 2)
    smooth = np.convolve(hits, kernel / kernel.sum(), mode="same") / _STEP
    return np.interp(y, search.Yw, smooth)


def _until(lost: Array, rate: Array, depth: float) -> float:
    """Return the time that the deepest place needs to reach a depth."""
    with np.errstate(divide="ignore", invalid="ignore"):
        times = np.where(rate > 1e-12 * rate.max(), (depth - lost) / rate, np.inf)
    return float(max(0.0, times.min()))
