"""Training through the simulator: the exact gradient of rollouts moves a policy.

Where other algorithms estimate from many episodes which way to change a policy, here the derivatives of
the equations of motion tell it (an analytic policy gradient, by backpropagation through time). The
policy starts from random weights. Needs the extra ``rl``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import design
from agents.controllers.learned import LearnedPolicy
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.scheduled import CONTROL_PERIOD, readings_of
from agents.controllers.service import CONICITIES, CREEP_FACTORS, WEARS, vehicles_of_service
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
"""What a policy that is trained through the simulator remembers, if not told otherwise."""

_NUDGE = 1e-7  # of every state at the start, in units of the model's scale: far from every limit
LOWEST_SPEED, HIGHEST_SPEED = 20.0, 400.0
"""m/s, between which critical speeds are searched."""

_LAST_RATE = 0.1  # of the learning rate, at the end


@dataclass(frozen=True)
class Descent:
    """Result of training through the simulator.

    Attributes
    ----------
    policy : LearnedPolicy
        The most robust of those judged.
    last : LearnedPolicy
    costs : ndarray, shape (iterations,)
        Cost of the group of every iteration, before its step; see :class:`Exercises`.
    judged : ndarray, shape (n_judged, 3)
        Iteration, environment steps until then, and the lowest critical speed (m/s) of nine vehicles of
        service, 0 if one is unstable at 20 m/s. The first is the policy of random weights.
    """

    policy: LearnedPolicy
    last: LearnedPolicy
    costs: Array
    judged: Array

    @property
    def steps(self) -> int:
        """Environment steps that were run in all."""
        return int(self.judged[-1, 1])

    def __str__(self) -> str:
        first, best = self.judged[0, 2], self.judged[:, 2].max()
        return (
            f"{len(self.costs)} iterations, {self.steps} steps: lowest critical speed {first:.2f} m/s "
            f"at first, {best:.2f} m/s at best"
        )

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the learning curve: cost and robust critical speed over the iterations."""
        from agents.learning.learning_plots import plot_descent

        return plot_descent(self.costs, self.judged, ax)


def train_through(
    model: Equipped,
    *,
    exercises: Exercises | None = None,
    memory: MemorySettings | None = None,
    hidden: Sequence[int] = (32,),
    iterations: int = 240,
    learning_rate: float = 0.01,
    largest_gradient: float = 1.0,
    judge_every: int = 30,
    seed: int = 0,
    period: float = CONTROL_PERIOD,
    progress: bool = False,
) -> Descent:
    """Train a policy by the exact gradient of its rollouts.

    In every iteration a group of vehicles runs under the policy in the environments' own kernel; the
    gradient of what their motions cost goes back through vehicle, actuator, delay, sensors, memory and
    network, and Adam takes a step. The policy is odd, and steady readings cancel in it. It does not
    read its own commands: what that alone makes grow is too slow for a rollout to show. It starts from
    random weights. Every few iterations, and at the end, it is judged by the lowest critical speed of
    vehicles of service.

    Parameters
    ----------
    model : Equipped
        With any number of actuators.
    exercises : Exercises, optional
    memory : MemorySettings, optional
        ``MEMORY`` when left out; without history and past commands.
    hidden : sequence of int
        Widths of the network's hidden layers; none is a linear policy.
    iterations : int
    learning_rate : float
        Of Adam at first; it falls linearly to a tenth.
    largest_gradient : float
        Norm to which longer gradients are cut.
    judge_every : int
        Iterations between judgements.
    seed : int
        Of the weights, the vehicles and where they start.
    period : float
        Control period, s.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns what was found until then.

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
    checks.whole("iterations", iterations)
    checks.whole("judge_every", judge_every)
    checks.whole("seed", seed, low=0)
    checks.number("learning_rate", learning_rate, low=0.0, open_low=True)
    checks.number("largest_gradient", largest_gradient, low=0.0, open_low=True)
    about: dict[str, Any] = {
        "algorithm": "analytic policy gradient",
        "exercises": todo.plain(),
        "hidden": list(widths),
        "learning_rate": learning_rate,
        "largest_gradient": largest_gradient,
        "seed": seed,
    }
    with one_blas_thread():
        path = _Path(model, todo, kept, widths, seed, period)
        path.run(iterations, judge_every, learning_rate, largest_gradient, progress)
    about |= {"iterations": len(path.costs), "judged": path.curve}
    best, last = max(path.judged, key=lambda row: row.robust), path.judged[-1]
    return Descent(
        dataclasses.replace(best.policy, about={**about, "chosen": best.iteration}),
        dataclasses.replace(last.policy, about={**about, "chosen": last.iteration}),
        np.array(path.costs),
        np.array(path.curve, dtype=float),
    )


def _checked(model: Equipped, memory: MemorySettings, hidden: Sequence[int]) -> tuple[int, ...]:
    """Return the widths of the hidden layers, or raise where something does not suit."""
    if not model.command_names:
        raise ParameterError(f"{model.name} has no actuators; there is nothing to learn")
    for name in ("history", "past_commands"):
        if getattr(memory, name):
            raise ParameterError(
                f"{name} of the memory is {getattr(memory, name)}; a policy trained through the "
                "simulator remembers what filters tell it of readings (corners), and it must be 0"
            )
    if not isinstance(hidden, (list, tuple)):
        raise ParameterError(f"hidden is {shown(hidden)}; it must be widths of layers, such as (32,)")
    return tuple(checks.whole("width of a hidden layer", width, low=1) for width in hidden)


@dataclass(frozen=True)
class _Judged:
    """A policy on the way, and what it reaches."""

    iteration: int
    steps: int
    robust: float
    policy: LearnedPolicy


class _Path:
    """The iterations of a training, and what was judged on the way."""

    def __init__(
        self,
        model: Equipped,
        exercises: Exercises,
        memory: MemorySettings,
        hidden: tuple[int, ...],
        seed: int,
        period: float,
    ) -> None:
        import torch

        from agents.learning.steady import cancelled
        from agents.learning.through import OddNetwork

        self._model, self._memory, self._period = model, memory, period
        self._readings = tuple(readings_of(model, "sensors", period))
        inner = Memory(memory, self._readings, model.command_names, period)
        with torch.random.fork_rng(devices=[]):  # the caller's own random numbers stay as they are
            torch.manual_seed(seed)
            self._network = OddNetwork(
                cancelled(inner, even=bool(hidden), commands=False),
                inner.signs,
                hidden,
                len(model.command_names),
            )
        self._vehicles = list(vehicles_of_service(model, CONICITIES[::2], CREEP_FACTORS, WEARS[::2]))
        self.costs: list[float] = []
        self._steps = 0
        self._groups = self._made(exercises, np.random.default_rng(seed))
        self.judged = [self._judge()]

    def _made(self, exercises: Exercises, rng: np.random.Generator) -> list[Runs]:
        """Return the groups of runs."""
        from agents.learning.through import Runs

        model, frame = self._model, self._policy()
        periods = max(2, round(exercises.horizon / self._period))
        plans = [(exercises.vehicles, 0.0, Track(), 1.0)] * exercises.groups
        if exercises.rough:
            rough = exercises.rough, exercises.offset, Track("low"), exercises.rough_weight
            plans.append(rough)
        groups = []
        for count, offset, track, weight in plans:
            cases = exercises.draw(model, count, offset, rng)
            nudges = _NUDGE * model.scale * rng.standard_normal((count, model.n_states))
            asked = exercises.decay, exercises.effort
            groups.append(Runs(model, frame, cases, track, periods, *asked, nudges, weight))
        return groups

    def _policy(self) -> LearnedPolicy:
        """Return the present policy."""
        return LearnedPolicy(
            self._network.plain(),
            self._readings,
            self._model.command_names,
            self._model.limits,
            "sensors",
            self._memory,
            period=self._period,
        )

    def run(
        self, iterations: int, judge_every: int, rate: float, longest: float, progress: bool
    ) -> None:
        """Go on by some iterations; an interrupt (Ctrl-C) ends them early."""
        import torch

        parameters = list(self._network.parameters())
        adam = torch.optim.Adam(parameters, lr=rate)
        falling = torch.optim.lr_scheduler.LinearLR(adam, 1.0, _LAST_RATE, iterations)
        turns: Iterable[int] = range(1, iterations + 1)
        if progress:
            from rich.progress import track

            turns = track(turns, description="training through the simulator", total=iterations)
        try:
            for turn in turns:
                group = self._groups[(turn - 1) % len(self._groups)]
                adam.zero_grad()
                cost = group.cost(self._network)
                torch.nn.utils.clip_grad_norm_(parameters, longest)
                adam.step()
                falling.step()
                self.costs.append(cost)
                self._steps += group.steps
                if turn % judge_every == 0 or turn == iterations:
                    self.judged.append(self._judge())
        except KeyboardInterrupt:
            pass

    def _judge(self) -> _Judged:
        """Note the lowest critical speed of all vehicles of service under the present policy."""
        policy, lowest, worst = self._policy(), HIGHEST_SPEED, 0
        for i, changes in enumerate(self._vehicles):
            speed = _stable_up_to(self._model.replace(**changes), policy, lowest)
            if speed < lowest:
                lowest, worst = speed, i
        # first at the next time, since it is likely to bound how far the others are looked at
        self._vehicles.insert(0, self._vehicles.pop(worst))
        return _Judged(len(self.costs), self._steps, lowest, policy)

    @property
    def curve(self) -> list[list[float]]:
        """Iteration, steps and robust critical speed (m/s) of each judged policy."""
        return [[row.iteration, row.steps, row.robust] for row in self.judged]


def _stable_up_to(vehicle: Equipped, policy: LearnedPolicy, highest: float) -> float:
    """Return the speed (m/s) up to which a vehicle is stable; 0 if it is not at the lowest one."""
    if highest <= LOWEST_SPEED:
        return highest
    try:
        found = design.critical_speed(vehicle, controller=policy, speed_range=(LOWEST_SPEED, highest))
    except EquilibriumError:
        return 0.0
    return highest if found.loss == "none" else float(found.speed or 0.0)
