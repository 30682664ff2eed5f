"""Eigenvalues of a vehicle at one speed over any of its parameters, or over its controller's gain."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.linear.quantities import meaning_of
from design.loop.dynamics import Dynamics, dynamics
from design.loop.feedback import ScaledFeedback, as_feedback
from design.loop.sampled import SampledDynamics
from design.stability.locus import VehicleLocus, while_running
from design.stability.modes import Modes
from railenv import checks
from railenv.equilibrium import follow_speeds
from railenv.errors import ParameterError, shown
from railenv.models import Model

Array = NDArray[np.float64]

GAIN = "gain"
"""Name of the factor on a controller's commands."""


class ParameterLocus(VehicleLocus):
    """Eigenvalues over a parameter at one speed; the attributes of :class:`VehicleLocus`, and this.

    Attributes
    ----------
    speed : float
        m/s.
    """

    _family: _Parameters

    @property
    def speed(self) -> float:
        """Forward speed, m/s."""
        return self._family.speed


def parameter_locus(
    model: Model,
    parameter: str,
    values: ArrayLike,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    controller: Any | None = None,
    period: float | None = None,
) -> ParameterLocus:
    """Compute the eigenvalues over a parameter of the vehicle, or over the gain of its controller.

    Parameters
    ----------
    model : Model
    parameter : str
        One of ``model.variable_names`` (of a :class:`railenv.Equipped` model also quantities of its
        actuator and sensors, such as ``delay``), or "gain": a factor on the controller's commands.
    values : array_like
        At least two increasing values.
    speed : float
        Forward speed, m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).
    controller : array_like, control.StateSpace or Feedback, optional
        Controller that closes the loop once per control period (:func:`design.closed_loop`).
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.

    Returns
    -------
    ParameterLocus
        If the equilibrium ends at some value, the locus ends there, with a warning, and ``ended`` says
        why.

    Raises
    ------
    UnknownNameError
        If the model has no such parameter, or "gain" is requested without a controller.
    EquilibriumError
        If there is no equilibrium even at the second value.

    Examples
    --------
    >>> import design, railenv
    >>> coach = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    >>> locus = design.parameter_locus(coach, "conicity", [0.05, 0.1, 0.15, 0.2], speed=110.0)
    >>> print(locus.critical_points[0])
    stability lost at conicity = 0.120143 at 4.6516 Hz
    """
    targets = _checked(model, parameter, values, controller)
    checks.curvature(radius)
    conditions = checks.speed(speed), float(radius), checks.cant(cant)
    family = _Parameters(model, parameter, *conditions, controller, period, 0)
    memory = max(family.memory(float(targets[0])), family.memory(float(targets[-1])))
    family = dataclasses.replace(family, least_memory=memory)
    modes = (family.modes(value) for value in targets.tolist())
    found, ended = while_running(modes, f"locus over {parameter}")
    return ParameterLocus(targets[: len(found)], found, family, ended=ended)


def _checked(model: Model, parameter: str, values: ArrayLike, controller: Any | None) -> Array:
    """Return the values of a parameter that exists."""
    targets = checks.numbers("values", values, least=2)
    if not (np.diff(targets) > 0.0).all():
        raise ParameterError(f"values is {shown(values)}; the values must increase")
    allowed = [*model.variable_names, *([GAIN] if controller is not None else [])]
    checks.known("parameter", [parameter], allowed)
    if controller is not None and parameter == GAIN and GAIN in model.variable_names:
        raise ParameterError(
            f"{GAIN!r} is a parameter of {model.name} and the factor on its controller's commands; "
            "rename the model's"
        )
    return targets


@dataclass(frozen=True)
class _Parameters:
    """The linear systems of a vehicle over a parameter."""

    model: Model
    parameter: str
    speed: float
    radius: float
    cant: float
    controller: Any | None
    own_period: float | None
    least_memory: int

    @property
    def name(self) -> str:
        return self.model.name

    @property
    def unit(self) -> str:
        known = {GAIN: "1"} if self.controller is not None else {}
        return known.get(self.parameter) or meaning_of(self.model, self.parameter).unit

    @property
    def period(self) -> float | None:
        if self.controller is None:
            return None
        return as_feedback(self.controller, self.model, self.own_period).period

    @property
    def condition(self) -> str:
        from design.style import curve_title

        return f"{self.speed:g} m/s, {curve_title(self.radius, self.cant)}"

    def at(self, value: float) -> tuple[Model, Dynamics]:
        """Return the model and its dynamics at a value."""
        if self.controller is not None and self.parameter == GAIN:
            own = as_feedback(self.controller, self.model, self.own_period)
            scaled = ScaledFeedback(own, value)
            return self.model, dynamics(self.model, scaled, None, self.least_memory)
        changed = self.model.replace(**{self.parameter: value})
        return changed, dynamics(changed, self.controller, self.own_period, self.least_memory)

    def memory(self, value: float) -> int:
        """Return the number of periods for which commands are states of the map at a value."""
        found = self.at(value)[1]
        return found.memory if isinstance(found, SampledDynamics) else 0

    def modes(self, value: float) -> Modes:
        changed, judged_by = self.at(value)
        (point,) = follow_speeds(changed, [self.speed], radius=self.radius, cant=self.cant)
        conditions = (self.speed, checks.curvature(self.radius), self.cant)
        return Modes(*judged_by.modes(point, conditions), point.state)
