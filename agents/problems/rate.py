"""Rating of controllers on problems, all in the same runs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

import design
from agents.controllers.controller import Controller, Floats
from agents.controllers.passive import Passive
from agents.evaluation.growth import measured_critical_speed
from agents.evaluation.nonlinear import Place, disturbed_critical_speed
from agents.evaluation.rollout import Case, Rollout, Track
from agents.problems.problem import Problem
from agents.problems.rating import Curving, Failures, Loss, Margin, Rating, Ride
from design.loop.feedback import Feedback
from railenv import Equipped
from railenv.assessment.ride import wz
from railenv.envs.infos import TERM_NAMES
from railenv.envs.observation import CANT_BASE
from railenv.errors import EquilibriumError

Array = NDArray[np.float64]

CURVES = ((4000.0, 0.0873), (1500.0, 0.0873))
"""m, rad."""

DEFICIENCY = 0.150
"""Cant deficiency on the curves, m."""

_SECONDS, _FREEZES = 12.0, 2.0  # of the runs on irregular track
_SETTLED = 2.0  # s, left out of means
_SAMPLES = 12  # vehicles within the ranges, for the robust critical speed
_NADAL, _UNLOADING, _INSTABILITY = map(TERM_NAMES.index, ("nadal", "unloading", "instability"))


def rate(controller: Controller, problem: Problem, *, name: str | None = None) -> Rating:
    """Rate a controller on a problem.

    Parameters
    ----------
    controller : Controller
        Controller for the problem's vehicle.
    problem : Problem
    name : str, optional
        Name of the controller; its class's name when left out.

    Raises
    ------
    ParameterError
        If the controller does not fit the vehicle.
    """
    return _Rater(problem, problem.model(), controller).rating(name or controller.name)


def rate_passive(problem: Problem, *, damped: bool, name: str | None = None) -> Rating:
    """Rate a problem's vehicle without actuators: with its best passive damper, or without any."""
    model = problem.passive(problem.damper if damped else None)
    told = name or (f"best passive damper ({problem.damper})" if damped else "no yaw damper")
    return _Rater(problem, model, Passive.design(model)).rating(told)


@dataclass
class _Rater:
    """The parts of a rating."""

    problem: Problem
    model: Equipped
    controller: Controller

    def rating(self, name: str) -> Rating:
        """Return all parts."""
        robust, worst = self.robust(self.model)
        return Rating(
            problem=self.problem.name,
            controller=name,
            observation=self.controller.observation,
            losses=tuple(self.losses()),
            robust=robust,
            worst=worst,
            nonlinear=self.nonlinear(),
            ride=tuple(self.ride()),
            curving=tuple(self.curving()),
            margin=self.margin(),
            failures=self.failures(),
            highest_speed=self.problem.speed_range[1],
            about=dict(getattr(self.controller, "about", {})),
        )

    # ------------------------------------------------------------------ critical speeds

    def ends(self) -> tuple[dict[str, float], ...]:
        """Return the vehicles at both ends of the ranges: newest or most worn, least or most creep."""
        ranges = self.problem.ranges
        return tuple(dict(zip(ranges, c, strict=True)) for c in itertools.product(*ranges.values()))

    def losses(self) -> list[Loss]:
        """Return the losses of stability of the vehicles at the corners, and of the nominal one."""
        how = self._loss if isinstance(self.controller, Feedback) else self._measured
        return [how(changes) for changes in ({}, *self.ends())]

    def _measured(self, changes: Mapping[str, float]) -> Loss:
        """Return a vehicle's loss of stability under a controller without linearisation."""
        limits = self.problem.speed_range
        found = measured_critical_speed(self.model, self.controller, limits, vehicle=changes)
        return Loss(changes, found.speed, found.loss, None)

    def _loss(self, changes: Mapping[str, float]) -> Loss:
        model = self.model.replace(**changes) if changes else self.model
        low, top = self.problem.speed_range
        while top > low:
            try:
                found = design.critical_speed(model, controller=self.controller, speed_range=(low, top))
            except EquilibriumError as error:
                top = 0.99 * min(top, error.reached or top)
                continue
            if found.loss == "none":
                return Loss(changes, top, "none", None)
            shape = found.mode_shape
            kind = found.loss if shape is None or found.loss != "hunting" else shape.name
            return Loss(changes, found.speed, kind, found.frequency)
        return Loss(changes, None, "end", None)

    def robust(self, model: Equipped) -> tuple[float | None, dict[str, float]]:
        """Return the robust critical speed and the vehicle that determines it.

        Without a linearisation it is the worst of the vehicles at the ends of the ranges and of some
        within, measured in the environment.
        """
        if not isinstance(self.controller, Feedback):
            return self._worst_measured(model)
        found = design.robust_critical_speed(
            model,
            self.controller,
            self.problem.ranges,
            speed_range=self.problem.speed_range,
            samples=_SAMPLES,
        )
        return found.speed, dict(found.worst)

    def _worst_measured(self, model: Equipped) -> tuple[float | None, dict[str, float]]:
        rater = _Rater(self.problem, model, self.controller)
        losses = [rater._measured(changes) for changes in (*self.ends(), *self.within())]
        worst = min(losses, key=lambda loss: loss.speed or 0.0)
        return worst.speed, dict(worst.vehicle)

    def within(self) -> list[dict[str, float]]:
        """Return a fixed set of vehicles, evenly spread within the ranges."""
        ranges = self.problem.ranges
        low, high = np.array(list(ranges.values())).T
        points = qmc.Halton(len(ranges), scramble=False).random(_SAMPLES + 1)[1:]
        values = (low + (high - low) * points).tolist()
        return [dict(zip(ranges, one, strict=True)) for one in values]

    def nonlinear(self) -> dict[str, float | None]:
        """Return the speeds up to which an offset dies out, for nominal and end vehicles."""
        found = {}
        for changes in ({}, *self.ends()):
            told = ", ".join(f"{name} {value:g}" for name, value in changes.items()) or "nominal"
            found[told] = disturbed_critical_speed(
                self.model,
                self.controller,
                Place(vehicle=changes),
                speed_range=self.problem.speed_range,
            )
        return found

    def margin(self) -> Margin | None:
        """Return the margins at the first ride speed."""
        if not isinstance(self.controller, Feedback) or isinstance(self.controller, Passive):
            return None
        found = design.margins(self.model, self.controller, speed=self.problem.ride_speeds[0])
        if not found.channels:
            return None
        return Margin(
            min(channel.gain_margin for channel in found.channels),
            min(channel.phase_margin for channel in found.channels),
            found.delay_margin,
        )

    # ------------------------------------------------------------------ runs

    def _cases(self) -> list[Case]:
        worn = (self.ends()[0], self.ends()[-1])
        return [Case(v, vehicle=own) for own in worn for v in self.problem.ride_speeds]

    def ride(self) -> list[Ride]:
        """Run newest and most worn wheels on an irregular line."""
        cases = self._cases()
        run = _Run(self.model, self.controller, cases)
        run.go(_SECONDS)
        return [
            Ride(
                vehicle=case.vehicle,
                speed=case.speed,
                wz=run.wz(i),
                acceleration=float(np.sqrt(np.mean(np.square(run.felt[:, i])))),
                moment=float(np.sqrt(np.mean(np.square(run.shares[:, i])))),
                peak=float(np.abs(run.shares[:, i]).max()),
                power=float(run.power[:, i].mean()),
                energy=float(run.power[:, i].mean() / case.speed),
                instability=float(run.terms[:, i, _INSTABILITY].max()),
                derailed=bool(run.derailed[i]),
            )
            for i, case in enumerate(cases)
        ]

    def curving(self) -> list[Curving]:
        """Run on curves with the allowed cant deficiency, at most at ride speed."""
        fastest = self.problem.ride_speeds[-1]
        cases = [
            Case(min(fastest, _passing_speed(radius, cant, self.model.gravity)), radius, cant)
            for radius, cant in CURVES
        ]
        run = _Run(self.model, self.controller, cases)
        run.go(_SECONDS)
        return [
            Curving(
                radius=case.radius,
                cant=case.cant,
                speed=case.speed,
                nadal=float(run.terms[:, i, _NADAL].max()),
                unloading=float(run.terms[:, i, _UNLOADING].max()),
                moment=float(np.sqrt(np.mean(np.square(run.shares[:, i])))),
                derailed=bool(run.derailed[i]),
            )
            for i, case in enumerate(cases)
        ]

    # ------------------------------------------------------------------ failures

    def failures(self) -> Failures:
        """Return the results when actuators do nothing, commands are late or sensors freeze."""
        dead = _Rater(self.problem, self.model, Passive.design(self.model))
        late = None
        if self.controller.observation == "sensors":
            late, _ = self.robust(self.model.replace(delay=2.0 * self.model.delay))
        first = self.problem.ride_speeds[0]
        cases = [case for case in self._cases() if case.speed == first]
        run = _Run(self.model, _Frozen(self.controller, self.model), cases)
        run.go(_SECONDS)
        last = run.terms[len(run.terms) // 2 :, :, _INSTABILITY]
        return Failures(dead.robust(self.model)[0], late, float(last.max()), bool(run.derailed.any()))


def _passing_speed(radius: float, cant: float, gravity: float) -> float:
    """Return the speed (m/s) on a curve with the allowed cant deficiency."""
    return math.sqrt(radius * gravity * (DEFICIENCY / CANT_BASE + cant))


class _Frozen(Controller):
    """A controller whose sensors freeze after some time."""

    def __init__(self, controller: Controller, model: Equipped) -> None:
        self.inner = controller
        self.observation = controller.observation
        self.period = getattr(controller, "period", 0.005)
        self.readings = getattr(controller, "readings", ())
        self.commands = getattr(controller, "commands", model.command_names)
        self._sensors = [
            i
            for i, reading in enumerate(self.readings)
            if reading.name.startswith(("accelerometer_", "gyro_"))
        ] or None

    def reset(self, count: int | None = None) -> None:
        """Start anew."""
        self.inner.reset(count)
        self._steps, self._last = 0, np.zeros(0)

    def act(self, observation: Floats) -> Floats:
        """Return the commands of the controller for its readings."""
        seen = np.array(observation, dtype=float)
        if self._steps * self.period < _FREEZES:
            self._last = seen.copy()
        columns: Any = slice(None) if self._sensors is None else self._sensors
        seen[..., columns] = self._last[..., columns]
        self._steps += 1
        return self.inner.act(seen)


class _Run:
    """A run on an irregular line with noisy sensors, and its readings."""

    def __init__(self, model: Equipped, controller: Controller, cases: Sequence[Case]) -> None:
        self.model = model
        self.rollout = Rollout(model, controller, cases, Track("low", noise=True))
        names = list(model.state_names)
        mounts = model.equipment.mounts
        self._moments = [names.index(mount.state_names[0]) for mount in mounts]
        self._felt = [names.index(f"accel_{body}") for body in model.felt]
        self._rates = np.zeros((len(mounts), len(names)))
        for k, mount in enumerate(mounts):
            rate = "dpsi" if mount.acts == "yaw" else "dy"
            for sign, body in zip((1.0, -1.0), mount.between, strict=True):
                if body in model.body_states:
                    self._rates[k, names.index(model.body_states[body][rate])] = sign

    def go(self, duration: float) -> None:
        """Run for a duration (s); the first seconds do not count."""
        rollout = self.rollout
        felt, shares, power, terms = [], [], [], []
        for k in range(round(duration / rollout.period)):
            rollout.step()
            if k * rollout.period < _SETTLED:
                continue
            x = rollout.fleet.all_states()
            moments = np.clip(x[:, self._moments], -self.model.limits, self.model.limits)
            felt.append(x[:, self._felt])
            shares.append(moments / self.model.limits)
            power.append(np.abs(moments * (x @ self._rates.T)).sum(axis=1))
            terms.append(rollout.fleet.terms.copy())
        self.felt, self.shares = np.array(felt), np.array(shares)
        self.power, self.terms = np.array(power), np.array(terms)
        self.derailed = rollout.derailed

    def wz(self, i: int) -> float:
        """Return the worst lateral ride index of the felt bodies of one case."""
        return max(wz(column, self.rollout.period, "lateral") for column in self.felt[:, i].T)
