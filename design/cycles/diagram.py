"""Bifurcation diagrams by simulation: many speeds, curves and initial states at once.

These are shown in the paper's Figs 10 and 11. They contain stable motions only; which of several
depends on the start of a simulation. :mod:`design.cycles.branch` finds all of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.progress import tracked
from railenv import checks
from railenv.batch import Batch
from railenv.equilibrium import follow_speeds
from railenv.errors import EquilibriumError, ParameterError
from railenv.models import Model
from railenv.simulation import natural_step

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_STEP = 2.0  # times the step of ``simulate``: half the time constant of the fastest mode
_SAMPLE = 2e-3  # s, between samples of the extremes
_SMALL, _LARGE = 0.1, 8.0  # of the model's scale: default disturbances of the first state


@dataclass(frozen=True)
class SimulatedDiagram:
    """Motions after a long time, over speed, for several curves and initial states.

    Attributes
    ----------
    model_name : str
    state_names : tuple of str
    radius : ndarray, shape (n_radii,)
        Radii that were computed, m.
    cant : float
        rad.
    speed : ndarray, shape (n_speeds,)
        m/s.
    starts : tuple of dict
        Disturbances of the running equilibrium at the start.
    lowest, highest : ndarray, shape (n_radii, n_speeds, n_starts, n_states)
        Extremes of every state within the window at the end; NaN where the motion diverged.
    steady : ndarray of bool, shape (n_radii, n_speeds)
        Whether a running equilibrium exists; otherwise the simulation starts from the last one.
    clearance : float or None
        Flange clearance of the model, m.
    ended : str or None
        Reason why not all radii were computed.
    """

    model_name: str
    state_names: tuple[str, ...]
    radius: Array
    cant: float
    speed: Array
    starts: tuple[dict[str, float], ...]
    lowest: Array
    highest: Array
    steady: NDArray[np.bool_]
    clearance: float | None
    ended: str | None

    @property
    def amplitude(self) -> dict[str, Array]:
        """Half peak to peak of every state, shape (n_radii, n_speeds, n_starts)."""
        half = (self.highest - self.lowest) / 2.0
        return {name: half[..., k] for k, name in enumerate(self.state_names)}

    def plot(
        self, state: str | None = None, radius: float | None = None, ax: Axes | None = None
    ) -> control.ControlPlot:
        """Draw the amplitude of a state (by default the first) over speed, on one curve or all."""
        from design.cycles.diagram_plots import plot_diagram

        return plot_diagram(self, state, radius, ax)


def simulated_diagram(
    model: Model,
    speeds: ArrayLike,
    *,
    radii: ArrayLike = (math.inf,),
    cant: float = 0.0,
    starts: Sequence[Mapping[str, float]] | None = None,
    duration: float = 20.0,
    window: float = 2.0,
    step: float | None = None,
    progress: bool = False,
) -> SimulatedDiagram:
    """Simulate a vehicle at many speeds, on several curves, from several initial states.

    All speeds and initial states of one curve are integrated together, in lanes of the processor's
    vector units and on all threads.

    Parameters
    ----------
    model : Model
    speeds : array_like
        Increasing, m/s.
    radii : array_like
        Curve radii, m; ``math.inf`` is tangent track.
    cant : float
        Cant angle on all of them, rad.
    starts : sequence of mappings, optional
        Disturbances of the running equilibrium, by state name. A small and a large displacement of the
        first state (0.1 and 8 of the model's scale) when left out.
    duration, window : float
        Time simulated, and the time at its end in which extremes are taken, s.
    step : float, optional
        Runge-Kutta step, s; half the time constant of the fastest mode when left out.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns the radii that were completed.

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium at the lowest speed on a curve.
    """
    targets = np.atleast_1d(np.asarray(speeds, dtype=float))
    curves = np.atleast_1d(np.asarray(radii, dtype=float))
    duration = checks.number("duration", duration, low=0.0, open_low=True, unit="s")
    window = checks.number("window", window, low=0.0, high=duration, open_low=True, unit="s")
    starts = _starts(model, starts)
    results: list[tuple[Array, Array, NDArray[np.bool_]]] = []
    ended: str | None = None
    try:
        for radius in tracked(curves.tolist(), f"simulated diagram, {model.name}", progress):
            results.append(_one_curve(model, targets, radius, cant, starts, (duration, window), step))
    except KeyboardInterrupt:
        ended = f"interrupted after {len(results)} of {len(curves)} radii"
        if not results:
            raise
    lowest, highest, steady = (np.array(part) for part in zip(*results, strict=True))
    return SimulatedDiagram(
        model_name=model.name,
        state_names=model.state_names,
        radius=curves[: len(results)],
        cant=cant,
        speed=targets,
        starts=starts,
        lowest=lowest,
        highest=highest,
        steady=steady,
        clearance=model.flange_clearance,
        ended=ended,
    )


def _starts(model: Model, starts: Sequence[Mapping[str, float]] | None) -> tuple[dict[str, float], ...]:
    """Return the initial disturbances, the given ones or the usual two."""
    if starts is None:
        first, scale = model.state_names[0], float(model.scale[0])
        return {first: _SMALL * scale}, {first: _LARGE * scale}
    if len(starts) == 0:
        raise ParameterError("starts is empty; give at least one initial disturbance")
    for given in starts:
        checks.known("state in starts", given, model.state_names)
    return tuple(dict(given) for given in starts)


def _one_curve(
    model: Model,
    speeds: Array,
    radius: float,
    cant: float,
    starts: Sequence[Mapping[str, float]],
    times: tuple[float, float],
    step: float | None,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the extremes at all speeds from all starts, and whether there is an equilibrium."""
    curvature = checks.curvature(radius)
    states, steady = equilibria(model, speeds, radius, cant)
    begin = disturbed(model, states, starts)
    if step is None:
        step = lane_step(model, states, speeds, curvature, cant)
    step = checks.number("step", step, low=0.0, open_low=True, unit="s")
    batch = Batch([model] * (len(speeds) * len(starts)))
    batch.conditions = [[v, curvature, cant] for v in speeds for _ in starts]
    batch.states = begin.reshape(-1, model.n_states)
    lowest, highest = extremes(batch, times, step)
    return lowest.reshape(begin.shape), highest.reshape(begin.shape), steady


def lane_step(model: Model, states: Array, speeds: Array, curvature: float, cant: float) -> float:
    """Return the Runge-Kutta step (s) of simulations in lanes, from the ends of a range of speeds."""
    ends = [(states[i], float(speeds[i])) for i in (0, -1)]
    return _STEP * min(natural_step(model, x, speed=v, curvature=curvature, cant=cant) for x, v in ends)


def disturbed(model: Model, states: Array, starts: Sequence[Mapping[str, float]]) -> Array:
    """Return the state at every speed with every start added, shape (n_speeds, n_starts, n_states)."""
    begin = np.repeat(states[:, None, :], len(starts), axis=1)
    for k, given in enumerate(starts):
        for name, value in given.items():
            begin[:, k, model.state_names.index(name)] += checks.number(f"start {name}", value)
    return begin


def extremes(batch: Batch, times: tuple[float, float], step: float) -> tuple[Array, Array]:
    """Integrate a batch; return the extremes of all states in the window at the end, NaN if lost."""
    duration, window = times
    total = max(2, math.ceil(duration / step))
    h = duration / total
    looked = min(total, max(1, math.ceil(window / h)))
    stride = max(1, round(_SAMPLE / h))
    batch.integrate(step=h, steps=total - looked)
    lowest = highest = np.asarray(batch.states, dtype=float)
    for _ in range(math.ceil(looked / stride)):
        batch.integrate(step=h, steps=stride)
        now = np.asarray(batch.states, dtype=float)
        lowest, highest = np.minimum(lowest, now), np.maximum(highest, now)
    finite = np.isfinite(highest - lowest)
    return np.where(finite, lowest, np.nan), np.where(finite, highest, np.nan)


def equilibria(
    model: Model, speeds: Array, radius: float, cant: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Return the running equilibrium at every speed, and whether there is one."""
    found: list[Array] = []
    try:
        for point in follow_speeds(model, speeds, radius=radius, cant=cant):
            found.append(point.state)
    except EquilibriumError:
        if not found:
            raise
    steady = np.arange(len(speeds)) < len(found)
    return np.array(found + [found[-1]] * (len(speeds) - len(found))), steady
