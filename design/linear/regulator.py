"""Linear-quadratic regulators and Kalman filters for a vehicle's lateral motion, on python-control.

On tangent track lateral and vertical motion are not coupled in the linear equations, so both use the
lateral states alone: all but z and theta of the bodies, with the commands on their way. States are
scaled before Riccati equations are solved, which are too stiff otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np
from numpy.typing import NDArray

from design.linear.linearization import CONTROL_PERIOD, discretize, linearize
from railenv import Equipped, checks
from railenv.errors import ParameterError

Array = NDArray[np.float64]

_SMALL = 1e-3  # typical deviation, in units of the model's scale of a millimetre or milliradian
_REGULARIZATION = 1e-9  # on every scaled state, so that the cost contains all of them


@dataclass(frozen=True, kw_only=True)
class Weights:
    """Sizes at which the terms of the quadratic cost count the same, in each period.

    Attributes
    ----------
    displacement : float
        Lateral displacement of a wheelset, m.
    yaw : float
        Yaw angle of a wheelset, rad.
    moment : float
        Commanded moment (or force) of an actuator, as a share of its limit.
    """

    displacement: float = 9e-3
    yaw: float = 2e-3
    moment: float = 1.0

    def __post_init__(self) -> None:
        for name in ("displacement", "yaw", "moment"):
            checks.number(f"weight {name}", getattr(self, name), low=0.0, open_low=True)


@dataclass(frozen=True)
class Regulator:
    """A linear-quadratic regulator ``u = -K x`` at one speed.

    Attributes
    ----------
    speed : float
        m/s.
    gain : ndarray, shape (n_commands, n)
        K, N m (N for a lateral actuator) per SI unit of the states.
    cost : ndarray, shape (n, n)
        P; the sum over all periods of the quadratic cost from a state x is x'Px.
    state_weight, command_weight : ndarray
        Q and R in SI units.
    system : control.StateSpace
        The sampled lateral model, to whose states K and P refer.
    multipliers : ndarray
        Multipliers of the closed loop of that model.
    """

    speed: float
    gain: Array
    cost: Array
    state_weight: Array
    command_weight: Array
    system: control.StateSpace
    multipliers: NDArray[np.complex128]


_VERTICAL = ("z", "theta", "dz", "dtheta")


def lateral_states(model: Equipped, *, sensors: bool) -> list[str]:
    """Return the names of the states of lateral motion and of the actuators (and sensors).

    They include states of force elements. Those of an element of vertical motion only are harmless,
    because nothing lateral moves them.
    """
    left_out = {own[c] for own in model.body_states.values() for c in _VERTICAL if c in own}
    if not sensors:
        left_out |= set(model.sensor_names)
    return [name for name in model.state_names if name not in left_out]


def lateral_model(
    model: Equipped,
    *,
    speed: float,
    period: float = CONTROL_PERIOD,
    sensors: bool = False,
    disturbances: tuple[str, ...] = (),
    delay: float | None = None,
) -> control.StateSpace:
    """Sample the lateral motion of an equipped vehicle on tangent track, its delay included.

    Parameters
    ----------
    model : Equipped
    speed : float
        m/s.
    period : float
        Control period, s.
    sensors : bool
        Keep the states of the sensors, which are then the outputs.
    disturbances : tuple of str
        Inputs to keep beside the commands.
    delay : float, optional
        Transport delay of the commands, s; the actuators' own when left out.

    Returns
    -------
    control.StateSpace
        Model in discrete time; states are those of :func:`design.discretize`.
    """
    if not getattr(model, "command_names", ()):
        raise ParameterError(f"model is {model!r}; it must be an Equipped vehicle with actuators")
    names = lateral_states(model, sensors=sensors)
    full = linearize(model, speed=speed, inputs=[*model.command_names, *disturbances])
    kept = [model.state_names.index(name) for name in names]
    outputs = list(model.sensor_names) if sensors else names
    lateral = control.ss(
        full.A[np.ix_(kept, kept)],
        full.B[kept],
        np.eye(len(kept))[[names.index(name) for name in outputs]],
        np.zeros((len(outputs), full.ninputs)),
        inputs=full.input_labels,
        states=names,
        outputs=outputs,
        name=f"{model.name}_lateral",
    )
    waits = model.delay if delay is None else delay
    return discretize(lateral, period, delay=waits, delayed=list(model.command_names))


def lqr(
    model: Equipped,
    *,
    speed: float,
    weights: Weights | None = None,
    period: float = CONTROL_PERIOD,
) -> Regulator:
    """Design a linear-quadratic regulator at one speed on tangent track.

    Parameters
    ----------
    model : Equipped
    speed : float
        m/s.
    weights : Weights, optional
    period : float
        Control period, s.

    Returns
    -------
    Regulator

    Raises
    ------
    ParameterError
        If the model has no actuators, or no wheelsets whose motion could be weighted.
    """
    w = Weights() if weights is None else weights
    system = lateral_model(model, speed=speed, period=period)
    sizes = dict.fromkeys((g.y for g in model.guided), w.displacement)
    sizes |= dict.fromkeys((g.psi for g in model.guided), w.yaw)
    if not sizes:
        raise ParameterError(f"{model.name} has no wheelsets, whose motion a regulator weighs")
    limits, scale = model.limits, scales(model, system)
    importance = np.full(system.nstates, _REGULARIZATION)
    for k, label in enumerate(system.state_labels):
        if label in sizes:
            importance[k] = (scale[k] / sizes[label]) ** 2
    Q = np.diag(importance)
    R = np.eye(system.ninputs) / w.moment**2
    A = system.A * scale / scale[:, None]
    B = system.B * limits / scale[:, None]
    K, P, multipliers = control.dlqr(A, B, Q, R, method="scipy")
    return Regulator(
        speed=float(speed),
        gain=np.asarray(K) * limits[:, None] / scale,
        cost=np.asarray(P) / scale / scale[:, None],
        state_weight=Q / scale / scale[:, None],
        command_weight=R / limits**2,
        system=system,
        multipliers=np.asarray(multipliers),
    )


def scales(model: Equipped, system: control.StateSpace) -> Array:
    """Return typical magnitudes of the states of a sampled lateral model."""
    known = dict(zip(model.state_names, model.scale / _SMALL, strict=True))
    known |= dict(zip(model.command_names, model.limits, strict=True))
    return np.array([known[label.partition("[")[0]] for label in system.state_labels])


@dataclass(frozen=True, kw_only=True)
class Disturbances:
    """The disturbances that a Kalman filter assumes; standard deviations in each period.

    Every state also has a floor with a variance of 1e-9 in units of 1000 times the model's scale
    (0.03 mm, 0.03 mrad), which keeps the Riccati equation solvable.

    Attributes
    ----------
    alignment : float
        Lateral displacement of the rails under each wheelset with rails as inputs, m.
    moment : float
        Moment of each actuator added to its command, as a share of the limit.
    accelerometer, gyro : float, optional
        Noise of the readings, m/s^2 and rad/s; the sensors' own when left out.
    accelerometer_drift, gyro_drift : float
        Random walk of the readings' offsets, which removes biases and the effect of a curve.
    """

    alignment: float = 1e-3
    moment: float = 0.01
    accelerometer: float | None = None
    gyro: float | None = None
    accelerometer_drift: float = 1e-3
    gyro_drift: float = 2e-5

    def __post_init__(self) -> None:
        for name in ("alignment", "moment", "accelerometer_drift", "gyro_drift"):
            checks.number(f"disturbance {name}", getattr(self, name), low=0.0)
        for name in ("accelerometer", "gyro"):
            value = getattr(self, name)
            if value is not None:
                checks.number(f"noise {name}", value, low=0.0, open_low=True)


@dataclass(frozen=True)
class Observer:
    """A stationary Kalman filter at one speed.

    The state estimate z has the lateral model's states, then an offset of each reading. With the
    innovation ``e = y - C z`` the present estimate is ``z + M e``, and that for the next period
    ``A (z + M e) + B u``.

    Attributes
    ----------
    speed : float
        m/s.
    A, B, C : ndarray
        Matrices of the lateral model with offsets, SI units.
    M : ndarray
        Gain of the filter, SI units.
    system : control.StateSpace
        The lateral model, without offsets.
    """

    speed: float
    A: Array
    B: Array
    C: Array
    M: Array
    system: control.StateSpace


def kalman(
    model: Equipped,
    *,
    speed: float,
    disturbances: Disturbances | None = None,
    period: float = CONTROL_PERIOD,
) -> Observer:
    """Design a stationary Kalman filter from the vehicle's sensors at one speed on tangent track.

    Parameters
    ----------
    model : Equipped
    speed : float
        m/s.
    disturbances : Disturbances, optional
    period : float
        Control period, s.

    Returns
    -------
    Observer
    """
    d = Disturbances() if disturbances is None else disturbances
    rails = tuple(wheelset.rails[0] for wheelset in model.guided if wheelset.rails)
    system = lateral_model(model, speed=speed, period=period, sensors=True, disturbances=rails)
    n, m, p = system.nstates, len(model.command_names), system.noutputs
    r, scale = len(rails), np.append(scales(model, system), np.full(p, 0.1))
    A = np.eye(n + p)
    A[:n, :n] = system.A
    B = np.vstack([system.B[:, :m], np.zeros((p, m))])
    C = np.hstack([system.C, np.eye(p)])
    # inputs: rails, actuators, and drifts of the readings' offsets, accelerometer and gyro in turn
    drift = np.tile([d.accelerometer_drift, d.gyro_drift], p // 2)
    G = np.zeros((n + p, r + m + p))
    G[:n, :r] = d.alignment * system.B[:, m:]
    prompt = lateral_model(model, speed=speed, period=period, sensors=True, delay=0.0)
    G[: prompt.nstates, r : r + m] = d.moment * model.limits * prompt.B  # comes without delay
    G[n:, r + m :] = np.diag(drift)
    noise = sensor_noise(model, d)
    scaled = A * scale / scale[:, None]
    seen = C * scale / noise[:, None]
    floor = _REGULARIZATION * np.eye(n + p)
    Q = (G / scale[:, None]) @ (G / scale[:, None]).T + floor
    _, P, _ = control.dlqe(scaled, np.eye(n + p), seen, Q, np.eye(p), method="scipy")
    gain = P @ seen.T @ np.linalg.inv(seen @ P @ seen.T + np.eye(p))
    return Observer(float(speed), A, B, C, scale[:, None] * gain / noise, system)


def sensor_noise(model: Equipped, disturbances: Disturbances) -> Array:
    """Return the noise that a filter assumes in each reading, in the order of the sensors."""
    d, s = disturbances, model.sensors
    pair = [_noise(d.accelerometer, s.accelerometer_noise), _noise(d.gyro, s.gyro_noise)]
    return np.tile(pair, len(model.sensor_names) // 2)


def _noise(given: float | None, own: float) -> float:
    """Return the assumed noise; small for ideal sensors, because the filter divides by it."""
    return max(own, 1e-6) if given is None else given
