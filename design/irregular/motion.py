"""A motion under constant conditions, step by step, for sections and exponents."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.shooting import Setting
from railenv import checks
from railenv.equilibrium import find_equilibrium
from railenv.errors import ParameterError, SimulationError
from railenv.models import Model
from railenv.simulation import natural_step

Array = NDArray[np.float64]

DEFAULT_PERTURBATION = 5.0
"""Initial displacement of the first state, in units of the model's scale."""

_FINER = 3.0
"""Factor by which steps are shorter than those of ``simulate``: contact has corners, and a step that
meets one at another phase each time blurs the section of a periodic motion."""

_LOOKS = 16  # states of a motion at which the fastest mode is computed
_MOST_STEPS = 10**9


def setting_of(
    model: Model, speed: float, radius: float, cant: float, inputs: ArrayLike | None
) -> Setting:
    """Return checked running conditions."""
    speed, curvature, cant = checks.speed(speed), checks.curvature(radius), checks.cant(cant)
    model.check_conditions(speed, curvature, cant)
    constant = checks.vector("inputs", inputs, model.input_names)
    return Setting(model, "speed", speed, curvature, cant, constant)


def start_of(
    setting: Setting, initial_state: ArrayLike | None, perturbation: Mapping[str, float] | None
) -> Array:
    """Return the initial state of a motion: the given one, or the running equilibrium.

    The perturbation is added; by default the running equilibrium is displaced by 5 of the model's scale
    in the first state.
    """
    model = setting.model
    if initial_state is not None:
        state = checks.vector("initial_state", initial_state, model.state_names)
    else:
        curvature = setting.curvature
        radius = 1.0 / curvature if curvature else math.inf
        state = find_equilibrium(
            model, speed=setting.speed, radius=radius, cant=setting.cant, inputs=setting.inputs
        ).state.copy()
        if perturbation is None:
            perturbation = {model.state_names[0]: DEFAULT_PERTURBATION * float(model.scale[0])}
    given = checks.mapping("perturbation", perturbation)
    checks.known("state in perturbation", given, model.state_names)
    for name, value in given.items():
        state[model.state_names.index(name)] += checks.number(f"perturbation {name}", value)
    return state


def diverged(setting: Setting, step: float, states: Array) -> SimulationError:
    """Return the error of a motion that is no longer finite after some states (rows)."""
    import control

    model = setting.model
    names = list(model.state_names)
    response = control.TimeResponseData(
        step * np.arange(len(states)),
        states.T,
        states.T,
        issiso=False,
        output_labels=names,
        state_labels=names,
        sysname=model.name,
    )
    return SimulationError(
        f"the state of {model.name} is no longer finite at {setting.speed:g} m/s: the motion diverges, "
        "or the step is too long for it; the `response` of this error holds the last states before",
        response,
    )


class Motion:
    """A motion of a model by Runge-Kutta steps from a state on.

    Parameters
    ----------
    setting : Setting
        Model and running conditions (the speed is that of the setting).
    start : ndarray, shape (n_states,)
    step : float or None
        Longest step, s. None for a twelfth of the time constant of the fastest mode at the start, and,
        once settled, of the fastest one along the motion.
    """

    def __init__(self, setting: Setting, start: Array, step: float | None) -> None:
        self.setting = setting
        model = setting.model
        self._kernels = model.kernels()
        self._layout = self._kernels.LAYOUT
        self._w = np.zeros(self._layout.j)
        self._w[self._layout.p : self._layout.dx], self._t = model.rows()
        self._w[self._layout.u : self._layout.c] = setting.inputs
        self._w[self._layout.c : self._layout.p] = (setting.speed, setting.curvature, setting.cant)
        self.state = start.copy()
        self._chosen = step is None
        self.step = self._natural(start) if step is None else step

    def _natural(self, state: Array) -> float:
        s = self.setting
        longest = natural_step(s.model, state, speed=s.speed, curvature=s.curvature, cant=s.cant)
        return longest / _FINER

    def settle(self, duration: float) -> None:
        """Go on for some time (s); by default the step becomes that of the motion's fastest mode.

        Raises
        ------
        SimulationError
            If the motion diverges.
        """
        if duration == 0.0:
            return
        stride = max(1, math.ceil(duration / self.step / (2 * _LOOKS)))
        states = self.record(2 * _LOOKS, duration / (2 * _LOOKS * stride), stride)
        if self._chosen:
            self.step = min(self.step, *(self._natural(x) for x in states[_LOOKS:]))

    def record(self, rows: int, step: float | None = None, stride: int = 1) -> Array:
        """Go on, and return the state now and after each of some strides of steps.

        Raises
        ------
        SimulationError
            If the motion diverges.
        """
        h = self.step if step is None else step
        if not rows * stride <= _MOST_STEPS:
            raise ParameterError(f"step is {h:g} s; that makes more than {_MOST_STEPS} steps")
        out = np.empty((rows + 1, self.setting.model.n_states))
        self._w[: len(self.state)] = self.state
        good = self._kernels.rk4_record(self._w, self._t, h, stride, out)
        if good < len(out):
            raise diverged(self.setting, h * stride, out[:good])
        self.state = out[-1].copy()
        return out

    def after(self, state: Array, step: float) -> Array:
        """Return the state one step (s) after another; the motion itself does not advance."""
        self._w[: len(state)] = state
        self._kernels.rk4_hold(self._w, self._t, step, 1)
        return self._w[: len(state)].copy()

    def slope(self, state: Array) -> Array:
        """Return the time derivatives of a state."""
        self._w[: len(state)] = state
        self._kernels.rhs(self._w, self._t)
        return self._w[self._layout.dx : self._layout.work].copy()
