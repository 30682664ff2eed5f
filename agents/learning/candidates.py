"""Candidates of a policy search: weights as policies, run side by side and judged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

import design
from agents.controllers.controller import Controller
from agents.controllers.learned import LearnedPolicy
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.network import Network, Normalization
from agents.controllers.scheduled import ScheduledController, readings_of
from agents.controllers.service import CONICITY, CREEP_FACTOR, varied
from agents.evaluation.rollout import Rollout, Track
from agents.learning.lessons import Lessons
from agents.learning.policy_start import Aim, start_weights
from agents.learning.steady import cancelled
from railenv import Equipped

Array = NDArray[np.float64]

_SMALLEST_SCALE = 1e-3  # of an input


class Population(Controller):
    """Candidates side by side: each runs the same cases with its own weights."""

    def __init__(self, frame: LearnedPolicy, gains: Array) -> None:
        settings = frame.memory
        self.memory = Memory(settings, frame.readings, frame.commands, frame.period, frame.base)
        self.period = frame.period
        self._gains = gains  # (candidates, commands, inputs)
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
        learned = np.clip(grouped @ self._gains.swapaxes(1, 2), -1.0, 1.0)
        added = self._authority * learned.reshape(len(x), -1)
        shares = np.clip(self.memory.demand + added, -1.0, 1.0)
        self.memory.advance(shares)
        return shares


class Candidates:
    """The evaluation of weights in a search: a policy, its returns, its robust critical speed.

    Parameters
    ----------
    model : Equipped
    base : ScheduledController
    lessons : Lessons
    memory : MemorySettings
    authority : float
        Largest share of the limit that the network commands.
    period : float
        Control period, s.
    """

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
        self._cancelled = cancelled(inner)
        self._scale = np.ones(len(self._signs))
        self._scale = self._usual()

    @property
    def dimension(self) -> int:
        """Number of weights."""
        return len(self._cancelled.free) * len(self.model.command_names)

    def _gains(self, weights: Array) -> Array:
        """Return the gains of some candidates, shape (candidates, commands, inputs)."""
        free = self._cancelled.free
        shape = (len(weights), len(self.model.command_names), len(free))
        gains = weights.reshape(shape) / self._scale[free] @ self._cancelled.matrix.T
        return np.asarray(gains / self.authority)

    def policy(self, weights: Array, about: Mapping[str, Any]) -> LearnedPolicy:
        """Return the policy with some weights."""
        width = len(self._signs)
        network = Network(
            weights=(self._gains(weights[None])[0],),
            biases=(np.zeros(len(self.model.command_names)),),
            activation="tanh",
            squash="none",
            normalization=Normalization(np.zeros(width), np.ones(width), 1e6),
            signs=self._signs,
        )
        return LearnedPolicy(
            network,
            self.readings,
            self.model.command_names,
            self.model.limits,
            "sensors",
            self.memory,
            self.base,
            self.authority,
            self.period,
            dict(about),
        )

    def _usual(self) -> Array:
        """Return the size (rms) that every input has under the base."""
        controller = Population(self.policy(np.zeros(self.dimension), {}), self._gains(
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
        controller = Population(frame, self._gains(candidates))
        return self.lessons.scores(self.model, controller, len(candidates))

    def robust(self, weights: Array) -> float:
        """Return the robust critical speed of weights (m/s), 0 if there is none."""
        box = varied(self.model, {"conicity": CONICITY, "creep_factor": CREEP_FACTOR})
        found = design.robust_critical_speed(self.model, self.policy(weights, {}), box, samples=6)
        return found.speed or 0.0
