"""The environment for Stable-Baselines3 with a memory and a base controller around the vehicle.

Needs the extra ``rl``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper

from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.scheduled import ScheduledController
from agents.learning.sb3 import HuntingVecEnv
from railenv import checks
from railenv.envs.fleet import BOUND
from railenv.errors import ParameterError


class MemoryVecEnv(VecEnvWrapper):
    """Environments with a memory's features in observations and actions on top of a base controller's.

    Parameters
    ----------
    venv : HuntingVecEnv
    memory : MemorySettings
        Settings; ``history`` must be that of the environment.
    base : ScheduledController, optional
        Controller that acts on every vehicle; the action is added to its command.
    authority : float
        Share of the limit that an action of 1 adds.

    Raises
    ------
    ParameterError
        If there are no actuators, or ``history`` differs.
    """

    def __init__(
        self,
        venv: HuntingVecEnv,
        memory: MemorySettings,
        base: ScheduledController | None = None,
        authority: float = 1.0,
    ) -> None:
        fleet = venv.vector_env.fleet
        if not fleet.n_actuators:
            raise ParameterError("the environment has no actuators; there is nothing to learn")
        if memory.history != fleet.settings.history:
            raise ParameterError(
                f"history of the memory is {memory.history}, that of the environment "
                f"{fleet.settings.history}; they must be the same"
            )
        self.hunting = venv
        self.authority = checks.number("authority", authority, low=0.0, high=1.0, open_low=True)
        self.memory = Memory(
            memory,
            fleet.observation_table,
            fleet.model.command_names,
            fleet.settings.control_period,
            base,
        )
        self._width = len(fleet.observation_names)
        size = self._width * (memory.history + 1) + len(self.memory.names)
        super().__init__(venv, spaces.Box(-BOUND, BOUND, (size,), np.float32))

    def reset(self) -> NDArray[np.float32]:
        """Start new episodes in all environments."""
        observations = np.asarray(self.venv.reset())
        self.memory.reset(self.num_envs)
        return self._joined(observations)

    def _joined(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        features = self.memory.features(observations[:, : self._width])
        return np.concatenate([observations, features.astype(np.float32)], axis=1)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Command the sum of base and action."""
        asked = np.clip(np.asarray(actions, dtype=float), -1.0, 1.0)
        shares = np.clip(self.memory.demand + self.authority * asked, -1.0, 1.0)
        self.memory.advance(shares)
        self.venv.step_async(shares)

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Advance all environments by one control period."""
        observations, rewards, dones, infos = self.venv.step_wait()
        first: NDArray[np.float32] = np.asarray(observations)
        if dones.any():
            last = first.copy()
            for i in np.flatnonzero(dones):
                last[i] = infos[i]["terminal_observation"]
            joined = self._joined(last)
            for i in np.flatnonzero(dones):
                infos[i]["terminal_observation"] = joined[i]
            self.memory.reset_rows(dones)
        return self._joined(first), rewards, dones, infos
