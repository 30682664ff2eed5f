"""The gradient of the cost of a policy's rollouts, through policy, memory and vehicle.

Forwards, a rollout is that of the environments. Backwards, :class:`agents.learning.adjoint.Adjoint`
differentiates the vehicle, the memory's matrices the linear memory, and torch the network, for all
vehicles and control periods at once. This module needs the extra ``rl``.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from agents.controllers.adaptive_policy import AdaptivePolicy, told_inputs
from agents.controllers.controller import Controller
from agents.controllers.learned import LearnedPolicy
from agents.controllers.memory import Memory
from agents.controllers.network import Network, Normalization
from agents.evaluation.rollout import Case, Rollout, Track
from agents.learning.adjoint import Adjoint
from agents.learning.steady import Cancelled
from railenv import Equipped
from railenv.envs.fleet import BOUND

Array = NDArray[np.float64]

POWER = 4
"""Power of the mean over cases: a policy is judged by its worst vehicle, not by the average."""


class OddNetwork(nn.Module):
    """A network of tanh layers that is odd in the mirror and blind to steady readings.

    Parameters
    ----------
    cancelled : Cancelled
        Inputs that it reads, and their cancellation.
    signs : ndarray
        +1 or -1 for every input, its factor in the mirror.
    hidden : sequence of int
        Widths of the hidden layers; none for a linear policy.
    outputs : int
    """

    def __init__(self, cancelled: Cancelled, signs: Array, hidden: Sequence[int], outputs: int) -> None:
        super().__init__()
        self._signs = signs
        self._picked = torch.from_numpy(cancelled.matrix)
        self._own = torch.from_numpy(signs[cancelled.free])
        widths = [len(cancelled.free), *hidden, outputs]
        layers: list[nn.Module] = []
        for before, after in itertools.pairwise(widths):
            layers += [nn.Linear(before, after, dtype=torch.float64), nn.Tanh()]
        self._layers = nn.Sequential(*layers[:-1])
        with torch.no_grad():
            self._linear[-1].bias.zero_()  # it cancels, and is never changed

    @property
    def _linear(self) -> list[nn.Linear]:
        return [layer for layer in self._layers if isinstance(layer, nn.Linear)]

    def forward(self, inputs: Tensor) -> Tensor:
        """Return commands as shares of their limits for inputs of shape (count, n_inputs)."""
        x = inputs @ self._picked
        odd = 0.5 * (self._layers(x) - self._layers(x * self._own))
        return torch.tanh(odd)

    def plain(self) -> Network:
        """Return the network in plain NumPy, for a policy."""
        weights = [layer.weight.detach().numpy().copy() for layer in self._linear]
        weights[0] = weights[0] @ self._picked.numpy().T
        width = len(self._signs)
        return Network(
            weights=tuple(weights),
            biases=tuple(layer.bias.detach().numpy().copy() for layer in self._linear),
            activation="tanh",
            squash="tanh",
            normalization=Normalization(np.zeros(width), np.ones(width), 1e6),
            signs=self._signs,
        )


class _Recorder(Controller):
    """A policy that records the inputs and outputs of its network."""

    def __init__(self, frame: LearnedPolicy | AdaptivePolicy, told: Array) -> None:
        self.frame, self.told = frame, told
        self.period = frame.period
        self.network = frame.network
        self.memory = Memory(frame.memory, frame.readings, frame.commands, frame.period)
        self.reset(1)

    def reset(self, count: int | None = None) -> None:
        """Start anew for ``count`` vehicles."""
        self.memory.reset(count or 1)
        self.inputs: list[Array] = []
        self.shares: list[Array] = []

    def act(self, observation: NDArray[np.floating[Any]]) -> Array:
        """Return the commands, and keep them."""
        rows = np.asarray(observation, dtype=np.float32)
        inputs = np.concatenate([rows, self.memory.features(rows), self.told], axis=1, dtype=float)
        shares = self.network(inputs)
        self.memory.advance(shares)
        self.inputs.append(inputs)
        self.shares.append(shares)
        return shares


class Runs:
    """Cases that are run repeatedly from the same start, under changing policies.

    Parameters
    ----------
    model : Equipped
    frame : LearnedPolicy or AdaptivePolicy
        Policy whose readings, commands and memory are those of all policies. One with an identifier is
        told the true numbers of each case's vehicle.
    cases : sequence of Case
    track : Track
    horizon : int
        Number of control periods.
    decay : float
        Rate (1/s) at which motions should decay; faster decay earns nothing.
    effort : float
        Weight of the mean squared command.
    nudges : ndarray, shape (n_cases, n_states)
        Additions to the states at the start.
    weight : float
        Weight of the cost.
    """

    def __init__(
        self,
        model: Equipped,
        frame: LearnedPolicy | AdaptivePolicy,
        cases: Sequence[Case],
        track: Track,
        horizon: int,
        decay: float,
        effort: float,
        nudges: Array,
        weight: float = 1.0,
    ) -> None:
        self._recorder = _Recorder(frame, _told(frame, cases))
        self._rollout = Rollout(model, self._recorder, cases, track)
        fleet = self._rollout.fleet
        for i, nudge in enumerate(nudges):
            fleet.set_state(i, fleet.state(i) + nudge)
        self._start = fleet.snapshot()
        self._adjoint = Adjoint(self._rollout)
        self._horizon, self._decay, self._effort = horizon, decay, effort
        self._weight = weight
        self._sizes = _sizes(model, cases)
        states = list(model.state_names)
        self._seen = [i for i, r in enumerate(frame.readings) if r.signal in states]
        self._sensed = [states.index(frame.readings[i].signal) for i in self._seen]
        self._units = np.array([frame.readings[i].scale for i in self._seen])
        linear = [self._recorder.memory.linear(_signals(frame, case.speed)) for case in cases]
        self._Fs = np.array([one.Fs for one in linear])
        self._Fy = np.array([one.Fy for one in linear])
        self._Gs, self._Gy, self._Gu = linear[0].Gs, linear[0].Gy, linear[0].Gu

    def run(self, network: Network) -> tuple[Array, Array, Array]:
        """Run a network; return states (one more than periods), its inputs and commands."""
        fleet, recorder = self._rollout.fleet, self._recorder
        fleet.restore(self._start)
        recorder.network = network
        recorder.reset(fleet.n)
        states = [fleet.all_states()]
        for _ in range(self._horizon):
            self._rollout.step()
            states.append(fleet.all_states())
        return np.array(states), np.array(recorder.inputs), np.array(recorder.shares)

    @property
    def steps(self) -> int:
        """Environment steps of a run of all cases."""
        return self._horizon * self._rollout.fleet.n

    def cost(self, network: OddNetwork) -> float:
        """Return the cost of a network, and add its gradient to that of the network's parameters."""
        states, inputs, shares = self.run(network.plain())
        cost, by_states = self.judge(states, shares)
        x = torch.from_numpy(inputs.reshape(-1, inputs.shape[2])).requires_grad_()
        out = network(x)
        slopes = [
            torch.autograd.grad(out[:, c].sum(), x, retain_graph=True)[0].numpy()
            for c in range(out.shape[1])
        ]
        gains = np.stack(slopes, axis=1).reshape(*inputs.shape[:2], out.shape[1], -1)
        by_shares = self._back(states, inputs, shares, gains, by_states)
        out.backward(torch.from_numpy(self._weight * by_shares.reshape(out.shape)))
        return self._weight * cost

    def judge(self, states: Array, shares: Array) -> tuple[float, Array]:
        """Return the cost of a motion and its derivatives by the states.

        The cost is the power mean of the (soft) excess of each motion's growth rate over the required
        decay, 1/s, plus the weighted mean square of the commands.
        """
        off = states - self._adjoint.still
        energy = (self._sizes * off**2).sum(axis=2)
        last = len(states) - max(1, self._horizon // 4)
        time = self._horizon * self._rollout.period
        wanted = energy[0] * np.exp(-2.0 * self._decay * time)
        ratio = energy[last:].mean(axis=0) / wanted
        rates = np.log1p(ratio) / (2.0 * time)
        worst = rates.max()  # keeps the powers within the range of numbers
        share = rates / worst
        mean = np.mean(share**POWER)
        value = worst * mean ** (1.0 / POWER)
        by_rates = value / worst * share ** (POWER - 1) / (len(share) * mean)
        value += self._effort * np.square(shares).mean()
        by_ratio = by_rates / (2.0 * time) / (1.0 + ratio)
        by_states = np.zeros_like(states)
        by_energy = by_ratio / wanted / (len(states) - last)
        by_states[last:] = 2.0 * by_energy[:, None] * self._sizes * off[last:]
        return float(value), by_states

    def _back(
        self, states: Array, inputs: Array, shares: Array, gains: Array, by_states: Array
    ) -> Array:
        """Return the derivatives of the cost by every command's share."""
        features, width = self._Fy.shape[1:]
        by_feature = gains[..., width : width + features]
        by_memory = by_feature @ self._Fs  # command by memory's state
        by_reading = gains[..., :width] + by_feature @ self._Fy
        within = np.abs(inputs[..., :width]) < BOUND
        found = 2.0 * self._effort * shares / shares.size
        state = by_states[-1]
        memory = np.zeros((len(state), len(self._Gs)))
        for k in reversed(range(len(shares))):
            pulled = self._adjoint.back(k, states[k], shares, state)
            for age, by in pulled.commands.items():
                found[k - age] += by
            found[k] += memory @ self._Gu
            own = found[k][:, None]
            readings = (own @ by_reading[k])[:, 0] + memory @ self._Gy
            memory = memory @ self._Gs + (own @ by_memory[k])[:, 0]
            state = pulled.state + by_states[k]
            state[:, self._sensed] += (readings * within[k])[:, self._seen] / self._units
        return found


def _sizes(model: Equipped, cases: Sequence[Case]) -> Array:
    """Return weights of squared states in each case's energy, the reward's measure of hunting."""
    names = model.state_names
    sizes = np.zeros((len(cases), len(names)))
    for i, case in enumerate(cases):
        wheelsets = model.replace(**case.vehicle).guided if case.vehicle else model.guided
        for g in wheelsets:
            wave = 2.0 * np.pi / g.wavelength
            for state, unit, share in (
                (g.y, g.clearance, 1.0),
                (g.psi, wave * g.clearance, 0.5),
                (g.dy, case.speed * wave * g.clearance, 0.5),
            ):
                sizes[i, names.index(state)] = share / len(wheelsets) / unit**2
    return sizes


def _told(frame: LearnedPolicy | AdaptivePolicy, cases: Sequence[Case]) -> Array:
    """Return the inputs that tell a policy the vehicle of each case; none without an identifier."""
    if isinstance(frame, LearnedPolicy):
        return np.zeros((len(cases), 0))
    numbers = {name: np.array([case.vehicle[name] for case in cases]) for name in frame.told}
    return told_inputs(frame.identifier.vehicles, numbers)


def _signals(frame: LearnedPolicy | AdaptivePolicy, speed: float) -> Array:
    return np.array([speed if r.signal == "speed" else 0.0 for r in frame.readings])
