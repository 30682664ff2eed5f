"""Track plans: curvature and cant along the line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError, shown


@dataclass(frozen=True)
class Track:
    """Curvature and cant along the line, linear between knots and constant beyond the last ones.

    Linear curvature is a clothoid, the transition curve of railways, along which the cant is ramped.

    Parameters
    ----------
    distance : tuple of float
        Positions of the knots, m, increasing.
    curvature, cant : tuple of float
        Curvature (1/m) and cant angle (rad) at the knots.

    Raises
    ------
    ParameterError
        If the lengths differ, a value is not allowed, or the distances do not increase.

    Examples
    --------
    >>> from railenv.track import Track
    >>> track = Track.into_curve(radius=6250.0, cant=0.0873, straight=100.0, transition=250.0)
    >>> float(track.curvature_at(225.0)) * 6250.0
    0.5
    """

    distance: tuple[float, ...]
    curvature: tuple[float, ...]
    cant: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("distance", "curvature", "cant"):
            value = getattr(self, name)
            try:
                object.__setattr__(self, name, tuple(value))
            except TypeError:
                raise ParameterError(
                    f"{name} is {shown(value)}; it must be a sequence of numbers"
                ) from None
        n = len(self.distance)
        if n == 0 or len(self.curvature) != n or len(self.cant) != n:
            raise ParameterError(
                f"a track needs as many curvatures ({len(self.curvature)}) and cants "
                f"({len(self.cant)}) as distances ({n}), and at least one"
            )
        for d in self.distance:
            checks.number("distance", d, unit="m")
        for a, b in pairwise(self.distance):
            if not a < b:
                raise ParameterError(f"distance {b:g} m follows {a:g} m; distances must increase")
        for k in self.curvature:
            checks.number("curvature", k, low=-1.0, high=1.0, unit="1/m")
        for c in self.cant:
            checks.cant(c)

    @classmethod
    def circular(cls, radius: float = math.inf, cant: float = 0.0) -> Self:
        """Return a track of constant radius (m; ``math.inf`` is tangent) and cant (rad)."""
        return cls((0.0,), (checks.curvature(radius),), (checks.cant(cant),))

    @classmethod
    def into_curve(
        cls,
        *,
        radius: float,
        cant: float,
        straight: float,
        transition: float,
        curve: float | None = None,
    ) -> Self:
        """Return a straight, a clothoid with its cant ramp and a curve, and back if ``curve`` is given.

        Parameters
        ----------
        radius : float
            Radius of the curve, m; negative is the other hand.
        cant : float
            Cant angle in the curve, rad.
        straight, transition : float
            Lengths of the straight before the curve and of each clothoid, m.
        curve : float, optional
            Length of the circular curve, m, after which a clothoid leads back to a straight; the curve
            never ends when left out.
        """
        k, c = checks.curvature(radius), checks.cant(cant)
        start = checks.number("straight", straight, low=0.0, unit="m")
        ramp = checks.number("transition", transition, low=0.0, open_low=True, unit="m")
        distance, plan, raised = [start, start + ramp], [0.0, k], [0.0, c]
        if curve is not None:
            end = start + ramp + checks.number("curve", curve, low=0.0, open_low=True, unit="m")
            distance += [end, end + ramp]
            plan += [k, 0.0]
            raised += [c, 0.0]
        return cls(tuple(distance), tuple(plan), tuple(raised))

    def curvature_at(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Return the curvature (1/m) at some distances (m)."""
        return np.interp(np.asarray(distance), self.distance, self.curvature)

    def cant_at(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Return the cant angle (rad) at some distances (m)."""
        return np.interp(np.asarray(distance), self.distance, self.cant)

    def curvature_slope_at(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Return the slope of the curvature along the line (1/m^2) at some distances (m)."""
        return self._slope_at(self.curvature, distance)

    def cant_slope_at(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Return the slope of the cant angle along the line (rad/m) at some distances (m)."""
        return self._slope_at(self.cant, distance)

    def _slope_at(self, values: tuple[float, ...], distance: ArrayLike) -> NDArray[np.float64]:
        """Return the slope between knots; 0 before the first and beyond the last."""
        slopes = np.concatenate([[0.0], np.diff(values) / np.diff(self.distance), [0.0]])
        return slopes[np.searchsorted(self.distance, np.asarray(distance), side="right")]
