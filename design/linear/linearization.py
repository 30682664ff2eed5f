"""Linear models of a vehicle about its running equilibrium, with named signals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import control
import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.linear.equilibrium import equilibrium
from railenv import checks
from railenv.equipment import Equipped
from railenv.errors import ParameterError
from railenv.models import Model

Array = NDArray[np.float64]

CONTROL_PERIOD = 0.005
"""Default control period, s."""


def linearize(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    state: ArrayLike | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> control.StateSpace:
    """Linearise a model about a state, by its exact Jacobian.

    A :class:`railenv.Equipped` model includes the dynamics of actuators and sensors: its inputs are the
    commanded moments (before their transport delay, see :func:`discretize`), and its sensors' readings
    are states.

    Parameters
    ----------
    model : Model
    speed : float
        Forward speed, m/s.
    radius : float
        Curve radius, m; ``math.inf`` is tangent track, negative the other hand.
    cant : float
        Cant angle, rad.
    state : array_like, shape (n_states,), optional
        State to linearise about; the running equilibrium when left out.
    inputs : sequence of str, optional
        Inputs to keep; all when left out.
    outputs : sequence of str, optional
        States to return as outputs, or signals of an equipped model (``force_b``, ``Y_left_w1``); all
        states when left out.

    Returns
    -------
    control.StateSpace
        Model of deviations from the state; inputs, states and outputs have the model's names.

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium.
    UnknownNameError
        If an input is not one of the model's, or an output is neither a state nor a signal.
    """
    driven = model.input_names if inputs is None else tuple(inputs)
    chosen = model.state_names if outputs is None else tuple(outputs)
    signals = model.signal_names if isinstance(model, Equipped) else ()
    available = [*model.state_names, *signals]
    checks.known("input", driven, model.input_names)
    checks.known("output", chosen, available)
    if state is None:
        state = equilibrium(model, speed=speed, radius=radius, cant=cant).states
    curvature = checks.curvature(radius)
    A, B = model.jacobian(state, speed=speed, curvature=curvature, cant=cant)
    C, D = np.eye(model.n_states), np.zeros((model.n_states, model.n_inputs))
    if isinstance(model, Equipped) and set(chosen) & set(signals):
        more_C, more_D = model.signal_jacobian(state, speed=speed, curvature=curvature, cant=cant)
        C, D = np.vstack([C, more_C]), np.vstack([D, more_D])
    rows = [available.index(name) for name in chosen]
    columns = [model.input_names.index(name) for name in driven]
    return control.ss(
        A,
        B[:, columns],
        C[rows],
        D[np.ix_(rows, columns)],
        inputs=list(driven),
        states=list(model.state_names),
        outputs=list(chosen),
        name=f"{model.name}_linearized",
    )


def discretize(
    system: control.StateSpace,
    period: float,
    *,
    delay: float = 0.0,
    delayed: Sequence[str] | None = None,
) -> control.StateSpace:
    """Sample a linear model whose inputs are held over each period, with an exact transport delay.

    The delay need not be a multiple of the period. Commands still on their way are states, the latest
    first: ``command_b[-1]`` is the command of the period before.

    Parameters
    ----------
    system : control.StateSpace
        System in continuous time.
    period : float
        s.
    delay : float
        Transport delay, s.
    delayed : sequence of str, optional
        Inputs with the delay; all when left out.

    Returns
    -------
    control.StateSpace
        System in discrete time; inputs and outputs keep their names.

    Raises
    ------
    ParameterError
        If the system is not in continuous time, or a delayed input acts on an output directly.
    UnknownNameError
        If a delayed input is not an input of the system.
    """
    if not system.isctime(strict=True):
        raise ParameterError(f"the system has dt = {system.dt}; it must be in continuous time (dt = 0)")
    period = checks.number("period", period, low=0.0, open_low=True, unit="s")
    delay = checks.number("delay", delay, low=0.0, unit="s")
    labels = list(system.input_labels)
    late = labels if delayed is None else list(delayed)
    checks.known("delayed input", late, labels)
    columns = [labels.index(name) for name in late]
    if delay > 0.0 and np.any(system.D[:, columns]):
        raise ParameterError("a delayed input acts on an output directly; give that no delay")
    A, B, ages = _sampled(system, columns, period, delay)
    on_their_way = [f"{name}[-{age}]" for age in range(1, ages + 1) for name in late]
    return control.ss(
        A,
        B,
        np.hstack([system.C, np.zeros((system.noutputs, len(on_their_way)))]),
        system.D,
        period,
        inputs=labels,
        states=[*system.state_labels, *on_their_way],
        outputs=list(system.output_labels),
        name=f"{system.name}_sampled",
    )


def _sampled(
    system: control.StateSpace, late: list[int], period: float, delay: float
) -> tuple[Array, Array, int]:
    """Return A and B over a period, and the number of commands of each delayed input among the states.

    Commands on their way get older by one each period; each acts on the states at its age.
    """
    transition, blocks = held_inputs(system.A, system.B[:, late], period, delay)
    _, (prompt, *_) = held_inputs(system.A, system.B, period, 0.0)
    n, m, ages = system.nstates, len(late), len(blocks) - 1
    A = np.zeros((n + m * ages, n + m * ages))
    B = np.zeros((n + m * ages, system.ninputs))
    A[:n, :n] = transition
    B[:n] = prompt
    B[:n, late] = blocks[0]
    for age in range(1, ages + 1):
        rows = slice(n + m * (age - 1), n + m * age)
        A[:n, rows] = blocks[age]
        if age == 1:
            B[rows, late] = np.eye(m)
        else:
            A[rows, n + m * (age - 2) : n + m * (age - 1)] = np.eye(m)
    return A, B, ages


def held_inputs(A: Array, B: Array, period: float, delay: float) -> tuple[Array, list[Array]]:
    """Return the transition over a period, and the contributions of commands of each age.

    Parameters
    ----------
    A, B : ndarray
        Matrices in continuous time.
    period, delay : float
        s.

    Returns
    -------
    ndarray, shape (n, n)
    list of ndarray, shape (n, m)
        Entry k belongs to the command given k periods before the one at the period's start.
    """
    from scipy.linalg import expm

    n, m = B.shape
    whole = math.floor(delay / period + 1e-9)
    rest = delay - whole * period
    rest = 0.0 if rest < 1e-9 * period else rest

    def stepped(duration: float) -> tuple[Array, Array]:
        extended = np.zeros((n + m, n + m))
        extended[:n, :n], extended[:n, n:] = A, B
        result = expm(duration * extended)
        return result[:n, :n], result[:n, n:]

    late_transition, late_effect = stepped(period - rest)
    blocks = [np.zeros((n, m)) for _ in range(whole)] + [late_effect]
    if rest == 0.0:
        return late_transition, blocks
    early_transition, early_effect = stepped(rest)
    return late_transition @ early_transition, [*blocks, late_transition @ early_effect]
