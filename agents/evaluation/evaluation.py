"""How much faster a vehicle runs without hunting: the evaluation that every controller gets alike."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import design
from agents.controllers.controller import Controller, equipped
from agents.evaluation.growth import growth_rates
from agents.evaluation.nonlinear import Place, disturbed_critical_speed, ramp_down
from agents.evaluation.rollout import Case, Rollout, Track
from design.loop.feedback import Feedback
from railenv import Bogie, DualWheelset, Equipped, checks
from railenv.envs.metrics import episode_metrics
from railenv.envs.observation import CANT_BASE
from railenv.errors import EquilibriumError, ParameterError, shown
from railenv.files import write_whole

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

SCHEMA = "railenv evaluation 1"

_BEYOND = 1.05  # of the linear critical speed, where hunting is established for the ramp
_MARGIN = 10.0  # m/s
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


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is evaluated.

    Attributes
    ----------
    speed_range : (float, float)
        m/s; a loop that is unstable at the lowest speed has failed.
    curves : tuple of (float, float)
        Radius (m) and cant (rad) of each; the first is where everything is evaluated.
    conicity : (float, float)
        Range of the robust critical speed.
    frictions : tuple of float
        Coefficients at which the nonlinear critical speed is looked at, beside the vehicle's own.
    ride_speeds : tuple of float
        m/s, of runs on irregular track with noisy sensors.
    ride_duration : float
        s.
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
    conicity: tuple[float, float] = (0.05, 0.4)
    frictions: tuple[float, ...] = (0.1, 0.5)
    ride_speeds: tuple[float, ...] = (80.0, 110.0, 140.0)
    ride_duration: float = 20.0
    delays: tuple[float, ...] = (0.0, 0.01, 0.02, 0.03)
    noises: tuple[float, ...] = (0.0, 1.0, 3.0)

    def __post_init__(self) -> None:
        for name in ("curves", "ride_speeds"):
            if not getattr(self, name):
                raise ParameterError(f"{name} is empty; the evaluation needs at least one")
        checks.number("ride_duration", self.ride_duration, low=1.0, unit="s")

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
        How stability is lost there; "none" if it is not, up to the highest speed.
    frequency : float or None
        Hz.
    disturbed : float or None
        Up to where a lateral offset of 9 mm of all bodies dies out.
    ramp : float or None
        Where established hunting stops when the vehicle slows down; None if it goes on at the lowest
        speed, or was not established.
    established : bool
        Whether hunting could be established at all: beyond the linear critical speed, or as far as
        there is a running equilibrium.
    disturbed_by_friction : mapping of str to (float or None)
        As ``disturbed``, at other coefficients of friction.
    deficiency_limit : float or None
        m/s, where cant deficiency passes 150 mm; None on tangent track.
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

        Where hunting cannot be established there is only the one from a disturbance. Beyond the linear
        critical speed nothing dies out in the end, however slowly it grows within a simulation. A loop
        that is unstable at the lowest speed has failed, however small its oscillation stays.
        """
        readings = [self.linear, self.disturbed, *([self.ramp] if self.established else [])]
        known = [speed for speed in readings if speed is not None]
        return min(known) if len(known) == len(readings) else None

    @property
    def name(self) -> str:
        """What to call the curve."""
        return "tangent" if math.isinf(self.radius) else f"R = {self.radius:g} m"


@dataclass(frozen=True)
class Evaluation:
    """What a controller reached; speeds in m/s.

    Attributes
    ----------
    controller, model_name, vehicle, observation : str
    curves : tuple of CurveResult
    robust : float or None
        Robust critical speed over conicity, on the first curve; None if a vehicle is unstable at the
        lowest speed, or the controller has no linearisation.
    worst : mapping of str to float
        The vehicle that sets it.
    ride : tuple of mapping
        Of each run on irregular track: speed, rms and peak moment (N m), rms and peak acceleration
        (m/s^2), readings of 49 CFR 213.333 and EN 14363 as shares of their limits, whether it derailed.
    delays : mapping of str to (linear, robust)
        Critical speeds at other delays (s).
    noises : mapping of str to float
        Rms moment (N m) at the first ride speed, on smooth track, by factor on the noise.
    about : mapping
        How the controller was designed.
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
            If it is none.
        """
        if data.get("schema") != SCHEMA:
            raise ParameterError(f"this is no evaluation of the layout {SCHEMA!r}")
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


def evaluate(
    controller: Controller,
    model: Bogie | DualWheelset | Equipped,
    *,
    name: str | None = None,
    plan: Plan | None = None,
    progress: bool = False,
) -> Evaluation:
    """Evaluate a controller on a vehicle.

    Parameters
    ----------
    controller : Controller
    model : Bogie, DualWheelset or Equipped
        With default actuators and sensors if it has none.
    name : str, optional
        What to call the controller; its class's name when left out.
    plan : Plan, optional
    progress : bool
        Show a progress bar.

    Returns
    -------
    Evaluation

    Raises
    ------
    ParameterError
        If the controller does not suit the vehicle.
    """
    vehicle = equipped(model)
    todo = Plan() if plan is None else plan
    worker = _Evaluator(vehicle, controller, todo)
    curves: Iterable[tuple[float, float]] = todo.curves
    if progress:
        from rich.progress import track

        curves = track(list(todo.curves), description=f"evaluating {name or controller.name}")
    results = tuple(worker.curve(radius, cant) for radius, cant in curves)
    robust, worst = worker.robust(vehicle)
    return Evaluation(
        controller=name or controller.name,
        model_name=vehicle.name,
        vehicle=vehicle.plant.vehicle.name,
        observation=controller.observation,
        curves=results,
        robust=robust,
        worst=worst,
        ride=tuple(worker.ride()),
        delays={f"{delay:g}": worker.with_delay(delay) for delay in todo.delays},
        noises={f"{factor:g}": worker.with_noise(factor) for factor in todo.noises},
        about=dict(getattr(controller, "about", {})),
        plan=todo,
    )


@dataclass
class _Evaluator:
    """The parts of an evaluation."""

    model: Equipped
    controller: Controller
    plan: Plan

    def curve(self, radius: float, cant: float) -> CurveResult:
        linear, loss, frequency = self.linear(self.model, radius, cant)
        low, top = self.plan.speed_range
        place = Place(radius, cant)
        disturbed = disturbed_critical_speed(
            self.model, self.controller, place, speed_range=self.plan.speed_range
        )
        start = min(top, max(_BEYOND * (linear or 0.0), (disturbed or 0.0) + _MARGIN, 2.0 * low))
        ramp, established = self._ramp(place, start)
        return CurveResult(
            radius,
            cant,
            linear,
            loss,
            frequency,
            disturbed,
            ramp,
            established,
            {f"{mu:g}": self._at_friction(radius, cant, mu) for mu in self.plan.frictions},
            self._deficiency_limit(radius, cant),
        )

    def _ramp(self, place: Place, start: float) -> tuple[float | None, bool]:
        """Return where hunting stops, from a start at which there is an equilibrium."""
        while True:
            try:
                found = ramp_down(
                    self.model, self.controller, place, start=start, lowest=self.plan.speed_range[0]
                )
            except EquilibriumError:
                start *= 0.95
                if start <= self.plan.speed_range[0]:
                    return None, False
                continue
            return (found.stops if found.established else None), found.established

    def linear(
        self, model: Equipped, radius: float, cant: float
    ) -> tuple[float | None, str, float | None]:
        """Return linear critical speed, loss and frequency."""
        if not isinstance(self.controller, Feedback):
            return self._measured(model, radius, cant)
        try:
            found = design.critical_speed(
                model,
                radius=radius,
                cant=cant,
                controller=self.controller,
                speed_range=self.plan.speed_range,
            )
        except EquilibriumError:
            return None, "end", None
        speed = self.plan.speed_range[1] if found.loss == "none" else found.speed
        return speed, found.loss, found.frequency

    def _measured(
        self, model: Equipped, radius: float, cant: float
    ) -> tuple[float | None, str, float | None]:
        """Return the speed up to which small motions decay in the environment, refined in rounds."""
        low, high = self.plan.speed_range
        speeds = np.geomspace(low, high, 32)
        for _ in range(3):
            try:
                rates = growth_rates(model, self.controller, speeds.tolist(), radius=radius, cant=cant)
            except EquilibriumError:
                speeds = np.linspace(speeds[0], speeds[-1] * 0.9, len(speeds))
                continue
            growing = np.flatnonzero(rates >= 0.0)
            if not len(growing):
                return float(speeds[-1]), "none", None
            k = int(growing[0])
            if k == 0:
                return None, "unstable at start", None
            share = -rates[k - 1] / (rates[k] - rates[k - 1])
            result = float(speeds[k - 1] + share * (speeds[k] - speeds[k - 1]))
            speeds = np.linspace(speeds[k - 1], speeds[k], len(speeds))
        return result, "hunting", None

    def _at_friction(self, radius: float, cant: float, friction: float) -> float | None:
        place = Place(radius, cant, {"friction": friction})
        return disturbed_critical_speed(
            self.model, self.controller, place, speed_range=self.plan.speed_range
        )

    def _deficiency_limit(self, radius: float, cant: float) -> float | None:
        if math.isinf(radius):
            return None
        gravity = self.model.plant.vehicle.gravity
        return math.sqrt(abs(radius) * gravity * (0.150 / CANT_BASE + abs(cant)))

    def robust(self, model: Equipped) -> tuple[float | None, dict[str, float]]:
        """Return the robust critical speed over conicity, and the worst vehicle."""
        if not isinstance(self.controller, Feedback):
            return None, {}
        radius, cant = self.plan.curves[0]
        found = design.robust_critical_speed(
            model,
            self.controller,
            {"conicity": self.plan.conicity},
            radius=radius,
            cant=cant,
            speed_range=self.plan.speed_range,
            samples=24,
        )
        return found.speed, dict(found.worst)

    def with_delay(self, delay: float) -> tuple[float | None, float | None]:
        """Return linear and robust critical speed at another delay."""
        model = self.model.replace(delay=delay)
        if self.controller.observation == "state":
            # the commands on their way are part of what it reads: it is made for its own delay
            return None, None
        return self.linear(model, *self.plan.curves[0])[0], self.robust(model)[0]

    def with_noise(self, factor: float) -> float:
        """Return the rms moment (N m) at the first ride speed, on smooth track, with scaled noise."""
        s = self.model.sensors
        model = self.model.replace(
            accelerometer_noise=factor * s.accelerometer_noise,
            gyro_noise=factor * s.gyro_noise,
            accelerometer_bias=factor * s.accelerometer_bias,
            gyro_bias=factor * s.gyro_bias,
        )
        radius, cant = self.plan.curves[0]
        case = Case(self.plan.ride_speeds[0], radius, cant)
        rollout = Rollout(model, self.controller, [case], Track(noise=True))
        return float(_moments(rollout, self.plan.ride_duration)[0][0])

    def ride(self) -> Sequence[Mapping[str, float]]:
        """Run on irregular track with noisy sensors."""
        radius, cant = self.plan.curves[0]
        cases = [Case(speed, radius, cant) for speed in self.plan.ride_speeds]
        rollout = Rollout(self.model, self.controller, cases, Track("low", noise=True))
        rms, peak = _moments(rollout, self.plan.ride_duration)
        rows = []
        for i, case in enumerate(cases):
            metrics = episode_metrics(rollout.fleet, i)
            rows.append(
                {
                    "speed": case.speed,
                    "moment_rms": float(rms[i]),
                    "moment_peak": float(peak[i]),
                    "acceleration_rms": metrics["acceleration_rms"],
                    "acceleration_peak": metrics["acceleration_peak"],
                    "cfr_213_333": metrics["cfr_213_333"],
                    "en_14363": metrics["en_14363"],
                    "derailed": float(rollout.derailed[i]),
                }
            )
        return rows


def _moments(rollout: Rollout, duration: float) -> Any:
    """Run, and return rms and peak of the applied moments (N m) of each case."""
    names = [n for n in rollout.fleet.model.state_names if n.startswith("T_")]
    limit = rollout.fleet.model.actuator.limit
    moments = np.clip(rollout.run(duration, names).states, -limit, limit)
    return np.sqrt((moments**2).mean(axis=(0, 2))), np.abs(moments).max(axis=(0, 2))


def save_evaluations(evaluations: Sequence[Evaluation], path: str | PathLike[str]) -> None:
    """Write evaluations to a JSON file."""
    rows = [e.summary() for e in evaluations]
    write_whole(path, json.dumps(rows, indent=1, allow_nan=False) + "\n")


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
    """Return a speed for a table: failed, a number, or beyond the highest looked at."""
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
