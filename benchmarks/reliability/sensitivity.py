"""How much results depend on time step, precision and control period."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

import agents
import design
import railenv
from railenv.batch import Batch

Array = NDArray[np.float64]

STEPS = (0.00025, 0.0005, 0.001, 0.002)
"""s, of RK4."""

PERIODS = (0.001, 0.0025, 0.005, 0.01, 0.02)
"""s, between commands."""

SPEED = 118.0
"""m/s, a little above the coach's critical speed on tangent track."""

_SMALL = 1e-7  # m, of the motion whose growth is measured
_LARGE = (1e-3, 1e-4)  # m; float32 does not resolve smaller ones
_HUNTING = 5e-3  # m, from which hunting starts at once
_BRACKET = (112.0, 120.0)  # m/s


@dataclass(frozen=True)
class Row:
    """One way to integrate.

    Attributes
    ----------
    what : str
    growth : float
        Growth rate (1/s) of the least stable mode at ``SPEED``.
    critical : float
        Speed (m/s) from which small motions grow.
    amplitude : float
        Half the peak-to-peak lateral motion (m) of the first wheelset in the limit cycle.
    """

    what: str
    growth: float
    critical: float
    amplitude: float


@dataclass(frozen=True)
class PeriodRow:
    """A control period.

    Attributes
    ----------
    period : float
        s.
    linear : float
        Critical speed of the sampled loop, m/s.
    """

    period: float
    linear: float


def coach() -> railenv.Bogie:
    """Return the vehicle that all this is measured on."""
    return railenv.Bogie(railenv.HIGH_SPEED_COACH)


def _mode(model: railenv.Bogie, speed: float) -> tuple[complex, Array, Array, Array]:
    """Return equilibrium, eigenvalue, shape (real part) and left eigenvector of the hunting mode."""
    found = railenv.find_equilibrium(model, speed=speed)
    A, _ = model.jacobian(found.state, speed=speed)
    values, vectors = np.linalg.eig(A)
    k = int(np.argmax(values.real))
    left = np.linalg.inv(vectors)[k]
    shape = vectors[:, k].real / np.abs(vectors[:, k].real).max()
    return values[k], found.state, shape, left


Motion = Callable[[railenv.Bogie, float, Array, float], tuple[Array, Array]]
"""From model, speed, initial state and duration to times and states of shape (samples, n_states)."""


def rk4(step: float) -> Motion:
    """Integrate with RK4 at a step (s)."""

    def motion(
        model: railenv.Bogie, speed: float, start: Array, duration: float
    ) -> tuple[Array, Array]:
        response = railenv.simulate(
            model, speed=speed, initial_state=start, duration=duration, step=step, output_step=0.004
        )
        return np.asarray(response.time), np.asarray(response.states).T

    return motion


def scipy_method(
    model: railenv.Bogie, speed: float, start: Array, duration: float
) -> tuple[Array, Array]:
    """Integrate with an eighth-order method at tight tolerances."""
    response = railenv.simulate(
        model,
        speed=speed,
        initial_state=start,
        duration=duration,
        method="DOP853",
        rtol=1e-11,
        atol=1e-14,
        output_step=0.004,
    )
    return np.asarray(response.time), np.asarray(response.states).T


def lanes(dtype: str) -> Motion:
    """Integrate in the lanes of a batch, at steps of 1 ms."""

    def motion(
        model: railenv.Bogie, speed: float, start: Array, duration: float
    ) -> tuple[Array, Array]:
        batch = Batch([model], dtype)
        batch.conditions = [speed, 0.0, 0.0]
        batch.states = start
        states = [start]
        for _ in range(round(duration / 0.004)):
            batch.integrate(step=0.001, steps=4)
            states.append(batch.states[0].astype(float))
        return 0.004 * np.arange(len(states)), np.array(states, dtype=float)

    return motion


def growth(model: railenv.Bogie, speed: float, motion: Motion, size: float) -> float:
    """Measure the growth rate (1/s) of the hunting mode in a motion of a small size (m)."""
    _, state, shape, left = _mode(model, speed)
    times, states = motion(model, speed, state + size * shape, 4.0)
    part = np.abs((states - state) @ left)
    half = len(times) // 4
    return float(np.polyfit(times[half:], np.log(part[half:]), 1)[0])


def amplitude(model: railenv.Bogie, motion: Motion, duration: float) -> float:
    """Return half the peak-to-peak lateral motion (m) of the first wheelset at the end of hunting."""
    state = railenv.find_equilibrium(model, speed=SPEED).state.copy()
    state[model.state_names.index("y_w1")] += _HUNTING
    _, states = motion(model, SPEED, state, duration)
    y = states[-round(2.0 / 0.004) :, model.state_names.index("y_w1")]
    return float(np.ptp(y) / 2.0)


def row(what: str, motion: Motion, size: float, duration: float) -> Row:
    """Measure one way to integrate."""
    model = coach()
    critical = brentq(lambda v: growth(model, v, motion, size), *_BRACKET, xtol=1e-4)
    rate = growth(model, SPEED, motion, size)
    return Row(what, rate, float(critical), amplitude(model, motion, duration))


def linear() -> Row:
    """Return what the eigenvalues and the boundary value problem of the limit cycle say."""
    model = coach()
    value, *_ = _mode(model, SPEED)
    cycle = design.simulated_cycle(model, speed=SPEED)
    k = model.state_names.index("y_w1")
    critical: Any = design.critical_speed(model).speed
    return Row(
        "eigenvalues; cycle by shooting", float(value.real), critical, float(cycle.amplitudes[k])
    )


def rows(
    steps: Sequence[float] = STEPS, duration: float = 30.0
) -> Iterator[tuple[str, Callable[[], Row]]]:
    """Name all ways to integrate, and how each is measured; hunting runs for ``duration`` (s)."""

    def measured(what: str, motion: Motion, size: float) -> tuple[str, Callable[[], Row]]:
        return what, lambda: row(what, motion, size, duration)

    yield "eigenvalues; cycle by shooting", linear
    yield measured("DOP853, tolerance 1e-11", scipy_method, _SMALL)  # a minute
    for step in steps:
        yield measured(f"RK4, {1e3 * step:g} ms", rk4(step), _SMALL)
    for size in _LARGE:
        for dtype in ("float64", "float32"):
            what = f"RK4, 1 ms, {dtype} lanes, motion of {1e3 * size:g} mm"
            yield measured(what, lanes(dtype), size)


def period_row(period: float) -> PeriodRow:
    """Compute the critical speed under a yaw-rate feedback that acts at a period (s)."""
    vehicle = agents.equipped(coach())
    damper = agents.YawRateFeedback.design(vehicle, gain=1e5, period=period)
    found: Any = design.critical_speed(vehicle, controller=damper, speed_range=(20.0, 400.0))
    return PeriodRow(period, found.speed)
