"""An adapter of the vector environments to Stable-Baselines3, which trains on the batch in one process.

Needs the extra ``rl``.

>>> from stable_baselines3 import PPO
>>> from agents.learning.sb3 import HuntingVecEnv
>>> env = HuntingVecEnv.make("railenv/Bogie-v1", num_envs=64, observation="sensors", history=3)
>>> model = PPO("MlpPolicy", env, n_steps=256, batch_size=2048, device="cpu")
"""

from __future__ import annotations

import dataclasses
import functools
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Self

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from railenv.envs.fleet import broadcast_options
from railenv.envs.infos import TERM_NAMES, of_start
from railenv.envs.metrics import episode_metrics
from railenv.envs.settings import Settings
from railenv.envs.vector import HuntingVectorEnv
from railenv.errors import ParameterError
from railenv.extras import require_rl
from railenv.kernels import loader

try:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv
except ImportError:
    require_rl("agents.learning.sb3")
    raise

Indices = int | Iterable[int] | None
"""Selection of environments: one, some, or all."""

METHODS = ("episode_metrics", "get_state", "render", "reset", "set_state")
"""Methods that :meth:`HuntingVecEnv.env_method` calls."""


class HuntingVecEnv(VecEnv):
    """A railenv vector environment as a ``VecEnv``; :meth:`make` makes both.

    Numbers are those of the vector environment; rewards are float32. An environment that ends is reset
    in the same step: the observation returned is the first of the new episode, and the info describes
    the ended one:

    - ``terminal_observation``: its last observation;
    - ``TimeLimit.truncated``: whether it was ended by time, not by a derailment;
    - everything in the last info of a single environment, by the same names: the last step's
      reward terms (``hunting`` and so on), ``derailed``, what had been drawn, and readings of the
      episode (``hunting_amplitude`` and so on);
    - ``episode``: return ``r``, length ``l`` and wall time ``t``, as from ``Monitor``, which makes
      Stable-Baselines3 log mean returns. No ``Monitor`` or ``VecMonitor`` is needed.

    Infos of running environments are empty, unless ``reward_terms`` asks for the terms of every step.

    Parameters
    ----------
    vector_env : HuntingVectorEnv
        Environment made with the autoreset mode SAME_STEP. It then belongs to the adapter.
    reward_terms : bool
        Put the reward's terms into the info of every step.

    Raises
    ------
    ParameterError
        If ``vector_env`` is anything else.
    """

    def __init__(self, vector_env: HuntingVectorEnv, *, reward_terms: bool = False) -> None:
        if not isinstance(vector_env, HuntingVectorEnv):
            raise ParameterError(
                f"vector_env is {vector_env!r}; it must be a railenv vector environment without "
                "wrappers (Stable-Baselines3 has its own)"
            )
        if vector_env.autoreset_mode is not AutoresetMode.SAME_STEP:
            raise ParameterError(
                f"vector_env has the autoreset mode {vector_env.autoreset_mode.value}; make it with "
                "autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP"
            )
        self.vector_env = vector_env
        self.reward_terms = reward_terms
        self._attributes: dict[str, list[Any]] = {}
        self._actions: Any = None
        self._returns = np.zeros(vector_env.num_envs)
        self._lengths = np.zeros(vector_env.num_envs, dtype=np.int64)
        self._started = time.perf_counter()
        super().__init__(
            vector_env.num_envs, vector_env.single_observation_space, vector_env.single_action_space
        )
        self.metadata.update(render_fps=vector_env.metadata["render_fps"])

    @classmethod
    def make(
        cls,
        id: str,
        num_envs: int = 64,
        seed: int | None = None,
        *,
        reward_terms: bool = False,
        **keywords: Any,
    ) -> Self:
        """Return an adapter over a new vector environment.

        Parameters
        ----------
        id : str
            ``"railenv/Bogie-v1"`` or ``"railenv/DualWheelset-v1"``.
        num_envs : int
        seed : int, optional
            Environment i starts from ``seed + i`` at the first reset.
        reward_terms : bool
            Put the reward's terms into the info of every step.
        **keywords
            Settings of the environments (:class:`railenv.envs.settings.Settings`), ``render_mode`` and
            ``max_episode_steps``.

        Raises
        ------
        UnknownKeywordError
            If a keyword is not a setting.
        ParameterError
            If a value is not allowed.
        """
        vector_env: Any = gym.make_vec(
            id, num_envs=num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **keywords
        )
        env = cls(vector_env, reward_terms=reward_terms)
        if seed is not None:
            env.seed(seed)
        return env

    # ------------------------------------------------------------------ resets

    def seed(self, seed: int | None = None) -> list[int]:
        """Set the seeds of the next reset: environment i gets ``seed + i``.

        Parameters
        ----------
        seed : int, optional
            Drawn from the operating system's entropy when left out.

        Returns
        -------
        list of int
            The environments' seeds.
        """
        if seed is None:
            seed = int(np.random.default_rng().integers(2**32 - self.num_envs))
        seeds = [int(seed) + i for i in range(self.num_envs)]
        self._seeds = list(seeds)
        return seeds

    def set_options(self, options: Sequence[dict[str, Any]] | dict[str, Any] | None = None) -> None:
        """Pin quantities in the next reset; later ones draw them again.

        Parameters
        ----------
        options : dict or sequence of dict, optional
            For all environments, with numbers or arrays of one per environment; or one dict for each.

        Raises
        ------
        ParameterError
            If the number of dicts is not that of the environments.
        """
        if options is None or isinstance(options, Mapping):
            self._options = list(broadcast_options(options, self.num_envs))
            return
        if len(options) != self.num_envs:
            raise ParameterError(
                f"options has {len(options)} entries; there are {self.num_envs} environments"
            )
        self._options = [broadcast_options(pinned, 1)[0] for pinned in options]

    def reset(self) -> NDArray[np.float32]:
        """Start new episodes in all environments; their conditions are in ``reset_infos``."""
        observations = self._start(range(self.num_envs), self._seeds, self._options)
        self._reset_seeds()
        self._reset_options()
        return observations

    def _start(
        self,
        rows: Iterable[int],
        seeds: Sequence[int | None],
        options: Sequence[Mapping[str, Any]],
    ) -> NDArray[np.float32]:
        """Reset some environments, those that pin the same quantities together."""
        rows = list(rows)
        groups: dict[tuple[str, ...], list[int]] = {}
        for i in rows:
            groups.setdefault(tuple(sorted(options[i])), []).append(i)
        for names, group in groups.items():
            pinned: dict[str, Any] = {name: np.full(self.num_envs, np.nan) for name in names}
            for name, values in pinned.items():
                values[group] = [options[i][name] for i in group]
            mask = np.zeros(self.num_envs, dtype=bool)
            mask[group] = True
            observations, _ = self.vector_env.reset(
                seed=list(seeds), options={**pinned, "reset_mask": mask}
            )
        self._begin(rows)
        return observations

    def _begin(self, rows: Sequence[int]) -> None:
        """Record the start of episodes."""
        self._returns[rows] = 0.0
        self._lengths[rows] = 0
        for i in rows:
            episode = self.vector_env.fleet.episodes[i]
            assert episode is not None
            self.reset_infos[i] = of_start(episode)

    # ------------------------------------------------------------------ steps

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions of the step that :meth:`step_wait` does."""
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Advance all environments by one control period.

        Returns
        -------
        observations : ndarray, shape (num_envs, m), float32
        rewards : ndarray, shape (num_envs,), float32
        dones : ndarray, shape (num_envs,), bool
        infos : list of dict
        """
        if self._actions is None:
            raise gym.error.NoAsyncCallError("call step_async() before step_wait()", "step")
        actions, self._actions = self._actions, None
        observations, rewards, terminated, truncated, found = self.vector_env.step(actions)
        self._returns += rewards
        self._lengths += 1
        dones = terminated | truncated
        ended = np.flatnonzero(dones).tolist()
        infos: list[dict[str, Any]]
        if self.reward_terms:
            columns = [found[name].tolist() for name in TERM_NAMES]
            infos = [dict(zip(TERM_NAMES, row, strict=True)) for row in zip(*columns, strict=True)]
        else:
            infos = [{} for _ in range(self.num_envs)]
        if ended:
            for i in ended:
                infos[i] = self._last_info(i, found)
                infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
            self._begin(ended)
        return observations, rewards.astype(np.float32), dones, infos

    def _last_info(self, i: int, found: Mapping[str, Any]) -> dict[str, Any]:
        """Return an episode's values from the last step's info."""
        last = found["final_info"]
        info: dict[str, Any] = {name: values[i] for name, values in last.items() if f"_{name}" in last}
        info["terminal_observation"] = found["final_obs"][i]
        info["episode"] = {
            "r": round(float(self._returns[i]), 6),
            "l": int(self._lengths[i]),
            "t": round(time.perf_counter() - self._started, 6),
        }
        return info

    # ------------------------------------------------------------------ exact resume

    def get_state(self) -> dict[str, Any]:
        """Return everything that changes, for an exact resume with :meth:`set_state`."""
        return {
            "vector_env": self.vector_env.get_state(),
            "returns": self._returns.copy(),
            "lengths": self._lengths.copy(),
            "reset_infos": [dict(info) for info in self.reset_infos],
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go back to a state of an adapter with the same settings and size."""
        self.vector_env.set_state(state["vector_env"])
        self._returns, self._lengths = state["returns"].copy(), state["lengths"].copy()
        self.reset_infos = [dict(info) for info in state["reset_infos"]]

    # ------------------------------------------------------------------ single environments

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of some environments, as if each were a single one.

        ``get_state`` returns, and ``set_state`` takes, states of single environments with the same
        settings: an episode can move between a batch and an environment from ``gymnasium.make``.
        ``reset`` starts a new episode, and ``episode_metrics`` and ``render`` show the present one.

        Parameters
        ----------
        method_name : {"episode_metrics", "get_state", "render", "reset", "set_state"}
        *method_args, **method_kwargs
            Arguments, as for the single environment; the same for every environment.
        indices : int or iterable of int, optional
            Selected environments; all when left out.

        Returns
        -------
        list
            One result for each of them.

        Raises
        ------
        AttributeError
            If single environments of a batch have no such method.
        """
        if method_name not in METHODS:
            raise AttributeError(
                f"single environments of a batch have no method {method_name!r}; they have "
                + ", ".join(METHODS)
            )
        rows = self._rows(indices)
        method = getattr(self, f"_rows_{method_name}")
        return method(rows, *method_args, **method_kwargs) if rows else []

    def _rows(self, indices: Indices) -> list[int]:
        if indices is None:
            return list(range(self.num_envs))
        chosen = [indices] if isinstance(indices, (int, np.integer)) else indices
        return [range(self.num_envs)[i] for i in chosen]

    def _rows_reset(
        self, rows: list[int], *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> list[tuple[NDArray[np.float32], dict[str, Any]]]:
        pinned = [*broadcast_options(options, 1)] * self.num_envs
        observations = self._start(rows, [seed] * self.num_envs, pinned)
        return [(observations[i], self.reset_infos[i]) for i in rows]

    def _rows_episode_metrics(self, rows: list[int]) -> list[dict[str, float]]:
        return [episode_metrics(self.vector_env.fleet, i) for i in rows]

    def _rows_render(self, rows: list[int]) -> list[NDArray[np.uint8] | None]:
        images = self.get_images()
        return [images[i] for i in rows]

    def _rows_get_state(self, rows: list[int]) -> list[dict[str, Any]]:
        whole = self.vector_env.get_state()
        return [
            {
                "fleet": {name: _row(name, value, i) for name, value in whole["fleet"].items()},
                "history": whole["history"][i : i + 1].copy(),
                "np_random": whole["generators"][i],
                "np_random_seed": whole["seeds"][i],
                "running": not whole["ended"][i],
                "return": float(self._returns[i]),
            }
            for i in rows
        ]

    def _rows_set_state(self, rows: list[int], state: Mapping[str, Any]) -> list[None]:
        whole = self.vector_env.get_state()
        for i in rows:
            for name, value in whole["fleet"].items():
                _put_row(name, value, i, state["fleet"][name])
            whole["history"][i] = state["history"][0]
            whole["generators"][i] = state["np_random"]
            whole["seeds"][i] = state["np_random_seed"]
            whole["ended"][i] = not state["running"]
        self.vector_env.set_state(whole)  # copies what it keeps
        self._begin(rows)
        self._returns[rows] = state.get("return", 0.0)
        self._lengths[rows] = self.vector_env.fleet.steps[rows]
        return [None] * len(rows)

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Return an attribute of some environments.

        Attributes of the vector environment are the same for all; spaces are those of single
        environments, ``np_random`` are copies of their generators.
        """
        rows = self._rows(indices)
        if attr_name in self._attributes:
            return [self._attributes[attr_name][i] for i in rows]
        if attr_name in METHODS:
            return [functools.partial(self._call, attr_name, i) for i in rows]
        if attr_name == "np_random":
            generators = self.vector_env.get_state()["generators"]
            return [generators[i] for i in rows]
        if attr_name in ("action_space", "observation_space"):
            attr_name = f"single_{attr_name}"
        return [getattr(self.vector_env, attr_name)] * len(rows)

    def _call(self, method_name: str, i: int, *args: Any, **keywords: Any) -> Any:
        (result,) = self.env_method(method_name, *args, indices=i, **keywords)
        return result

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Attach an attribute to some environments, for :meth:`get_attr`; None in the others.

        Raises
        ------
        ParameterError
            If it is one of the environments' own attributes or a setting, which do not change.
        """
        settings = [f.name for f in dataclasses.fields(Settings)]
        if attr_name in settings or hasattr(self.vector_env, attr_name):
            raise ParameterError(
                f"{attr_name} does not change once an environment is made; make another one, or pin "
                "what an episode draws by set_options()"
            )
        values = self._attributes.setdefault(attr_name, [None] * self.num_envs)
        for i in self._rows(indices):
            values[i] = value

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Indices = None
    ) -> list[bool]:
        """Return whether environments are wrapped: never, but infos are like those of ``Monitor``.

        The answer for ``Monitor`` is therefore yes: ``evaluate_policy`` then takes returns from the
        infos, which are those before any normalisation.
        """
        return [wrapper_class is Monitor] * len(self._rows(indices))

    # ------------------------------------------------------------------ pictures, the end

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Draw every environment; needs pygame (extra ``render``) and the render mode rgb_array."""
        images = self.vector_env.render() if self.render_mode == "rgb_array" else None
        if images is None:
            warnings.warn(
                "there are no images without a render mode; give render_mode='rgb_array' to make",
                stacklevel=2,
            )
            return [None] * self.num_envs
        return images

    def close(self) -> None:
        """Close the vector environment; a second time does nothing."""
        self.vector_env.close()


# In the lane kernel's buffers, values of one environment are spread over a block; everything else in a
# fleet's snapshot has one entry per environment.
_BLOCKS = ("_blocks", "_extras")


def _row(name: str, value: Any, i: int) -> Any:
    """Return one environment's part of a fleet's snapshot, as of a fleet of one."""
    if name not in _BLOCKS:
        return value[i : i + 1] if isinstance(value, list) else value[i : i + 1].copy()
    lanes = loader.LANES["float64"]
    block, lane = divmod(i, lanes)
    return value[block].reshape(-1, lanes)[None, :, lane].copy()


def _put_row(name: str, value: Any, i: int, given: Any) -> None:
    """Write one environment's part of a fleet's snapshot."""
    own = _row(name, value, i)
    if getattr(own, "shape", 0) != getattr(given, "shape", 0):
        raise ParameterError(
            f"the state given has another {name} than this environment; it must come from one with "
            "the same settings"
        )
    if name in _BLOCKS:
        lanes = loader.LANES["float64"]
        block, lane = divmod(i, lanes)
        value[block].reshape(-1, lanes)[:, lane] = given[0]
    else:
        value[i] = given[0]
