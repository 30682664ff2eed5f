"""Evaluation of controllers, the same for all: the speeds up to which a vehicle does not hunt."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import design
from agents.controllers.controller import Controller, equipped
from agents.evaluation.evaluation import CurveResult, Evaluation, Plan
from agents.evaluation.growth import measured_critical_speed
from agents.evaluation.nonlinear import Place, disturbed_critical_speed, ramp_down
from agents.evaluation.rollout import Case, Rollout, Track
from design.loop.feedback import Feedback
from railenv import Equipped, Model
from railenv.envs.metrics import episode_metrics
from railenv.envs.observation import CANT_BASE
from railenv.errors import EquilibriumError

_BEYOND = 1.05  # times the linear critical speed, where hunting is established for the ramp
_MARGIN = 10.0  # m/s
_BACK = 0.99  # of a speed at which there is no equilibrium


def evaluate(
    controller: Controller,
    model: Model,
    *,
    name: str | None = None,
    plan: Plan | None = None,
    progress: bool = False,
) -> Evaluation:
    """Evaluate a controller on a vehicle.

    Parameters
    ----------
    controller : Controller
    model : Model
        Vehicle; with default actuators and sensors if it has none.
    name : str, optional
        Name of the controller; its class's name when left out.
    plan : Plan, optional
    progress : bool
        Show a progress bar.

    Returns
    -------
    Evaluation

    Raises
    ------
    ParameterError
        If the controller does not fit the vehicle.
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
        vehicle=vehicle.vehicle_name,
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
            self._at_frictions(radius, cant),
            self._deficiency_limit(radius, cant),
        )

    def _ramp(self, place: Place, start: float) -> tuple[float | None, bool]:
        """Return the speed at which hunting stops, from a start with an equilibrium."""
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
            limits = self.plan.speed_range
            speed, how = measured_critical_speed(
                model, self.controller, limits, radius=radius, cant=cant
            )
            return speed, how, None
        low, top = self.plan.speed_range
        loss = "none"
        while top > low:
            try:
                found = design.critical_speed(
                    model,
                    radius=radius,
                    cant=cant,
                    controller=self.controller,
                    speed_range=(low, top),
                )
            except EquilibriumError as error:  # vehicle and controller have no common equilibrium
                top, loss = _BACK * min(top, error.reached or top), "end"
                continue
            if found.loss == "none":
                return top, loss, None
            return found.speed, found.loss, found.frequency
        return None, "end", None

    def _at_frictions(self, radius: float, cant: float) -> dict[str, float | None]:
        """Return the disturbed critical speeds at other coefficients of friction, if there are any."""
        if "friction" not in self.model.variable_names:
            return {}
        return {
            f"{mu:g}": disturbed_critical_speed(
                self.model,
                self.controller,
                Place(radius, cant, {"friction": mu}),
                speed_range=self.plan.speed_range,
            )
            for mu in self.plan.frictions
        }

    def _deficiency_limit(self, radius: float, cant: float) -> float | None:
        if math.isinf(radius):
            return None
        return math.sqrt(abs(radius) * self.model.gravity * (0.150 / CANT_BASE + abs(cant)))

    def robust(self, model: Equipped) -> tuple[float | None, dict[str, float]]:
        """Return the critical speed of the worst vehicle within the plan's ranges, and that vehicle."""
        box = self.plan.robust_over(model)
        if not isinstance(self.controller, Feedback) or not box:
            return None, {}
        radius, cant = self.plan.curves[0]
        found = design.robust_critical_speed(
            model,
            self.controller,
            box,
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
            # it reads the commands still on their way, so it is made for its own delay
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
    """Run, and return rms and peak of the applied moments (N m) of each case.

    They are forces (N) if no actuator applies a moment.
    """
    model = rollout.fleet.model
    pairs = list(zip(model.equipment.mounts, model.limits, strict=True))
    chosen = [(m, limit) for m, limit in pairs if m.acts == "yaw"] or pairs
    limits = np.array([limit for _, limit in chosen])
    names = [mount.state_names[0] for mount, _ in chosen]
    moments = np.clip(rollout.run(duration, names).states, -limits, limits)
    return np.sqrt((moments**2).mean(axis=(0, 2))), np.abs(moments).max(axis=(0, 2))
