"""Policy search by the returns of episodes, without their gradient (CMA-ES).

An odd linear network on top of a base controller (:class:`agents.LearnedPolicy`) is judged by its
returns over a fixed set of vehicles and speeds (:mod:`agents.learning.lessons`). It starts from weights
found on linear models (:mod:`agents.learning.policy_start`). The covariance matrix adaptation is that
of the package ``cma`` (extra ``rl``).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agents.controllers.learned import LearnedPolicy
from agents.controllers.memory import MemorySettings
from agents.controllers.scheduled import CONTROL_PERIOD, ScheduledController
from agents.learning.candidates import Candidates
from agents.learning.lessons import Lessons
from agents.learning.policy_start import Aim
from railenv import Equipped
from railenv.extras import require
from railenv.threads import one_blas_thread

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

MEMORY = MemorySettings(corners=(0.2, 2.0, 12.0), past_commands=2, schedule=(20.0, 240.0))
"""Default memory of a searched policy."""


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
        search's mean policy then. The first is the policy from which the search started.
    episodes : int
        Total number of episodes.
    """

    policy: LearnedPolicy
    mean: Array
    judged: Array
    episodes: int

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the learning curve: score and robust critical speed over the generations."""
        from agents.learning.learning_plots import plot_search

        return plot_search(self.mean, self.judged, ax)


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
    adds nothing in steady running, even on a curve. It starts from weights found on linear models. The
    search moves a normal distribution of weights towards the better episodes. Every few generations,
    and at the end, its mean is judged. The result is the policy with the best score among those judged
    whose robust critical speed is at least ``gain`` above the base's; if there are none, the most
    robust one.

    Parameters
    ----------
    model : Equipped
        Vehicle with any number of actuators.
    base : ScheduledController
    lessons : Lessons, optional
    memory : MemorySettings, optional
        Memory; ``MEMORY`` when left out.
    aim : Aim, optional
        Goal for the start in linear models.
    authority : float
        Largest share of the limit that the network commands.
    generations, population : int
    spread : float
        Spread of the first generation's weights about the start, in shares of the limit for a usual
        input.
    judge_every : int
        Generations between judgements.
    gain : float
        Required gain in robust critical speed of the result over the base, m/s.
    seed : int
    period : float
        Control period, s.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns the results found so far.

    Raises
    ------
    ParameterError
        If the base does not fit the model.
    MissingPackageError
        If the package ``cma`` (extra ``rl``) is missing.
    """
    require("cma", "cma", "policy search")
    todo = Lessons() if lessons is None else lessons
    wanted = Aim() if aim is None else aim
    with one_blas_thread():
        candidates = Candidates(model, base, todo, memory or MEMORY, authority, period)
        options = {"popsize": population, "seed": seed + 1, "verbose": -9}
        path = _Path(candidates, wanted, spread, options)
        path.run(generations, judge_every, progress)
    base_reaches = candidates.robust(np.zeros(candidates.dimension))
    chosen = _best(path.judged, base_reaches + gain)
    about = {
        "algorithm": "policy search, CMA-ES",
        "lessons": todo.plain(),
        "aim": wanted.plain(),
        "generations": len(path.means),
        "population": population,
        "spread": spread,
        "gain": gain,
        "seed": seed,
        "chosen": chosen.generation,
        "means": path.means,
        "judged": path.curve,
    }
    return Searched(
        candidates.policy(chosen.weights, about),
        np.array(path.means),
        np.array(path.curve),
        len(path.means) * population * len(todo.cases),
    )


@dataclass(frozen=True)
class _Judged:
    """A search's mean weights at some generation, and their results."""

    generation: int
    weights: Array
    robust: float
    score: float


class _Path:
    """The generations of a search (CMA-ES), and the means judged on the way."""

    def __init__(
        self, candidates: Candidates, aim: Aim, spread: float, options: dict[str, int]
    ) -> None:
        import cma

        self.candidates = candidates
        start = candidates.start(aim)
        self.means: list[float] = []
        self.judged = [self._judge(start)]
        self._strategy = cma.CMAEvolutionStrategy(start, spread, options)

    def run(self, generations: int, judge_every: int, progress: bool) -> None:
        """Run some more generations; an interrupt (Ctrl-C) ends them early."""
        turns: Iterable[int] = range(1, generations + 1)
        if progress:
            from rich.progress import track

            turns = track(turns, description="policy search", total=generations)
        try:
            for turn in turns:
                self._advance(judge=turn % judge_every == 0 or turn == generations)
        except KeyboardInterrupt:
            pass

    def _advance(self, *, judge: bool) -> None:
        """Run one more generation, and optionally judge its mean."""
        weights = np.array(self._strategy.ask())
        scores = self.candidates.scores(weights)
        self._strategy.tell(weights, (-scores).tolist())
        self.means.append(float(scores.mean()))
        if judge:
            self.judged.append(self._judge(np.array(self._strategy.mean)))

    def _judge(self, weights: Array) -> _Judged:
        score = float(self.candidates.scores(weights[None])[0])
        return _Judged(len(self.means), weights.copy(), self.candidates.robust(weights), score)

    @property
    def curve(self) -> list[list[float]]:
        """Generation, robust critical speed (m/s) and score of each judged mean."""
        return [[row.generation, row.robust, row.score] for row in self.judged]


def _best(judged: list[_Judged], wanted: float) -> _Judged:
    """Return the best score among those as robust as wanted (m/s), else the most robust."""
    enough = [row for row in judged if row.robust >= wanted]
    if enough:
        return max(enough, key=lambda row: row.score)
    return max(judged, key=lambda row: row.robust)
