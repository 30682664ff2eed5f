"""Lyapunov exponents: how fast neighbouring motions part, or come together."""

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
_JOINED = 2  # blocks that are one sample of the mean for its error: longer ones are less dependent
_FEWEST = 8  # of them that an interrupted run is worth returning for
_SPREAD = 10.0  # time constants of the fastest mode between two re-orthonormalisations
_ALIGNING = 0.5  # of ``settle``, in which the directions turn into their places
_SURE = 3.0  # standard errors
_LEAST = 5.0  # exponents: a distance must change by e^5 over the run to be told from a constant one
_NEUTRAL = 3e-3  # of the angular frequency: exponents below it are zero as far as a torus is concerned
_RESTING = 1e-9  # of the model's scale a second: a motion that is slower has no direction of its own
_STILL = 1e-6  # of the model's scale: less is no motion
_STEADY = 0.8  # least ratio of the swings of both halves of a run


@dataclass(frozen=True)
class LyapunovExponents:
    """The largest Lyapunov exponents of a motion.

    Attributes
    ----------
    model_name : str
    speed, curvature, cant : float
        m/s, 1/m, rad.
    duration : float
        Time over which they are the mean, s.
    step, stretch : float
        Runge-Kutta step, and time between two re-orthonormalisations, s.
    ends : ndarray, shape (n_blocks + 1,)
        Times that part the duration into blocks, s: where there are enough of them, moments at which
        the state that swings most passes its mean upwards, so that a block of a periodic motion has
        whole periods.
    blocks : ndarray, shape (n_blocks, count)
        Mean exponents of these blocks, 1/s.
    own : ndarray, shape (n_parts,)
        For equal parts of the duration:
        how far the motion's own direction, in which nothing grows, is from being carried into itself,
        the sum of relative errors, 1/s. That is how accurate the derivatives are. It is large where the
        equations jump, for derivatives do not see a jump: a wheel that lifts loses its creep forces.
    frequency : float
        Mean frequency (Hz) of the state that swings most: its upward passages of its mean.
    lowest, highest : ndarray, shape (n_parts, n_states)
        Extremes of the states in these parts.
    scale : ndarray, shape (n_states,)
        Typical magnitudes of the model's states.
    end : ndarray, shape (n_states,)
        State at the end, from which the motion may be carried on.
    state_names : tuple of str
    ended : str or None
        Why the duration is shorter than was asked for.
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
        """Mean of ``own``, 1/s: exponents that are not larger say nothing."""
        return float(self.own.mean())

    @property
    def bound(self) -> Array:
        """What an exponent must exceed (either way) to be told from zero, 1/s.

        Three standard errors, 5 over the duration, and the error of the motion's own direction.
        """
        return np.maximum(_SURE * self.error, max(_LEAST / self.duration, self.own_error))

    @property
    def time(self) -> Array:
        """Times since the start of the first block at which blocks end, s."""
        return self.ends[1:] - self.ends[0]

    @property
    def history(self) -> Array:
        """Exponents as they were at these times, shape (n_blocks, count), 1/s."""
        lengths = np.diff(self.ends)[:, None]
        return np.asarray(np.cumsum(self.blocks * lengths, axis=0) / np.cumsum(lengths, axis=0))

    @property
    def swing(self) -> Array:
        """Half of peak to peak of every state, shape (n_states,)."""
        return (self.highest.max(axis=0) - self.lowest.min(axis=0)) / 2.0

    @property
    def steady(self) -> bool:
        """Whether the motion neither grows nor decays: both halves of the run swing alike."""
        half = len(self.lowest) // 2
        parts = [slice(None, half), slice(half, None)]
        first, last = (np.ptp([self.lowest[p].min(0), self.highest[p].max(0)], axis=0) for p in parts)
        k = int(np.argmax(self.swing / self.scale))
        return bool(min(first[k], last[k]) >= _STEADY * max(first[k], last[k]))

    @property
    def kind(self) -> Kind:
        """What kind of motion the exponents tell.

        "equilibrium": nothing moves, or it decays and all exponents are negative. "periodic": the first
        is zero and the second negative. "torus": the first two are zero, known to 0.3 % of the angular
        frequency; motions of uncoupled parts count as such whatever their frequencies, for their
        phases are indifferent. "chaotic": the first is positive. "not decided": errors are too large
        (or ``count`` too small) to tell, the motion still grows or decays, or it goes on although all
        exponents are negative, which is not possible: its derivatives do not see a jump.
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
        """Kaplan-Yorke dimension of the attractor; None where it takes more exponents than there are.

        Exponents that cannot be told from zero count as zero.
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
        """Draw how the exponents converge over time."""
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
    """Compute the largest Lyapunov exponents of the motion that a model comes to.

    Two motions that start close to each other part (or approach) as exp(lambda t); lambda is the
    largest exponent, that of areas the sum of the first two, and so on. The kernels integrate the exact
    derivatives of the state after a stretch of Runge-Kutta steps; a set of directions is carried along
    with them and made orthonormal again after each stretch. Method: Benettin, Galgani, Giorgilli and
    Strelcyn, Meccanica 15 (1980); Shimada and Nagashima, Prog. Theor. Phys. 61 (1979).

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
        How many exponents, at most as many as there are states. Two tell a periodic motion from a
        torus; a dimension needs one more than it has whole numbers.
    duration : float
        Time over which the exponents are averaged, s. Errors fall with its square root, and an exponent
        can be told from zero only if it exceeds 5 over it.
    settle : float
        Time before that, in which the motion comes to its attractor, s.
    initial_state : array_like, shape (n_states,), optional
        Where to start instead of the running equilibrium.
    perturbation : mapping of str to float, optional
        Added to it; to the running equilibrium 5 of the model's scale (5 mm) in the first state when
        left out.
    step : float, optional
        Runge-Kutta step, s; a twelfth of the time constant of the fastest mode along the motion when
        left out.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns the mean up to there.

    Raises
    ------
    ParameterError
        If an argument is not allowed.
    EquilibriumError
        If there is no running equilibrium to start from (give ``initial_state`` then).
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
    """Return what the parts of a run tell, and why it ended early."""
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

    How much the logarithms of the directions' lengths grow in each stretch, how far the own direction
    misses itself (1/s), extremes, and the state that swings most after each step.
    """

    growth: Array
    own: float
    lowest: Array
    highest: Array
    signal: Array


class _Tangent:
    """Carries directions along with a motion."""

    def __init__(self, setting: Setting, motion: Motion, count: int) -> None:
        self.state = motion.state
        self._speed, self._step = setting.speed, motion.step
        self._shooting = Shooting(setting, 1)
        fastest = self._shooting.fastest(self.state, setting.speed)
        steps = max(1, math.floor(_SPREAD / max(fastest, 1e-6) / motion.step))
        # a stretch must not be longer than what a block of time may have left over
        self._shooting.steps = min(steps, _SLOWEST_STEPS)
        self.stretch = self._shooting.steps * motion.step
        self._directions = _orthonormal(setting.model.n_states, count)
        self._setting, self._scale = setting, setting.model.scale
        self._swinging: int | None = None

    def go(self, duration: float) -> _Part:
        """Go on for some time (s) and return what was found."""
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
        if self._swinging is None:  # told by the part before the first that counts
            self._swinging = int(np.argmax(np.ptp(ends, axis=0) / self._scale))
        time = stretches * self.stretch
        signal = np.concatenate(signals) if signals else np.zeros(0)
        return _Part(np.array(growth), missed / time, lowest, highest, signal)

    def _slope(self) -> Array:
        """Return the motion's own direction."""
        return self._shooting.slope(self.state, self._speed)

    def _missed(self, carried: Array, slope: Array) -> float:
        """Return how far the own direction is from what it should have been carried into."""
        whole = float(np.linalg.norm(slope / self._scale))
        if whole < _RESTING:
            return 0.0
        return float(np.linalg.norm((carried - slope) / self._scale)) / whole


_SLOWEST_STEPS = 400
"""Most steps of a stretch."""


def _orthonormal(n: int, count: int) -> Array:
    """Return directions that lie in no subspace of the equations' own."""
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

    Within a stretch (s) what grows is taken as growing evenly.
    """
    grown = np.concatenate([np.zeros((1, growth.shape[1])), np.cumsum(growth, axis=0)])
    times = stretch * np.arange(len(grown))
    ends = np.linspace(0.0, times[-1], _BLOCKS + 1)
    if len(passages) >= 2 * _BLOCKS:
        ends = passages[np.round(np.linspace(0, len(passages) - 1, _BLOCKS + 1)).astype(int)]
    at_ends = np.array([np.interp(ends, times, column) for column in grown.T]).T
    return ends, np.diff(at_ends, axis=0) / np.diff(ends)[:, None]
