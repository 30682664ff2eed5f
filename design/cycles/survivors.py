"""Motions that persist after large disturbances, found by simulation, speed by speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.diagram import disturbed, equilibria, extremes, lane_step
from design.cycles.shooting import displacement
from railenv import checks
from railenv.batch import Batch
from railenv.models import Model

Array = NDArray[np.float64]

STILL = 0.05
"""Largest displacement, in units of the model's scale, below which a motion has died out."""

_LARGE = (8.0, 14.0)  # of the model's scale: 8 and 14 mm
_KICK = 1e-3  # of the model's scale, for every state, so that no symmetry preserves an unstable motion
_LOOKS = 400  # least number of steps in a window, so that peaks are found
_STEADY = 2e-3  # relative change of the amplitude over two windows
_REMEMBERED = 6  # amplitudes: if all of them fell, the motion is still dying out
_LONGEST = 80  # halves of the requested duration, if motions are still dying out


@dataclass(frozen=True)
class Survivor:
    """A motion that persists.

    Attributes
    ----------
    speed : float
        m/s.
    amplitudes : ndarray, shape (n_states,)
        Half peak to peak of every state at the end.
    state : ndarray, shape (n_states,)
        State at the end of the simulation.
    steady : bool
        Whether the amplitudes have stopped changing.
    """

    speed: float
    amplitudes: Array
    state: Array
    steady: bool


def large_disturbances(model: Model) -> tuple[dict[str, float], ...]:
    """Return disturbances that throw a vehicle against its flanges: to one side, and alternating.

    They are 8 and 14 of the model's scale (8 and 14 mm) in every lateral displacement (states named
    ``y_...``), or in the first state of equations without such names.
    """
    names = [s for s in model.state_names if s.startswith("y_")] or [model.state_names[0]]
    scale = {s: float(model.scale[model.state_names.index(s)]) for s in names}
    signs = ([1.0] * len(names), [(-1.0) ** k for k in range(len(names))])
    return tuple(
        {s: sign * large * scale[s] for s, sign in zip(names, turned, strict=True)}
        for large in _LARGE
        for turned in signs[: min(2, len(names))]
    )


def survivors(
    model: Model,
    speeds: ArrayLike,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    starts: Sequence[Mapping[str, float]] | None = None,
    duration: float = 20.0,
    window: float = 2.0,
) -> tuple[Survivor, ...]:
    """Simulate a vehicle from large disturbances at some speeds; return the motions that persist.

    Motions that are still dying out at the end are simulated further, up to forty times as long: close
    to a critical speed motions take minutes to die out.

    Parameters
    ----------
    model : Model
    speeds : array_like
        Increasing, m/s.
    radius, cant : float
        m, rad.
    starts : sequence of mappings, optional
        Disturbances of the running equilibrium, by state name; :func:`large_disturbances` when left
        out. A thousandth of the model's scale is also added to every state.
    duration, window : float
        Time simulated, and the time at its end in which extremes are taken, which must be longer than a
        period, s.
    """
    targets = np.atleast_1d(np.asarray(speeds, dtype=float))
    starts = large_disturbances(model) if starts is None else starts
    curvature = checks.curvature(radius)
    states, _ = equilibria(model, targets, radius, cant)
    conditions = np.array([[v, curvature, cant] for v in targets for _ in starts])
    ends = disturbed(model, states, starts).reshape(-1, model.n_states)
    ends += _KICK * model.scale * np.cos(np.arange(model.n_states))
    step = min(lane_step(model, states, targets, curvature, cant), window / _LOOKS)
    lanes = np.arange(len(ends))
    amplitudes = np.zeros_like(ends)
    sizes = np.full((len(ends), _REMEMBERED), np.nan)
    steady = np.zeros(len(ends), dtype=bool)
    for round_ in range(_LONGEST):
        stretch = duration if round_ == 0 else duration / 2.0
        amplitudes[lanes], ends[lanes] = _simulated(
            model, conditions[lanes], ends[lanes], (stretch, window), step
        )
        sizes[lanes, :-1] = sizes[lanes, 1:]
        sizes[lanes, -1] = [displacement(model, a) for a in amplitudes[lanes]]
        steady[lanes] = _steady(sizes[lanes])
        lanes = lanes[_dying(sizes[lanes]) & ~steady[lanes]]
        if lanes.size == 0:
            break
    speed = conditions[:, 0]
    persist = sizes[:, -1] > STILL
    return tuple(
        Survivor(float(speed[i]), amplitudes[i], ends[i], bool(steady[i]))
        for i in np.flatnonzero(persist)
    )


def _steady(sizes: Array) -> NDArray[np.bool_]:
    """Return whether motions have stopped changing; each row has the last amplitudes of one."""
    return np.asarray(np.abs(sizes[:, -1] / np.maximum(sizes[:, -2], STILL) - 1.0) <= _STEADY)


def _dying(sizes: Array) -> NDArray[np.bool_]:
    """Return whether motions may still die out: they move, and none of their amplitudes grew."""
    moving = sizes[:, -1] > STILL  # False if states are no longer finite
    wavering = (np.diff(sizes, axis=1) > 0.0).any(axis=1)
    return np.asarray(moving & ~(np.isfinite(sizes).all(axis=1) & wavering))


def _simulated(
    model: Model, conditions: Array, states: Array, times: tuple[float, float], step: float
) -> tuple[Array, Array]:
    """Return the amplitudes of a window at the end, and the states there."""
    batch = Batch([model] * len(states))
    batch.conditions = conditions
    batch.states = states
    lowest, highest = extremes(batch, times, step)
    return (highest - lowest) / 2.0, np.asarray(batch.states, dtype=float)
