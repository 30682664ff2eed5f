"""The content of a frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError

TANGENT = 1e-6
"""1/m; track of less curvature is drawn and labelled as tangent."""

_FACTORS = (1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 75.0, 100.0)


def _array(name: str, value: ArrayLike, shape: tuple[int | None, ...], meaning: str) -> Any:
    try:
        result = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is {value!r}, which is not an array of numbers") from None
    wanted = (
        "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," * (len(shape) == 1)) + ")"
    )
    fits = result.ndim == len(shape) and all(
        n is None or n == m for n, m in zip(shape, result.shape, strict=True)
    )
    if not fits:
        raise ParameterError(f"{name} has shape {result.shape}; it must be {wanted}: {meaning}")
    if not np.isfinite(result).all():
        raise ParameterError(f"{name} has entries that are not finite numbers")
    return result


@dataclass(frozen=True, eq=False)
class History:
    """The content of the strip chart, oldest first.

    Parameters
    ----------
    time : array of shape (n,)
        Instants, s, increasing.
    y : array of shape (n, n_wheelsets)
        Lateral displacements of the wheelsets, the leading one first, m.
    action : array of shape (n, n_actuators)
        Normalised actions in [-1, 1]; ``n_actuators`` may be 0.

    Raises
    ------
    ParameterError
        If a shape does not fit, an entry is not finite or time does not increase.
    """

    time: NDArray[np.float64]
    y: NDArray[np.float64]
    action: NDArray[np.float64]

    def __post_init__(self) -> None:
        time = _array("history.time", self.time, (None,), "instants")
        n = len(time)
        if (np.diff(time) <= 0.0).any():
            raise ParameterError("history.time must increase from entry to entry")
        y = _array("history.y", self.y, (n, None), "displacements of the wheelsets at every instant")
        action = _array("history.action", self.action, (n, None), "the action at every instant")
        _set(self, time=time, y=y, action=action)

    @classmethod
    def empty(cls, n_actuators: int = 0, n_wheelsets: int = 2) -> History:
        """Return a history without instants."""
        return cls(np.zeros(0), np.zeros((0, n_wheelsets)), np.zeros((0, n_actuators)))


@dataclass(frozen=True)
class Outline:
    """The outline of a body that is not a wheelset.

    Attributes
    ----------
    x : float
        Place of its centre from the middle of the wheelsets, m.
    half_length : float
        m.
    kind : {"frame", "body"}
        Two beams and a cross beam, or a rectangle above everything.
    """

    x: float
    half_length: float
    kind: Literal["frame", "body"] = "frame"

    def __post_init__(self) -> None:
        checks.number("x of an outline", self.x, unit="m")
        checks.number("half_length of an outline", self.half_length, low=0.0, open_low=True, unit="m")
        checks.choice("kind of an outline", self.kind, ("frame", "body"))


@dataclass(frozen=True, eq=False)
class Scene:
    """The content of one frame; SI units.

    Parameters
    ----------
    time, speed : float
        Time (s) and forward speed (m/s).
    curvature, cant : float
        Curvature (1/m, positive: the outer rail is the left one) and cant angle (rad, positive: the
        left rail is raised).
    critical_speed : float or None
        Critical speed (m/s), shown beside the speed when given.
    bodies : array of shape (n, 4)
        y, z (m), phi and psi (rad) of the wheelsets, the leading one first, then of the other bodies.
    equilibrium : array of the same shape
        The running equilibrium, drawn as a ghost.
    rail : array of shape (n_wheelsets,)
        Lateral displacement (m) of the rails under each wheelset.
    half_gauge, half_wheelbase, wheel_radius, flange_clearance : float
        Geometry of the vehicle, m.
    history : History
        The last seconds, for the strip chart.
    derailed : str or None
        The reason, once derailed.
    wheelsets : tuple of float, optional
        Places of the wheelsets from their middle, m, falling; two of them, half a wheelbase before and
        behind it, when left out.
    outlines : tuple of Outline, optional
        Outlines of the other bodies; when left out, a frame over both wheelsets, if there is a body
        for it.

    Raises
    ------
    ParameterError
        If a shape does not fit or a value is not allowed.
    """

    time: float
    speed: float
    curvature: float
    cant: float
    critical_speed: float | None
    bodies: NDArray[np.float64]
    equilibrium: NDArray[np.float64]
    rail: NDArray[np.float64]
    half_gauge: float
    half_wheelbase: float
    wheel_radius: float
    flange_clearance: float
    history: History
    derailed: str | None = None
    wheelsets: tuple[float, ...] = ()
    outlines: tuple[Outline, ...] = ()

    def __post_init__(self) -> None:
        meaning = "y, z, phi, psi of the wheelsets, then of the other bodies"
        bodies = _array("bodies", self.bodies, (None, 4), meaning)
        self._set_places(bodies)
        equilibrium = _array("equilibrium", self.equilibrium, bodies.shape, "as bodies")
        count = len(self.wheelsets)
        rail = _array("rail", self.rail, (count,), "displacement of the rails under each wheelset")
        for name in ("half_gauge", "half_wheelbase", "wheel_radius", "flange_clearance"):
            value = checks.number(name, getattr(self, name), low=0.0, open_low=True, unit="m")
            _set(self, **{name: value})
        if not isinstance(self.history, History):
            raise ParameterError(f"history is {self.history!r}; it must be a History")
        if len(self.history.time) and self.history.y.shape[1] != count:
            raise ParameterError(
                f"history.y has {self.history.y.shape[1]} columns; it must have one for each of the "
                f"{count} wheelsets"
            )
        if not (self.derailed is None or isinstance(self.derailed, str)):
            raise ParameterError(f"derailed is {self.derailed!r}; it must be a reason, or None")
        if self.critical_speed is not None:
            _set(self, critical_speed=checks.speed(self.critical_speed, "critical_speed"))
        _set(
            self,
            time=checks.number("time", self.time, unit="s"),
            speed=checks.speed(self.speed),
            curvature=checks.number("curvature", self.curvature, low=-1.0, high=1.0, unit="1/m"),
            cant=checks.cant(self.cant),
            bodies=bodies,
            equilibrium=equilibrium,
            rail=rail,
        )

    def _set_places(self, bodies: NDArray[np.float64]) -> None:
        """Check the places of the bodies, or set those of a bogie."""
        if not self.wheelsets:
            if len(bodies) not in (2, 3):
                raise ParameterError(
                    f"bodies has shape {bodies.shape}; it must be (2, 4) or (3, 4): y, z, phi, psi of "
                    "both wheelsets and, for a bogie, the frame; or give wheelsets and outlines"
                )
            half = checks.number(
                "half_wheelbase", self.half_wheelbase, low=0.0, open_low=True, unit="m"
            )
            frame = (Outline(0.0, half),) if len(bodies) == 3 else ()
            _set(self, wheelsets=(half, -half), outlines=frame)
            return
        places = _array("wheelsets", self.wheelsets, (None,), "places of the wheelsets")
        if (np.diff(places) >= 0.0).any():
            raise ParameterError(f"wheelsets is {places.tolist()}; places must fall, the leading first")
        _set(self, wheelsets=tuple(places.tolist()), outlines=tuple(self.outlines))
        wanted = len(places) + len(self.outlines)
        if len(bodies) != wanted:
            raise ParameterError(
                f"bodies has shape {bodies.shape}; it must be ({wanted}, 4), for {len(places)} "
                f"wheelsets and {len(self.outlines)} outlines"
            )

    @cached_property
    def exaggeration(self) -> float:
        """Factor by which lateral motion and yaw are enlarged."""
        room = 0.35 * self.half_gauge / self.flange_clearance
        return max((f for f in _FACTORS if f <= room), default=1.0)


def _set(record: Any, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(record, name, value)


def touching(scene: Scene, i: int, side: float) -> bool:
    """Return whether the flange of a wheel has reached the rail."""
    return bool(side * (scene.bodies[i, 0] - scene.rail[i]) >= scene.flange_clearance)
