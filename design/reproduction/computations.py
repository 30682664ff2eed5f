"""Computations of the report: functions of plain inputs whose results are kept."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

import railenv
from design.cycles.branch import cycle_branch
from design.cycles.cycle import Cycle, CycleBranch
from design.cycles.diagram import SimulatedDiagram, simulated_diagram
from design.cycles.hunting_map import HuntingMap, hunting_map
from design.cycles.polach import HUNTING
from design.cycles.spectrum import spectrum
from design.linear.linearization import linearize
from design.reproduction.codec import response as time_response
from design.stability.critical_speed import SPEED_RANGE, critical_speed
from design.stability.loss import CriticalSpeed
from design.stability.sweep import curve_sweep
from railenv.models import Bogie, DualWheelset

VehicleModel = Bogie | DualWheelset

_FAST = 200.0
"""m/s; no train could have a critical speed above it."""

_STATES = ("y_w1", "psi_w1", "y_b", "psi_b")
_BISECTIONS = 7  # from 0.8 to 1.2 of the linear critical speed: a resolution of 0.3 % of it
_BELOW, _ABOVE = 0.8, 1.2
KEPT = 0.98
"""Least ratio of the amplitude over half a simulation: less is a decay."""

_SAMPLE = 2e-3  # s, between samples of a motion
_ROWS = 65  # samples kept of a limit cycle


def critical_speeds(
    model: VehicleModel, radii: Sequence[float], listed: Sequence[float], cant: float
) -> dict[str, Any]:
    """Find critical speeds on tangent track, over a range of radii, and at the radii of a table."""
    return {
        "tangent": critical_speed(model),
        "sweep": curve_sweep(model, radii, cant=cant),
        "listed": [critical_speed(model, radius=r, cant=cant) for r in listed],
    }


def motion(
    model: VehicleModel,
    speed: float,
    radius: float,
    cant: float,
    duration: float,
    window: float,
    shown: float,
) -> dict[str, Any]:
    """Simulate from zero initial conditions, as in the paper, and classify the end of the motion.

    Returns
    -------
    dict
        response : displacements and their rates of leading wheelset and frame, up to the time ``shown``
        (s); spectrum : of the leading
        wheelset within the window at the end; amplitude, mean (m) : its half peak to peak and mean
        there; hunts : whether that is hunting; speed (m/s).
    """
    found = _from_rest(model, speed, radius, cant, duration)
    names = [s for s in _STATES if s in model.state_names]
    names += [f"d{s}" for s in names]
    rows = [model.state_names.index(s) for s in names]
    time, outputs = np.asarray(found.time), np.asarray(found.outputs)
    y, start = outputs[0, time >= duration - window], time <= shown
    return {
        "response": time_response(time[start], outputs[rows][:, start], names, model.name),
        "spectrum": spectrum(found, skip=duration - window),
        "amplitude": float(np.ptp(y) / 2.0),
        "mean": float(y.mean()),
        "hunts": _hunts(model, y),
        "speed": speed,
    }


def motion_at_critical(
    model: VehicleModel,
    factor: float,
    radius: float,
    cant: float,
    distance: float,
    window: float | None,
) -> dict[str, Any] | None:
    """Simulate a run of some length (m) at a multiple of the critical speed on a curve.

    The result is that of :func:`motion` without the response; the window is the whole run when None.
    It is None if there is no critical speed below 200 m/s.
    """
    critical = critical_speed(model, radius=radius, cant=cant)
    if not _hunting(critical):
        return None
    speed = factor * _speed(critical)
    duration = distance / speed
    found = motion(model, speed, radius, cant, duration, duration if window is None else window, 0.0)
    return {name: value for name, value in found.items() if name != "response"}


def simulated_critical_speed(
    model: VehicleModel, radius: float, cant: float, duration: float, window: float
) -> float | None:
    """Find by bisection the speed (m/s) from which a simulation from zero initial conditions hunts.

    It hunts if the amplitude at the end is that of hunting and has not decayed since half the time.
    The result is None if there is no such change from 0.8 to 1.2 of the linear critical speed.
    """
    critical = critical_speed(model, radius=radius, cant=cant)
    if not _hunting(critical):
        return None

    def hunts(speed: float) -> bool:
        found = _from_rest(model, speed, radius, cant, duration)
        time, y = np.asarray(found.time), np.asarray(found.outputs)[0]
        end = y[time >= duration - window]
        middle = y[(time >= duration / 2.0 - window) & (time < duration / 2.0)]
        return _hunts(model, end) and bool(np.ptp(end) > KEPT * np.ptp(middle))

    low, high = _BELOW * _speed(critical), _ABOVE * _speed(critical)
    if hunts(low) or not hunts(high):
        return None
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if hunts(middle) else (middle, high)
    return high


def natural_frequencies(model: VehicleModel) -> dict[str, Any] | None:
    """Compare frequencies on tangent track at the critical speed; None without such a speed.

    Returns
    -------
    dict
        hunting (Hz); kinematic : Klingel's frequency of a free wheelset (Hz); frame : undamped natural
        frequencies (Hz) of the frame on its suspension with the wheelsets held.
    """
    critical = critical_speed(model)
    if not _hunting(critical):
        return None
    A = np.asarray(linearize(model, speed=_speed(critical)).A)
    frame = [i for i, name in enumerate(model.state_names) if name.endswith("_b")]
    rates, coordinates = frame[len(frame) // 2 :], frame[: len(frame) // 2]
    squares = np.linalg.eigvals(-A[np.ix_(rates, coordinates)]).real
    return {
        "hunting": critical.frequency,
        "kinematic": _speed(critical) / model.vehicle.klingel_wavelength,
        "frame": np.sqrt(np.maximum(np.sort(squares), 0.0)) / (2.0 * math.pi),
    }


def diagram(
    model: VehicleModel,
    speeds: Sequence[float],
    radii: Sequence[float],
    cant: float,
    duration: float,
    window: float,
) -> SimulatedDiagram:
    """Simulate at many speeds on several curves, from a small and a large disturbance."""
    found = simulated_diagram(model, speeds, radii=radii, cant=cant, duration=duration, window=window)
    _whole(found.ended)
    return found


def branch(
    model: VehicleModel,
    radius: float,
    cant: float,
    highest: float,
    points: int,
    longest_step: float,
) -> dict[str, Any] | None:
    """Follow the limit cycles from the Hopf point; None if there is none below 200 m/s."""
    critical = critical_speed(model, radius=radius, cant=cant)
    if not _hunting(critical):
        return None
    limits = (SPEED_RANGE[0], highest)
    found = cycle_branch(
        model, start=critical, parameter_range=limits, points=points, longest_step=longest_step
    )
    _whole(found.ended)
    return {"branch": _thinned(found), "criticality": critical.criticality}


def chart(
    model: VehicleModel, parameter: str, values: Sequence[float], radius: float, cant: float
) -> HuntingMap:
    """Find linear and nonlinear critical speeds over a parameter."""
    found = hunting_map(model, parameter, values, radius=radius, cant=cant)
    _whole(found.ended)
    return found


def _from_rest(
    model: VehicleModel, speed: float, radius: float, cant: float, duration: float
) -> control.TimeResponseData:
    zero = np.zeros(model.n_states)
    return railenv.simulate(
        model,
        speed=speed,
        radius=radius,
        cant=cant,
        duration=duration,
        initial_state=zero,
        output_step=_SAMPLE,
    )


def _hunts(model: VehicleModel, y: NDArray[np.float64]) -> bool:
    return bool(np.ptp(y) / 2.0 > HUNTING * model.scale[0])


def _hunting(critical: CriticalSpeed) -> bool:
    return critical.loss == "hunting" and _speed(critical) < _FAST


def _speed(critical: CriticalSpeed) -> float:
    assert critical.speed is not None
    return critical.speed


def _whole(ended: str | None) -> None:
    """Raise an interrupt again that a computation has caught to return its results so far."""
    if ended is not None and ended.startswith("interrupted"):
        raise KeyboardInterrupt


def _thinned(found: CycleBranch) -> CycleBranch:
    return dataclasses.replace(
        found,
        cycles=tuple(_thin(c) for c in found.cycles),
        special=tuple(dataclasses.replace(s, cycle=_thin(s.cycle)) for s in found.special),
    )


def _thin(cycle: Cycle) -> Cycle:
    """Return a cycle with fewer samples of its motion; everything else stays."""
    time = np.linspace(0.0, cycle.period, _ROWS)
    states = np.stack([np.interp(time, cycle.time, column) for column in cycle.states.T], axis=1)
    return dataclasses.replace(cycle, states=states)
