"""H-infinity control of a vehicle's lateral motion from its sensors, on python-control and slycot.

The disturbances of a Kalman filter and the weights of a regulator (irregular track, actuators, noise
and drift of the readings; motion of the wheelsets and commands) become one system from disturbances to
weighted motion. To these are added forces that the model does not foresee: those that wheels and rails
of other conicity or creep would add to a small motion. The controller keeps the largest gain of the
closed loop, over all frequencies and directions, below a bound.

Theory: K. Zhou, J. C. Doyle, K. Glover: Robust and Optimal Control, Prentice Hall, 1996. The sampled
model is mapped to continuous time by the bilinear transform, which keeps the norm, and the controller
back. ``control.hinfsyn`` seeks the smallest bound by itself, and returns controllers that are close to
singular there, or whose loop exceeds it; so slycot's routine behind it (SB10AD) is called at given
bounds, and the norm of every loop is computed anew.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import control
import numpy as np
from numpy.typing import NDArray
from slycot import ab04md, sb10ad
from slycot.exceptions import SlycotArithmeticError

from design.linear.linearization import CONTROL_PERIOD
from design.linear.regulator import Disturbances, Weights, lateral_model, scales, sensor_noise
from railenv import Equipped, checks
from railenv.errors import ParameterError

Array = NDArray[np.float64]

MOTION = 1.5e-4
"""Size of the motion to which unforeseen forces belong, m and rad."""

ROLL_OFF = 50.0
"""Frequency above which commands weigh more, Hz."""

SLACK = 1.4
"""Bound on the norm, as a multiple of the smallest achievable one."""

_UNIT = 1e-3  # m or rad, the unit of a model's scales
_RANK = 1e-2  # of singular values that count as a direction of force
_LOOSE = 1e6  # a bound that every stabilising controller keeps
_RESOLUTION = 0.02  # of the smallest bound, relative
_STEPS = 12  # of its search
_EXACT = 1e-3  # allowed numerical excess of a norm over a bound
_AT_THE_BOUND = 4  # of SB10AD, as opposed to its own search


@dataclass(frozen=True)
class UncertainModel:
    """A sampled lateral model, and changes of its equations over ranges of the vehicle's numbers.

    Attributes
    ----------
    model : Equipped
    speed : float
        m/s.
    system : control.StateSpace
        As from :func:`design.lateral_model`, with sensors; inputs are commands, then alignment of the
        rails under each wheelset.
    prompt : ndarray, shape (n, n_commands)
        Effect of moments added to the commands, which act without delay.
    changes : mapping of str to ndarray, shape (n, n)
        Half of the change of the system's matrix A from one end of each range to the other.
    """

    model: Equipped
    speed: float
    system: control.StateSpace
    prompt: Array
    changes: Mapping[str, Array]


def uncertain_model(
    model: Equipped,
    *,
    speed: float,
    ranges: Mapping[str, tuple[float, float]],
    period: float = CONTROL_PERIOD,
) -> UncertainModel:
    """Linearise and sample a vehicle at a speed, and at the ends of ranges of its numbers.

    Parameters
    ----------
    model : Equipped
    speed : float
        m/s.
    ranges : mapping of str to (float, float)
        Ranges of numbers of the model, such as ``{"conicity": (0.05, 0.4)}``; may be empty.
    period : float
        Control period, s.

    Raises
    ------
    UnknownNameError
        If a name is not one of the model's.
    ParameterError
        If a range is empty, or the model has no actuators.
    """
    given = checks.mapping("ranges", ranges)
    checks.known("quantity", given, model.variable_names)
    ends = {name: checks.interval(f"ranges[{name!r}]", pair) for name, pair in given.items()}
    rails = tuple(wheelset.rails[0] for wheelset in model.guided if wheelset.rails)
    system = lateral_model(model, speed=speed, period=period, sensors=True, disturbances=rails)
    late = lateral_model(model, speed=speed, period=period, sensors=True, delay=0.0)
    prompt = np.zeros((system.nstates, late.ninputs))
    prompt[: late.nstates] = late.B

    def matrix(name: str, value: float) -> Array:
        changed = model.replace(**{name: value})
        return lateral_model(changed, speed=speed, period=period, sensors=True).A

    changes = {
        name: 0.5 * (matrix(name, high) - matrix(name, low)) for name, (low, high) in ends.items()
    }
    return UncertainModel(model, float(speed), system, prompt, changes)


@dataclass(frozen=True)
class HInfinitySynthesis:
    """An H-infinity controller at one speed, ``z' = A z + B y``, ``u = C z + D y``, in discrete time.

    Attributes
    ----------
    speed : float
        m/s.
    A, B, C, D : ndarray
        Controller from the sensors' readings y (SI units, in the order of the model's ``sensor_names``)
        to the commands u (N m; N for a lateral actuator). Steady readings command nothing.
    E : ndarray, shape (n, n_commands)
        Effect of an applied command on the states, which are estimates of the lateral model's: a
        controller that uses the applied commands is ``z' = (A - E C) z + (B - E D) y + E u``.
    bound : float
        Bound on the closed loop's norm.
    least : float
        Smallest bound for which a controller was found.
    norm : float
        Largest singular value of ``closed_loop`` over all frequencies.
    plant, closed_loop : control.StateSpace
        Systems from disturbances to weighted motion and commands, all in units of their weights; in the
        plant, commands (shares of the limits) and whitened readings come last.
    """

    speed: float
    A: Array
    B: Array
    C: Array
    D: Array
    E: Array
    bound: float
    least: float
    norm: float
    plant: control.StateSpace
    closed_loop: control.StateSpace


def h_infinity(
    uncertain: UncertainModel,
    *,
    weights: Weights | None = None,
    disturbances: Disturbances | None = None,
    motion: float = MOTION,
    roll_off: float = ROLL_OFF,
    slack: float = SLACK,
) -> HInfinitySynthesis:
    """Design an H-infinity controller at one speed on tangent track.

    Parameters
    ----------
    uncertain : UncertainModel
        See :func:`uncertain_model`.
    weights : Weights, optional
        Sizes of motion and commands that count the same.
    disturbances : Disturbances, optional
        Disturbances in each period. Offsets drift, so readings are filtered by ``(z - 1) / (z - b)``
        with the b that whitens their noise: steady parts are not fed back.
    motion : float
        Size (m and rad) of a motion of every coordinate, to which wheels and rails at the ends of the
        ranges add forces that the model does not foresee. These enter as disturbances.
    roll_off : float
        Frequency above which commands weigh more, in proportion to frequency, Hz. The loop must be
        inactive there because delay and actuators are not known well.
    slack : float
        Bound on the closed loop's norm, as a multiple of the smallest one found; greater than 1.

    Returns
    -------
    HInfinitySynthesis

    Raises
    ------
    ParameterError
        If a value is not allowed, or no controller keeps the bound.
    """
    w = Weights() if weights is None else weights
    d = Disturbances() if disturbances is None else disturbances
    checks.number("motion", motion, low=0.0)
    checks.number("roll_off", roll_off, low=0.0, open_low=True, unit="Hz")
    checks.number("slack", slack, low=1.0, open_low=True)
    whitening = _Whitening.of(uncertain.model, d)
    plant = _plant(uncertain, w, d, whitening, motion, roll_off)
    commands, readings = len(uncertain.model.command_names), len(uncertain.model.sensor_names)
    search = _Search.of(plant, commands, readings)
    least = search.least()
    found = search.at(slack * least) if math.isfinite(least) else None
    if found is None:
        raise ParameterError(
            f"no H-infinity controller is found for {uncertain.model.name} at {uncertain.speed:g} m/s "
            f"with {w}, {d} and motion {motion:g}; other weights may have one"
        )
    closed = plant.lft(found, commands, readings)
    norm = norm_of(closed)
    if not norm <= (1.0 + _EXACT) * slack * least:
        raise ParameterError(
            f"the H-infinity controller of {uncertain.model.name} at {uncertain.speed:g} m/s has a "
            f"norm of {norm:.4g}, above its bound of {slack * least:.4g}: the problem with {w}, {d} "
            f"and motion {motion:g} is too badly conditioned"
        )
    A, B, C, D = whitening.before(found)
    limits = uncertain.model.limits
    # its first states are the plant's, on which commands act as on the plant
    E = np.vstack([plant.B[:, -commands:], np.zeros((len(A) - plant.nstates, commands))])
    return HInfinitySynthesis(
        speed=uncertain.speed,
        A=A,
        B=B,
        C=limits[:, None] * C,
        D=limits[:, None] * D,
        E=E / limits,
        bound=slack * least,
        least=least,
        norm=norm,
        plant=plant,
        closed_loop=closed,
    )


@dataclass(frozen=True)
class _Whitening:
    """High-pass filters ``g (z - 1) / (z - b)`` of the readings, which whiten noise and drift.

    Attributes
    ----------
    b : ndarray
        b of each reading.
    gain : ndarray
        g of each reading, per SI unit.
    """

    b: Array
    gain: Array

    @classmethod
    def of(cls, model: Equipped, disturbances: Disturbances) -> Self:
        d = disturbances
        for name in ("accelerometer_drift", "gyro_drift"):
            checks.number(name, getattr(d, name), low=0.0, open_low=True)
        noise = sensor_noise(model, d)
        drift = np.tile([d.accelerometer_drift, d.gyro_drift], len(noise) // 2)
        # noise^2 + drift^2 / |z - 1|^2 = |z - b|^2 / (g |z - 1|)^2 on the unit circle
        ratio = np.square(drift / noise)
        b = 1.0 + 0.5 * ratio - np.sqrt(ratio + 0.25 * ratio**2)
        return cls(b, np.sqrt(b) / noise)

    def before(self, controller: control.StateSpace) -> tuple[Array, Array, Array, Array]:
        """Return a controller of whitened readings as one of readings, with means as last states."""
        n, p = controller.nstates, len(self.b)
        seen = np.diag(self.gain)
        A = np.zeros((n + p, n + p))
        A[:n, :n], A[:n, n:], A[n:, n:] = controller.A, -controller.B @ seen, np.diag(self.b)
        B = np.vstack([controller.B @ seen, np.diag(1.0 - self.b)])
        return A, B, np.hstack([controller.C, -controller.D @ seen]), controller.D @ seen


def _plant(
    u: UncertainModel,
    w: Weights,
    d: Disturbances,
    whitening: _Whitening,
    motion: float,
    roll_off: float,
) -> control.StateSpace:
    """Return the system from disturbances and commands to weighted motion and whitened readings."""
    model, system = u.model, u.system
    sizes = dict.fromkeys((g.y for g in model.guided), w.displacement)
    sizes |= dict.fromkeys((g.psi for g in model.guided), w.yaw)
    if not sizes:
        raise ParameterError(f"{model.name} has no wheelsets, whose motion a regulator weighs")
    n, p, m = system.nstates, system.noutputs, len(model.command_names)
    scale = scales(model, system)
    moved = dict(zip(model.state_names, model.scale / _UNIT * motion, strict=True))
    moves = np.array([moved.get(label, 0.0) for label in system.state_labels])
    rails = enumerate(system.input_labels[m:], start=m)
    entering = {rail: d.alignment * system.B[:, [k]] for k, rail in rails}
    entering["moment"] = d.moment * u.prompt * model.limits
    for name, change in u.changes.items():
        left, values, _ = np.linalg.svd(change * moves / scale[:, None])
        count = int(np.count_nonzero(values > _RANK * max(values[0], 1e-300)))
        entering[name] = scale[:, None] * left[:, :count] * values[:count]
    G = np.hstack([*entering.values()])
    q = G.shape[1]
    # states: the lateral model's, the mean that each filter subtracts, the previous command
    size, lead = n + p + m, 1.0 / (2.0 * math.pi * roll_off * system.dt)
    A = np.zeros((size, size))
    A[:n, :n] = system.A * scale / scale[:, None]
    seen = system.C * scale * whitening.gain[:, None]
    A[n : n + p, :n] = (1.0 - whitening.b)[:, None] * seen
    A[n : n + p, n : n + p] = np.diag(whitening.b)
    B = np.zeros((size, q + p + m))
    B[:n, :q] = G / scale[:, None]
    B[:n, q + p :] = system.B[:, :m] * model.limits / scale[:, None]
    B[n + p :, q + p :] = np.eye(m)
    labels, weighed = system.state_labels, len(sizes)
    C = np.zeros((weighed + m + p, size))
    for row, (label, typical) in zip(C, sizes.items(), strict=False):
        row[labels.index(label)] = scale[labels.index(label)] / typical
    C[weighed : weighed + m, n + p :] = -lead / w.moment * np.eye(m)
    C[weighed + m :, : n + p] = np.hstack([seen, -np.eye(p)])
    D = np.zeros((len(C), B.shape[1]))
    D[weighed : weighed + m, q + p :] = (1.0 + lead) / w.moment * np.eye(m)
    D[weighed + m :, q : q + p] = np.eye(p)
    inputs = [f"{name}[{k}]" for name, columns in entering.items() for k in range(columns.shape[1])]
    return control.ss(
        A,
        B,
        C,
        D,
        system.dt,
        inputs=[*inputs, *(f"noise of {s}" for s in system.output_labels), *model.command_names],
        outputs=[*sizes, *(f"weighted {c}" for c in model.command_names), *system.output_labels],
        name=f"{model.name}_generalised",
    )


@dataclass(frozen=True)
class _Search:
    """The search for the smallest bound that a controller can keep.

    Attributes
    ----------
    sizes : (int, int, int, int, int)
        Numbers of the plant's states, inputs, outputs, commands and readings.
    mapped : tuple of ndarray
        A, B, C and D of the plant in continuous time.
    period : float
        s.
    """

    sizes: tuple[int, int, int, int, int]
    mapped: tuple[Array, Array, Array, Array]
    period: float

    @classmethod
    def of(cls, plant: control.StateSpace, commands: int, readings: int) -> Self:
        n, outputs = plant.nstates, plant.noutputs
        # SB10AD rejects achievable bounds unless, beside the readings' noise, there are more
        # disturbances than weighted motions: silent ones are added
        weighted, entering = outputs - readings - commands, plant.ninputs - commands - readings
        silent = max(weighted + 1 - entering, 0)
        B = np.hstack([np.zeros((n, silent)), plant.B])
        D = np.hstack([np.zeros((outputs, silent)), plant.D])
        inputs = plant.ninputs + silent
        mapped = ab04md("D", n, inputs, outputs, plant.A, B, plant.C, D)
        return cls((n, inputs, outputs, commands, readings), mapped, plant.dt)

    def least(self) -> float:
        """Return the smallest bound found; infinite if no controller is found at all."""
        high, low = self._norm(_LOOSE), 0.0
        for _ in range(_STEPS):
            if not math.isfinite(high) or high - low < _RESOLUTION * high:
                break
            middle = 0.5 * (low + high)
            # the routine reports that the loop is stable, but not whether it keeps the bound
            if self._norm(middle) <= (1.0 + _EXACT) * middle:
                high = middle
            else:
                low = middle
        return high

    def at(self, bound: float) -> control.StateSpace | None:
        """Return the controller for a bound, from whitened readings to shares of limits, or None."""
        n, *_, commands, readings = self.sizes
        try:
            law = self._synthesis(bound)[1:5]
        except SlycotArithmeticError:
            return None
        return control.ss(*ab04md("C", n, readings, commands, *law), self.period)

    def _norm(self, bound: float) -> float:
        """Return the norm of the loop with the controller for a bound; infinite if there is none."""
        try:
            loop = control.ss(*self._synthesis(bound)[5:9])
        except SlycotArithmeticError:
            return math.inf
        return norm_of(loop)

    def _synthesis(self, bound: float) -> tuple[Any, ...]:
        return tuple(sb10ad(*self.sizes, bound, *self.mapped, job=_AT_THE_BOUND))


def norm_of(loop: control.StateSpace) -> float:
    """Return the H-infinity norm of a system; infinite if it is unstable."""
    poles = loop.poles()
    stable = (poles.real < 0.0).all() if loop.isctime() else (np.abs(poles) < 1.0).all()
    return float(control.linfnorm(loop)[0]) if stable else math.inf
