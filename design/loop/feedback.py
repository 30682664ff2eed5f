"""Sampled controllers in the analysis of their closed loops: linear, about an equilibrium.

A controller reads signals at the start of each control period and returns commands, held until
the next. Signals are the states of the model (including the sensors' readings ``accel_b``,
``gyro_b``), commands given before (``command_b[-1]`` is the latest), the running conditions
``speed``, ``curvature``, ``cant`` and ``cant_deficiency`` (rad), and the vehicle's own numbers, such as
``conicity``. All are in SI units.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import control
import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.linear.linearization import CONTROL_PERIOD
from railenv import checks
from railenv.equipment import Equipped
from railenv.errors import ParameterError, UnknownNameError, shown
from railenv.models import Model

Array = NDArray[np.float64]

CONDITIONS = ("speed", "curvature", "cant", "cant_deficiency")
"""Signals that do not change with the vehicle's motion."""

_NEWTON_STEPS = 20
_SETTLED = 1e-9  # of the commands (of 1 N m below that)


@runtime_checkable
class Feedback(Protocol):
    """The interface of a controller for the analysis of its closed loop."""

    @property
    def period(self) -> float:
        """Time between commands, s."""

    @property
    def input_labels(self) -> Sequence[str]:
        """Names of the signals it reads."""

    @property
    def output_labels(self) -> Sequence[str]:
        """Names of the model's inputs that it commands."""

    def steady(self, signals: Array) -> Array:
        """Return the commands (N m) at which it settles under constant signals."""

    def linearize(self, signals: Array) -> control.StateSpace:
        """Return its linearisation, in discrete time, about rest at some signals."""


@dataclass(frozen=True)
class LinearFeedback:
    """A linear controller that acts on deviations of signals from the vehicle's own equilibrium.

    It commands nothing at that equilibrium, so the closed loop has the same one.

    Attributes
    ----------
    system : control.StateSpace
        System in discrete time, with the names of the signals and the commands. Its outputs are the
        commands themselves: negative feedback has a negative gain.
    """

    system: control.StateSpace

    def __post_init__(self) -> None:
        if not isinstance(self.system, control.StateSpace) or not self.system.isdtime(strict=True):
            raise ParameterError(
                f"the controller has dt = {getattr(self.system, 'dt', None)!r}; it must be a "
                "control.StateSpace in discrete time (control.c2d samples one in continuous time)"
            )

    @property
    def period(self) -> float:
        """Time between commands, s."""
        return CONTROL_PERIOD if self.system.dt is True else float(self.system.dt)

    @property
    def input_labels(self) -> list[str]:
        """Names of the signals it reads."""
        return list(self.system.input_labels)

    @property
    def output_labels(self) -> list[str]:
        """Names of the model's inputs that it commands."""
        return list(self.system.output_labels)

    def steady(self, signals: Array) -> Array:
        """Return no command: at the equilibrium there is no deviation."""
        return np.zeros(self.system.noutputs)

    def linearize(self, signals: Array) -> control.StateSpace:
        """Return the system itself."""
        return self.system


@dataclass(frozen=True)
class StaticFeedback:
    """Any law without memory, with its Jacobian: commands are a function of the signals.

    Attributes
    ----------
    function : callable
        Takes the signals (ndarray, shape (n_signals,)) and returns the commands, N m.
    jacobian : callable
        Takes the signals and returns the derivatives, shape (n_commands, n_signals).
    input_labels, output_labels : sequence of str
        Names of the signals and of the commands.
    period : float
        s.
    """

    function: Callable[[Array], ArrayLike]
    jacobian: Callable[[Array], ArrayLike]
    input_labels: Sequence[str]
    output_labels: Sequence[str]
    period: float = CONTROL_PERIOD

    def steady(self, signals: Array) -> Array:
        """Return the commands at some signals."""
        return np.asarray(self.function(signals), dtype=float).reshape(len(self.output_labels))

    def linearize(self, signals: Array) -> control.StateSpace:
        """Return the Jacobian as a static gain."""
        shape = (len(self.output_labels), len(self.input_labels))
        gain = np.asarray(self.jacobian(signals), dtype=float).reshape(shape)
        return _static(gain, self.input_labels, self.output_labels, self.period)


@dataclass(frozen=True)
class ScaledFeedback:
    """A controller whose commands are multiplied by a factor on their way to the actuators.

    It does not know the factor: past commands that it reads are those before the factor.

    Attributes
    ----------
    feedback : Feedback
    factor : float
    """

    feedback: Feedback
    factor: float

    def __post_init__(self) -> None:
        checks.number("factor", self.factor)

    @property
    def period(self) -> float:
        """Time between commands, s."""
        return self.feedback.period

    @property
    def input_labels(self) -> list[str]:
        """Names of the signals it reads, without its past commands, which it remembers."""
        return [name for name in self.feedback.input_labels if age_of(name) is None]

    @property
    def output_labels(self) -> list[str]:
        """Names of the model's inputs that it commands."""
        return list(self.feedback.output_labels)

    def steady(self, signals: Array) -> Array:
        """Return the commands (N m) at which it settles, by Newton's method if it reads past ones."""
        return self.factor * self._commands(signals)

    def linearize(self, signals: Array) -> control.StateSpace:
        """Return its linearisation, whose states are the controller's and its past commands."""
        own = self.feedback.linearize(self._all_signals(signals, self._commands(signals)))
        own = control.ss(own, inputs=list(self.feedback.input_labels), outputs=self.output_labels)
        remembering = with_memory(own)
        return control.ss(
            remembering.A,
            remembering.B,
            self.factor * remembering.C,
            self.factor * remembering.D,
            self.period,
            inputs=self.input_labels,
            outputs=self.output_labels,
        )

    def _all_signals(self, signals: Array, commands: Array) -> Array:
        """Return the signals with steady commands in place of past ones."""
        given = iter(signals)
        names = self.output_labels
        ages = [age_of(name) for name in self.feedback.input_labels]
        return np.array([next(given) if a is None else commands[names.index(a[0])] for a in ages])

    def _commands(self, signals: Array) -> Array:
        """Return the commands, before the factor, that reproduce themselves."""
        commands = np.zeros(len(self.output_labels))
        read = [age_of(name) for name in self.feedback.input_labels]
        if not any(read):
            return self.feedback.steady(signals)
        chosen = np.array(
            [[a is not None and a[0] == name for a in read] for name in self.output_labels]
        )
        for _ in range(_NEWTON_STEPS):
            full = self._all_signals(signals, commands)
            excess = commands - self.feedback.steady(full)
            if np.abs(excess).max() <= _SETTLED * max(1.0, float(np.abs(commands).max())):
                return commands
            slope = steady_gain(self.feedback.linearize(full)) @ chosen.T
            commands = commands - np.linalg.solve(np.eye(len(commands)) - slope, excess)
        raise ParameterError(
            "the controller reads its own past commands and does not settle: Newton's method finds no "
            f"steady command (commands still change by {np.abs(excess).max():.3g} N m)"
        )


def with_memory(system: control.StateSpace) -> control.StateSpace:
    """Return a controller with its past commands as states, in place of inputs such as ``u[-1]``.

    Parameters
    ----------
    system : control.StateSpace
        In discrete time, with named inputs and outputs.
    """
    outputs = list(system.output_labels)
    ages = [age_of(name) for name in system.input_labels]
    fresh = [k for k, a in enumerate(ages) if a is None]
    oldest = max((a[1] for a in ages if a is not None), default=0)
    n, m = system.nstates, system.noutputs
    reads = np.zeros((system.ninputs, m * oldest))
    for row, age in enumerate(ages):
        if age is not None:
            reads[row, m * (age[1] - 1) + outputs.index(age[0])] = 1.0
    C = np.hstack([system.C, system.D @ reads])
    A = np.zeros((n + m * oldest,) * 2)
    B = np.zeros((n + m * oldest, len(fresh)))
    A[:n] = np.hstack([system.A, system.B @ reads])
    B[:n] = system.B[:, fresh]
    if oldest:
        A[n : n + m], B[n : n + m] = C, system.D[:, fresh]
        A[n + m :, n : n + m * (oldest - 1)] = np.eye(m * (oldest - 1))
    labels = [system.input_labels[k] for k in fresh]
    return control.ss(A, B, C, system.D[:, fresh], system.dt, inputs=labels, outputs=outputs)


def steady_gain(controller: control.StateSpace) -> Array:
    """Return the gain from steady signals to steady commands, shape (n_commands, n_signals)."""
    if controller.nstates == 0:
        return np.asarray(controller.D)
    inner = np.eye(controller.nstates) - controller.A
    return np.asarray(controller.D + controller.C @ np.linalg.lstsq(inner, controller.B, rcond=None)[0])


def as_feedback(controller: Any, model: Model, period: float | None = None) -> Feedback:
    """Return a controller in the form for the analysis of closed loops.

    Parameters
    ----------
    controller : array_like, control.StateSpace or Feedback
        A matrix K is the state feedback ``u = -K (x - x_0)`` of python-control's ``lqr``, from the
        states of an equipped model, or from those and the commands on their way, in the order of
        :func:`design.discretize`. A linear system acts on deviations from the equilibrium and has the
        names of signals and commands.
    model : Model
    period : float, optional
        Control period, s, if the controller does not have its own; 0.005 s when left out.

    Raises
    ------
    ParameterError
        If it is none of these or its size is wrong.
    UnknownNameError
        If it reads a signal or commands an input that the model does not have.
    """
    if period is not None:
        period = checks.number("period", period, low=0.0, open_low=True, unit="s")
    feedback = _converted(controller, model, period)
    if period is not None and abs(feedback.period - period) > 1e-9 * period:
        raise ParameterError(
            f"period is {period:g} s, but the controller's own is {feedback.period:g} s; leave it out"
        )
    if strange := [name for name in feedback.output_labels if name not in model.input_names]:
        raise UnknownNameError(
            f"command of the controller, which is not for the actuators of {model.name}",
            strange,
            model.command_names if isinstance(model, Equipped) else model.input_names,
        )
    a_vehicle = bool(model.body_names) or "gravity" in model.parameters
    conditions = [c for c in CONDITIONS if c != "cant_deficiency" or a_vehicle]
    signals = [*model.state_names, *conditions, *model.parameters]
    present = [name for name in feedback.input_labels if not _PAST.fullmatch(name)]
    checks.known("signal", present, signals)
    past = [m[1] for name in feedback.input_labels if (m := _PAST.fullmatch(name))]
    checks.known("past command", past, feedback.output_labels)
    return feedback


_PAST = re.compile(r"(\w+)\[-([1-9]\d*)\]")


def age_of(signal: str) -> tuple[str, int] | None:
    """Return name and age of a past command such as ``command_b[-2]``; None for other signals."""
    match = _PAST.fullmatch(signal)
    return (match[1], int(match[2])) if match else None


def _converted(controller: Any, model: Model, period: float | None) -> Feedback:
    if isinstance(controller, control.StateSpace):
        if controller.dt is True and period is not None:
            controller = control.ss(controller, dt=period)
        return LinearFeedback(controller)
    if isinstance(controller, Feedback):
        return controller
    try:
        gain = np.atleast_2d(np.asarray(controller, dtype=float))
    except (OverflowError, TypeError, ValueError):
        raise ParameterError(
            f"controller is {shown(controller)}; it must be a matrix, a control.StateSpace or an "
            "object with `steady` and `linearize` (design.Feedback)"
        ) from None
    if not isinstance(model, Equipped):
        raise ParameterError(
            f"a matrix does not say which inputs of {model.name} it commands; give a "
            "control.StateSpace with named inputs and outputs, or equip the vehicle"
        )
    commands, n = model.command_names, model.n_states
    ages, rest = divmod(gain.shape[1] - n, max(len(commands), 1))
    if gain.ndim != 2 or gain.shape[0] != len(commands) or ages < 0 or rest:
        raise ParameterError(
            f"the gain has shape {gain.shape}; it must have a row for each of "
            f"{', '.join(commands)} and a column for each of the {n} states, then for commands on "
            "their way"
        )
    if not np.isfinite(gain).all():
        raise ParameterError(f"the gain is {shown(gain)}; its entries must be finite")
    past = [f"{name}[-{age}]" for age in range(1, ages + 1) for name in commands]
    return LinearFeedback(
        _static(-gain, [*model.state_names, *past], commands, period or CONTROL_PERIOD)
    )


def _static(
    gain: Array, inputs: Sequence[str], outputs: Sequence[str], period: float
) -> control.StateSpace:
    return control.ss([], [], [], gain, period, inputs=list(inputs), outputs=list(outputs))
