"""The nonlinear critical speed by simulation: slow ramps of speed, and large disturbances.

Polach has two definitions: the speed at which hunting ceases when a hunting vehicle is slowed down, and
the lowest speed at which the vehicle goes on hunting after a large disturbance. A ramp up gives the
linear critical speed, if small disturbances act on the vehicle all the time, as on any track.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from design.cycles.cycle import Cycle
from design.cycles.diagram import SimulatedDiagram, simulated_diagram
from design.cycles.survivors import large_disturbances
from railenv import checks
from railenv.errors import ParameterError
from railenv.models import Model
from railenv.simulation import simulate

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

HUNTING = 1.0
"""Amplitude of the first state, in units of the model's scale (mm), above which a vehicle hunts."""

DISTURBANCE = 0.01
"""Size of the small kicks during a ramp, in units of the model's scale (10 micrometres)."""

_OUTPUT_STEP = 5e-3  # s
_SPREAD = 1.0  # s between kicks


@dataclass(frozen=True)
class SpeedRamp:
    """A vehicle whose speed changes steadily and slowly.

    Attributes
    ----------
    model_name, state : str
        Name of the model, and the state whose amplitude is measured.
    time, speed : ndarray
        s, m/s.
    amplitude : ndarray
        Half peak to peak of the state within a window around each time.
    threshold : float
        Amplitude above which the vehicle hunts.
    disturbance : float
        Size of the small kicks, in units of the model's scale.
    final_state : ndarray, shape (n_states,)
    """

    model_name: str
    state: str
    time: Array
    speed: Array
    amplitude: Array
    threshold: float
    disturbance: float
    final_state: Array

    @property
    def critical_speed(self) -> float | None:
        """Speed (m/s) at which hunting ceases (ramp down) or begins (ramp up); None if it does not."""
        hunting = self.amplitude > self.threshold
        changes = np.flatnonzero(hunting[1:] != hunting[0])
        return float(self.speed[changes[0]]) if changes.size else None

    def __str__(self) -> str:
        way = f"ramp from {self.speed[0]:.4g} to {self.speed[-1]:.4g} m/s"
        if self.critical_speed is None:
            return f"{way}: no change"
        verb = "ceases" if self.amplitude[0] > self.threshold else "begins"
        return f"{way}: hunting {verb} at {self.critical_speed:.3f} m/s"

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw amplitude over speed."""
        from design.cycles.polach_plots import plot_ramp

        return plot_ramp(self, ax)


def speed_ramp(
    model: Model,
    *,
    start: float,
    stop: float,
    rate: float = 0.05,
    radius: float = math.inf,
    cant: float = 0.0,
    cycle: Cycle | None = None,
    initial_state: ArrayLike | None = None,
    perturbation: Mapping[str, float] | None = None,
    state: str | None = None,
    threshold: float | None = None,
    window: float = 1.0,
    disturbance: float = DISTURBANCE,
    seed: int = 0,
) -> SpeedRamp:
    """Simulate a slow change of speed, up or down.

    A ramp lags: hunting ceases, or begins, a little after the speed at which it must. The lag grows
    with the rate.

    A vehicle exactly at its equilibrium would stay there, stable or not. So once a second every state
    gets a small random kick, whose growth or decay is that of the vehicle.

    Parameters
    ----------
    model : Model
    start, stop : float
        First and last speed, m/s.
    rate : float
        Magnitude of the change of speed, m/s^2.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track) and cant (rad).
    cycle : Cycle, optional
        A hunting motion from which to start.
    initial_state, perturbation
        As in :func:`railenv.simulate`; the running equilibrium when all are left out.
    state : str, optional
        State whose amplitude is measured; the first when left out.
    threshold : float, optional
        Amplitude above which the vehicle hunts; one unit of the model's scale (1 mm) when left out.
    window : float
        Window for the amplitude, longer than a period, s.
    disturbance : float
        Standard deviation of the kicks, in units of the model's scale (mm); 0 for none.
    seed : int
        Seed of the kicks.
    """
    low, high = checks.speed(start, "start"), checks.speed(stop, "stop")
    rate = checks.number("rate", rate, low=0.0, open_low=True, unit="m/s^2")
    name, k, limit = _judged(model, state, threshold)
    if low == high:
        raise ParameterError(f"start and stop are both {low:g} m/s; a ramp needs two speeds")
    disturbance = checks.number("disturbance", disturbance, low=0.0)
    duration = abs(high - low) / rate

    def speed(t: Array) -> Array:
        return np.asarray(low + (high - low) * np.minimum(t / duration, 1.0))

    start_state = initial_state if cycle is None else cycle.states[0]
    run = _Run(model, speed, duration, radius, cant, disturbance, np.random.default_rng(seed))
    time, states = run.states(start_state, perturbation)
    size = max(3, round(window / float(time[1] - time[0])))
    spread = maximum_filter1d(states[k], size) - minimum_filter1d(states[k], size)
    return SpeedRamp(
        model.name, name, time, speed(time), spread / 2.0, limit, disturbance, states[:, -1].copy()
    )


@dataclass(frozen=True)
class _Run:
    """A run with kicks of the states at the start and once a second."""

    model: Model
    speed: Callable[[Array], Array]
    duration: float
    radius: float
    cant: float
    disturbance: float
    rng: np.random.Generator

    def states(
        self, start: ArrayLike | None, perturbation: Mapping[str, float] | None
    ) -> tuple[Array, Array]:
        """Return times (s) and states, shape (n_states, n_times)."""
        count = math.ceil(self.duration / _SPREAD) if self.disturbance else 1
        ends = np.minimum(np.arange(count + 1) * _SPREAD, self.duration)
        ends[-1] = self.duration
        times: list[Array] = [np.zeros(1)]
        states: list[Array] = []
        for begin, end in pairwise(ends.tolist()):
            response = self._part(begin, end, start, self._kicked(perturbation))
            if not states:
                states.append(response.states[:, :1])
            times.append(begin + response.time[1:])
            states.append(response.states[:, 1:])
            start, perturbation = response.states[:, -1], None
        return np.concatenate(times), np.concatenate(states, axis=1)

    def _part(
        self, begin: float, end: float, start: ArrayLike | None, perturbation: Mapping[str, float]
    ) -> control.TimeResponseData:
        return simulate(
            self.model,
            speed=lambda t: self.speed(begin + t),
            radius=self.radius,
            cant=self.cant,
            duration=end - begin,
            initial_state=start,
            perturbation=perturbation,
            output_step=_OUTPUT_STEP,
        )

    def _kicked(self, perturbation: Mapping[str, float] | None) -> dict[str, float]:
        """Return the given perturbation plus a kick in every state."""
        kicks = self.disturbance * self.model.scale * self.rng.standard_normal(self.model.n_states)
        found = dict(zip(self.model.state_names, kicks.tolist(), strict=True))
        for name, value in checks.mapping("perturbation", perturbation or {}).items():
            found[name] = found.get(name, 0.0) + checks.number(f"perturbation {name}", value)
        return found


def _judged(model: Model, state: str | None, threshold: float | None) -> tuple[str, int, float]:
    """Return the state whose amplitude is measured, its index, and the amplitude of hunting."""
    name = model.state_names[0] if state is None else state
    checks.known("state", [name], model.state_names)
    k = model.state_names.index(name)
    return name, k, HUNTING * float(model.scale[k]) if threshold is None else threshold


@dataclass(frozen=True)
class DisturbanceTest:
    """A test whether a vehicle goes on hunting after a large disturbance, speed by speed.

    Attributes
    ----------
    diagram : SimulatedDiagram
        The simulations; its one start is the disturbance.
    state : str
        The state whose amplitude is measured.
    threshold : float
        Amplitude above which the vehicle hunts.
    """

    diagram: SimulatedDiagram
    state: str
    threshold: float

    @property
    def speed(self) -> Array:
        """Speeds, m/s."""
        return self.diagram.speed

    @property
    def amplitude(self) -> Array:
        """Amplitude at the end, at each speed."""
        return self.diagram.amplitude[self.state][0, :, 0]

    @property
    def critical_speed(self) -> float | None:
        """Lowest of the speeds (m/s) at which the vehicle goes on hunting; None if it never does."""
        hunting = self.amplitude > self.threshold
        return float(self.speed[np.argmax(hunting)]) if hunting.any() else None

    def __str__(self) -> str:
        if self.critical_speed is None:
            return f"the disturbance dies out from {self.speed[0]:g} to {self.speed[-1]:g} m/s"
        return f"goes on hunting after the disturbance from {self.critical_speed:.4g} m/s"

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw amplitude over speed."""
        return self.diagram.plot(self.state, ax=ax)


def disturbance_test(
    model: Model,
    speeds: ArrayLike,
    *,
    disturbance: Mapping[str, float] | None = None,
    radius: float = math.inf,
    cant: float = 0.0,
    duration: float = 20.0,
    window: float = 2.0,
    state: str | None = None,
    threshold: float | None = None,
) -> DisturbanceTest:
    """Disturb a vehicle strongly at several speeds at once, and find where it goes on hunting.

    Near the critical speed a disturbance dies out slowly, so too short a ``duration`` gives too low a
    speed. The result depends on the disturbance.

    Parameters
    ----------
    model : Model
    speeds : array_like
        Increasing, m/s.
    disturbance : mapping of str to float, optional
        Disturbance of the running equilibrium; 8 of the model's scale (8 mm) in every lateral
        displacement (states named ``y_...``), or in the first state, when left out.
    radius, cant, duration, window
        As in :func:`design.simulated_diagram`.
    state, threshold
        As in :func:`speed_ramp`.
    """
    name, _, limit = _judged(model, state, threshold)
    if disturbance is None:
        disturbance = large_disturbances(model)[0]
    diagram = simulated_diagram(
        model,
        speeds,
        radii=[radius],
        cant=cant,
        starts=[disturbance],
        duration=duration,
        window=window,
    )
    return DisturbanceTest(diagram, name, limit)
