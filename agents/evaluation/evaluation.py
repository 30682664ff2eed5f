"""The plan, the results and the file of a controller's evaluation."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.controllers.service import CONICITY, CREEP_FACTOR, WEAR, varied
from railenv import Model, checks
from railenv.errors import ParameterError, shown
from railenv.files import write_whole

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

SCHEMA = "railenv evaluation 2"

ROBUST_OVER = ("conicity", "creep_factor", "wear")
"""Parameters varied for the robust critical speed, if a vehicle has them: fields of :class:`Plan`."""

_RIDE = (
    "speed",
    "moment_rms",
    "moment_peak",
    "acceleration_rms",
    "acceleration_peak",
    "cfr_213_333",
    "en_14363",
    "derailed",
)


_RANGES = ("conicity", "creep_factor", "wear")
"""Ranges of the robust critical speed in a plan."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The plan of an evaluation.

    Attributes
    ----------
    speed_range : (float, float)
        Range of speeds, m/s; a loop that is unstable at the lowest speed has failed.
    curves : tuple of (float, float)
        Radius (m) and cant (rad) of each; everything is evaluated on the first.
    conicity, creep_factor, wear : (float, float)
        Ranges of the robust critical speed, each for vehicles with a parameter of that name.
    frictions : tuple of float
        Coefficients at which the nonlinear critical speed is found, beside the vehicle's own, for
        vehicles with a parameter ``friction``.
    ride_speeds : tuple of float
        Speeds of runs on irregular track with noisy sensors, m/s.
    ride_duration : float
        Duration of these runs, s.
    delays : tuple of float
        Transport delays of the actuator, s.
    noises : tuple of float
        Factors on noise and bias of the sensors.
    """

    speed_range: tuple[float, float] = (20.0, 400.0)
    curves: tuple[tuple[float, float], ...] = (
        (math.inf, 0.0),
        (10000.0, 0.0873),
        (6250.0, 0.0873),
        (4000.0, 0.0873),
    )
    conicity: tuple[float, float] = CONICITY
    creep_factor: tuple[float, float] = CREEP_FACTOR
    wear: tuple[float, float] = WEAR
    frictions: tuple[float, ...] = (0.1, 0.5)
    ride_speeds: tuple[float, ...] = (80.0, 110.0, 140.0)
    ride_duration: float = 20.0
    delays: tuple[float, ...] = (0.0, 0.01, 0.02, 0.03)
    noises: tuple[float, ...] = (0.0, 1.0, 3.0)

    def __post_init__(self) -> None:
        for name in ("curves", "ride_speeds"):
            if not getattr(self, name):
                raise ParameterError(f"{name} is empty; the evaluation needs at least one")
        for name in _RANGES:
            object.__setattr__(self, name, checks.interval(name, getattr(self, name)))
        checks.number("ride_duration", self.ride_duration, low=1.0, unit="s")

    def robust_over(self, model: Model) -> dict[str, tuple[float, float]]:
        """Return the ranges of the robust critical speed that apply to a vehicle."""
        return varied(model, {name: getattr(self, name) for name in ROBUST_OVER})

    @classmethod
    def quick(cls) -> Plan:
        """Return a plan that takes seconds: tangent track and one curve."""
        return cls(
            curves=((math.inf, 0.0), (6250.0, 0.0873)),
            frictions=(),
            ride_speeds=(80.0,),
            ride_duration=8.0,
            delays=(0.02,),
            noises=(),
        )


@dataclass(frozen=True)
class CurveResult:
    """Critical speeds on one curve, m/s.

    Attributes
    ----------
    radius, cant : float
        m, rad.
    linear : float or None
        From the sampled-data closed loop (or measured, for a controller without linearisation); None if
        unstable at the lowest speed.
    loss : str
        Kind of the loss of stability; "none" if stable up to the highest speed.
    frequency : float or None
        Hz.
    disturbed : float or None
        Speed up to which a lateral offset of 9 mm of all bodies dies out.
    ramp : float or None
        Speed at which established hunting stops when the vehicle slows down; None if it goes on at the
        lowest speed, or was not established.
    established : bool
        Whether hunting could be established: beyond the linear critical speed, or as far as there is a
        running equilibrium.
    disturbed_by_friction : mapping of str to (float or None)
        As ``disturbed``, at other coefficients of friction.
    deficiency_limit : float or None
        Speed at which cant deficiency passes 150 mm, m/s; None on tangent track.
    """

    radius: float
    cant: float
    linear: float | None
    loss: str
    frequency: float | None
    disturbed: float | None
    ramp: float | None
    established: bool
    disturbed_by_friction: Mapping[str, float | None]
    deficiency_limit: float | None

    @property
    def nonlinear(self) -> float | None:
        """The lower of both readings of the nonlinear critical speed, m/s, at most the linear one.

        If hunting cannot be established, only the reading from a disturbance exists. Beyond the linear
        critical speed no motion dies out in the end, however slowly it grows within a simulation. A
        loop that is unstable at the lowest speed has failed, however small its oscillation stays.
        """
        readings = [self.linear, self.disturbed, *([self.ramp] if self.established else [])]
        known = [speed for speed in readings if speed is not None]
        return min(known) if len(known) == len(readings) else None

    @property
    def name(self) -> str:
        """Name of the curve."""
        return "tangent" if math.isinf(self.radius) else f"R = {self.radius:g} m"


@dataclass(frozen=True)
class Evaluation:
    """The results of a controller; speeds in m/s.

    Attributes
    ----------
    controller, model_name, vehicle, observation : str
    curves : tuple of CurveResult
    robust : float or None
        Critical speed of the worst vehicle within the ranges of the plan, on the first curve; None if
        a vehicle is unstable at the lowest speed, the controller has no linearisation, or the vehicle
        has none of the parameters.
    worst : mapping of str to float
        The vehicle that determines it, by the parameters that were varied.
    ride : tuple of mapping
        For each run on irregular track: speed, rms and peak moment of the yaw actuators (N m; force of
        the lateral ones, N, if there are only those), rms and peak acceleration (m/s^2), readings of
        49 CFR 213.333 and EN 14363 as shares of their limits, and whether it derailed.
    delays : mapping of str to (linear, robust)
        Critical speeds at other delays (s).
    noises : mapping of str to float
        Rms moment (N m) at the first ride speed, on smooth track, by factor on the noise.
    about : mapping
        Record of the controller's design.
    plan : Plan
    """

    controller: str
    model_name: str
    vehicle: str
    observation: str
    curves: tuple[CurveResult, ...]
    robust: float | None
    worst: Mapping[str, float]
    ride: tuple[Mapping[str, float], ...]
    delays: Mapping[str, tuple[float | None, float | None]]
    noises: Mapping[str, float]
    about: Mapping[str, Any]
    plan: Plan = field(repr=False)

    @property
    def linear(self) -> float | None:
        """Linear critical speed on the first curve."""
        return self.curves[0].linear

    @property
    def nonlinear(self) -> float | None:
        """Nonlinear critical speed on the first curve."""
        return self.curves[0].nonlinear

    @property
    def robust_over(self) -> str:
        """Ranges of the robust critical speed, in words."""
        names = list(self.worst) or ["conicity", "creep_factor"]
        ranges = ((name.replace("_", " "), *getattr(self.plan, name)) for name in names)
        return ", ".join(f"{name} {low:g} to {high:g}" for name, low, high in ranges)

    def summary(self) -> dict[str, Any]:
        """Return everything as plain numbers and strings, ready for JSON."""
        data = dataclasses.asdict(self)
        data["plan"]["curves"] = [[_finite(r), c] for r, c in self.plan.curves]
        for row, curve in zip(data["curves"], self.curves, strict=True):
            row["radius"] = _finite(curve.radius)
            row["nonlinear"] = curve.nonlinear
        return {"schema": SCHEMA, **data}

    @classmethod
    def from_summary(cls, data: Mapping[str, Any]) -> Evaluation:
        """Return the evaluation of a summary.

        Raises
        ------
        ParameterError
            If it is not a summary.
        """
        if data.get("schema") != SCHEMA:
            raise ParameterError(f"this is not an evaluation of the layout {SCHEMA!r}")
        plan = {k: _tuples(v) for k, v in data["plan"].items()}
        plan["curves"] = tuple((math.inf if r is None else r, c) for r, c in data["plan"]["curves"])
        curves = []
        for row in data["curves"]:
            known = {k: v for k, v in row.items() if k != "nonlinear"}
            known["radius"] = math.inf if known["radius"] is None else known["radius"]
            curves.append(CurveResult(**known))
        rest = {
            k: v for k, v in data.items() if k not in ("schema", "plan", "curves", "ride", "delays")
        }
        if not curves or not data["ride"]:
            raise ParameterError("an evaluation must have curves and runs on irregular track")
        for name in ("controller", "model_name", "vehicle", "observation"):
            if not isinstance(data[name], str):
                raise ParameterError(f"{name} is {shown(data[name])}; it must be a text")
        for row in data["ride"]:
            if set(row) != set(_RIDE):
                raise ParameterError(
                    f"ride has the readings {shown(sorted(row))}; it must have {_RIDE}"
                )
        _check_numbers(
            "curves", [{k: v for k, v in row.items() if k != "loss"} for row in data["curves"]]
        )
        checks.known("number in worst", data["worst"], _RANGES)
        for name in ("robust", "ride", "delays", "noises", "worst", "plan"):
            _check_numbers(name, data[name])
        return cls(
            curves=tuple(curves),
            ride=tuple(data["ride"]),
            delays={k: _pair(v) for k, v in data["delays"].items()},
            plan=Plan(**plan),
            **rest,
        )

    def __str__(self) -> str:
        top = self.plan.speed_range[1]
        return (
            f"{self.controller}: linear {written(self.linear, top)}, "
            f"nonlinear {written(self.nonlinear, top)}, "
            f"robust {written(self.robust, top)} m/s"
        )

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the critical speeds on all curves as bars."""
        from agents.evaluation.evaluation_plots import plot_evaluation

        return plot_evaluation(self, ax)


def save_evaluations(evaluations: Sequence[Evaluation], path: str | PathLike[str]) -> None:
    """Write evaluations to a JSON file, one per line."""
    lines = ",\n".join(json.dumps(e.summary(), allow_nan=False) for e in evaluations)
    write_whole(path, f"[\n{lines}\n]\n")


def load_evaluations(path: str | PathLike[str]) -> list[Evaluation]:
    """Read evaluations from a JSON file.

    Raises
    ------
    ParameterError
        If the file is damaged or holds something else.
    """
    try:
        rows = json.loads(Path(path).read_text(encoding="utf-8"))
        return [Evaluation.from_summary(row) for row in rows]
    except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
        raise ParameterError(f"{path} is not a file of evaluations: {error}") from None


def written(speed: float | None, highest: float) -> str:
    """Return a speed for a table: failed, a number, or above the highest tried."""
    if speed is None:
        return "failed"
    return f"> {highest:g}" if speed >= highest * (1.0 - 1e-9) else f"{speed:.1f}"


def _check_numbers(name: str, value: Any) -> None:
    """Raise ParameterError unless all entries of plain data are numbers, true, false or None."""
    if isinstance(value, Mapping):
        for key, entry in value.items():
            _check_numbers(f"{name}.{key}", entry)
    elif isinstance(value, (list, tuple)):
        for entry in value:
            _check_numbers(name, entry)
    elif value is not None and not isinstance(value, bool):
        checks.number(name, value)


def _finite(value: float) -> float | None:
    return None if math.isinf(value) else value


def _pair(value: Any) -> tuple[float | None, float | None]:
    first, second = value
    return first, second


def _tuples(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
