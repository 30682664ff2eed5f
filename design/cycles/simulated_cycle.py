"""A limit cycle found by simulation, to start a branch that no Hopf point reaches."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.continuation import CycleContinuation
from design.cycles.cycle import Cycle, CycleError
from design.cycles.periodic import half_peak_to_peak
from design.cycles.shooting import Setting
from railenv import checks
from railenv.models import Model
from railenv.simulation import simulate

Array = NDArray[np.float64]

_SAMPLE = 1e-3  # s
_STILL = 1e-3  # of the model's scale: less does not count as hunting
_DECAYED = 0.8  # of the amplitude of the half of the simulation, between its first and last fifth
_BACK = 0.03  # of the peak to peak of every state: the motion has returned
_CROSSINGS = 8  # number used
_DEFAULT = 5.0  # of the model's scale: perturbation of the first state


def simulated_cycle(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    perturbation: Mapping[str, float] | None = None,
    initial_state: ArrayLike | None = None,
    duration: float = 20.0,
    steps_per_period: int | None = None,
) -> Cycle:
    """Simulate until a vehicle hunts steadily, and solve for the periodic motion exactly.

    Parameters
    ----------
    model : Model
    speed : float
        m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track) and cant (rad).
    perturbation : mapping of str to float, optional
        Added to the running equilibrium; 5 of the model's scale (5 mm) in the first state when left
        out.
    initial_state : array_like, shape (n_states,), optional
        State to start from instead of the running equilibrium.
    duration : float
        Duration, s; long enough for the motion to become periodic within a few percent, for Newton's
        method.
    steps_per_period : int, optional
        As in :func:`design.cycle_branch`.

    Raises
    ------
    CycleError
        If the motion dies out or does not become periodic.
    """
    if perturbation is None and initial_state is None:
        perturbation = {model.state_names[0]: _DEFAULT * float(model.scale[0])}
    response = simulate(
        model,
        speed=speed,
        radius=radius,
        cant=cant,
        duration=duration,
        perturbation=perturbation,
        initial_state=initial_state,
        output_step=_SAMPLE,
    )
    time, states = np.asarray(response.time), np.asarray(response.states).T
    period, motion = _last_period(model, time, states)
    setting = Setting(
        model, "speed", checks.speed(speed), checks.curvature(radius), cant, np.zeros(model.n_inputs)
    )
    guess = _guess(setting, period, motion)
    limits = (0.5 * speed, 2.0 * speed)
    return CycleContinuation.from_cycle(setting, guess, 1, limits, 0.1, steps_per_period).cycles[0]


def _guess(setting: Setting, period: float, motion: Array) -> Cycle:
    """Return a simulated motion as a cycle to start from, with unknown stability."""
    return Cycle(
        speed=setting.speed,
        curvature=setting.curvature,
        cant=setting.cant,
        value=setting.speed,
        period=period,
        states=motion,
        amplitudes=half_peak_to_peak(motion),
        multipliers=np.zeros(0, dtype=complex),
        trivial_error=math.nan,
        tangent=np.zeros(0),
        scale=np.zeros(0),
        orientation=0,
        state_names=setting.model.state_names,
    )


def _last_period(model: Model, time: Array, states: Array) -> tuple[float, Array]:
    """Return the length (s) of a period at the end of a simulation, and the motion in it."""
    tail = states[len(states) // 2 :]
    k = int(np.argmax(np.ptp(tail, axis=0) / model.scale))
    signal = tail[:, k] - (tail[:, k].max() + tail[:, k].min()) / 2.0
    tenth = max(2, len(signal) // 5)
    early, late = np.ptp(signal[:tenth]), np.ptp(signal[-tenth:])
    if np.ptp(signal) < _STILL * model.scale[k] or late < _DECAYED * early:
        raise CycleError(
            f"the motion of {model.name} dies out within {time[-1]:g} s: there is no limit cycle that "
            "this disturbance reaches. Raise the speed or the perturbation"
        )
    up = np.flatnonzero((signal[:-1] < 0.0) & (signal[1:] >= 0.0))
    if len(up) < 3:
        raise CycleError(
            f"{model.name} completes fewer than two periods in the last {time[-1] / 2.0:.3g} s; "
            "simulate longer"
        )
    exact = up + signal[up] / (signal[up] - signal[up + 1])
    part = (exact - up)[:, None]
    crossings = (1.0 - part) * tail[up] + part * tail[up + 1]
    i = _returning(crossings / np.maximum(np.ptp(tail, axis=0), _STILL * model.scale))
    period = float((exact[-1] - exact[i]) * (time[1] - time[0]))
    samples = up[i] + np.arange(round(period / _SAMPLE) + 1)
    return period, tail[np.minimum(samples, len(tail) - 1)]


def _returning(crossings: Array) -> int:
    """Return the index of the latest upward crossing to whose state the last one returns.

    A motion may cross its middle several times a period.
    """
    misses = np.abs(crossings[:-1] - crossings[-1]).max(axis=1)[-_CROSSINGS:]
    back = np.flatnonzero(misses < max(_BACK, 2.0 * float(misses.min())))
    return len(crossings) - 1 - len(misses) + int(back[-1])
