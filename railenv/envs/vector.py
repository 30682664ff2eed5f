"""Many hunting vehicles as a Gymnasium vector environment, in the lanes of one kernel."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from railenv import checks
from railenv.envs import infos
from railenv.envs.environment import History, action_space, numbers_of, observation_space
from railenv.envs.fleet import Fleet, broadcast_options
from railenv.envs.metrics import episode_metrics
from railenv.envs.settings import Plant, Settings, settings
from railenv.envs.showing import film_rate
from railenv.envs.specs import described
from railenv.envs.views import Views
from railenv.errors import ParameterError, shown
from railenv.kernels import loader

Bools = NDArray[np.bool_]

LARGEST_SEED = 2**128 - 1
"""Largest seed; those that NumPy draws from the operating system's entropy have as many bits."""

MOST_ENVIRONMENTS = 2**20
"""Largest number of environments side by side; they take gigabytes."""


_GymnasiumsVectorEnv = VectorEnv[NDArray[np.float32], Any, NDArray[Any]]


class HuntingVectorEnv(VectorEnv[NDArray[np.float32], Any, NDArray[Any]]):
    """Base of the vector environments; keywords, spaces and rewards are those of the single ones.

    Environment ``i`` with the seed ``s`` does what the single environment does with the seed ``s + i``,
    to the bit.

    Parameters
    ----------
    num_envs : int
    render_mode : {"rgb_array", "rgb_array_list"}, optional
        A picture of every environment, or the pictures of all steps since the last call.
    autoreset_mode : AutoresetMode
        What happens at the end of an episode: a reset in the next step (default), in the same, or none.
    max_episode_steps : int, optional
        Truncates episodes before their ``duration`` is over.
    **keywords
        Settings of the environments (:class:`railenv.envs.settings.Settings`).
    """

    metadata: dict[str, Any] = {
        "render_modes": ["rgb_array", "rgb_array_list"],
        "render_fps": 200,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }
    plant: ClassVar[Plant]
    _spec: EnvSpec | None = None

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
            checks.choice("render_mode", render_mode, self.metadata["render_modes"])
        if max_episode_steps is not None:
            checks.whole("max_episode_steps", max_episode_steps)
        self.settings: Settings = settings(self.plant, keywords)
        infos.check_names(self.settings)
        self.num_envs = num_envs
        self.render_mode = render_mode
        modes = {mode.value: mode for mode in AutoresetMode}
        key = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        checks.known("autoreset_mode", [key], list(modes))
        self.autoreset_mode = modes[key]
        rate = film_rate(self.settings.control_period)
        modes_of_this = {"render_fps": rate, "autoreset_mode": self.autoreset_mode}
        self.metadata = {**type(self).metadata, **modes_of_this}
        self._fleet = Fleet(self.settings, self.num_envs, loader.LANES["float64"])
        width = len(self._fleet.observation_names)
        self._history = History(self.num_envs, width, self.settings.history)
        self.single_action_space = action_space(self._fleet)
        self.single_observation_space = observation_space(self._fleet)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._steps = min(self.settings.steps, max_episode_steps or self.settings.steps)
        self._generators: list[np.random.Generator | None] = [None] * self.num_envs
        self._seeds_used: list[int | None] = [None] * self.num_envs
        self._seeded = False
        self._infos = infos.Columns(self.settings, self.num_envs)
        self._ended = np.ones(self.num_envs, dtype=bool)
        self._idle = np.zeros((self.num_envs, 0))
        self._views = Views(self._fleet, render_mode)

    @property
    def spec(self) -> EnvSpec | None:
        """Spec from which Gymnasium remakes this environment, in plain values for JSON."""
        return self._spec

    @spec.setter
    def spec(self, given: EnvSpec | None) -> None:
        self._spec = None if given is None else described(given, self._steps)

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
                self._generators[i], self._seeds_used[i] = seeding.np_random(seeds[i])
        self._seeded = all(generator is not None for generator in self._generators)
        self._reset(rows, broadcast_options(pinned, self.num_envs))
        whole = len(rows) == self.num_envs
        return self._observations(), self._infos.infos(None if whole else rows)

    def _generate(self) -> None:
        """Make the missing generators."""
        for i, generator in enumerate(self._generators):
            if generator is None:
                self._generators[i], self._seeds_used[i] = seeding.np_random()

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The environments' random generators."""
        self._generate()
        return tuple(generator for generator in self._generators if generator is not None)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The seeds that they started from."""
        self._generate()
        return tuple(seed for seed in self._seeds_used if seed is not None)

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
            first = checks.whole("seed", seed, low=0, high=LARGEST_SEED)
            return [first + i for i in range(self.num_envs)]
        seeds: list[int | None] = list(np.atleast_1d(np.asarray(seed, dtype=object)))
        if len(seeds) != self.num_envs:
            raise ParameterError(
                f"seed has {len(seeds)} entries; there are {self.num_envs} environments"
            )
        return [
            None if one is None else checks.whole("seed", one, low=0, high=LARGEST_SEED)
            for one in seeds
        ]

    def _reset(self, rows: Any, pinned: Sequence[dict[str, Any]]) -> None:
        drawn = []
        for i in rows:
            generator = self._generators[i]
            assert generator is not None
            drawn.append(self._fleet.draw(generator, pinned[i]))
        for i, (episode, nodes) in zip(rows, drawn, strict=True):  # only if all of them can be
            self._fleet.place(int(i), episode, nodes)
            self._history.reset(i, self._fleet.observations[i])
            self._infos.start(int(i), episode)
        self._ended[rows] = False
        self._views.restart(rows)

    def _observations(self) -> NDArray[np.float32]:
        return self._history.stacked.copy()

    # ------------------------------------------------------------------ steps

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.float32], NDArray[Any], Bools, Bools, dict[str, Any]]:
        """Advance all environments by one control period."""
        fleet = self._fleet
        waiting = self._ended.nonzero()[0]
        if waiting.size and self.autoreset_mode is not AutoresetMode.NEXT_STEP:
            raise gym.error.ResetNeeded(
                f"environments {waiting.tolist()} have ended; reset them first "
                "(options={'reset_mask': mask})"
            )
        if not self._seeded:
            raise gym.error.ResetNeeded("call reset() before step()")
        commands = self._commands(actions)
        fleet.step(commands)
        self._history.push(fleet.observations)
        terms = fleet.terms
        rewards = fleet.rewards.copy()
        terminated = fleet.derailed
        truncated = fleet.steps >= self._steps
        if waiting.size:
            rewards[waiting], terminated[waiting], truncated[waiting] = 0.0, False, False
        self._infos.step(terms, terminated)
        self._views.record(commands, waiting)
        ended = terminated | truncated
        rows = ended.nonzero()[0]
        for i in rows.tolist():
            self._infos.end(i, episode_metrics(fleet, i))
        if waiting.size:
            self._reset(waiting, [{}] * self.num_envs)
        final: dict[str, Any] = {}
        if rows.size:
            self._ended[rows] = True
            if self.autoreset_mode is AutoresetMode.SAME_STEP:
                final = self._final(rows, ended)
                self._reset(rows, [{}] * self.num_envs)
        found = self._infos.infos()
        found.update(final)
        return self._observations(), rewards, terminated, truncated, found

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

    def _final(self, rows: NDArray[np.int_], ended: Bools) -> dict[str, Any]:
        """Return final_obs and final_info of the episodes that end in this step."""
        final_obs = np.full(self.num_envs, None, dtype=object)
        for i in rows:
            final_obs[i] = self._history.stacked[i].copy()
        return {
            "final_obs": final_obs,
            "_final_obs": ended.copy(),
            "final_info": self._infos.infos(rows),
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
            "seeds": list(self._seeds_used),
            "ended": self._ended.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state of a vector environment with the same settings and size."""
        self._fleet.restore(state["fleet"])
        self._history.stacked[:] = state["history"]
        self._generators = copy.deepcopy(state["generators"])
        self._seeds_used = list(state["seeds"])
        self._seeded = all(generator is not None for generator in self._generators)
        self._ended = state["ended"].copy()
        for i, episode in enumerate(self._fleet.episodes):
            if episode is not None:
                self._infos.start(i, episode)
        self._views.forget()

    def set_speed_range(self, low: float, high: float) -> None:
        """Draw the speeds of later episodes from a part of ``speed_range`` (m/s), as in a curriculum.

        Raises
        ------
        ParameterError
            If it is not within the range with which the environment was made.
        """
        least, most = self.settings.speed_range
        low = checks.number("lowest speed", low, low=least, high=most, unit="m/s")
        high = checks.number("highest speed", high, low=low, high=most, unit="m/s")
        self._fleet.settings = dataclasses.replace(self.settings, speed_range=(low, high))

    def render(self) -> tuple[Any, ...] | None:
        """Draw every environment; needs pygame (extra ``render``).

        Returns
        -------
        tuple or None
            A picture (height, width, 3) of each environment; with ``rgb_array_list`` a list of those
            of its steps since the last call, or since its reset.

        Raises
        ------
        gymnasium.error.ResetNeeded
            If they have not been reset yet.
        """
        if self.render_mode is None:
            gym.logger.warn("render() needs a render mode; give render_mode='rgb_array' to make_vec")
            return None
        return self._views.draw()

    def call(self, name: str, *args: Any, **keywords: Any) -> tuple[Any, ...]:
        """Call a method of every environment, or get an attribute, as ``SyncVectorEnv`` does.

        Parameters
        ----------
        name : str
            ``episode_metrics``, ``render``, or an attribute; those of the vector environment are the
            same for all, spaces are those of single environments.
        *args, **keywords
            Arguments of the method.

        Raises
        ------
        AttributeError
            If single environments of a batch have no such method or attribute.
        """
        if name in ("action_space", "observation_space"):
            name = f"single_{name}"
        found = getattr(self, name)
        if name in ("episode_metrics", "render"):
            results = found(*args, **keywords)
            return (None,) * self.num_envs if results is None else tuple(results)
        if callable(found):
            raise AttributeError(
                f"single environments of a batch have no method {name!r}; they have episode_metrics "
                "and render"
            )
        return found if name in ("np_random", "np_random_seed") else (found,) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of every environment (see :meth:`call`)."""
        return self.call(name)

    def close_extras(self, **kwargs: Any) -> None:  # noqa: D102 - Gymnasium's protocol
        self._views.close()


class BogieVectorEnv(HuntingVectorEnv, _GymnasiumsVectorEnv):
    """Many bogies; see :class:`railenv.envs.environment.BogieEnv`."""

    plant = "bogie"


class DualWheelsetVectorEnv(HuntingVectorEnv, _GymnasiumsVectorEnv):
    """Many dual wheelsets; see :class:`railenv.envs.environment.DualWheelsetEnv`."""

    plant = "dual_wheelset"


class CoachVectorEnv(HuntingVectorEnv, _GymnasiumsVectorEnv):
    """Many coaches; see :class:`railenv.envs.environment.CoachEnv`."""

    plant = "coach"
