"""What a frame shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.errors import ParameterError

TANGENT = 1e-6
"""1/m; a track of less curvature is drawn and called tangent."""

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
    """What the strip chart shows, oldest first.

    Parameters
    ----------
    time : array of shape (n,)
        Instants, s, increasing.
    y : array of shape (n, 2)
        Lateral displacements of the leading and the trailing wheelset, m.
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
        y = _array("history.y", self.y, (n, 2), "displacements of both wheelsets at every instant")
        action = _array("history.action", self.action, (n, None), "the action at every instant")
        _set(self, time=time, y=y, action=action)

    @classmethod
    def empty(cls, n_actuators: int = 0) -> History:
        """Return a history without instants."""
        return cls(np.zeros(0), np.zeros((0, 2)), np.zeros((0, n_actuators)))


@dataclass(frozen=True, eq=False)
class Scene:
    """What one frame shows; SI units.

    Parameters
    ----------
    time, speed : float
        Time (s) and forward speed (m/s).
    curvature, cant : float
        Curvature (1/m, positive: the outer rail is the left one) and cant angle (rad, positive: the
        left rail is raised).
    critical_speed : float or None
        Critical speed (m/s), shown beside the speed when given.
    bodies : array of shape (2, 4) or (3, 4)
        y, z (m), phi and psi (rad) of leading wheelset, trailing wheelset and, for a bogie, the frame.
    equilibrium : array of the same shape
        The running equilibrium, drawn as a ghost.
    rail : array of shape (2,)
        Lateral displacement (m) of the rails under leading and trailing wheelset.
    half_gauge, half_wheelbase, wheel_radius, flange_clearance : float
        Geometry of the vehicle, m.
    history : History
        The last seconds, for the strip chart.
    derailed : str or None
        The reason, once derailed.

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

    def __post_init__(self) -> None:
        meaning = "y, z, phi, psi of both wheelsets and, for a bogie, the frame"
        bodies = _array("bodies", self.bodies, (None, 4), meaning)
        if len(bodies) not in (2, 3):
            raise ParameterError(
                f"bodies has shape {bodies.shape}; it must be (2, 4) or (3, 4): {meaning}"
            )
        equilibrium = _array("equilibrium", self.equilibrium, bodies.shape, "as bodies")
        rail = _array("rail", self.rail, (2,), "displacement of the rails under each wheelset")
        for name in ("half_gauge", "half_wheelbase", "wheel_radius", "flange_clearance"):
            value = checks.number(name, getattr(self, name), low=0.0, open_low=True, unit="m")
            _set(self, **{name: value})
        if not isinstance(self.history, History):
            raise ParameterError(f"history is {self.history!r}; it must be a History")
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

    @property
    def exaggeration(self) -> float:
        """Factor by which lateral motion and yaw are drawn larger than they are."""
        room = 0.35 * self.half_gauge / self.flange_clearance
        return max((f for f in _FACTORS if f <= room), default=1.0)


def _set(record: Any, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(record, name, value)


def touching(scene: Scene, i: int, side: float) -> bool:
    """Return whether the flange of a wheel has reached the rail."""
    return bool(side * (scene.bodies[i, 0] - scene.rail[i]) >= scene.flange_clearance)
