"""Lyapunov exponents: the rates at which neighbouring motions separate or converge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.shooting import Setting, Shooting
from design.irregular.motion import Motion, diverged, setting_of, start_of
from design.progress import tracked
from railenv import checks
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Kind = Literal["equilibrium", "periodic", "torus", "chaotic", "not decided"]

_BLOCKS = 24  # of the duration
_JOINED = 2  # blocks in one sample for the error of the mean: longer samples are less dependent
_FEWEST = 8  # least number of blocks that an interrupted run returns
_SPREAD = 10.0  # time constants of the fastest mode between two re-orthonormalisations
_ALIGNING = 0.5  # of ``settle``, in which the directions align
_SURE = 3.0  # standard errors
_LEAST = 5.0  # a distance must change by e^5 over the run to differ from a constant one
_NEUTRAL = 3e-3  # of the angular frequency: exponents below it count as zero for a torus
_RESTING = 1e-9  # of the model's scale per second: a slower motion has no direction of its own
_STILL = 1e-6  # of the model's scale: less does not count as motion
_STEADY = 0.8  # least ratio of the swings in both halves of a run


@dataclass(frozen=True)
class LyapunovExponents:
    """The largest Lyapunov exponents of a motion.

    Attributes
    ----------
    model_name : str
    speed, curvature, cant : float
        m/s, 1/m, rad.
    duration : float
        Time over which they are averaged, s.
    step, stretch : float
        Runge-Kutta step, and time between two re-orthonormalisations, s.
    ends : ndarray, shape (n_blocks + 1,)
        Times that divide the duration into blocks, s: if there are enough, moments at which the state
        that swings most passes its mean upwards, so that a block of a periodic motion has whole
        periods.
    blocks : ndarray, shape (n_blocks, count)
        Mean exponents of these blocks, 1/s.
    own : ndarray, shape (n_parts,)
        Error of the motion's own direction, in which nothing grows, for equal parts of the duration:
        the sum of relative errors after it is carried along, 1/s. It shows the accuracy of the
        derivatives, and is large if the equations jump, which derivatives do not contain: a wheel that
        lifts loses its creep forces.
    frequency : float
        Mean frequency (Hz) of the state that swings most: its upward passages of its mean.
    lowest, highest : ndarray, shape (n_parts, n_states)
        Extremes of the states in these parts.
    scale : ndarray, shape (n_states,)
        Typical magnitudes of the model's states.
    end : ndarray, shape (n_states,)
        State at the end, from which the motion may be continued.
    state_names : tuple of str
    ended : str or None
        Reason why the duration is shorter than requested.
    """

    model_name: str
    speed: float
    curvature: float
    cant: float
    duration: float
    step: float
    stretch: float
    ends: Array
    blocks: Array
    own: Array
    frequency: float
    lowest: Array
    highest: Array
    scale: Array
    end: Array
    state_names: tuple[str, ...]
    ended: str | None = None

    @property
    def exponents(self) -> Array:
        """The exponents, the largest first, 1/s."""
        return np.asarray(self.history[-1])

    @property
    def largest(self) -> float:
        """The largest exponent, 1/s."""
        return float(self.exponents[0])

    @property
    def error(self) -> Array:
        """Standard errors of the exponents, from the scatter of the blocks, 1/s."""
        whole = len(self.blocks) - len(self.blocks) % _JOINED
        samples = self.blocks[-whole:].reshape(-1, _JOINED, self.blocks.shape[1]).mean(axis=1)
        return np.asarray(samples.std(axis=0, ddof=1) / math.sqrt(len(samples)))

    @property
    def own_error(self) -> float:
        """Mean of ``own``, 1/s: smaller exponents are not significant."""
        return float(self.own.mean())

    @property
    def bound(self) -> Array:
        """Magnitude above which an exponent differs significantly from zero, 1/s.

        The largest of three standard errors, 5 over the duration, and the error of the motion's own
        direction.
        """
        return np.maximum(_SURE * self.error, max(_LEAST / self.duration, self.own_error))

    @property
    def time(self) -> Array:
        """Times since the start of the first block at which blocks end, s."""
        return self.ends[1:] - self.ends[0]

    @property
    def history(self) -> Array:
        """Exponents up to these times, shape (n_blocks, count), 1/s."""
        lengths = np.diff(self.ends)[:, None]
        return np.asarray(np.cumsum(self.blocks * lengths, axis=0) / np.cumsum(lengths, axis=0))

    @property
    def swing(self) -> Array:
        """Half of peak to peak of every state, shape (n_states,)."""
        return (self.highest.max(axis=0) - self.lowest.min(axis=0)) / 2.0

    @property
    def steady(self) -> bool:
        """Whether the motion neither grows nor decays: both halves of the run swing equally."""
        half = len(self.lowest) // 2
        parts = [slice(None, half), slice(half, None)]
        first, last = (np.ptp([self.lowest[p].min(0), self.highest[p].max(0)], axis=0) for p in parts)
        k = int(np.argmax(self.swing / self.scale))
        return bool(min(first[k], last[k]) >= _STEADY * max(first[k], last[k]))

    @property
    def kind(self) -> Kind:
        """Kind of motion by the exponents.

        "equilibrium": nothing moves, or it decays and all exponents are negative. "periodic": the first
        is zero and the second negative. "torus": the first two are zero, known to 0.3 % of the angular
        frequency; motions of uncoupled parts count as such whatever their frequencies, because their
        phases are arbitrary. "chaotic": the first is positive. "not decided": errors are too large (or
        ``count`` is too small) to decide, the motion still grows or decays, or it goes on although all
        exponents are negative, which is impossible: its derivatives miss a jump.
        """
        value, bound = self.exponents, self.bound
        if (self.swing < _STILL * self.scale).all():
            return "equilibrium"
        if not self.steady:
            return "equilibrium" if value[0] < -bound[0] else "not decided"
        if value[0] > bound[0]:
            return "chaotic"
        if value[0] < -bound[0]:
            return "not decided"
        if len(value) > 1 and value[1] < -bound[1]:
            return "periodic"
        neutral = _NEUTRAL * 2.0 * math.pi * self.frequency
        if len(value) > 1 and (bound[:2] <= neutral).all():
            return "torus"
        return "not decided"

    @property
    def kaplan_yorke(self) -> float | None:
        """Kaplan-Yorke dimension of the attractor; None if it needs more exponents than there are.

        Exponents that do not differ significantly from zero count as zero.
        """
        value = np.where(np.abs(self.exponents) <= self.bound, 0.0, self.exponents)
        sums = np.cumsum(value)
        negative = np.flatnonzero(sums < 0.0)
        if len(negative) == 0:
            return None
        k = int(negative[0])
        return k + float(sums[k - 1]) / abs(float(value[k])) if k else 0.0

    def summary(self) -> dict[str, Any]:
        """Return the exponents as plain numbers and strings, ready for JSON."""
        return {
            "model": self.model_name,
            "speed": self.speed,
            "curvature": self.curvature,
            "cant": self.cant,
            "duration": self.duration,
            "exponents": self.exponents.tolist(),
            "error": self.error.tolist(),
            "kind": self.kind,
            "kaplan_yorke": self.kaplan_yorke,
            "frequency": self.frequency,
            "ended": self.ended,
        }

    def __str__(self) -> str:
        pairs = zip(self.exponents, self.error, strict=True)
        listed = ", ".join(f"{value:.4g} ± {error:.1g}" for value, error in pairs)
        dimension = self.kaplan_yorke
        text = f"{self.kind}; exponents {listed} 1/s"
        return text if dimension is None else f"{text}; Kaplan-Yorke dimension {dimension:.2f}"

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the convergence of the exponents over time."""
        from design.irregular.irregular_plots import plot_convergence

        return plot_convergence(self, ax)


def lyapunov_exponents(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    inputs: ArrayLike | None = None,
    count: int = 3,
    duration: float = 200.0,
    settle: float = 50.0,
    initial_state: ArrayLike | None = None,
    perturbation: Mapping[str, float] | None = None,
    step: float | None = None,
    progress: bool = False,
) -> LyapunovExponents:
    """Compute the largest Lyapunov exponents of the motion at which a model arrives.

    Two motions that start close to each other separate (or converge) as exp(lambda t); lambda is the
    largest exponent, that of areas is the sum of the first two, and so on. The kernels integrate the
    exact derivatives of the state over a stretch of Runge-Kutta steps; a set of directions is carried
    along with them and made orthonormal again after each stretch. Method: Benettin, Galgani, Giorgilli
    and Strelcyn, Meccanica 15 (1980); Shimada and Nagashima, Prog. Theor. Phys. 61 (1979).

    Parameters
    ----------
    model : Model
    speed : float
        m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track) and cant (rad).
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs; zero when left out.
    count : int
        Number of exponents, at most that of the states. Two distinguish a periodic motion from a torus;
        a dimension needs one more than its whole part.
    duration : float
        Time over which the exponents are averaged, s. Errors fall with its square root, and an exponent
        differs significantly from zero only if it exceeds 5 over it.
    settle : float
        Time before that, in which the motion reaches its attractor, s.
    initial_state : array_like, shape (n_states,), optional
        State to start from instead of the running equilibrium.
    perturbation : mapping of str to float, optional
        Disturbance of it; for the running equilibrium 5 of the model's scale (5 mm) in the first state
        when left out.
    step : float, optional
        Runge-Kutta step, s; a twelfth of the time constant of the fastest mode along the motion when
        left out.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns the mean so far.

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    EquilibriumError
        If there is no running equilibrium to start from (then give ``initial_state``).
    SimulationError
        If the motion diverges.

    Examples
    --------
    >>> import design, railenv
    >>> model = railenv.CooperriderBogie()
    >>> design.lyapunov_exponents(model, speed=70.0, duration=60.0).kind
    'periodic'
    """
    setting = setting_of(model, speed, radius, cant, inputs)
    count = min(checks.whole("count", count), model.n_states)
    duration = checks.number("duration", duration, low=0.0, open_low=True, unit="s")
    settle = checks.number("settle", settle, low=0.0, unit="s")
    if step is not None:
        step = checks.number("step", step, low=0.0, open_low=True, unit="s")
    motion = Motion(setting, start_of(setting, initial_state, perturbation), step)
    motion.settle((1.0 - _ALIGNING) * settle)
    tangent = _Tangent(setting, motion, count)
    tangent.go(_ALIGNING * settle)
    parts: list[_Part] = []
    ended = None
    try:
        for _ in tracked(range(_BLOCKS), f"Lyapunov exponents, {model.name}", progress):
            parts.append(tangent.go(duration / _BLOCKS))
    except KeyboardInterrupt:
        if len(parts) < _FEWEST:
            raise
        ended = f"interrupted after {len(parts)} of {_BLOCKS} parts of the duration"
    return _told(setting, motion.step, tangent, parts, ended)


def _told(
    setting: Setting, step: float, tangent: _Tangent, parts: Sequence[_Part], ended: str | None
) -> LyapunovExponents:
    """Return the results of the parts of a run, and the reason if it ended early."""
    growth = np.concatenate([part.growth for part in parts])
    signal = np.concatenate([part.signal for part in parts])
    passages = _passages(signal, tangent.stretch * len(growth) / len(signal))
    ends, blocks = _blocks(growth, tangent.stretch, passages)
    return LyapunovExponents(
        model_name=setting.model.name,
        speed=setting.speed,
        curvature=setting.curvature,
        cant=setting.cant,
        duration=tangent.stretch * len(growth),
        step=step,
        stretch=tangent.stretch,
        ends=ends,
        blocks=blocks,
        own=np.array([part.own for part in parts]),
        frequency=_frequency(passages),
        lowest=np.array([part.lowest for part in parts]),
        highest=np.array([part.highest for part in parts]),
        scale=setting.model.scale,
        end=tangent.state,
        state_names=setting.model.state_names,
        ended=ended,
    )


@dataclass(frozen=True)
class _Part:
    """Part of a run.

    It has the growth of the logarithms of the directions' lengths in each stretch, the error of the own
    direction (1/s), extremes, and the state that swings most after each step.
    """

    growth: Array
    own: float
    lowest: Array
    highest: Array
    signal: Array


class _Tangent:
    """Directions that are carried along with a motion."""

    def __init__(self, setting: Setting, motion: Motion, count: int) -> None:
        self.state = motion.state
        self._speed, self._step = setting.speed, motion.step
        self._shooting = Shooting(setting, 1)
        fastest = self._shooting.fastest(self.state, setting.speed)
        steps = max(1, math.floor(_SPREAD / max(fastest, 1e-6) / motion.step))
        # a stretch must not be longer than the rest of a block of time
        self._shooting.steps = min(steps, _SLOWEST_STEPS)
        self.stretch = self._shooting.steps * motion.step
        self._directions = _orthonormal(setting.model.n_states, count)
        self._setting, self._scale = setting, setting.model.scale
        self._swinging: int | None = None

    def go(self, duration: float) -> _Part:
        """Go on for some time (s) and return the results."""
        stretches = max(1, round(duration / self.stretch))
        growth: list[Array] = []
        missed = 0.0
        slope = self._slope()
        ends: list[Array] = [self.state]
        lowest, highest = self.state, self.state
        signals: list[Array] = []
        for _ in range(stretches):
            shot = self._shooting.shoot(self.state, self.stretch, self._speed)
            derivatives = shot.derivatives[:, : len(self.state)]
            carried = derivatives @ self._directions
            if not np.isfinite(carried).all():
                raise diverged(self._setting, self.stretch, np.array(ends))
            self._directions, triangle = np.linalg.qr(carried)
            growth.append(np.log(np.maximum(np.abs(np.diag(triangle)), np.finfo(float).tiny)))
            self.state = shot.states[-1].copy()
            before, slope = slope, self._slope()
            missed += self._missed(derivatives @ before, slope)
            lowest = np.minimum(lowest, shot.states.min(axis=0))
            highest = np.maximum(highest, shot.states.max(axis=0))
            if self._swinging is not None:
                signals.append(shot.states[1:, self._swinging])
            ends.append(self.state)
        if self._swinging is None:  # known from the part before the first that counts
            self._swinging = int(np.argmax(np.ptp(ends, axis=0) / self._scale))
        time = stretches * self.stretch
        signal = np.concatenate(signals) if signals else np.zeros(0)
        return _Part(np.array(growth), missed / time, lowest, highest, signal)

    def _slope(self) -> Array:
        """Return the motion's own direction."""
        return self._shooting.slope(self.state, self._speed)

    def _missed(self, carried: Array, slope: Array) -> float:
        """Return the error of the own direction after it was carried along."""
        whole = float(np.linalg.norm(slope / self._scale))
        if whole < _RESTING:
            return 0.0
        return float(np.linalg.norm((carried - slope) / self._scale)) / whole


_SLOWEST_STEPS = 400
"""Largest number of steps of a stretch."""


def _orthonormal(n: int, count: int) -> Array:
    """Return directions outside every invariant subspace of the equations."""
    return np.asarray(np.linalg.qr(np.random.default_rng(0).standard_normal((n, count)))[0])


def _passages(signal: Array, step: float) -> Array:
    """Return the times (s) at which a signal passes its mean upwards; it starts after one step (s)."""
    above = signal - signal.mean()
    k = np.flatnonzero((above[:-1] <= 0.0) & (above[1:] > 0.0))
    return np.asarray(step * (1.0 + k + above[k] / (above[k] - above[k + 1])))


def _frequency(passages: Array) -> float:
    """Return the mean frequency (Hz) of passages."""
    if len(passages) < 2:
        return 0.0
    return float((len(passages) - 1) / (passages[-1] - passages[0]))


def _blocks(growth: Array, stretch: float, passages: Array) -> tuple[Array, Array]:
    """Return the ends (s) of blocks of a run, and the mean exponents (1/s) of these blocks.

    Growth is taken as even within a stretch (s).
    """
    grown = np.concatenate([np.zeros((1, growth.shape[1])), np.cumsum(growth, axis=0)])
    times = stretch * np.arange(len(grown))
    ends = np.linspace(0.0, times[-1], _BLOCKS + 1)
    if len(passages) >= 2 * _BLOCKS:
        ends = passages[np.round(np.linspace(0, len(passages) - 1, _BLOCKS + 1)).astype(int)]
    at_ends = np.array([np.interp(ends, times, column) for column in grown.T]).T
    return ends, np.diff(at_ends, axis=0) / np.diff(ends)[:, None]
