"""Training through the simulator by the exact gradient of rollouts.

Other algorithms estimate from many episodes how to change a policy; here the derivatives of the
equations of motion give it (an analytic policy gradient, by backpropagation through time). The policy
starts from random weights. This module needs the extra ``rl``.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import design
from agents.controllers.adaptive import AdaptiveLQG
from agents.controllers.adaptive_policy import AdaptivePolicy, told_ranges
from agents.controllers.learned import LearnedPolicy
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.scheduled import CONTROL_PERIOD, readings_of
from agents.controllers.service import CONICITY, WEAR, varied, vehicles_of_service
from agents.evaluation.rollout import Track
from agents.learning.exercises import Exercises
from railenv import Equipped, checks
from railenv.errors import EquilibriumError, ParameterError, shown
from railenv.extras import require_rl
from railenv.threads import one_blas_thread

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from agents.learning.through import Runs

Array = NDArray[np.float64]

MEMORY = MemorySettings(corners=(0.2, 1.0, 5.0))
"""Default memory of a policy trained through the simulator."""

_NUDGE = 1e-7  # for every state at the start, in units of the model's scale: far from every limit
LOWEST_SPEED, HIGHEST_SPEED = 20.0, 400.0
"""Range of the search for critical speeds, m/s."""

_JUDGED = 9  # conicities (or wears) of the vehicles that judge a policy, with 3 creep factors
_REMEMBERED = 30  # changes of the gradient from which L-BFGS estimates the curvature


@dataclass(frozen=True)
class Descent:
    """Result of training through the simulator.

    Attributes
    ----------
    policy : LearnedPolicy or AdaptivePolicy
        The most robust policy judged.
    last : LearnedPolicy or AdaptivePolicy
    costs : ndarray, shape (evaluations,)
        Costs of all policies run, including those of line searches; see :class:`Exercises`.
    judged : ndarray, shape (n_judged, 3)
        Evaluations and environment steps until then, and the lowest critical speed (m/s) of 27
        vehicles of service, 0 if one is unstable at 20 m/s. The first is the policy of random weights.
        A policy with an identifier is told the true vehicle here.
    """

    policy: LearnedPolicy | AdaptivePolicy
    last: LearnedPolicy | AdaptivePolicy
    costs: Array
    judged: Array

    @property
    def steps(self) -> int:
        """Total number of environment steps."""
        return int(self.judged[-1, 1])

    def __str__(self) -> str:
        first, best = self.judged[0, 2], self.judged[:, 2].max()
        return (
            f"{len(self.costs)} evaluations, {self.steps} steps: lowest critical speed {first:.2f} m/s "
            f"at first, {best:.2f} m/s at best"
        )

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the learning curve: cost and robust critical speed over the evaluations."""
        from agents.learning.learning_plots import plot_descent

        return plot_descent(self.costs, self.judged, ax)


def train_through(
    model: Equipped,
    *,
    exercises: Exercises | None = None,
    memory: MemorySettings | None = None,
    identifier: AdaptiveLQG | None = None,
    hidden: Sequence[int] = (32,),
    evaluations: int = 300,
    judge_every: int = 25,
    seed: int = 0,
    period: float = CONTROL_PERIOD,
    progress: bool = False,
) -> Descent:
    """Train a policy by the exact gradient of its rollouts.

    All exercises run under the policy in the environments' own kernel, and the gradient of the cost of
    their motions goes back through vehicle, actuator, delay, sensors, memory and network. The cost is a
    smooth function without noise, which L-BFGS (SciPy) minimises. The policy is odd, and steady
    readings cancel in it. It does not read its own commands, because a growth caused by these alone is
    too slow to show in a rollout. It starts from random weights. During training, and at the end, it is
    judged by the lowest critical speed of vehicles of service.

    Parameters
    ----------
    model : Equipped
        Vehicle with any number of actuators.
    exercises : Exercises, optional
    memory : MemorySettings, optional
        Memory without history and past commands; ``MEMORY`` when left out.
    identifier : AdaptiveLQG, optional
        Bank of filters for this model. With it the policy adapts: it is told the numbers in which the
        bank's vehicles differ, in training the true ones, later the identifier's estimates.
    hidden : sequence of int
        Widths of the network's hidden layers; none for a linear policy, which cannot be told anything.
    evaluations : int
        Largest number of runs of all exercises, each with its gradient.
    judge_every : int
        Least number of evaluations between judgements.
    seed : int
        Seed of the weights, the vehicles and their starts.
    period : float
        Control period, s.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns the results found so far.

    Raises
    ------
    ParameterError
        If an argument is not allowed, or the model has no actuators.
    MissingPackageError
        If the extra ``rl`` is missing.
    """
    require_rl("training through the simulator")
    todo = Exercises() if exercises is None else exercises
    kept = MEMORY if memory is None else memory
    widths = _checked(model, kept, hidden)
    if identifier is not None:
        _check_identifier(model, identifier, todo, widths, period)
    checks.whole("evaluations", evaluations)
    checks.whole("judge_every", judge_every)
    checks.whole("seed", seed, low=0)
    about: dict[str, Any] = {
        "algorithm": "analytic policy gradient",
        "exercises": todo.plain(),
        "hidden": list(widths),
        "seed": seed,
    }
    with one_blas_thread():
        path = _Path(model, todo, kept, identifier, widths, seed, period)
        path.run(evaluations, judge_every, progress)
    about |= {"evaluations": len(path.costs), "judged": path.curve}
    best, last = max(path.judged, key=lambda row: row.robust), path.judged[-1]
    return Descent(
        dataclasses.replace(best.policy, about={**about, "chosen": best.evaluations}),
        dataclasses.replace(last.policy, about={**about, "chosen": last.evaluations}),
        np.array(path.costs),
        np.array(path.curve, dtype=float),
    )


def _checked(model: Equipped, memory: MemorySettings, hidden: Sequence[int]) -> tuple[int, ...]:
    """Return the widths of the hidden layers, or raise if something does not fit."""
    if not model.command_names:
        raise ParameterError(f"{model.name} has no actuators; there is nothing to learn")
    for name in ("history", "past_commands"):
        if getattr(memory, name):
            raise ParameterError(
                f"{name} of the memory is {getattr(memory, name)}; a policy trained through the "
                "simulator remembers readings only through filters (corners), so it must be 0"
            )
    if not isinstance(hidden, (list, tuple)):
        raise ParameterError(f"hidden is {shown(hidden)}; it must be widths of layers, such as (32,)")
    return tuple(checks.whole("width of a hidden layer", width, low=1) for width in hidden)


def _check_identifier(
    model: Equipped,
    identifier: AdaptiveLQG,
    exercises: Exercises,
    hidden: tuple[int, ...],
    period: float,
) -> None:
    """Raise ParameterError unless the identifier fits the model and the exercises."""
    if not isinstance(identifier, AdaptiveLQG):
        raise ParameterError(f"identifier is {shown(identifier)}; it must be an agents.AdaptiveLQG")
    if not hidden:
        raise ParameterError(
            "hidden is empty; a policy with an identifier needs a hidden layer, because a linear one "
            "cannot change its gains with what it is told"
        )
    same = (
        identifier.readings == readings_of(model, "sensors", period)
        and identifier.commands == tuple(model.command_names)
        and abs(identifier.period - period) < 1e-9 * period
    )
    if not same:
        raise ParameterError(
            f"the identifier reads {[r.name for r in identifier.readings]} and follows "
            f"{list(identifier.commands)} every {identifier.period:g} s; it must be designed for "
            f"{model.name}, with the readings and commands of this vehicle every {period:g} s"
        )
    told, differ = list(told_ranges(identifier.vehicles)), varied(model, dict(exercises.ranges))
    missing = [name for name in told if name not in differ]
    if missing:
        raise ParameterError(
            f"the identifier estimates {', '.join(told)}, but {', '.join(missing)} does not differ in "
            f"the exercises; they vary {', '.join(differ)}"
        )
    # the vehicles that judge a policy differ in these, and in nothing else
    checks.known("number that a policy can be told", told, list(vehicles_of_service(model)[0]))


class _Spent(Exception):
    """All evaluations are done."""


@dataclass(frozen=True)
class _Judged:
    """A policy during training, and its results."""

    evaluations: int
    steps: int
    robust: float
    policy: LearnedPolicy | AdaptivePolicy


class _Path:
    """The course of a training, and the policies judged in it."""

    def __init__(
        self,
        model: Equipped,
        exercises: Exercises,
        memory: MemorySettings,
        identifier: AdaptiveLQG | None,
        hidden: tuple[int, ...],
        seed: int,
        period: float,
    ) -> None:
        import torch

        from agents.learning.steady import cancelled
        from agents.learning.through import OddNetwork

        self._model, self._memory, self._period = model, memory, period
        self._identifier = identifier
        self._readings = tuple(readings_of(model, "sensors", period))
        inner = Memory(memory, self._readings, model.command_names, period)
        told = 0 if identifier is None else len(told_ranges(identifier.vehicles))
        with torch.random.fork_rng(devices=[]):  # the caller's own random numbers stay as they are
            torch.manual_seed(seed)
            self._network = OddNetwork(
                cancelled(inner, even=bool(hidden), commands=False, told=told),
                np.concatenate([inner.signs, np.ones(told)]),
                hidden,
                len(model.command_names),
            )
        conicities, wears = (np.linspace(*ends, _JUDGED).tolist() for ends in (CONICITY, WEAR))
        self._vehicles = list(vehicles_of_service(model, conicities, wears=wears))
        self.costs: list[float] = []
        self._steps = 0
        self._groups = self._made(exercises, np.random.default_rng(seed))
        self.judged = [self._judge()]

    def _made(self, exercises: Exercises, rng: np.random.Generator) -> list[Runs]:
        """Return the runs with small motions, and those on irregular track."""
        from agents.learning.through import Runs

        model, frame = self._model, self._policy()
        periods = max(2, round(exercises.horizon / self._period))
        plans = [(exercises.small(model), Track(), 1.0)]
        if exercises.rough:
            plans.append((exercises.large(model, rng), Track("low"), exercises.rough_weight))
        groups = []
        for cases, track, weight in plans:
            nudges = _NUDGE * model.scale * rng.standard_normal((len(cases), model.n_states))
            asked = exercises.decay, exercises.effort
            groups.append(Runs(model, frame, cases, track, periods, *asked, nudges, weight))
        return groups

    def _policy(self) -> LearnedPolicy | AdaptivePolicy:
        """Return the present policy."""
        if self._identifier is not None:
            return AdaptivePolicy(self._network.plain(), self._identifier, self._memory)
        return LearnedPolicy(
            self._network.plain(),
            self._readings,
            self._model.command_names,
            self._model.limits,
            "sensors",
            self._memory,
            period=self._period,
        )

    def run(self, evaluations: int, judge_every: int, progress: bool) -> None:
        """Descend; an interrupt (Ctrl-C) ends it early, at the last policy judged."""
        from rich.progress import Progress
        from scipy.optimize import minimize
        from torch.nn.utils import parameters_to_vector

        accepted = parameters_to_vector(self._network.parameters()).detach().numpy()
        with Progress(disable=not progress) as bar:
            task = bar.add_task("training through the simulator", total=evaluations)

            def cost(weights: Array) -> tuple[float, Array]:
                if len(self.costs) == evaluations:  # maxfun is only looked at between line searches
                    raise _Spent
                return self._cost(weights)

            def judge(intermediate_result: Any) -> None:
                """Judge what an iteration has come to, if it is time."""
                nonlocal accepted
                accepted = intermediate_result.x.copy()
                bar.update(task, completed=len(self.costs))
                if len(self.costs) - self.judged[-1].evaluations >= judge_every:
                    self._set(accepted)
                    self.judged.append(self._judge())

            options = {
                "maxfun": evaluations + 1,
                "maxiter": evaluations,
                "maxcor": _REMEMBERED,
                "ftol": 0.0,
                "gtol": 0.0,
            }
            try:
                with contextlib.suppress(_Spent):
                    minimize(
                        cost, accepted, method="L-BFGS-B", jac=True, callback=judge, options=options
                    )
                if len(self.costs) > self.judged[-1].evaluations:
                    self._set(accepted)
                    self.judged.append(self._judge())
            except KeyboardInterrupt:
                pass

    def _set(self, weights: Array) -> None:
        """Give the network weights."""
        import torch
        from torch.nn.utils import vector_to_parameters

        with torch.no_grad():
            vector_to_parameters(torch.from_numpy(weights.copy()), self._network.parameters())

    def _cost(self, weights: Array) -> tuple[float, Array]:
        """Return the cost of all exercises with some weights, and its gradient."""
        self._set(weights)
        self._network.zero_grad()
        cost = sum(group.cost(self._network) for group in self._groups)
        self.costs.append(cost)
        self._steps += sum(group.steps for group in self._groups)
        slopes = [
            np.zeros(p.numel()) if p.grad is None else p.grad.numpy().ravel()
            for p in self._network.parameters()
        ]
        return cost, np.concatenate(slopes)

    def _judge(self) -> _Judged:
        """Record the lowest critical speed of all vehicles of service under the present policy."""
        policy, lowest, worst = self._policy(), HIGHEST_SPEED, 0
        for i, changes in enumerate(self._vehicles):
            speed = _stable_up_to(self._model.replace(**changes), _knowing(policy, changes), lowest)
            if speed < lowest:
                lowest, worst = speed, i
        # first at the next time, since it is likely to limit the search for the others
        self._vehicles.insert(0, self._vehicles.pop(worst))
        return _Judged(len(self.costs), self._steps, lowest, policy)

    @property
    def curve(self) -> list[list[float]]:
        """Evaluations, steps and robust critical speed (m/s) of each judged policy."""
        return [[row.evaluations, row.steps, row.robust] for row in self.judged]


def _knowing(policy: LearnedPolicy | AdaptivePolicy, changes: Mapping[str, float]) -> LearnedPolicy:
    """Return the policy for a known vehicle."""
    if isinstance(policy, LearnedPolicy):
        return policy
    return policy.knowing({name: changes[name] for name in policy.told})


def _stable_up_to(vehicle: Equipped, policy: LearnedPolicy, highest: float) -> float:
    """Return the speed (m/s) up to which a vehicle is stable; 0 if it is not at the lowest one."""
    if highest <= LOWEST_SPEED:
        return highest
    try:
        found = design.critical_speed(vehicle, controller=policy, speed_range=(LOWEST_SPEED, highest))
    except EquilibriumError:
        return 0.0
    return highest if found.loss == "none" else float(found.speed or 0.0)
