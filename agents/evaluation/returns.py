"""Returns of a controller in an environment, over a fixed set of episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from railenv import checks
from railenv.envs.fleet import Fleet
from railenv.envs.vector import HuntingVectorEnv
from railenv.errors import ParameterError

Array = NDArray[np.float64]


class Player(Protocol):
    """A controller of the vehicles of a fleet."""

    def __call__(self, fleet: Fleet) -> NDArray[np.floating[Any]]:
        """Return the commands as shares of the limits, shape (n, n_actuators)."""


@dataclass(frozen=True)
class Returns:
    """Returns of some episodes.

    Attributes
    ----------
    values : ndarray, shape (episodes,)
        Sums of the rewards.
    derailed : ndarray of bool, shape (episodes,)
    steps : int
        Control steps of a whole episode, which is also the largest possible return.
    """

    values: Array
    derailed: NDArray[np.bool_]
    steps: int

    @property
    def mean(self) -> float:
        """Mean return."""
        return float(self.values.mean())

    def __str__(self) -> str:
        return (
            f"mean return {self.mean:.1f} of at most {self.steps} over {len(self.values)} episodes, "
            f"{self.derailed.mean():.0%} derailed"
        )


def episode_returns(
    env_id: str,
    controller: Controller | Callable[[Fleet], Player] | None = None,
    *,
    episodes: int = 64,
    seed: int = 0,
    env_kwargs: Mapping[str, Any] | None = None,
) -> Returns:
    """Run a controller in an environment, an episode for each of some seeds.

    Parameters
    ----------
    env_id : str
    controller : Controller or callable, optional
        None commands nothing. A callable takes the fleet after its reset and returns its controller,
        which may use more information than observations contain.
    episodes : int
        Number of episodes, side by side.
    seed : int
        Seed of the first; episode i is the environment's episode for ``seed + i``.
    env_kwargs : mapping, optional
        Keywords of the environment.

    Raises
    ------
    ParameterError
        If the controller's readings or commands are not those of the environment.
    """
    checks.whole("episodes", episodes)
    checks.whole("seed", seed, low=0)
    keywords = {"history": 0, **checks.mapping("env_kwargs", env_kwargs)}
    if isinstance(controller, Controller):
        told = any(reading.drawn for reading in getattr(controller, "readings", ()))
        keywords |= {"observation": controller.observation, "context": told}
    elif controller is not None:
        keywords |= {"observation": "state", "context": False}
    env: Any = gym.make_vec(
        env_id, num_envs=episodes, autoreset_mode=AutoresetMode.SAME_STEP, **keywords
    )
    env.reset(seed=seed)
    returns, derailed = _run(env, _player(controller, env.fleet))
    return Returns(returns, derailed, env.settings.steps)


def _player(controller: Controller | Callable[[Fleet], Player] | None, fleet: Fleet) -> Player:
    if controller is None:
        return lambda fleet: np.zeros((fleet.n, fleet.n_actuators))
    if not isinstance(controller, Controller):
        return controller(fleet)
    check_reads(controller, fleet)
    controller.reset(fleet.n)
    return lambda fleet: controller.act(fleet.observations)


def check_reads(controller: Controller, fleet: Fleet) -> None:
    """Raise ParameterError if a controller declares other actuators or sensors."""
    model = fleet.model
    commands = tuple(getattr(controller, "commands", model.command_names))
    own = [reading.name for reading in fleet.observation_table]
    reads = [reading.name for reading in getattr(controller, "readings", fleet.observation_table)]
    if commands != model.command_names or reads != own:
        raise ParameterError(
            f"{controller.name} commands {', '.join(commands)} and reads {', '.join(reads)}; "
            f"{model.name} has {', '.join(model.command_names) or 'no commands'}, and there is "
            f"{', '.join(own)} to read"
        )


def _run(env: HuntingVectorEnv, player: Player) -> tuple[Array, NDArray[np.bool_]]:
    """Sum up rewards until every environment's first episode has ended."""
    running = np.ones(env.num_envs, dtype=bool)
    returns, derailed = np.zeros(env.num_envs), np.zeros(env.num_envs, dtype=bool)
    while running.any():
        _, rewards, terminated, truncated, _ = env.step(player(env.fleet))
        returns[running] += rewards[running]
        derailed |= running & terminated
        running &= ~(terminated | truncated)
    return returns, derailed
