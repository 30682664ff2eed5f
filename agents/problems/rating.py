"""Ratings of controllers on a problem: speeds, ride, curves, power, margins, failures."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from railenv import checks
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

SCHEMA = "railenv rating 1"


@dataclass(frozen=True)
class Loss:
    """The loss of stability of one vehicle of a problem, by the linear closed loop.

    Attributes
    ----------
    vehicle : mapping of str to float
        Its varied numbers.
    speed : float or None
        m/s; None if it is unstable at the lowest speed, the highest speed tried if it never is.
    kind : str
        "body hunting ..." or "bogie hunting ..." with its name; "hunting" for a bogie alone; "none".
    frequency : float or None
        Hz.
    """

    vehicle: Mapping[str, float]
    speed: float | None
    kind: str
    frequency: float | None


@dataclass(frozen=True)
class Ride:
    """A run on an irregular line (ERRI B176, low) with noisy sensors, on tangent track.

    Attributes
    ----------
    vehicle : mapping of str to float
    speed : float
        m/s.
    wz : float
        Sperling's lateral ride index, the worst of the bodies whose ride counts.
    acceleration : float
        Rms of the lateral acceleration felt, m/s^2.
    moment, peak : float
        Rms and largest moment of the actuators, as shares of their limits.
    power : float
        Mean magnitude of the power of all actuators on the vehicle, W.
    energy : float
        Energy per metre of track, J.
    instability : float
        Largest running rms of the sum of guiding forces as a share of EN 14363's limit.
    derailed : bool
    """

    vehicle: Mapping[str, float]
    speed: float
    wz: float
    acceleration: float
    moment: float
    peak: float
    power: float
    energy: float
    instability: float
    derailed: bool


@dataclass(frozen=True)
class Curving:
    """A run on a curve with an irregular line, at 150 mm of cant deficiency at most.

    Attributes
    ----------
    radius, cant, speed : float
        m, rad, m/s.
    nadal, unloading : float
        Largest Y/Q and wheel unloading over 2 m as shares of their limits.
    moment : float
        Rms moment of the actuators, as a share of their limits.
    derailed : bool
    """

    radius: float
    cant: float
    speed: float
    nadal: float
    unloading: float
    moment: float
    derailed: bool


@dataclass(frozen=True)
class Failures:
    """The results when something fails.

    Attributes
    ----------
    lost : float or None
        Robust critical speed (m/s) of the vehicle when all actuators do nothing.
    doubled_delay : float or None
        Robust critical speed with twice the transport delay; None if there is none, or the controller
        reads the state, which contains the commands on their way.
    frozen : float
        Running rms of the guiding forces, as a share of EN 14363's limit, in the last part of a run in
        which all sensors freeze after 2 s, at the first ride speed; the worst of new and worn.
    frozen_derailed : bool
    """

    lost: float | None
    doubled_delay: float | None
    frozen: float
    frozen_derailed: bool


@dataclass(frozen=True)
class Margin:
    """Margins of the nominal closed loop at the first ride speed, the least of all commands.

    Attributes
    ----------
    gain : float
        Factor by which the gain may grow.
    phase : float
        Phase margin, rad.
    delay : float or None
        Additional delay, s.
    """

    gain: float
    phase: float
    delay: float | None


@dataclass(frozen=True)
class Rating:
    """The rating of a controller on a problem; speeds in m/s.

    Attributes
    ----------
    problem, controller, observation : str
    losses : tuple of Loss
        Losses of stability of the vehicles at the corners and the middle of the ranges.
    robust : float or None
        Robust critical speed over the ranges; None if some vehicle is unstable at the lowest speed. For
        a controller without linearisation, the worst of some vehicles at the ends of the ranges and
        within, measured in the environment.
    worst : mapping of str to float
        The vehicle that determines it.
    nonlinear : mapping of str to (float or None)
        Speeds up to which an offset of 9 mm dies out, for the nominal vehicle and those at the ends of
        the ranges.
    ride : tuple of Ride
    curving : tuple of Curving
    margin : Margin or None
        Margins; None if the loop is unstable or the controller has no linearisation.
    failures : Failures
    highest_speed : float
        Highest speed of the search, m/s.
    about : mapping
        Record of the controller's design.
    """

    problem: str
    controller: str
    observation: str
    losses: tuple[Loss, ...]
    robust: float | None
    worst: Mapping[str, float]
    nonlinear: Mapping[str, float | None]
    ride: tuple[Ride, ...]
    curving: tuple[Curving, ...]
    margin: Margin | None
    failures: Failures
    highest_speed: float
    about: Mapping[str, Any]

    def lowest(self, kind: str) -> Loss | None:
        """Return the loss of some kind ("body hunting", "bogie hunting", ...) at the lowest speed."""
        known = [loss for loss in self.losses if kind in loss.kind and loss.speed is not None]
        return min(known, key=lambda loss: loss.speed or 0.0, default=None)

    @property
    def worst_ride(self) -> Ride:
        """The run with the highest ride index of those that did not derail, else of all."""
        whole = [ride for ride in self.ride if not ride.derailed] or list(self.ride)
        return max(whole, key=lambda ride: ride.wz)

    def summary(self) -> dict[str, Any]:
        """Return everything as plain numbers and strings, ready for JSON."""
        return {"schema": SCHEMA, **_plain(dataclasses.asdict(self))}

    @classmethod
    def from_summary(cls, data: Mapping[str, Any]) -> Self:
        """Return the rating of a summary.

        Raises
        ------
        ParameterError
            If it is not a summary.
        """
        if data.get("schema") != SCHEMA:
            raise ParameterError(f"this is not a rating of the layout {SCHEMA!r}")
        fields = {name: value for name, value in data.items() if name != "schema"}
        checks.known("field of a rating", fields, [f.name for f in dataclasses.fields(cls)])
        margin = fields["margin"]
        if margin is not None:  # infinite values are stored as None
            limits = {n: math.inf if margin[n] is None else margin[n] for n in ("gain", "phase")}
            margin = Margin(**{**margin, **limits})
        parts = {"losses": Loss, "ride": Ride, "curving": Curving}
        lists = {name: tuple(part(**row) for row in fields[name]) for name, part in parts.items()}
        return cls(**{**fields, **lists, "margin": margin, "failures": Failures(**fields["failures"])})

    def __str__(self) -> str:
        robust = "none" if self.robust is None else f"{self.robust:.1f} m/s"
        return f"{self.controller} on {self.problem}: robust critical speed {robust}"

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the linear critical speed of every vehicle."""
        from agents.problems.rating_plots import plot_ratings

        return plot_ratings([self], ax)


def _plain(value: Any) -> Any:
    """Return data with None in place of infinities, which JSON lacks."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
