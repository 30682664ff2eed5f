"""Many hunting vehicles as a Gymnasium vector environment, in the lanes of one kernel."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from railenv import checks
from railenv.envs.environment import TERM_NAMES, History, action_space, numbers_of, observation_space
from railenv.envs.fleet import Fleet, broadcast_options
from railenv.envs.metrics import episode_metrics
from railenv.envs.settings import Plant, Settings, settings
from railenv.envs.showing import Recorder
from railenv.errors import ParameterError, shown
from railenv.kernels import loader

Bools = NDArray[np.bool_]

MOST_ENVIRONMENTS = 2**20
"""Side by side; they take gigabytes."""


class HuntingVectorEnv(VectorEnv[NDArray[np.float32], Any, NDArray[Any]]):
    """Base of the vector environments; keywords, spaces and rewards are those of the single ones.

    Environment ``i`` with the seed ``s`` does what the single environment does with the seed ``s + i``,
    to the bit.

    Parameters
    ----------
    num_envs : int
    render_mode : {"rgb_array"}, optional
    autoreset_mode : AutoresetMode
        What happens at the end of an episode: a reset in the next step (default), in the same, or none.
    max_episode_steps : int, optional
        Truncates episodes before their ``duration`` is over.
    **keywords
        Settings of the environments (:class:`railenv.envs.settings.Settings`).
    """

    metadata: dict[str, Any] = {
        "render_modes": ["rgb_array"],
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }
    plant: ClassVar[Plant]

    def __init__(
        self,
        num_envs: int = 1,
        render_mode: str | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        **keywords: Any,
    ) -> None:
        num_envs = checks.whole("num_envs", num_envs, high=MOST_ENVIRONMENTS)
        if render_mode is not None:
            checks.choice("render_mode", render_mode, ["rgb_array"])
        if max_episode_steps is not None:
            checks.whole("max_episode_steps", max_episode_steps)
        self.settings: Settings = settings(self.plant, keywords)
        self.num_envs = num_envs
        self.render_mode = render_mode
        modes = {mode.value: mode for mode in AutoresetMode}
        key = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        checks.known("autoreset_mode", [key], list(modes))
        self.autoreset_mode = modes[key]
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}
        self._fleet = Fleet(self.settings, self.num_envs, loader.LANES["float64"])
        width = len(self._fleet.observation_names)
        self._history = History(self.num_envs, width, self.settings.history)
        self.single_action_space = action_space(self._fleet)
        self.single_observation_space = observation_space(self._fleet)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._steps = min(self.settings.steps, max_episode_steps or self.settings.steps)
        self._generators: list[np.random.Generator | None] = [None] * self.num_envs
        self._seeded = False
        self._ended = np.ones(self.num_envs, dtype=bool)
        self._idle = np.zeros((self.num_envs, 0))
        fps = self.metadata["render_fps"]
        self._recorders = [
            Recorder(self._fleet, render_mode, fps, i)
            for i in range(self.num_envs if render_mode else 0)
        ]

    @property
    def fleet(self) -> Fleet:
        """State of the vehicles: model, equilibria, moments."""
        return self._fleet

    # ------------------------------------------------------------------ resets

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start new episodes.

        Parameters
        ----------
        seed : int or sequence of int, optional
            Environment i gets ``seed + i``, or the i-th seed.
        options : dict, optional
            Pinned quantities, numbers or arrays of one per environment; ``reset_mask`` (bool array)
            resets only some environments.
        """
        pinned = checks.mapping("options", options)
        rows = np.flatnonzero(self._mask(pinned.pop("reset_mask", None))).tolist()
        seeds = self._seeds(seed)
        for i in rows:
            if seeds[i] is not None or self._generators[i] is None:
                self._generators[i], _ = seeding.np_random(seeds[i])
        self._seeded = all(generator is not None for generator in self._generators)
        self._reset(rows, broadcast_options(pinned, self.num_envs))
        return self._observations(), self._conditions(rows)

    def _mask(self, mask: Any) -> Bools:
        if mask is None:
            return np.ones(self.num_envs, dtype=bool)
        if not (isinstance(mask, np.ndarray) and mask.dtype == bool and mask.shape == (self.num_envs,)):
            raise ParameterError(
                f"reset_mask is {mask!r}; it must be a boolean array of shape ({self.num_envs},)"
            )
        if not mask.any():
            raise ParameterError("reset_mask has no True; at least one environment must be reset")
        return mask

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if not isinstance(seed, (list, tuple, np.ndarray)):
            first = checks.whole("seed", seed, low=0)
            return [first + i for i in range(self.num_envs)]
        seeds: list[int | None] = list(np.atleast_1d(np.asarray(seed, dtype=object)))
        if len(seeds) != self.num_envs:
            raise ParameterError(
                f"seed has {len(seeds)} entries; there are {self.num_envs} environments"
            )
        return [None if one is None else checks.whole("seed", one, low=0) for one in seeds]

    def _reset(self, rows: Any, pinned: Sequence[dict[str, Any]]) -> None:
        drawn = []
        for i in rows:
            generator = self._generators[i]
            assert generator is not None
            drawn.append(self._fleet.draw(generator, pinned[i]))
        for i, (episode, nodes) in zip(rows, drawn, strict=True):  # only when all of them can be
            self._fleet.place(int(i), episode, nodes)
            self._history.reset(i, self._fleet.observations[i])
            if self._recorders:
                self._recorders[i].restart()
        self._ended[rows] = False

    def _conditions(self, rows: Any) -> dict[str, Any]:
        """Conditions of some new episodes, as a vector info."""
        drawn = [self._fleet.episodes[i] for i in rows]
        conditions: dict[str, Any] = {}
        for name in drawn[0].conditions() if drawn and drawn[0] else ():
            values = np.zeros(self.num_envs)
            values[rows] = [episode.conditions()[name] for episode in drawn if episode]
            conditions[name] = values
            conditions[f"_{name}"] = self._only(rows)
        return {"conditions": conditions, "_conditions": self._only(rows)}

    def _only(self, rows: Any) -> Bools:
        mask = np.zeros(self.num_envs, dtype=bool)
        mask[rows] = True
        return mask

    def _observations(self) -> NDArray[np.float32]:
        return self._history.stacked.copy()

    # ------------------------------------------------------------------ steps

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.float32], NDArray[Any], Bools, Bools, dict[str, Any]]:
        """Advance all environments by one control period."""
        fleet = self._fleet
        waiting = self._ended.copy()
        if self.autoreset_mode is not AutoresetMode.NEXT_STEP and waiting.any():
            raise gym.error.ResetNeeded(
                f"environments {np.flatnonzero(waiting).tolist()} have ended; reset them first "
                "(options={'reset_mask': mask})"
            )
        if not self._seeded:
            raise gym.error.ResetNeeded("call reset() before step()")
        commands = self._commands(actions)
        fleet.step(commands)
        self._history.push(fleet.observations)
        running = ~waiting
        terminated = fleet.derailed & running
        truncated = (fleet.steps >= self._steps) & running
        infos: dict[str, Any] = {}
        columns = np.column_stack([fleet.costs, terminated])
        for k, name in enumerate(TERM_NAMES):
            infos[name], infos[f"_{name}"] = columns[:, k] * running, running
        for recorder, command in zip(self._recorders, commands, strict=False):
            recorder.record(command)
        rewards = fleet.rewards * running
        ended = terminated | truncated
        if ended.any():
            self._add_endings(infos, np.flatnonzero(ended), terminated)
        if waiting.any():
            rows = np.flatnonzero(waiting)
            self._reset(rows, [{}] * self.num_envs)
            infos |= self._conditions(rows)
        self._ended[ended] = True
        if ended.any() and self.autoreset_mode is AutoresetMode.SAME_STEP:
            infos = self._final(infos, ended)
            rows = np.flatnonzero(ended)
            self._reset(rows, [{}] * self.num_envs)
            infos |= self._conditions(rows)
        return self._observations(), rewards, terminated, truncated, infos

    def _commands(self, actions: Any) -> NDArray[np.float64]:
        n = self._fleet.n_actuators
        if n == 0:
            return self._idle
        commands = numbers_of(actions)
        if commands is None or commands.shape != (self.num_envs, n):
            raise ParameterError(
                f"actions are {shown(actions)}; they must be finite numbers of shape "
                f"({self.num_envs}, {n})"
            )
        return commands

    def _add_endings(self, infos: dict[str, Any], rows: Any, terminated: Bools) -> None:
        """Add the episodes' metrics and, for derailments, their reasons."""
        found = {i: episode_metrics(self._fleet, int(i)) for i in rows}
        metrics: dict[str, Any] = {}
        for name in found[rows[0]]:
            values = np.zeros(self.num_envs)
            values[rows] = [found[i][name] for i in rows]
            metrics[name], metrics[f"_{name}"] = values, self._only(rows)
        infos["episode_metrics"], infos["_episode_metrics"] = metrics, self._only(rows)
        if terminated.any():
            reasons = np.full(self.num_envs, None, dtype=object)
            for i in np.flatnonzero(terminated):
                reasons[i] = self._fleet.reason(int(i))
            infos["derailed"], infos["_derailed"] = reasons, terminated

    def _final(self, infos: dict[str, Any], ended: Bools) -> dict[str, Any]:
        """Move what belongs to the ended episodes into final_obs and final_info."""
        final_obs = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended):
            final_obs[i] = self._history.stacked[i].copy()
        final_info: dict[str, Any] = {}
        kept: dict[str, Any] = {}
        for name, value in infos.items():
            if name.startswith("_"):
                continue
            mask = infos[f"_{name}"]
            final_info[name], final_info[f"_{name}"] = value, mask & ended
            if (mask & ~ended).any():
                kept[name], kept[f"_{name}"] = value, mask & ~ended
        return {
            **kept,
            "final_obs": final_obs,
            "_final_obs": ended.copy(),
            "final_info": final_info,
            "_final_info": ended.copy(),
        }

    # ------------------------------------------------------------------ the rest

    def episode_metrics(self) -> list[dict[str, float]]:
        """Return the metrics of every environment's episode so far."""
        return [episode_metrics(self._fleet, i) for i in range(self.num_envs)]

    def get_state(self) -> dict[str, Any]:
        """Return everything that changes, for an exact resume with :meth:`set_state`."""
        return {
            "fleet": self._fleet.snapshot(),
            "history": self._history.stacked.copy(),
            "generators": copy.deepcopy(self._generators),
            "ended": self._ended.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state of a vector environment with the same settings and size."""
        self._fleet.restore(state["fleet"])
        self._history.stacked[:] = state["history"]
        self._generators = copy.deepcopy(state["generators"])
        self._seeded = all(generator is not None for generator in self._generators)
        self._ended = state["ended"].copy()
        for recorder in self._recorders:
            recorder.restart()

    def set_speed_range(self, low: float, high: float) -> None:
        """Draw the speeds of later episodes from a part of ``speed_range`` (m/s), as in a curriculum.

        Raises
        ------
        ParameterError
            If it is not within the range that the environment was made with.
        """
        least, most = self.settings.speed_range
        low = checks.number("lowest speed", low, low=least, high=most, unit="m/s")
        high = checks.number("highest speed", high, low=low, high=most, unit="m/s")
        self._fleet.settings = dataclasses.replace(self.settings, speed_range=(low, high))

    def render(self) -> tuple[NDArray[np.uint8] | None, ...] | None:  # type: ignore[override]
        """Draw every environment; needs pygame (extra ``render``)."""
        if self.render_mode is None:
            gym.logger.warn("render() needs a render mode; give render_mode='rgb_array' to make_vec")
            return None
        return tuple(recorder.draw() for recorder in self._recorders)

    def close_extras(self, **kwargs: Any) -> None:  # noqa: D102 - Gymnasium's protocol
        for recorder in self._recorders:
            recorder.close()


class BogieVectorEnv(HuntingVectorEnv):
    """Many bogies; see :class:`railenv.envs.environment.BogieEnv`."""

    plant = "bogie"


class DualWheelsetVectorEnv(HuntingVectorEnv):
    """Many dual wheelsets; see :class:`railenv.envs.environment.DualWheelsetEnv`."""

    plant = "dual_wheelset"


class CoachVectorEnv(HuntingVectorEnv):
    """Many coaches; see :class:`railenv.envs.environment.CoachEnv`."""

    plant = "coach"
