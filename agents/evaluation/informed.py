"""Controllers with full information: the vehicle of the episode, its state and the track under it.

Their returns are a lower bound of the best that can be reached in an environment.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from design.linear.regulator import Regulator, Weights, lqr
from railenv import Equipped
from railenv.envs.episodes import Episode
from railenv.envs.fleet import Fleet

Array = NDArray[np.float64]


class InformedLQR:
    """LQR of each vehicle of a fleet, designed for that vehicle at its speed.

    It acts on the true states, as deviations from the running equilibrium of the track under the
    vehicle, and on the commands that are still on their way.

    Parameters
    ----------
    fleet : Fleet
        Fleet after its reset.
    weights : Weights
    """

    def __init__(self, fleet: Fleet, weights: Weights) -> None:
        model = fleet.model
        self._curves = fleet.settings.track != "constant"
        found = [_regulator(fleet, episode, weights) for episode in fleet.episodes]
        labels = list(found[0].system.state_labels)
        present = [name for name in labels if "[" not in name]
        self._columns = [model.state_names.index(name) for name in present]
        self._ages = (len(labels) - len(present)) // fleet.n_actuators
        order = [labels.index(name) for name in [*present, *_past(model.command_names, self._ages)]]
        gains = np.array([regulator.gain[:, order] for regulator in found])
        self._gains = gains / model.limits[:, None]
        self._past = np.zeros((fleet.n, self._ages, fleet.n_actuators))
        self._rest = self._equilibria(fleet)

    def _equilibria(self, fleet: Fleet) -> Array:
        full = np.zeros((fleet.n, fleet.model.n_states))
        n = fleet.model.plant.n_states
        full[:, :n] = [fleet.equilibrium(i) for i in range(fleet.n)]
        return full[:, self._columns]

    def __call__(self, fleet: Fleet) -> Array:
        """Return the commands as shares of the limits, shape (n, n_actuators)."""
        if self._curves:
            self._rest = self._equilibria(fleet)
        deviation = fleet.all_states()[:, self._columns] - self._rest
        moments = (self._past * fleet.model.limits).reshape(fleet.n, -1)
        seen = np.concatenate([deviation, moments], axis=1)
        shares = np.clip(-np.einsum("imn,in->im", self._gains, seen), -1.0, 1.0)
        if self._ages:
            self._past = np.concatenate([shares[:, None], self._past[:, :-1]], axis=1)
        return shares


def _regulator(fleet: Fleet, episode: Episode | None, weights: Weights) -> Regulator:
    assert episode is not None
    own = own_vehicle(fleet.model, episode)
    period = fleet.settings.control_period
    return lqr(own, speed=episode.speed, weights=weights, period=period)


def _past(commands: Sequence[str], ages: int) -> list[str]:
    return [f"{name}[-{age}]" for age in range(1, ages + 1) for name in commands]


def own_vehicle(model: Equipped, episode: Episode) -> Equipped:
    """Return the equipped vehicle of an episode."""
    changed: dict[str, Any] = {
        name: value
        for name, value in episode.plant.parameters.items()
        if value != model.plant.parameters[name]
    }
    return model.replace(**changed) if changed else model
