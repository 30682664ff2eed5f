"""Learned policies behind the interface of every controller: NumPy only, exactly linearised."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, Literal, Self, get_args

import control
import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller, check_labels, check_limits, observation_rows
from agents.controllers.files import ControllerFile, read, restored, write
from agents.controllers.linear_kinds import LINEAR
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.network import Network
from agents.controllers.scheduled import CONTROL_PERIOD, MOST_VEHICLES, ScheduledController
from design.loop.feedback import CONDITIONS
from railenv import checks
from railenv.envs.environment import History
from railenv.envs.fleet import BOUND
from railenv.envs.observation import Observation, Reading
from railenv.errors import EquilibriumError, ParameterError

Array = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]

_SETTLED = 1e-12  # share of the limit
_NEWTON_STEPS = 50


@dataclass(frozen=True)
class Settled:
    """A policy at rest under a constant observation."""

    shares: Array
    features: Array
    free: NDArray[np.bool_]  # commands that are not at a limit


@dataclass(eq=False)
class LearnedPolicy(Controller):
    """A neural network as a controller, alone or on top of a base controller.

    Each control period it commands, as shares of the limit,

        clip(base + authority clip(network(observation, its history, features), -1, 1), -1, 1)

    with the features of :class:`agents.controllers.memory.Memory`. ``base`` is zero without a base
    controller.

    Attributes
    ----------
    network : Network
    readings : tuple of Reading
        The observation's entries, without history.
    commands : tuple of str
        Inputs of the equipped model that it commands.
    limit : float or sequence of float
        Largest moment (N m; N of a lateral actuator), of all commands or of each.
    observation : {"state", "sensors"}
    memory : MemorySettings
    base : ScheduledController, optional
    authority : float
        Largest share of the limit that the network commands, in (0, 1].
    period : float
        Control period, s.
    about : dict
        Record of its training: plain numbers, strings and lists, kept in its file.
    """

    network: Network
    readings: tuple[Reading, ...]
    commands: tuple[str, ...]
    limit: float | Sequence[float] | Array
    observation: Literal["state", "sensors"]
    memory: MemorySettings = field(default_factory=MemorySettings)
    base: ScheduledController | None = None
    authority: float = 1.0
    period: float = CONTROL_PERIOD
    about: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        checks.known("observation", [self.observation], get_args(Observation))
        checks.number("period", self.period, low=0.0, open_low=True, unit="s")
        checks.number("authority", self.authority, low=0.0, high=1.0, open_low=True)
        check_labels(self.readings, self.commands)
        self.limit = check_limits(self.commands, self.limit)
        self._memory = Memory(self.memory, self.readings, self.commands, self.period, self.base)
        expected = self._stacked_width + len(self._memory.names)
        if (self.network.n_inputs, self.network.n_outputs) != (expected, len(self.commands)):
            raise ParameterError(
                f"the network has {self.network.n_inputs} inputs and {self.network.n_outputs} outputs; "
                f"it must have {expected} (readings with their history and features) and "
                f"{len(self.commands)} ({', '.join(self.commands)})"
            )
        signs = self.network.signs
        if signs is not None and not np.array_equal(signs, self._memory.signs):
            raise ParameterError("the network's signs are not those of its readings in the mirror")
        self._scales = np.array([reading.scale for reading in self.readings])
        self._rests = np.array([reading.rest for reading in self.readings])
        self.reset()

    @property
    def limits(self) -> Array:
        """Largest moment (N m) or force (N) of each command."""
        return np.full(len(self.commands), self.limit)

    @property
    def _stacked_width(self) -> int:
        return len(self.readings) * (self.memory.history + 1)

    # ------------------------------------------------------------------ running

    def reset(self, count: int | None = None) -> None:
        """Start anew, for one vehicle (None) or for ``count`` vehicles side by side."""
        self._single = count is None
        count = None if count is None else checks.whole("count", count, high=MOST_VEHICLES)
        self._history = History(count or 1, len(self.readings), self.memory.history)
        self._started = False
        self._memory.reset(count or 1)

    def act(self, observation: Floats) -> Floats:
        """Return commanded moments as shares of the limit, for one observation or for each row."""
        count = None if self._single else len(self._history.stacked)
        given = observation_rows(observation, count, len(self.readings))
        rows = given.astype(np.float32)  # as the environments give them
        if self._started:
            self._history.push(rows)
        else:
            self._history.reset(slice(None), rows)
            self._started = True
        features = self._memory.features(rows)
        inputs = np.concatenate([self._history.stacked, features], axis=1, dtype=float)
        shares = self._shares(inputs, self._memory.demand)
        self._memory.advance(shares)
        return shares[0] if self._single else shares

    def _shares(self, inputs: Array, demand: Array) -> Array:
        learned = np.clip(self.network(inputs), -1.0, 1.0)
        return np.asarray(np.clip(demand + self.authority * learned, -1.0, 1.0))

    # ------------------------------------------------------------------ design.Feedback

    @property
    def input_labels(self) -> list[str]:
        """Signals that it reads, by their names in :mod:`design.loop.feedback`."""
        return [reading.signal for reading in self.readings]

    @property
    def output_labels(self) -> list[str]:
        """Inputs of the model that it commands."""
        return list(self.commands)

    def steady(self, signals: Array) -> Array:
        """Return the moments (N m) at which it settles under constant signals.

        Raises
        ------
        EquilibriumError
            If it does not settle.
        """
        return self._settle(signals).shares * self.limits

    def linearize(self, signals: Array) -> control.StateSpace:
        """Return its exact linearisation, in discrete time, about rest at some signals.

        States are past observations of the motion, filters, past commands and the base controller's.
        Past observations of running conditions equal the present ones. A command at its limit does not
        respond.
        """
        linear = self._memory.linear(signals)
        settled = self._settle(signals)
        y, active = self._scaled(signals)
        gain = self._gain(y, settled)
        width, history = len(self.readings), self.memory.history
        now, past, features = np.split(gain, [width, width * (history + 1)], axis=1)
        past = past.reshape(len(gain), history, width)
        steady = np.array([r.drawn or r.signal in CONDITIONS for r in self.readings])
        now = now + past.sum(axis=1) * steady
        moving = int(np.count_nonzero(~steady))
        stack = moving * history
        past = past[:, :, ~steady].reshape(len(gain), stack)
        n = len(linear.Gs)
        C = np.hstack([past, features @ linear.Fs])
        D = now + features @ linear.Fy
        if self.base is not None:
            demand = self._demand_rows(len(linear.Fs))
            C[:, stack:] += settled.free[:, None] * linear.Fs[demand]
            D = D + settled.free[:, None] * linear.Fy[demand]
        A = np.zeros((stack + n, stack + n))
        B = np.zeros((stack + n, width))
        A[:stack, :stack] = np.eye(stack, k=-moving)
        B[:stack] = np.eye(stack, moving) @ np.eye(width)[~steady]
        A[stack:, stack:] = linear.Gs
        A[stack:] += linear.Gu @ C
        B[stack:] = linear.Gy + linear.Gu @ D
        units = active / self._scales
        return control.ss(
            A,
            B * units,
            self.limits[:, None] * C,
            self.limits[:, None] * D * units,
            self.period,
            inputs=self.input_labels,
            outputs=self.output_labels,
        )

    def _scaled(self, signals: Array) -> tuple[Array, Array]:
        """Return signals in the units of the observation, and which of them are within its bound."""
        y = (np.asarray(signals, dtype=float) - self._rests) / self._scales
        return np.clip(y, -BOUND, BOUND), (np.abs(y) < BOUND).astype(float)

    def _demand_rows(self, features: int) -> slice:
        """Return the rows of the features with the base's demand."""
        return slice(features - len(self.commands) if self.base is not None else features, features)

    def _gain(self, y: Array, settled: Settled) -> Array:
        """Return the derivative of the free commands by the network's inputs."""
        inputs = self._inputs(y, settled.features)
        moving = np.abs(self.network(inputs[None])[0]) < 1.0
        share = settled.free * moving * self.authority
        return np.asarray(share[:, None] * self.network.jacobian(inputs))

    def _inputs(self, y: Array, features: Array) -> Array:
        return np.concatenate([np.tile(y, self.memory.history + 1), features])

    def _settle(self, signals: Array) -> Settled:
        """Solve for the command that reproduces itself, by Newton's method from zero."""
        y, _ = self._scaled(signals)
        linear = self._memory.linear(signals)
        inner = np.eye(len(linear.Gs)) - linear.Gs
        states = np.linalg.lstsq(inner, np.hstack([(linear.Gy @ y)[:, None], linear.Gu]), rcond=None)[0]
        by_command = linear.Fs @ states[:, 1:]
        demand = self._demand_rows(len(linear.Fs))
        shares = np.zeros(len(self.commands))
        for _ in range(_NEWTON_STEPS):
            features = linear.Fy @ y + linear.Fs @ states[:, 0] + by_command @ shares
            asked = np.zeros(len(shares)) if self.base is None else features[demand]
            learned = np.clip(self.network(self._inputs(y, features)[None])[0], -1.0, 1.0)
            raw = asked + self.authority * learned
            settled = Settled(shares, features, np.abs(raw) < 1.0)
            excess = shares - np.clip(raw, -1.0, 1.0)
            if not np.abs(excess).max() > _SETTLED:
                return settled
            slope = self._gain(y, settled)[:, self._stacked_width :] @ by_command
            if self.base is not None:
                slope += settled.free[:, None] * by_command[demand]
            shares = shares - np.linalg.solve(np.eye(len(shares)) - slope, excess)
        raise EquilibriumError(
            f"the policy does not settle at {dict(zip(self.input_labels, signals, strict=True))}",
            float(np.abs(excess).max()),
        )

    # ------------------------------------------------------------------ files

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to an npz file; :func:`agents.load` gives back its equal."""
        write(path, self.to_file())

    def to_file(self) -> ControllerFile:
        """Return the content of its file."""
        header: dict[str, Any] = {
            "readings": [list(reading) for reading in self.readings],
            "commands": list(self.commands),
            "limit": self.limit,
            "observation": self.observation,
            "period": self.period,
            "authority": self.authority,
            "memory": dataclasses.asdict(self.memory),
            "network": self.network.header(),
            "about": self.about,
        }
        arrays = self.network.arrays()
        if self.base is not None:
            base = self.base.to_file()
            header["base"] = {"kind": base.kind, "header": base.header}
            arrays |= {f"base_{name}": value for name, value in base.arrays.items()}
        return ControllerFile(type(self).__name__, header, arrays)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a policy from its file.

        Raises
        ------
        ParameterError
            If the file is damaged or holds another kind of controller.
        """
        return cls.from_file(read(path, cls.__name__))

    @classmethod
    def from_file(cls, content: ControllerFile) -> Self:
        """Return the policy in a file.

        Raises
        ------
        ParameterError
            If something in it is missing or inconsistent.
        """
        h = content.header
        try:
            network = Network.restore(h["network"], content.arrays_named(*Network.names(h["network"])))
            return cls(
                network=network,
                readings=tuple(Reading(*row) for row in h["readings"]),
                commands=tuple(h["commands"]),
                limit=h["limit"],
                observation=h["observation"],
                memory=MemorySettings(**h["memory"]),
                base=_base_of(content),
                authority=h["authority"],
                period=h["period"],
                about=h["about"],
            )
        except (KeyError, TypeError) as e:
            raise ParameterError(f"the file of a {content.kind} is damaged: {e!r}") from None

    @classmethod
    def from_sb3(
        cls,
        model: Any,
        vecnormalize: Any,
        env: Any,
        *,
        about: dict[str, Any] | None = None,
    ) -> Self:
        """Return the policy of a Stable-Baselines3 model, with the normalisation of its training.

        Stable-Baselines3's own files are pickles, which run code when they are read. Open only files
        that you trust, and keep what this returns: :meth:`save` writes plain numbers.

        Parameters
        ----------
        model : path or BaseAlgorithm
            A PPO, A2C, SAC, TD3 or DDPG model with ``MlpPolicy``, or its ``.zip`` file.
        vecnormalize : path, VecNormalize or None
            Its normalisation, or the file that its ``save`` wrote; None if there was none.
        env : HuntingVecEnv, MemoryVecEnv or railenv environment
            An environment with the settings of its training, for readings, history and limits.
        about : dict, optional

        Raises
        ------
        ParameterError
            If the model's network cannot be read.
        MissingPackageError
            If the extra ``rl`` is missing.
        """
        from railenv.extras import require_rl

        require_rl("importing a model of Stable-Baselines3")
        from agents.controllers.from_sb3 import policy_parts

        return cls(**policy_parts(model, vecnormalize, env), about=about or {})


def _base_of(content: ControllerFile) -> ScheduledController | None:
    if "base" not in content.header:
        return None
    base = content.header["base"]
    arrays = {
        name.removeprefix("base_"): value
        for name, value in content.arrays.items()
        if name.startswith("base_")
    }
    if base["kind"] == LearnedPolicy.__name__:
        raise ParameterError(f"a base controller is {base['kind']}; it must be linear")
    return restored(ControllerFile(base["kind"], base["header"], arrays), LINEAR, "a base controller")
