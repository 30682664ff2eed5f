"""Policy search: episodes tell which of many policies is better (CMA-ES, no gradient of returns).

An odd linear network on top of a base controller (:class:`agents.LearnedPolicy`) is judged by its
returns over a fixed set of vehicles and speeds (:mod:`agents.learning.lessons`). It starts from weights
that linear models suggest (:mod:`agents.learning.policy_start`). The covariance matrix adaptation is
that of the package ``cma`` (extra ``rl``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import design
from agents.controllers.controller import Controller
from agents.controllers.learned import LearnedPolicy
from agents.controllers.memory import BY_SPEED, Memory, MemorySettings
from agents.controllers.network import Network, Normalization
from agents.controllers.scheduled import CONTROL_PERIOD, ScheduledController, readings_of
from agents.evaluation.rollout import Rollout, Track
from agents.learning.lessons import Lessons
from agents.learning.policy_start import Aim, start_weights
from railenv import Equipped
from railenv.extras import require
from railenv.threads import one_blas_thread

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

MEMORY = MemorySettings(corners=(0.2, 2.0, 12.0), past_commands=2, schedule=(20.0, 240.0))
"""What a searched policy remembers, if not told otherwise."""

CONICITIES = (0.05, 0.4)
"""Range over which the robust critical speed of a searched policy is looked at."""

_SMALLEST_SCALE = 1e-3  # of an input


@dataclass(frozen=True)
class Searched:
    """Result of a policy search.

    Attributes
    ----------
    policy : LearnedPolicy
    mean : ndarray, shape (generations,)
        Mean score of each generation; see :class:`Lessons`.
    judged : ndarray, shape (n_judged, 3)
        Generation, robust critical speed (m/s; 0 if unstable at the lowest speed) and score of the
        search's mean policy then. The first is the policy that the search started from.
    episodes : int
        Episodes that were run in all.
    """

    policy: LearnedPolicy
    mean: Array
    judged: Array
    episodes: int

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the learning curve: score and robust critical speed over the generations."""
        from agents.learning.learning_plots import plot_search

        return plot_search(self.mean, self.judged, ax)


class _Population(Controller):
    """Candidates side by side: each runs the same cases, with weights of its own."""

    def __init__(self, frame: LearnedPolicy, gains: Array) -> None:
        settings = frame.memory
        self.memory = Memory(settings, frame.readings, frame.commands, frame.period, frame.base)
        self.period = frame.period
        self._gains = gains  # (candidates, inputs)
        self._authority = frame.authority

    def reset(self, count: int | None = None) -> None:
        """Start anew for ``count`` vehicles: those of the first candidate, of the second, and so on."""
        self.memory.reset(count or 1)

    def inputs(self, observation: NDArray[np.floating[Any]]) -> Array:
        """Return the networks' inputs for an observation."""
        rows = np.asarray(observation, dtype=np.float32)
        return np.concatenate([rows, self.memory.features(rows)], axis=1, dtype=float)

    def act(self, observation: NDArray[np.floating[Any]]) -> Array:
        """Return every candidate's commands for its vehicles."""
        x = self.inputs(observation)
        grouped = x.reshape(len(self._gains), -1, x.shape[1])
        learned = np.clip(np.einsum("cri,ci->cr", grouped, self._gains), -1.0, 1.0)
        shares = np.clip(self.memory.demand + self._authority * learned.reshape(-1, 1), -1.0, 1.0)
        self.memory.advance(shares)
        return shares


def search_policy(
    model: Equipped,
    base: ScheduledController,
    *,
    lessons: Lessons | None = None,
    memory: MemorySettings | None = None,
    aim: Aim | None = None,
    authority: float = 0.5,
    generations: int = 144,
    population: int = 16,
    spread: float = 0.01,
    judge_every: int = 12,
    gain: float = 0.98,
    seed: int = 0,
    period: float = CONTROL_PERIOD,
    progress: bool = False,
) -> Searched:
    """Search a policy on top of a base controller by the returns of its episodes.

    The policy is linear in the features of its memory and odd, and steady readings cancel in it, so it
    adds nothing at rest, be it on a curve. It starts from what linear models suggest. The search moves
    a normal distribution of weights towards the better episodes. Every few generations, and at the
    end, its mean is judged. What comes out is, of the judged ones whose robust critical speed is by
    ``gain`` above the base's, the one with the best score; if there are none, the most robust.

    Parameters
    ----------
    model : Equipped
        With a single actuator.
    base : ScheduledController
    lessons : Lessons, optional
    memory : MemorySettings, optional
        ``MEMORY`` when left out.
    aim : Aim, optional
        What the start is to reach in linear models.
    authority : float
        Largest share of the limit that the network commands.
    generations, population : int
    spread : float
        Of the first generation's weights about the start, in shares of the limit for a usual input.
    judge_every : int
        Generations between judgements.
    gain : float
        m/s, by which the robust critical speed of what comes out is to be above the base's.
    seed : int
    period : float
        Control period, s.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns what was found until then.

    Raises
    ------
    ParameterError
        If the base does not suit the vehicle.
    MissingPackageError
        If the package ``cma`` (extra ``rl``) is missing.
    """
    require("cma", "cma", "policy search")
    import cma

    todo = Lessons() if lessons is None else lessons
    wanted = Aim() if aim is None else aim
    turns: Iterable[int] = range(generations)
    if progress:
        from rich.progress import track

        turns = track(turns, description="policy search", total=generations)
    means: list[float] = []
    with one_blas_thread():
        search = _Search(model, base, todo, memory or MEMORY, authority, period)
        start = search.start(wanted)
        judged = [search.judged(0, start)]
        options = {"popsize": population, "seed": seed + 1, "verbose": -9}
        strategy = cma.CMAEvolutionStrategy(start, spread, options)
        try:
            for turn in turns:
                candidates = np.array(strategy.ask())
                scores = search.scores(candidates)
                strategy.tell(candidates, (-scores).tolist())
                means.append(float(scores.mean()))
                if (turn + 1) % judge_every == 0 or turn + 1 == generations:
                    judged.append(search.judged(turn + 1, np.array(strategy.mean)))
        except KeyboardInterrupt:
            pass
    chosen = _best(judged, search.robust(np.zeros(search.dimension)) + gain)
    curve = [[row.generation, row.robust, row.score] for row in judged]
    about = {
        "algorithm": "policy search, CMA-ES",
        "lessons": todo.plain(),
        "aim": wanted.plain(),
        "generations": len(means),
        "population": population,
        "spread": spread,
        "gain": gain,
        "seed": seed,
        "chosen": chosen.generation,
        "means": means,
        "judged": curve,
    }
    return Searched(
        search.policy(chosen.weights, about),
        np.array(means),
        np.array(curve),
        len(means) * population * len(todo.cases),
    )


@dataclass(frozen=True)
class _Judged:
    """A search's mean weights at some generation, and what they reach."""

    generation: int
    weights: Array
    robust: float
    score: float


def _best(judged: list[_Judged], wanted: float) -> _Judged:
    """Return the one of the best score of those as robust as wanted (m/s), else the most robust."""
    enough = [row for row in judged if row.robust >= wanted]
    if enough:
        return max(enough, key=lambda row: row.score)
    return max(judged, key=lambda row: row.robust)


class _Search:
    """What a search asks of weights: a policy, its returns, its robust critical speed."""

    def __init__(
        self,
        model: Equipped,
        base: ScheduledController,
        lessons: Lessons,
        memory: MemorySettings,
        authority: float,
        period: float,
    ) -> None:
        self.model = model
        self.lessons = lessons
        self.readings = readings_of(model, "sensors", period)
        self.memory, self.base, self.authority, self.period = memory, base, authority, period
        inner = Memory(memory, self.readings, model.command_names, period, base)
        self._signs = inner.signs
        # lateral inputs; cant deficiency is steady on a curve and must not command anything
        steady = [reading.name == "cant_deficiency" for reading in self.readings]
        used = self._signs < 0.0
        used[: len(steady)] &= ~np.array(steady)
        # what a curve adds to a reading passes all its filters alike: together they must not see it
        names = [*(reading.name for reading in self.readings), *inner.names]
        self._groups = []
        for reading in (names[i] for i in inner.filtered):
            for end in ("", BY_SPEED) if memory.schedule else ("",):
                own = [
                    k
                    for k, name in enumerate(names)
                    if name.startswith(f"{reading} below") and name.endswith("Hz" + end)
                ]
                direct = names.index(reading + end)
                if own:  # the slowest filter takes out what the others have of a steady reading
                    self._groups.append((own[0], [direct, *own[1:]]))
                    used[own[0]] = False
                else:
                    used[direct] = False
        self._used = np.flatnonzero(used)
        self._scale = np.ones(len(self._signs))
        self._scale = self._usual()

    @property
    def dimension(self) -> int:
        """Number of weights."""
        return len(self._used)

    def _gains(self, weights: Array) -> Array:
        gains = np.zeros((len(weights), len(self._signs)))
        gains[:, self._used] = weights / self._scale[self._used]
        for slowest, others in self._groups:
            gains[:, slowest] = -gains[:, others].sum(axis=1)
        return gains / self.authority

    def policy(self, weights: Array, about: Mapping[str, Any]) -> LearnedPolicy:
        """Return weights as a policy."""
        width = len(self._signs)
        network = Network(
            weights=(self._gains(weights[None]),),
            biases=(np.zeros(1),),
            activation="tanh",
            squash="none",
            normalization=Normalization(np.zeros(width), np.ones(width), 1e6),
            signs=self._signs,
        )
        return LearnedPolicy(
            network,
            self.readings,
            self.model.command_names,
            self.model.actuator.limit,
            "sensors",
            self.memory,
            self.base,
            self.authority,
            self.period,
            dict(about),
        )

    def _usual(self) -> Array:
        """Return the size (rms) that every input has under the base."""
        controller = _Population(self.policy(np.zeros(self.dimension), {}), self._gains(
            np.zeros((1, self.dimension))))  # fmt: skip
        rollout = Rollout(self.model, controller, self.lessons.cases, Track("low", noise=True))
        total = np.zeros(len(self._signs))
        steps = round(1.0 / self.period)
        for _ in range(steps):
            total += np.square(controller.inputs(rollout.fleet.observations)).mean(axis=0)
            rollout.step()
        return np.maximum(np.sqrt(total / steps), _SMALLEST_SCALE)

    def start(self, aim: Aim) -> Array:
        """Return the weights that linear models suggest."""
        signals = [reading.signal for reading in self.readings]
        return start_weights(
            self.model, signals, lambda w: self.policy(w, {}), self.dimension, aim, self.period
        )

    def scores(self, candidates: Array) -> Array:
        """Return the score of every candidate, shape (candidates,)."""
        frame = self.policy(np.zeros(self.dimension), {})
        controller = _Population(frame, self._gains(candidates))
        return self.lessons.scores(self.model, controller, len(candidates))

    def robust(self, weights: Array) -> float:
        """Return the robust critical speed of weights (m/s), 0 if there is none."""
        box = {"conicity": CONICITIES}
        found = design.robust_critical_speed(self.model, self.policy(weights, {}), box, samples=6)
        return found.speed or 0.0

    def judged(self, generation: int, weights: Array) -> _Judged:
        """Return what weights reach."""
        score = float(self.scores(weights[None])[0])
        return _Judged(generation, weights.copy(), self.robust(weights), score)
