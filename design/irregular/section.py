"""Poincare sections: the states of a motion each time that it passes a surface."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.irregular.motion import Motion, setting_of, start_of
from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
At = float | Literal["maximum", "minimum"]

_CHUNK = 4000  # steps whose states are held at a time
_RETURN = 1e-3  # of the motion's swing: points closer than this are the same
_LONGEST_RETURN = 64  # points
_STILL = 1e-6  # of the model's scale: a smaller motion has no section


@dataclass(frozen=True)
class SectionSurface:
    """A surface: a state has a maximum or a minimum, or passes a value.

    Attributes
    ----------
    state : str
    at : {"maximum", "minimum"} or float
    direction : {"up", "down"}
        Direction in which a value is passed; it has no effect for extremes.
    """

    state: str
    at: At
    direction: Literal["up", "down"]

    def __str__(self) -> str:
        if isinstance(self.at, str):
            return f"{self.at} of {self.state}"
        return f"{self.state} = {self.at:g}, {'upwards' if self.direction == 'up' else 'downwards'}"


def section_of(
    model: Model, state: str | None, at: At, direction: Literal["up", "down"]
) -> SectionSurface:
    """Return a checked section; by default of the first state."""
    name = model.state_names[0] if state is None else state
    checks.known("state", [name], model.state_names)
    checks.choice("direction", direction, ["up", "down"])
    if isinstance(at, str):
        if at not in ("maximum", "minimum"):
            raise ParameterError(f"at is {shown(at)}; it must be 'maximum', 'minimum' or a number")
        return SectionSurface(name, at, direction)
    return SectionSurface(name, checks.number("at", at), direction)


@dataclass(frozen=True)
class PoincareSection:
    """The points at which a motion passes a surface.

    Attributes
    ----------
    model_name : str
    speed, curvature, cant : float
        m/s, 1/m, rad.
    section : SectionSurface
        The surface.
    time : ndarray, shape (n_points,)
        Times of the passages, s, from the end of settling.
    states : ndarray, shape (n_points, n_states)
        States at the passages.
    lowest, highest, mean : ndarray, shape (n_states,)
        Extremes and mean of the states over the whole motion.
    end : ndarray, shape (n_states,)
        State at the end, from which the motion may be continued.
    scale : ndarray, shape (n_states,)
        Typical magnitudes of the model's states.
    state_names : tuple of str
    """

    model_name: str
    speed: float
    curvature: float
    cant: float
    section: SectionSurface
    time: Array
    states: Array
    lowest: Array
    highest: Array
    mean: Array
    end: Array
    scale: Array
    state_names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.time)

    @property
    def amplitude(self) -> dict[str, float]:
        """Half peak to peak of every state over the whole motion."""
        return dict(zip(self.state_names, ((self.highest - self.lowest) / 2.0).tolist(), strict=True))

    @property
    def moves(self) -> bool:
        """Whether there is a motion at all."""
        return bool((self.highest - self.lowest > 2.0 * _STILL * self.scale).any())

    def values(self, state: str | None = None) -> Array:
        """Return a state (by default that of the section) at the points, shape (n_points,)."""
        name = self.section.state if state is None else state
        checks.known("state", [name], self.state_names)
        return self.states[:, self.state_names.index(name)]

    @property
    def period(self) -> int | None:
        """Number of points after which the motion returns; None if it does not within 64.

        It returns if the second half of the points repeats within 0.1 % of the swing of every state.
        """
        most = min(_LONGEST_RETURN, len(self) - len(self) // 2 - 1)
        return next((k for k in range(1, most + 1) if self.miss(k) <= _RETURN), None)

    def miss(self, points: int) -> float:
        """Return the distance of the motion from a return after some points, in units of its swing.

        This is the largest distance of any state in the second half of the points.
        """
        checks.whole("points", points, high=max(1, len(self) - len(self) // 2 - 1))
        last = self.states[len(self) // 2 :]
        swing = np.maximum(self.highest - self.lowest, _STILL * self.scale)
        return float((np.abs(last[points:] - last[:-points]) / swing).max(initial=0.0))

    @property
    def kind(self) -> str:
        """Kind of motion in the section: rest, a return after some points, or no return."""
        if not self.moves:
            return "at rest"
        return "does not come back" if self.period is None else f"period {self.period}"

    def return_map(self, state: str | None = None) -> tuple[Array, Array]:
        """Return a state (by default the section's) at each point but the last, and at the next one."""
        values = self.values(state)
        return values[:-1], values[1:]

    def summary(self) -> dict[str, Any]:
        """Return the section as plain numbers and strings, ready for JSON."""
        return {
            "model": self.model_name,
            "speed": self.speed,
            "curvature": self.curvature,
            "cant": self.cant,
            "section": str(self.section),
            "points": len(self),
            "kind": self.kind,
            "values": self.values().tolist(),
            "amplitude": self.amplitude,
        }

    def __str__(self) -> str:
        return f"{len(self)} points at {self.section}; {self.kind}"

    def plot(
        self, states: tuple[str, str] | None = None, ax: Axes | None = None
    ) -> control.ControlPlot:
        """Draw the points in the plane of two states (by default the first two that vary)."""
        from design.irregular.irregular_plots import plot_section

        return plot_section(self, states, ax)

    def plot_return_map(self, state: str | None = None, ax: Axes | None = None) -> control.ControlPlot:
        """Draw a state (by default the section's) at each point over its value at the previous one."""
        from design.irregular.irregular_plots import plot_return_map

        return plot_return_map(self, state, ax)


def poincare_section(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    inputs: ArrayLike | None = None,
    state: str | None = None,
    at: At = "maximum",
    direction: Literal["up", "down"] = "up",
    duration: float = 100.0,
    settle: float = 50.0,
    initial_state: ArrayLike | None = None,
    perturbation: Mapping[str, float] | None = None,
    step: float | None = None,
) -> PoincareSection:
    """Record a motion each time that a state has a maximum or a minimum, or passes a value.

    A periodic motion gives one point, or several in turn; a motion of two frequencies gives a closed
    curve; a chaotic one gives a set with structure on all scales. Each point is located by shortening
    the last Runge-Kutta step until it ends on the surface, so it is as accurate as the steps.

    Parameters
    ----------
    model : Model
    speed : float
        m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track) and cant (rad).
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs; zero when left out.
    state : str, optional
        State of the surface; the first when left out.
    at : {"maximum", "minimum"} or float
        Place of the surface. Maxima show the amplitude.
    direction : {"up", "down"}
        Direction in which a value is passed.
    duration, settle : float
        Time recorded, and time before that to reach the attractor, s.
    initial_state, perturbation, step
        As in :func:`design.lyapunov_exponents`.

    Raises
    ------
    ParameterError, UnknownNameError
        If an argument is not allowed.
    EquilibriumError
        If there is no running equilibrium to start from (then give ``initial_state``).
    SimulationError
        If the motion diverges.

    Examples
    --------
    >>> import design, railenv
    >>> model = railenv.CooperriderBogie()
    >>> print(design.poincare_section(model, speed=70.0, duration=20.0))
    80 points at maximum of y_w1; period 1
    """
    setting = setting_of(model, speed, radius, cant, inputs)
    duration = checks.number("duration", duration, low=0.0, open_low=True, unit="s")
    settle = checks.number("settle", settle, low=0.0, unit="s")
    if step is not None:
        step = checks.number("step", step, low=0.0, open_low=True, unit="s")
    surface = section_of(model, state, at, direction)
    motion = Motion(setting, start_of(setting, initial_state, perturbation), step)
    motion.settle(settle)
    return passages(motion, surface, duration)


def passages(motion: Motion, section: SectionSurface, duration: float) -> PoincareSection:
    """Continue a motion for some time (s) and return its section."""
    setting = motion.setting
    model = setting.model
    index = model.state_names.index(section.state)
    steps = max(1, math.ceil(duration / motion.step))
    found: list[tuple[float, Array]] = []
    lowest = highest = motion.state
    total = np.zeros(model.n_states)
    before = np.empty(
        (0, model.n_states)
    )  # the state before the chunk, which may begin with an extreme
    for first in range(0, steps, _CHUNK):
        states = motion.record(min(_CHUNK, steps - first))
        lowest, highest = (
            np.minimum(lowest, states.min(axis=0)),
            np.maximum(highest, states.max(axis=0)),
        )
        total += states[1:].sum(axis=0)
        together = np.concatenate([before, states])
        found += [
            ((first - len(before) + k) * motion.step + part, state)
            for k, part, state in _crossings(motion, section, index, together, len(before))
        ]
        before = states[-2:-1]
    return PoincareSection(
        model_name=model.name,
        speed=setting.speed,
        curvature=setting.curvature,
        cant=setting.cant,
        section=section,
        time=np.array([time for time, _ in found]),
        states=np.array([state for _, state in found]).reshape(-1, model.n_states),
        lowest=lowest,
        highest=highest,
        mean=total / steps,
        end=motion.state,
        scale=model.scale,
        state_names=model.state_names,
    )


def _crossings(
    motion: Motion, section: SectionSurface, index: int, states: Array, overlap: int
) -> list[tuple[int, float, Array]]:
    """Return the passages of the surface: the step, the time (s) after it, and the state.

    The first ``overlap`` steps were already searched.
    """
    signal = states[:, index]
    if isinstance(section.at, str):
        sign = 1.0 if section.at == "minimum" else -1.0

        def height(state: Array) -> float:
            return sign * float(motion.slope(state)[index])

        steps = _about_minima(sign * signal)
    else:
        sign, value = (1.0 if section.direction == "up" else -1.0), section.at

        def height(state: Array) -> float:
            return sign * (float(state[index]) - value)

        above = sign * (signal - value) >= 0.0
        steps = [int(k) for k in np.flatnonzero(~above[:-1] & above[1:]) if k >= overlap]
    return [
        (k, *_located(motion, height, states[k]))
        for k in steps
        if height(states[k]) < 0.0 <= height(states[k + 1])
    ]


def _about_minima(signal: Array) -> list[int]:
    """Return the steps within which a signal may have its minima: those beside its lowest samples."""
    middle = np.flatnonzero((signal[:-2] > signal[1:-1]) & (signal[1:-1] <= signal[2:])) + 1
    return [int(k) for m in middle for k in (m - 1, m)]


def _located(motion: Motion, height: Callable[[Array], float], state: Array) -> tuple[float, Array]:
    """Return the length of a step (s) from a state to the surface, and the state at its end."""
    from scipy.optimize import brentq

    def missed(step: float) -> float:
        return height(motion.after(state, step))

    # rounding may leave the end of the whole step just short of the surface
    step = motion.step
    if missed(step) > 0.0:
        step = float(brentq(missed, 0.0, step, xtol=1e-15, rtol=1e-14))
    return step, motion.after(state, step)
