"""Loci: eigenvalues over a parameter, sorted into modes; the speed locus."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import control
import numpy as np
from control.pzmap import PoleZeroData
from numpy.typing import ArrayLike, NDArray

from design.loop.dynamics import Dynamics, dynamics
from design.stability.critical_points import CriticalPoint, Family, find_critical_points
from design.stability.critical_speed import critical_speed
from design.stability.loss import CriticalSpeed
from design.stability.mode_shape import ModeShape
from design.stability.modes import Complex, Modes, follow
from railenv import checks
from railenv.equilibrium import LOW_SPEED, Point, follow_speeds
from railenv.errors import EquilibriumError, ParameterError
from railenv.models import Model
from railenv.threads import one_blas_thread

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Each = TypeVar("Each")

_FASTEST_DRAWN = 2.5  # times the frequency of the least damped mode, in plots over the parameter
_HEAVIEST_DRAWN = 1.0  # damping ratio up to which modes count as oscillating


class Locus(PoleZeroData):
    """Eigenvalues over a parameter, as python-control's data of a root locus.

    Attributes
    ----------
    parameter, unit : str
        The parameter that varies, and its unit ("" if unknown).
    values, gains : ndarray, shape (n_values,)
        Values of the parameter (the same array under python-control's name).
    loci : ndarray, shape (n_values, n_modes)
        Eigenvalues (1/s; multipliers for a root locus in discrete time); each column follows one mode.
    modes : ndarray, shape (n_values, n_states, n_modes)
        Their eigenvectors; for a closed loop, the first entries are the vehicle's states.
    poles : ndarray, shape (n_modes,)
        Those at the lowest value; for a root locus, those of the open loop.
    least_damped : int
        Column of the mode whose real part is largest anywhere in the range.
    ended : str or None
        Reason why the locus ends below the highest value requested, if it does.
    period : float or None
        Control period (s) of a closed loop, whose eigenvalues are those of its map over a period,
        converted to continuous time; None in continuous time.
    """

    def __init__(
        self,
        values: Array,
        modes: Sequence[Modes],
        family: Family,
        *,
        ended: str | None = None,
    ) -> None:
        self._family = family
        self._followed = follow(modes, family.period)
        self.eigenvalues = np.array([m.eigenvalues for m in self._followed])
        loci = self._drawn(self.eigenvalues)
        super().__init__(
            loci[0], np.empty(0), gains=values, loci=loci, dt=0, sysname=family.name, sort_loci=False
        )
        self.parameter = family.parameter
        self.unit = family.unit
        self.values = values
        self.modes = np.array([m.vectors for m in self._followed])
        self.period = family.period
        self.ended = ended
        upper = np.where(self.eigenvalues.imag >= 0.0, self.eigenvalues.real, -np.inf)
        self.least_damped = int(np.argmax(upper.max(axis=0)))

    def _drawn(self, eigenvalues: Complex) -> Complex:
        """Return eigenvalues (1/s) in the form of the loci."""
        return eigenvalues

    @property
    def condition(self) -> str:
        """The constant conditions, for titles."""
        return ""

    @property
    def growth(self) -> Array:
        """Growth rate (1/s) of every mode at every value, shape (n_values, n_modes)."""
        return self.eigenvalues.real

    @property
    def damping(self) -> Array:
        """Damping ratio of every mode at every value, shape (n_values, n_modes)."""
        magnitude = np.abs(self.eigenvalues)
        return -self.eigenvalues.real / np.where(magnitude > 0.0, magnitude, 1.0)

    @property
    def frequency(self) -> Array:
        """Frequency (Hz) of every mode at every value, shape (n_values, n_modes)."""
        return np.abs(self.eigenvalues.imag) / (2.0 * math.pi)

    @property
    def beside_least_damped(self) -> tuple[int, ...]:
        """Columns of the modes in pictures beside the least damped one.

        They oscillate somewhere below some multiple of its frequency and are not critically damped.
        """
        fastest = _FASTEST_DRAWN * max(float(self.frequency[:, self.least_damped].max()), 1e-9)
        oscillates = self.eigenvalues.imag > 0.0
        drawn = oscillates & (self.frequency <= fastest) & (self.damping < _HEAVIEST_DRAWN)
        chosen = np.flatnonzero(drawn.any(axis=0)).tolist()
        return tuple(k for k in chosen if k != self.least_damped)

    @property
    def window(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Part of the upper half plane around the least damped mode: limits across (1/s) and up."""
        marked = self.loci[:, self.least_damped]
        top = 1.25 * float(np.abs(marked.imag).max())
        if top == 0.0:  # a real mode: as high as it is wide
            top = 0.6 * float(np.abs(marked.real).max()) or 1.0
        left = 1.6 * min(float(marked.real.min()), -0.08 * top)
        return (left, max(0.08 * top, 1.5 * float(marked.real.max()))), (-0.03 * top, top)

    @cached_property
    def critical_points(self) -> tuple[CriticalPoint, ...]:
        """Points where stability is lost or gained as the parameter grows.

        They are located between the values, where every mode is followed as by
        :func:`design.critical_speed`: steps in which one may cross the axis unnoticed are halved.
        """
        return find_critical_points(self._family, self.values, self._followed)

    def written(self, value: float) -> str:
        """Return a value of the parameter with its unit."""
        return f"{value:.4g} {self.unit}" if self.unit not in ("", "1") else f"{value:.4g}"

    def at(self, value: float) -> Modes:
        """Return the modes at any value within the range, in the order of the loci.

        Raises
        ------
        ParameterError
            If the value lies outside the range.
        """
        low, high = float(self.values[0]), float(self.values[-1])
        value = checks.number(self.parameter, value, low=low, high=high, unit=self.unit)
        nearest = int(np.argmin(np.abs(self.values - value)))
        with one_blas_thread():
            return follow([self._followed[nearest], self._family.modes(value)], self.period)[1]

    def _chosen(self, value: float, mode: int | None) -> tuple[Complex, complex, str]:
        """Return eigenvector, eigenvalue and condition of a mode at a value."""
        found = self.at(value)
        count = len(found.eigenvalues)
        if mode is not None and not (hasattr(mode, "__index__") and 0 <= mode < count):
            raise ParameterError(f"mode is {mode!r}; it must be a whole number from 0 to {count - 1}")
        k = found.least_damped if mode is None else mode
        where = f"{self.parameter} = {self.written(value)}"
        return found.vectors[:, k], complex(found.eigenvalues[k]), where

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the loci, with the least damped mode and the critical points marked."""
        from design.stability.locus_plots import plot_locus

        return plot_locus(self, ax)

    def plot_damping(self) -> control.ControlPlot:
        """Draw damping ratio and frequency of the slower modes over the parameter."""
        from design.stability.locus_plots import plot_damping

        return plot_damping(self)


class VehicleFamily(Family, Protocol):
    """Linear systems of a vehicle on one curve that depend on a parameter."""

    @property
    def model(self) -> Model:
        """The vehicle."""

    @property
    def radius(self) -> float:
        """Curve radius, m."""

    @property
    def cant(self) -> float:
        """Cant angle, rad."""

    @property
    def condition(self) -> str:
        """The constant conditions, for titles."""


class VehicleLocus(Locus):
    """Eigenvalues of a vehicle about its running equilibrium, over a parameter.

    Attributes
    ----------
    states : ndarray, shape (n_values, n_states)
        Running equilibrium at each value (the vehicle's own, without its controller).
    radius, cant : float
        m (``math.inf`` on tangent track), rad.
    """

    def __init__(
        self,
        values: Array,
        modes: Sequence[Modes],
        family: VehicleFamily,
        *,
        ended: str | None = None,
    ) -> None:
        super().__init__(values, modes, family, ended=ended)
        self.radius = float(family.radius)
        self.cant = family.cant
        self.states = np.array([m.state for m in self._followed])
        self._condition = family.condition
        self._model = family.model

    @property
    def condition(self) -> str:
        """The constant conditions, for titles."""
        return self._condition

    def mode(self, value: float, mode: int | None = None) -> ModeShape:
        """Return the shape of a mode at any value within the range.

        Parameters
        ----------
        value : float
            Value of the parameter.
        mode : int, optional
            Column of ``loci``; the least damped mode at that value when left out.

        Raises
        ------
        ParameterError
            If the value lies outside the range, or there is no such mode.
        """
        return ModeShape.of(self._model, *self._chosen(value, mode))


class SpeedLocus(VehicleLocus):
    """Eigenvalues over speed; the attributes of :class:`Locus` and :class:`VehicleLocus`, and these.

    Attributes
    ----------
    speeds : ndarray, shape (n_speeds,)
        m/s; the same as ``values``.
    critical : CriticalSpeed
        First loss of stability, searched from 3 m/s (for a closed loop, which may not be meant for low
        speeds, from the lowest speed of the locus) up to the highest speed.
    """

    def __init__(
        self,
        values: Array,
        modes: Sequence[Modes],
        family: VehicleFamily,
        *,
        critical: CriticalSpeed,
        ended: str | None = None,
    ) -> None:
        super().__init__(values, modes, family, ended=ended)
        self.speeds = values
        self.critical = critical


def speed_locus(
    model: Model,
    speeds: ArrayLike,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    controller: Any | None = None,
    period: float | None = None,
) -> SpeedLocus:
    """Compute the eigenvalues about the running equilibrium at some speeds, sorted into modes.

    Parameters
    ----------
    model : Model
    speeds : array_like
        At least two increasing speeds, m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).
    controller : array_like, control.StateSpace or Feedback, optional
        Controller that closes the loop once per control period (:func:`design.closed_loop`).
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.

    Returns
    -------
    SpeedLocus
        If the equilibrium ends before the highest speed, the locus ends there too, with a warning, and
        ``ended`` says why.

    Raises
    ------
    EquilibriumError
        If there is no equilibrium even at the second speed.
    """
    targets = checks.numbers("speeds", speeds, least=2)
    checks.curvature(radius)
    with one_blas_thread():
        family = Speeds(model, dynamics(model, controller, period), float(radius), checks.cant(cant))
        followed = follow_speeds(model, targets, radius=radius, cant=cant)
        points, ended = while_running(followed, "speed locus")
        reached = targets[: len(points)]
        low = float(reached[0]) if controller is not None else min(float(reached[0]), LOW_SPEED)
        search = (low, float(targets[-1]))
        critical = critical_speed(
            model, radius=radius, cant=cant, speed_range=search, controller=controller, period=period
        )
        modes = [family.about(p, float(v)) for p, v in zip(points, reached, strict=True)]
        return SpeedLocus(reached, modes, family, critical=critical, ended=ended)


def while_running(points: Iterable[Each], locus: str) -> tuple[list[Each], str | None]:
    """Return the points of a locus up to the end of the equilibrium, and the reason if it ends.

    Raises
    ------
    EquilibriumError
        If there are fewer than two.
    """
    found: list[Each] = []
    try:
        for point in points:
            found.append(point)
    except EquilibriumError as error:
        if len(found) < 2:
            raise
        # at level 1 is this function, at 2 the one that makes the locus
        warnings.warn(f"the {locus} ends early: {error}", UserWarning, stacklevel=3)
        return found, str(error)
    return found, None


@dataclass(frozen=True)
class Speeds:
    """The linear systems of a vehicle over speed."""

    model: Model
    dynamics: Dynamics
    radius: float
    cant: float
    parameter: str = "speed"
    unit: str = "m/s"

    @property
    def name(self) -> str:
        """Name of the vehicle's model."""
        return self.model.name

    @property
    def period(self) -> float | None:
        """Control period, s; None for a vehicle alone."""
        return self.dynamics.period

    @property
    def condition(self) -> str:
        """The curve, for titles."""
        from design.style import curve_title

        return curve_title(self.radius, self.cant)

    def modes(self, value: float) -> Modes:
        """Return the modes about the running equilibrium at a speed (m/s)."""
        (point,) = follow_speeds(self.model, [value], radius=self.radius, cant=self.cant)
        return self.about(point, value)

    def about(self, point: Point, speed: float) -> Modes:
        """Return the modes about a point of the branch of equilibria."""
        conditions = (speed, checks.curvature(self.radius), self.cant)
        return Modes(*self.dynamics.modes(point, conditions), point.state)
