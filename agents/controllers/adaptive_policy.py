"""A learned policy that is told which vehicle it controls, by an identifier.

The network reads numbers of the vehicle, such as its conicity, beside the sensors. In training it gets
the true numbers; running, it gets what an :class:`AdaptiveLQG`'s filters find likely (a policy of
privileged inputs and their estimate, as A. Kumar et al., RMA: rapid motor adaptation for legged robots,
Robotics: Science and Systems, 2021). For any fixed numbers it is a :class:`LearnedPolicy`.
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from agents.controllers.adaptive import AdaptiveLQG
from agents.controllers.controller import Controller, observation_rows
from agents.controllers.files import ControllerFile, read, write
from agents.controllers.learned import LearnedPolicy
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.network import Network
from railenv import checks
from railenv.envs.observation import Reading
from railenv.errors import ParameterError

Array = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]

_IDENTIFIER = "identifier_"
"""Beginning of the names of the identifier's arrays in a file."""


@dataclass(eq=False)
class AdaptivePolicy(Controller):
    """A neural network that reads the sensors and estimates of the vehicle's numbers.

    It has no linearisation because the estimates depend on past readings; that of :meth:`knowing` has
    one. :func:`agents.train_through` trains it.

    Attributes
    ----------
    network : Network
        Its last inputs are the numbers of the vehicle, scaled to -1 to 1 over the identifier's bank.
    identifier : AdaptiveLQG
        Its estimates are these numbers; its own commands are not used. The policy keeps a copy.
    memory : MemorySettings
        Memory without history.
    about : dict
        Record of its training: plain numbers, strings and lists, kept in its file.
    """

    network: Network
    identifier: AdaptiveLQG
    memory: MemorySettings = field(default_factory=MemorySettings)
    about: dict[str, Any] = field(default_factory=dict)
    observation: Literal["state", "sensors"] = "sensors"

    def __post_init__(self) -> None:
        if self.memory.history:
            raise ParameterError(
                f"history of the memory is {self.memory.history}; a policy with an identifier "
                "remembers through filters (corners), so it must be 0"
            )
        if not told_ranges(self.identifier.vehicles):
            raise ParameterError(
                f"the identifier's vehicles are all {self.identifier.vehicles[0]!r}; they must differ "
                "in a number that the policy can be told"
            )
        self.identifier = copy.deepcopy(self.identifier)  # it has states, and another may use it
        self._memory = Memory(self.memory, self.readings, self.commands, self.period)
        expected = (len(self._memory.signs) + len(self.told), len(self.commands))
        if (self.network.n_inputs, self.network.n_outputs) != expected:
            raise ParameterError(
                f"the network has {self.network.n_inputs} inputs and {self.network.n_outputs} outputs; "
                f"it must have {expected[0]} (readings, features, {', '.join(self.told)}) and "
                f"{expected[1]} ({', '.join(self.commands)})"
            )
        self.reset()

    @property
    def readings(self) -> tuple[Reading, ...]:
        """Entries of the observation."""
        return self.identifier.readings

    @property
    def commands(self) -> tuple[str, ...]:
        """Inputs of the equipped model that it commands."""
        return self.identifier.commands

    @property
    def limits(self) -> Array:
        """Largest moment (N m) or force (N) of each command."""
        return self.identifier.limits

    @property
    def period(self) -> float:
        """Control period, s."""
        return self.identifier.period

    @property
    def told(self) -> list[str]:
        """Names of the numbers of the vehicle that it is told."""
        return list(told_ranges(self.identifier.vehicles))

    # ------------------------------------------------------------------ running

    def reset(self, count: int | None = None) -> None:
        """Start anew, for one vehicle (None) or for ``count`` vehicles side by side."""
        self.identifier.reset(count)
        self._single = count is None
        self._memory.reset(count or 1)

    def act(self, observation: Floats) -> Floats:
        """Return commanded moments as shares of the limits."""
        count = None if self._single else len(self.identifier.likely)
        rows = observation_rows(observation, count, len(self.readings)).astype(np.float32)
        self.identifier.observe(observation)
        numbers = {name: self.identifier.estimate(name) for name in self.told}
        told = told_inputs(self.identifier.vehicles, numbers)
        inputs = np.concatenate([rows, self._memory.features(rows), told], axis=1, dtype=float)
        shares = np.clip(self.network(inputs), -1.0, 1.0)
        self._memory.advance(shares)
        self.identifier.advance(shares)
        return np.asarray(shares[0] if self._single else shares)

    def knowing(self, vehicle: Mapping[str, float]) -> LearnedPolicy:
        """Return the policy that is always told the same vehicle; it has a linearisation.

        Parameters
        ----------
        vehicle : mapping of str to float
            All numbers that the policy is told, such as ``{"conicity": 0.4, "creep_factor": 1.4}``.

        Raises
        ------
        UnknownNameError
            If the policy is not told one of them.
        ParameterError
            If one is missing.
        """
        checks.known("number that the policy is told", list(vehicle), self.told)
        missing = [name for name in self.told if name not in vehicle]
        if missing:
            raise ParameterError(f"vehicle is {dict(vehicle)!r}; {', '.join(missing)} is missing")
        known = {name: checks.number(name, vehicle[name]) for name in self.told}
        numbers = {name: np.array([value]) for name, value in known.items()}
        told = told_inputs(self.identifier.vehicles, numbers)[0]
        return LearnedPolicy(
            _folded(self.network, told),
            self.readings,
            self.commands,
            self.limits,
            self.observation,
            self.memory,
            period=self.period,
            about={**self.about, "told": known},
        )

    # ------------------------------------------------------------------ files

    def save(self, path: str | PathLike[str]) -> None:
        """Write it to an npz file; :func:`agents.load` gives back its equal."""
        write(path, self.to_file())

    def to_file(self) -> ControllerFile:
        """Return the content of its file."""
        inner = self.identifier.to_file()
        header = {
            "network": self.network.header(),
            "memory": dataclasses.asdict(self.memory),
            "identifier": inner.header,
            "about": self.about,
        }
        arrays = {_IDENTIFIER + name: value for name, value in inner.arrays.items()}
        return ControllerFile(type(self).__name__, header, self.network.arrays() | arrays)

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
        inner = {
            name.removeprefix(_IDENTIFIER): value
            for name, value in content.arrays.items()
            if name.startswith(_IDENTIFIER)
        }
        try:
            network = Network.restore(h["network"], content.arrays_named(*Network.names(h["network"])))
            filed = ControllerFile(AdaptiveLQG.__name__, h["identifier"], inner)
            memory = MemorySettings(**h["memory"])
            return cls(network, AdaptiveLQG.from_file(filed), memory, h["about"])
        except (KeyError, TypeError) as e:
            raise ParameterError(f"the file of a {content.kind} is damaged: {e!r}") from None


def told_ranges(vehicles: Sequence[Mapping[str, float]]) -> dict[str, tuple[float, float]]:
    """Return the numbers in which an identifier's vehicles differ, with the ends of each."""
    values = {name: [vehicle[name] for vehicle in vehicles] for name in vehicles[0]}
    ends = {name: (min(found), max(found)) for name, found in values.items()}
    return {name: (low, high) for name, (low, high) in ends.items() if low < high}


def told_inputs(vehicles: Sequence[Mapping[str, float]], numbers: Mapping[str, Array]) -> Array:
    """Return the inputs of a network that tell it numbers of some vehicles, shape (count, n_numbers).

    Parameters
    ----------
    vehicles : sequence of mapping of str to float
        The identifier's; every number is scaled to -1 to 1 between its ends among them.
    numbers : mapping of str to ndarray, shape (count,)
    """
    columns = [
        (2.0 * numbers[name] - low - high) / (high - low)
        for name, (low, high) in told_ranges(vehicles).items()
    ]
    return np.stack(columns, axis=1)


def _folded(network: Network, told: Array) -> Network:
    """Return a network in which the last inputs are constant, as part of its first biases."""
    kept = network.n_inputs - len(told)
    constant = network.normalization(np.concatenate([np.zeros(kept), told]))[kept:]
    first, *others = network.weights
    scaling = dataclasses.replace(
        network.normalization,
        mean=network.normalization.mean[:kept],
        scale=network.normalization.scale[:kept],
    )
    return dataclasses.replace(
        network,
        weights=(first[:, :kept], *others),
        biases=(network.biases[0] + first[:, kept:] @ constant, *network.biases[1:]),
        normalization=scaling,
        signs=None if network.signs is None else network.signs[:kept],
    )
