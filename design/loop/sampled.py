"""Sampled-data closed loops: a vehicle with a controller that acts once per control period.

The motion over one period is a map of (states, commands on their way, controller's states). Between
samples the vehicle is in continuous time: its part of the map is the exact transition of the linear
equations, with the actuator's delay at its exact place within the period. The closed loop is
stable if the map's eigenvalues, its multipliers, lie within the unit circle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import control
import numpy as np
from numpy.typing import NDArray

from design.linear.linearization import discretize, held_inputs
from design.loop.feedback import CONDITIONS, Feedback, age_of, as_feedback, steady_gain, with_memory
from railenv import checks
from railenv.equilibrium import Point, find_equilibrium
from railenv.equipment import Equipped
from railenv.errors import EquilibriumError
from railenv.models import Model

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_STEADY = 1e-9  # of a command's typical size: change that counts as settled
_SETTLED = 1e-6  # last change of a state, in units of the model's scale
_NEWTON_STEPS = 20
_SMALLEST_MULTIPLIER = 1e-12  # forgotten by the map within a period


@dataclass(frozen=True)
class ClosedLoop:
    """A closed loop at one running condition.

    Attributes
    ----------
    model_name : str
    speed, radius, cant : float
        m/s, m (``math.inf`` on tangent track), rad.
    state : ndarray, shape (n_states,)
        Equilibrium of the vehicle under the controller.
    commands : ndarray
        Steady commands there, N m.
    system : control.StateSpace
        The map over one period: states are the vehicle's, commands on their way, then the
        controller's. Inputs are disturbances of the vehicle's inputs, held over a period (moments
        commanded beside the controller's come without delay); outputs are the vehicle's states and the
        commands.
    """

    model_name: str
    speed: float
    radius: float
    cant: float
    state: Array
    commands: Array
    system: control.StateSpace

    @property
    def period(self) -> float:
        """Control period, s."""
        return float(self.system.dt)

    @property
    def multipliers(self) -> Complex:
        """Eigenvalues of the map, the largest first."""
        values = np.linalg.eigvals(self.system.A)
        return values[np.argsort(-np.abs(values))]

    @property
    def spectral_radius(self) -> float:
        """Largest magnitude of a multiplier; below 1 the loop is stable."""
        return float(np.abs(self.multipliers[0]))

    @property
    def eigenvalues(self) -> Complex:
        """Multipliers as eigenvalues in continuous time (1/s), up to aliases of the frequency."""
        return continuous(self.multipliers, self.period)

    @property
    def growth(self) -> float:
        """Growth rate (1/s) of the least stable mode."""
        return float(self.eigenvalues[0].real)

    @property
    def stable(self) -> bool:
        """Whether small motions die out."""
        return self.spectral_radius < 1.0

    @property
    def damping(self) -> Array:
        """Damping ratio of each mode, in the order of ``multipliers``."""
        values = self.eigenvalues
        return -values.real / np.maximum(np.abs(values), 1e-300)

    @property
    def frequency(self) -> Array:
        """Frequency (Hz) of each mode."""
        return np.abs(self.eigenvalues.imag) / (2.0 * math.pi)

    def __str__(self) -> str:
        worst = self.eigenvalues[0]
        word = "stable" if self.stable else "unstable"
        return (
            f"{self.model_name} with its controller at {self.speed:g} m/s: {word}, spectral radius "
            f"{self.spectral_radius:.6f}, slowest mode {worst.real:+.4g} 1/s at "
            f"{abs(worst.imag) / (2.0 * math.pi):.4g} Hz"
        )

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the multipliers in the unit circle."""
        from design.loop.sampled_plots import plot_multipliers

        return plot_multipliers(self, ax)


def closed_loop(
    model: Model,
    controller: Any,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    period: float | None = None,
    delay: float | None = None,
) -> ClosedLoop:
    """Close the loop of a vehicle and a controller about their common equilibrium.

    Parameters
    ----------
    model : Model
        A :class:`railenv.Equipped` vehicle, or any other model whose inputs the controller commands.
    controller : array_like, control.StateSpace or Feedback
        See :func:`design.loop.feedback.as_feedback`.
    speed : float
        Forward speed, m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.
    delay : float, optional
        Transport delay of the commands, s; the actuator's own, or none.

    Returns
    -------
    ClosedLoop

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium, or none under the controller.
    """
    dynamics = SampledDynamics(model, controller, period=period, delay=delay)
    return dynamics.closed(dynamics.settled(speed, radius, cant), radius)


def open_loop(
    model: Model,
    controller: Any,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    period: float | None = None,
    delay: float | None = None,
) -> control.StateSpace:
    """Open the loop of a vehicle and a controller at the commands, about their common equilibrium.

    Parameters and errors are those of :func:`closed_loop`.

    Returns
    -------
    control.StateSpace
        L in discrete time, from commands to minus commands: the closed loop is ``1 + L``, as in
        python-control's ``margin`` and ``root_locus_map``. Past commands that the controller reads are
        its own.
    """
    dynamics = SampledDynamics(model, controller, period=period, delay=delay)
    return dynamics.loop(*dynamics.settled(speed, radius, cant))


class Settled(NamedTuple):
    """An equilibrium under a controller.

    Attributes
    ----------
    state, commands : ndarray
    jacobian : ndarray
        The model's full Jacobian there.
    conditions : (float, float, float)
        Speed (m/s), curvature (1/m), cant (rad).
    """

    state: Array
    commands: Array
    jacobian: Array
    conditions: tuple[float, float, float]


class SampledDynamics:
    """The map over one control period along a branch of equilibria, for searches and loci.

    Parameters are those of :func:`closed_loop`, and ``memory``: the least number of periods for which
    commands are states of the map, so that maps for different delays have the same size.
    """

    def __init__(
        self,
        model: Model,
        controller: Any,
        *,
        period: float | None = None,
        delay: float | None = None,
        memory: int = 0,
    ) -> None:
        self.model = model
        self.feedback: Feedback = as_feedback(controller, model, period)
        self.period = self.feedback.period
        own = model.delay if isinstance(model, Equipped) else 0.0
        self.delay = own if delay is None else checks.number("delay", delay, low=0.0, unit="s")
        self._commands = [model.input_names.index(name) for name in self.feedback.output_labels]
        self._evaluator = model.evaluator()
        self._scale = model.scale
        self._gravity = model.gravity
        self._sizes = self._typical_commands()
        whole = math.floor(self.delay / self.period + 1e-9)
        exact = self.delay - whole * self.period < 1e-9 * self.period
        read = [found[1] for name in self.feedback.input_labels if (found := age_of(name))]
        self._ages = max([whole if exact else whole + 1, memory, *read])
        self._selection = self._selected()

    @property
    def memory(self) -> int:
        """Number of periods for which commands are states of the map."""
        return self._ages

    def _selected(self) -> Array:
        """Return the matrix that selects the controller's signals from states and past commands."""
        m = len(self._commands)
        n = self.model.n_states
        matrix = np.zeros((len(self.feedback.input_labels), n + m * self._ages))
        for row, name in enumerate(self.feedback.input_labels):
            past = age_of(name)
            if past is not None:
                command = list(self.feedback.output_labels).index(past[0])
                matrix[row, n + m * (past[1] - 1) + command] = 1.0
            elif name in self.model.state_names:
                matrix[row, self.model.state_names.index(name)] = 1.0
        return matrix

    def _signals(self, state: Array, commands: Array, conditions: tuple[float, float, float]) -> Array:
        speed, curvature, cant = conditions
        known = (speed, curvature, cant, speed * speed * curvature / self._gravity - cant)
        values = self._selection @ np.concatenate([state, np.tile(commands, self._ages)])
        for row, name in enumerate(self.feedback.input_labels):
            if name in CONDITIONS:
                values[row] = known[CONDITIONS.index(name)]
            elif name in self.model.parameters and name not in self.model.state_names:
                values[row] = self.model.parameters[name]
        return values

    def settled(self, speed: float, radius: float, cant: float) -> Settled:
        """Return the common equilibrium of vehicle and controller at a speed on a curve.

        Parameters and errors are those of :func:`closed_loop`.
        """
        found = find_equilibrium(self.model, speed=speed, radius=radius, cant=cant)
        conditions = (float(speed), checks.curvature(radius), checks.cant(cant))
        return Settled(*self.equilibrium(found.state, *conditions), conditions)

    def closed(self, about: Settled, radius: float) -> ClosedLoop:
        """Return the closed loop about an equilibrium on a curve of some radius (m)."""
        speed, _, cant = about.conditions
        return ClosedLoop(
            self.model.name,
            speed,
            float(radius),
            cant,
            about.state,
            about.commands,
            self.system(*about),
        )

    def equilibrium(
        self, state: Array, speed: float, curvature: float, cant: float
    ) -> tuple[Array, Array, Array]:
        """Find the equilibrium under the controller by Newton's method, from the vehicle's own.

        Return state, commands and the model's full Jacobian there.

        Raises
        ------
        EquilibriumError
            If it does not converge.
        """
        conditions = (speed, curvature, cant)
        n, chosen = self.model.n_states, self._commands
        commands, inputs = np.zeros(len(chosen)), np.zeros(self.model.n_inputs)
        settled = True  # the vehicle's own equilibrium, unless the controller commands something
        for _ in range(_NEWTON_STEPS):
            inputs[chosen] = commands
            self._evaluator.set(state, speed, curvature, cant, inputs)
            jacobian = self._evaluator.jacobian()
            signals = self._signals(state, commands, conditions)
            excess = commands - self.feedback.steady(signals)
            if settled and not (np.abs(excess) / self._sizes).max(initial=0.0) > _STEADY:
                return state, commands, jacobian
            gain = steady_gain(self.feedback.linearize(signals)) @ self._selection
            to_commands = gain[:, n:].reshape(len(chosen), self._ages, len(chosen)).sum(axis=1)
            matrix = np.block(
                [[jacobian[:, :n], jacobian[:, n:][:, chosen]], [-gain[:, :n], -to_commands]]
            )
            matrix[n:, n:] += np.eye(len(chosen))
            residual = np.concatenate([self._evaluator.rhs(), excess])
            try:
                change = np.linalg.solve(matrix, residual)
            except np.linalg.LinAlgError:  # if wheels have lifted, nothing holds the vehicle
                break
            state, commands = state - change[:n], commands - change[n:]
            settled = bool(np.abs(change[:n] / self._scale).max() < _SETTLED)
            if not np.isfinite(state).all():
                break
        raise EquilibriumError(
            f"{self.model.name} has no running equilibrium at {speed:g} m/s under this controller that "
            "Newton's method finds from the vehicle's own",
            float(np.abs(excess).max()),
            speed,
        )

    def _typical_commands(self) -> Array:
        """Return the limits of the commanded actuators; 1 for inputs of other kinds."""
        model, known = self.model, {}
        if isinstance(model, Equipped):
            known = dict(zip(model.command_names, model.limits.tolist(), strict=True))
        return np.array([known.get(name, 1.0) for name in self.feedback.output_labels])

    def matrix(
        self, state: Array, commands: Array, jacobian: Array, conditions: tuple[float, float, float]
    ) -> Array:
        """Return the map's matrix at an equilibrium."""
        transition, effects, controller = self._parts(state, commands, jacobian, conditions)
        n, m, ages = len(transition), len(self._commands), self._ages
        sees = self._selection
        now = controller.D @ sees  # the command for the states and past commands
        k = controller.nstates
        A = np.zeros((n + m * ages + k,) * 2)
        A[:n, :n] = transition
        for age in range(1, len(effects)):
            A[:n, n + m * (age - 1) : n + m * age] = effects[age]
        A[:n, : n + m * ages] += effects[0] @ now
        A[:n, n + m * ages :] = effects[0] @ controller.C
        if ages:
            A[n : n + m, : n + m * ages] = now
            A[n : n + m, n + m * ages :] = controller.C
            A[n + m : n + m * ages, n : n + m * (ages - 1)] = np.eye(m * (ages - 1))
        A[n + m * ages :, : n + m * ages] = controller.B @ sees
        A[n + m * ages :, n + m * ages :] = controller.A
        return A

    def _parts(
        self, state: Array, commands: Array, jacobian: Array, conditions: tuple[float, float, float]
    ) -> tuple[Array, list[Array], control.StateSpace]:
        n = self.model.n_states
        B = jacobian[:, n:][:, self._commands]
        transition, effects = held_inputs(jacobian[:, :n], B, self.period, self.delay)
        controller = self.feedback.linearize(self._signals(state, commands, conditions))
        return transition, effects, controller

    def system(
        self, state: Array, commands: Array, jacobian: Array, conditions: tuple[float, float, float]
    ) -> control.StateSpace:
        """Return the map as a linear system with named signals."""
        n, inputs = self.model.n_states, self.model.n_inputs
        A = self.matrix(state, commands, jacobian, conditions)
        _, (held, *_) = held_inputs(jacobian[:, :n], jacobian[:, n : n + inputs], self.period, 0.0)
        B = np.vstack([held, np.zeros((len(A) - n, inputs))])
        controller = self.feedback.linearize(self._signals(state, commands, conditions))
        C = np.vstack([np.eye(n, len(A)), np.zeros((len(self._commands), len(A)))])
        C[n:, : self._selection.shape[1]] = controller.D @ self._selection
        C[n:, self._selection.shape[1] :] = controller.C
        outputs = list(self.feedback.output_labels)
        past = [f"{name}[-{age}]" for age in range(1, self._ages + 1) for name in outputs]
        own = [f"controller_{label}" for label in controller.state_labels]
        return control.ss(
            A,
            B,
            C,
            np.zeros((len(C), inputs)),
            self.period,
            inputs=list(self.model.input_names),
            states=[*self.model.state_names, *past, *own],
            outputs=[*self.model.state_names, *[f"u_{name}" for name in outputs]],
            name=f"{self.model.name}_closed_loop",
        )

    def loop(
        self, state: Array, commands: Array, jacobian: Array, conditions: tuple[float, float, float]
    ) -> control.StateSpace:
        """Return the open loop at an equilibrium, for negative feedback around it.

        It leads from deviations of the commands at the actuators (before the transport delay) to minus
        those of the controller's commands, both with the commands' names. Past commands that the
        controller reads are its own.
        """
        n, names = self.model.n_states, list(self.feedback.output_labels)
        plant = control.ss(
            jacobian[:, :n],
            jacobian[:, n:][:, self._commands],
            np.eye(n),
            0,
            inputs=names,
            outputs=list(self.model.state_names),
        )
        sampled = discretize(plant, self.period, delay=self.delay)
        controller = self.feedback.linearize(self._signals(state, commands, conditions))
        labels = list(self.feedback.input_labels)
        own = with_memory(control.ss(controller, inputs=labels, outputs=names))
        picked = np.zeros((own.ninputs, n))
        for row, name in enumerate(own.input_labels):
            if name in self.model.state_names:  # running conditions do not change
                picked[row, self.model.state_names.index(name)] = 1.0
        k = own.nstates
        A = np.zeros((sampled.nstates + k,) * 2)
        A[: -k or None, : -k or None] = sampled.A
        C = picked @ sampled.C
        A[sampled.nstates :] = np.hstack([own.B @ C, own.A])
        return control.ss(
            A,
            np.vstack([sampled.B, np.zeros((k, len(names)))]),
            -np.hstack([own.D @ C, own.C]),
            0,
            self.period,
            inputs=names,
            outputs=names,
            name=f"{self.model.name}_open_loop",
        )

    def modes(self, point: Point, conditions: tuple[float, float, float]) -> tuple[Complex, Complex]:
        """Return eigenvalues (1/s) and eigenvectors of the closed loop at a point of a branch."""
        multipliers, vectors = np.linalg.eig(self.matrix_at(point, conditions))
        return continuous(multipliers, self.period), vectors

    def eigenvalues(self, point: Point, conditions: tuple[float, float, float]) -> Complex:
        """Return the eigenvalues (1/s) of the closed loop at a point of a branch."""
        multipliers = np.linalg.eigvals(self.matrix_at(point, conditions)).astype(complex)
        return continuous(multipliers, self.period)

    def matrix_at(self, point: Point, conditions: tuple[float, float, float]) -> Array:
        """Return the map's matrix at a point of a branch of the vehicle's equilibria."""
        return self.matrix(*self.equilibrium(point.state, *conditions), conditions)


def continuous(multipliers: Complex, period: float) -> Complex:
    """Return multipliers over a period (s) as eigenvalues in continuous time, 1/s."""
    magnitude = np.maximum(np.abs(multipliers), _SMALLEST_MULTIPLIER)
    return (np.log(magnitude) + 1j * np.angle(multipliers)) / period
