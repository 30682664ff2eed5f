"""Policy search: episodes tell which of many policies is better, and no gradient is needed (CMA-ES).

An odd linear network on top of a base controller (:class:`agents.LearnedPolicy`) is judged by its
returns over a fixed set of vehicles and speeds, with the weight on the worst of them: hunting of one
vehicle counts more than a little comfort in all others. Policy gradients follow the mean return, which
hardly sees that. The covariance matrix adaptation is that of the package ``cma`` (extra ``rl``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import design
from agents.controller import Controller
from agents.learned import LearnedPolicy
from agents.memory import Memory, MemorySettings
from agents.network import Network, Normalization
from agents.rollout import Case, Rollout, Track
from agents.scheduled import CONTROL_PERIOD, ScheduledController, readings_of
from railenv import Equipped, checks
from railenv.extras import require
from railenv.threads import one_blas_thread

Array = NDArray[np.float64]

_SMALLEST_SCALE = 1e-3  # of an input


@dataclass(frozen=True, kw_only=True)
class Lessons:
    """Episodes by which policies are judged.

    Attributes
    ----------
    conicities, speeds : tuple of float
        Every vehicle runs at every speed (m/s), on tangent track.
    offset : float
        m, lateral, of all bodies at the start.
    duration : float
        s.
    worst : float
        Share of the episodes that counts as the worst.
    emphasis : float
        Weight of their mean return, against that of all.
    effort : float
        Weight of the mean squared moment (share of the limit) in the return.
    roughness : float
        Factor on the irregularity (ERRI B176, low) of the tracks that are rough, those of speeds up to
        ``rough_up_to`` (m/s).
    rough_up_to : float
    """

    conicities: tuple[float, ...] = (0.05, 0.15, 0.25, 0.33, 0.4)
    speeds: tuple[float, ...] = (30.0, 60.0, 85.0, 115.0, 140.0, 156.0, 163.0, 170.0, 177.0)
    offset: float = 4e-3
    duration: float = 5.0
    worst: float = 0.3
    emphasis: float = 0.6
    effort: float = 0.5
    roughness: float = 0.5
    rough_up_to: float = 90.0

    def __post_init__(self) -> None:
        checks.number("duration", self.duration, low=0.0, open_low=True, unit="s")
        for name in ("worst", "emphasis"):
            checks.number(name, getattr(self, name), low=0.0, high=1.0)

    def cases(self) -> list[Case]:
        """Return the episodes."""
        return [
            Case(
                speed,
                offset=self.offset,
                vehicle={"conicity": conicity},
                roughness=self.roughness if speed <= self.rough_up_to else 0.0,
            )
            for conicity in self.conicities
            for speed in self.speeds
        ]


@dataclass(frozen=True)
class Searched:
    """Result of a policy search.

    Attributes
    ----------
    policy : LearnedPolicy
        The best that was seen.
    best, mean : ndarray, shape (generations,)
        Score of the best candidate so far, and the mean of each generation; at most 0.
    robust : ndarray, shape (n_judged, 2)
        Generation, and robust critical speed (m/s) of the search's mean policy then; 0 if it is
        unstable at the lowest speed.
    episodes : int
        Episodes that were run in all.
    """

    policy: LearnedPolicy
    best: Array
    mean: Array
    robust: Array
    episodes: int


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
    authority: float = 0.5,
    generations: int = 60,
    population: int = 16,
    spread: float = 0.02,
    judge_every: int = 10,
    seed: int = 0,
    period: float = CONTROL_PERIOD,
    progress: bool = False,
) -> Searched:
    """Search a policy on top of a base controller by the returns of its episodes.

    The policy is linear in the features of its memory and odd, and steady readings cancel in it, so it
    adds nothing at rest, be it on a curve. It starts as the base alone. The search moves a normal
    distribution of weights towards the better episodes. Every few generations, and at the end, its
    mean is linearised; the mean with the highest robust critical speed over the conicities of the
    lessons is what comes out.

    Parameters
    ----------
    model : Equipped
        With a single actuator.
    base : ScheduledController
    lessons : Lessons, optional
    memory : MemorySettings, optional
    authority : float
        Largest share of the limit that the network commands.
    generations, population : int
    spread : float
        Of the first generation's weights, in shares of the limit for a usual input.
    judge_every : int
        Generations between linearisations.
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
    remembered = MemorySettings(corners=(0.2, 1.0, 4.0, 12.0)) if memory is None else memory
    search = _Search(model, base, todo, remembered, authority, period)
    options = {"popsize": population, "seed": seed + 1, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(np.zeros(search.dimension), spread, options)
    turns: Iterable[int] = range(generations)
    if progress:
        from rich.progress import track

        turns = track(turns, description="policy search", total=generations)
    means: list[float] = []
    bests: list[float] = []
    judged = [(0, search.robust(np.zeros(search.dimension)), np.zeros(search.dimension))]
    try:
        with one_blas_thread():
            for turn in turns:
                candidates = np.array(strategy.ask())
                scores = search.scores(candidates, seed + turn)
                strategy.tell(candidates, (-scores).tolist())
                means.append(float(scores.mean()))
                bests.append(max([*bests[-1:], float(scores.max())]))
                if (turn + 1) % judge_every == 0 or turn + 1 == generations:
                    centre = np.asarray(strategy.mean)
                    judged.append((turn + 1, search.robust(centre), centre))
    except KeyboardInterrupt:
        pass
    _, robust, weights = max(judged, key=lambda row: row[1])
    about = {
        "algorithm": "policy search, CMA-ES",
        "lessons": asdict(todo),
        "generations": len(means),
        "population": population,
        "seed": seed,
        "robust": robust,
    }
    return Searched(
        search.policy(weights, about),
        np.array(bests),
        np.array(means),
        np.array([(turn, speed) for turn, speed, _ in judged]),
        len(means) * population * len(todo.cases()),
    )


def _track(seed: int) -> Track:
    return Track("low", noise=True, seed=seed)


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
        self.cases = lessons.cases()
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
        for i in inner.filtered:
            reading = names[i]
            own = [k for k, name in enumerate(names) if name.startswith(f"{reading} below")]
            if own:  # the slowest filter takes out what the others have of a steady reading
                self._groups.append((own[0], [i, *own[1:]]))
                used[own[0]] = False
            else:
                used[i] = False
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
        rollout = Rollout(self.model, controller, self.cases, _track(0))
        total = np.zeros(len(self._signs))
        steps = round(1.0 / self.period)
        for _ in range(steps):
            total += np.square(controller.inputs(rollout.fleet.observations)).mean(axis=0)
            rollout.step()
        return np.maximum(np.sqrt(total / steps), _SMALLEST_SCALE)

    def scores(self, candidates: Array, seed: int) -> Array:
        """Return the score of every candidate: mean return and that of the worst episodes."""
        frame = self.policy(np.zeros(self.dimension), {})
        controller = _Population(frame, self._gains(candidates))
        rollout = Rollout(self.model, controller, self.cases * len(candidates), _track(seed))
        steps = round(self.lessons.duration / self.period)
        total = np.zeros(len(rollout.cases))
        for _ in range(steps):
            rollout.step()
            hunting, excursion, _, effort = rollout.fleet.terms[:, 1:5].T
            total -= 0.5 * hunting + 0.5 * excursion + self.lessons.effort * effort
        returns = np.sort((total / steps).reshape(len(candidates), -1), axis=1)
        count = max(1, round(self.lessons.worst * returns.shape[1]))
        worst = returns[:, :count].mean(axis=1)
        weight = self.lessons.emphasis
        return np.asarray(weight * worst + (1.0 - weight) * returns.mean(axis=1))

    def robust(self, weights: Array) -> float:
        """Return the robust critical speed (m/s) over the lessons' conicities; 0 if there is none."""
        ends = (min(self.lessons.conicities), max(self.lessons.conicities))
        found = design.robust_critical_speed(
            self.model, self.policy(weights, {}), {"conicity": ends}, samples=6
        )
        return found.speed or 0.0
