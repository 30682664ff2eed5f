"""Robust critical speed: the speed up to which a closed loop is stable for every vehicle of a box.

The box is sampled (corners, middle, low-discrepancy points) and the worst places are refined by local
searches, once over the critical speed and once over the growth rate below it, which finds unstable
ranges of speed that the samples miss. This is a search, not a proof: it gives an upper bound, which is
tight near its samples. A structured singular value would give a lower bound.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from design.loop.dynamics import dynamics
from design.progress import tracked
from design.stability.critical_speed import critical_speed
from design.stability.loss import CriticalSpeed
from railenv import checks
from railenv.equilibrium import follow_speeds
from railenv.errors import EquilibriumError, ParameterError
from railenv.models import Model
from railenv.threads import one_blas_thread

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

LOWEST_SPEED = 20.0
"""Speed above which a closed loop has to be stable, m/s."""

_MOST_CORNERS = 6  # in a box with more dimensions, corners are only sampled at random
_SPEED_TOLERANCE = 1e-3
_SPEEDS = 24  # number of speeds at which growth rates are computed
_STARTS = 2  # local searches
_ROUNDS = 3
_EVALUATIONS = 12  # for a local search, times the number of dimensions plus one


@dataclass(frozen=True)
class RobustCriticalSpeed:
    """The highest speed up to which a closed loop is stable for every vehicle of a box.

    Attributes
    ----------
    speed : float or None
        m/s; None if a vehicle is unstable at the lowest speed. If none loses stability, the
        highest speed searched.
    worst : mapping of str to float
        The vehicle that determines it, by the varied quantities.
    result : CriticalSpeed or None
        Loss of stability of that vehicle; None if it has no running equilibrium at the lowest speed.
    box : mapping of str to (float, float)
    samples : tuple of (mapping, float)
        Every vehicle tried, with the speed up to which it is stable (or was searched); 0 if it is
        unstable at the lowest speed.
    speed_range : (float, float)
        m/s.
    """

    speed: float | None
    worst: Mapping[str, float]
    result: CriticalSpeed | None
    box: Mapping[str, tuple[float, float]]
    samples: tuple[tuple[Mapping[str, float], float], ...]
    speed_range: tuple[float, float]

    @property
    def limited(self) -> bool:
        """Whether some vehicle does lose stability within the range of speeds."""
        return self.speed is None or self.speed < self.speed_range[1]

    def summary(self) -> dict[str, Any]:
        """Return the result as plain numbers and strings, ready for JSON."""
        return {
            "speed": self.speed,
            "worst": dict(self.worst),
            "loss": None if self.result is None else self.result.loss,
            "frequency": None if self.result is None else self.result.frequency,
            "box": {name: list(ends) for name, ends in self.box.items()},
            "vehicles": len(self.samples),
            "speed_range": list(self.speed_range),
        }

    def __str__(self) -> str:
        low = self.speed_range[0]
        vehicle = ", ".join(f"{name} {value:.4g}" for name, value in self.worst.items())
        if self.speed is None:
            return f"unstable already at {low:g} m/s with {vehicle}"
        if not self.limited:
            return f"stable from {low:g} to {self.speed:g} m/s with every vehicle tried"
        return f"stable from {low:g} to {self.speed:.2f} m/s; the worst vehicle has {vehicle}"

    def plot(self, ax: Axes | None = None, parameter: str | None = None) -> control.ControlPlot:
        """Draw the speeds of all vehicles tried over one varied quantity."""
        from design.stability.robust_plots import plot_robust

        return plot_robust(self, parameter or next(iter(self.box)), ax)


def robust_critical_speed(
    model: Model,
    controller: Any | None,
    box: Mapping[str, tuple[float, float]],
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    speed_range: tuple[float, float] = (LOWEST_SPEED, 400.0),
    period: float | None = None,
    longest_step: float | None = None,
    samples: int = 32,
    seed: int = 0,
    progress: bool = False,
) -> RobustCriticalSpeed:
    """Find the highest speed up to which a closed loop is stable for every vehicle of a box.

    Parameters
    ----------
    model : Model
        Model, varied with ``model.replace``; the controller does not change.
    controller : array_like, control.StateSpace, Feedback or None
        See :func:`design.closed_loop`; None for the vehicle alone.
    box : mapping of str to (float, float)
        Ranges of quantities of the model, such as ``{"conicity": (0.05, 0.4)}``; names are those of
        ``model.variable_names``.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).
    speed_range : (float, float)
        Range of speeds, m/s; the loop has to be stable from the lowest one.
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.
    longest_step : float, optional
        Longest step between sampled speeds, as in :func:`design.critical_speed`.
    samples : int
        Number of vehicles to start from, beside the corners and the middle of the box.
    seed : int
        Seed of the sampling.
    progress : bool
        Show a progress bar.

    Returns
    -------
    RobustCriticalSpeed

    Raises
    ------
    UnknownNameError
        If a name is not a quantity of the model.
    ParameterError
        If a range is empty or a value in it is not allowed.
    """
    ranges = _checked(model, box)
    search = _Search(model, controller, ranges, radius, cant, speed_range, period, longest_step)
    points = search.starts(samples, seed)
    with one_blas_thread():
        for point in tracked(points, f"robust critical speed, {model.name}", progress):
            search.stable_up_to(point)
        search.refine()
    return search.result()


def _checked(model: Model, box: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    ranges = checks.mapping("box", box)
    if not ranges:
        raise ParameterError("box is empty; give ranges of quantities of the vehicle")
    checks.known("quantity", ranges, model.variable_names)
    result = {}
    for name, ends in ranges.items():
        result[name] = checks.interval(f"box[{name!r}]", ends)
        for end in result[name]:
            model.replace(**{name: end})  # raises if it is not allowed
    return result


@dataclass
class _Search:
    """A search for the worst vehicle; points are in the unit cube."""

    model: Model
    controller: Any
    box: dict[str, tuple[float, float]]
    radius: float
    cant: float
    speed_range: tuple[float, float]
    period: float | None
    longest_step: float | None

    def __post_init__(self) -> None:
        self.found: list[tuple[Array, float]] = []
        self.results: dict[bytes, CriticalSpeed | None] = {}

    @cached_property
    def _dimension(self) -> int:
        return len(self.box)

    def starts(self, samples: int, seed: int) -> list[Array]:
        """Return the middle, corners and low-discrepancy points of the cube."""
        from scipy.stats import qmc

        d = self._dimension
        points = [np.full(d, 0.5)]
        if d <= _MOST_CORNERS:
            points += [np.array(corner) for corner in itertools.product((0.0, 1.0), repeat=d)]
        if d == 1:
            return [*points, *np.linspace(0.0, 1.0, samples + 2)[1:-1, None]]
        return [*points, *qmc.Halton(d, rng=np.random.default_rng(seed)).random(samples)]

    def values(self, point: Array) -> dict[str, float]:
        """Return the vehicle of a point."""
        shares = np.clip(point, 0.0, 1.0)
        return {
            name: float(low + share * (high - low))
            for share, (name, (low, high)) in zip(shares, self.box.items(), strict=True)
        }

    @property
    def worst(self) -> tuple[Array, float]:
        """The worst point found so far, and its speed."""
        return min(self.found, key=lambda pair: pair[1])

    def stable_up_to(self, point: Array, below: float | None = None) -> float:
        """Return the speed (m/s) up to which a vehicle is stable, 0 if not even at the lowest.

        Speeds beyond ``below`` (by default that of the worst vehicle so far) are not searched.
        """
        low, high = self.speed_range
        if below is None:
            below = min([high, *(1.05 * speed for _, speed in self.found)])
        if below <= low:  # the worst possible vehicle has been found
            return 0.0
        try:
            result = critical_speed(
                self.model.replace(**self.values(point)),
                radius=self.radius,
                cant=self.cant,
                speed_range=(low, max(below, 1.001 * low)),
                controller=self.controller,
                period=self.period,
                longest_step=self.longest_step,
            )
            speed = below if result.loss == "none" else (result.speed or 0.0)
        except EquilibriumError:
            result, speed = None, 0.0
        self.found.append((np.clip(point, 0.0, 1.0), float(speed)))
        self.results[self.found[-1][0].tobytes()] = result
        return float(speed)

    def refine(self) -> None:
        """Search around the worst points, until nothing worse is found."""
        for _ in range(_ROUNDS):
            before = self.worst[1]
            if before <= self.speed_range[0]:
                return
            for start, _ in sorted(self.found, key=lambda pair: pair[1])[:_STARTS]:
                self._minimize(lambda p: self.stable_up_to(p, self._limit()), start)
            self._look_below()
            if self.worst[1] > (1.0 - _SPEED_TOLERANCE) * before:
                return

    def _limit(self) -> float:
        """Return a limit that lets a local search see the slope around the worst vehicle."""
        return min(self.speed_range[1], 1.3 * self.worst[1])

    def _minimize(self, function: Any, start: Array) -> Array:
        if self._dimension == 1:
            width = 2.0 / max(len(self.found), 8)
            bounds = (max(0.0, start[0] - width), min(1.0, start[0] + width))
            found = optimize.minimize_scalar(
                lambda x: function(np.array([x])),
                bounds=bounds,
                method="bounded",
                options={"xatol": 1e-3},
            )
            return np.array([found.x])
        simplex = np.vstack([start, start + np.diag(np.where(start < 0.5, 0.15, -0.15))])
        found = optimize.minimize(
            lambda p: function(np.clip(p, 0.0, 1.0)),
            start,
            method="Nelder-Mead",
            options={
                "initial_simplex": simplex,
                "maxfev": _EVALUATIONS * (self._dimension + 1),
                "xatol": 1e-3,
                "fatol": 0.02,
            },
        )
        return np.clip(found.x, 0.0, 1.0)

    def _look_below(self) -> None:
        """Search for growth below the worst speed found, between the samples."""
        low, high = self.speed_range[0], (1.0 - 2.0 * _SPEED_TOLERANCE) * self.worst[1]
        if high <= low:
            return
        speeds = np.geomspace(low, high, _SPEEDS)
        seen = sorted(
            ((self._growth(point, speeds), point) for point, _ in self.found[: 4 * _STARTS]),
            key=lambda pair: -pair[0],
        )
        for _, start in seen[:1]:
            point = self._minimize(lambda p: -self._growth(p, speeds), start)
            if self._growth(point, speeds) > 0.0:
                self.stable_up_to(point, high)

    def _growth(self, point: Array, speeds: Array) -> float:
        """Return the largest growth rate (1/s) of a vehicle at some speeds."""
        model = self.model.replace(**self.values(point))
        judged_by = dynamics(model, self.controller, self.period)
        curvature = checks.curvature(self.radius)
        rates = []
        try:
            for speed, at in zip(
                speeds, follow_speeds(model, speeds, radius=self.radius, cant=self.cant), strict=True
            ):
                rates.append(judged_by.eigenvalues(at, (speed, curvature, self.cant)).real.max())
        except EquilibriumError:
            return math.inf
        return float(max(rates))

    def result(self) -> RobustCriticalSpeed:
        """Return the result."""
        low, high = self.speed_range
        point, speed = self.worst
        return RobustCriticalSpeed(
            speed=float(speed) if speed > low else None,
            worst=self.values(point),
            result=self.results[point.tobytes()],
            box=self.box,
            samples=tuple((self.values(p), v) for p, v in self.found),
            speed_range=(float(low), float(high)),
        )
