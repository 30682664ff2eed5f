"""Reading the actor of a Stable-Baselines3 model as plain arrays; needs the extra ``rl``."""

from __future__ import annotations

import pickle
import zipfile
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import Env
from sb3_contrib import TQC
from stable_baselines3 import A2C, DDPG, PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.network import Network, Normalization
from railenv import checks
from railenv.envs.environment import HuntingEnv
from railenv.envs.fleet import Fleet
from railenv.envs.vector import HuntingVectorEnv
from railenv.errors import ParameterError

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "ppo": PPO,
    "a2c": A2C,
    "sac": SAC,
    "tqc": TQC,
    "td3": TD3,
    "ddpg": DDPG,
}

_ACTIVATIONS = {nn.Tanh: "tanh", nn.ReLU: "relu", nn.ELU: "elu"}


def policy_parts(model: Any, vecnormalize: Any, env: Any) -> dict[str, Any]:
    """Return the fields of a :class:`agents.LearnedPolicy`; see ``LearnedPolicy.from_sb3``."""
    inner: Any = env
    while isinstance(inner, VecNormalize):
        inner = inner.venv
    memory, base, authority = MemorySettings(), None, 1.0
    if isinstance(getattr(inner, "memory", None), Memory):  # a MemoryVecEnv
        memory, base, authority = inner.memory.settings, inner.memory.base, inner.authority
        fleet = inner.hunting.vector_env.fleet
    else:
        fleet = _fleet(inner)
        memory = MemorySettings(history=fleet.settings.history)
    loaded = model if isinstance(model, BaseAlgorithm) else _read(model)
    layers, squash = _actor(loaded.policy)
    weights, biases, activation, signs = _arrays(layers)
    network = Network(
        weights,
        biases,
        activation,  # type: ignore[arg-type]
        "tanh" if squash else "none",
        _normalization(vecnormalize, weights[0].shape[1]),
        signs,
    )
    return {
        "network": network,
        "readings": tuple(fleet.observation_table),
        "commands": tuple(fleet.model.command_names),
        "limit": fleet.model.limits,
        "observation": fleet.settings.observation,
        "memory": memory,
        "base": base,
        "authority": authority,
        "period": fleet.settings.control_period,
    }


def _fleet(env: Any) -> Fleet:
    vector = getattr(env, "vector_env", None)  # of a HuntingVecEnv
    if isinstance(vector, HuntingVectorEnv):
        return vector.fleet
    inner = env.unwrapped if isinstance(env, Env) else env
    if isinstance(inner, (HuntingEnv, HuntingVectorEnv)):
        return inner.fleet
    raise ParameterError(
        f"env is {env!r}; it must be a railenv environment, a HuntingVecEnv or a MemoryVecEnv"
    )


def _read(path: str | PathLike[str]) -> BaseAlgorithm:
    """Read a model; its file does not name its algorithm, but its content identifies it."""
    try:
        data, _, _ = load_from_zip_file(Path(path), device="cpu", load_data=True)
    except (ValueError, zipfile.BadZipFile) as e:
        raise ParameterError(f"{path} is not a model of Stable-Baselines3: {e}") from None
    if data is None:
        raise ParameterError(f"{path} is not a model of Stable-Baselines3: it has no data")
    kind = "ppo"
    if "top_quantiles_to_drop_per_net" in data:
        kind = "tqc"
    elif "target_entropy" in data:
        kind = "sac"
    elif "policy_delay" in data:
        kind = "td3"
    elif "clip_range" not in data:
        kind = "a2c"
    return ALGORITHMS[kind].load(Path(path), device="cpu")


def _actor(policy: Any) -> tuple[list[nn.Module], bool]:
    """Return the actor's modules in their order, and whether a tanh follows them."""
    if hasattr(policy, "mlp_extractor"):
        if getattr(policy, "squash_output", False):
            raise ParameterError("policies of PPO with squash_output cannot be read")
        return [policy.mlp_extractor.policy_net, policy.action_net], False
    actor: Any = getattr(policy, "actor", None)
    if hasattr(actor, "odd"):
        return [actor.odd, actor.mu], True
    if hasattr(actor, "latent_pi"):
        return [actor.latent_pi, actor.mu], True
    if hasattr(actor, "mu"):
        *layers, last = actor.mu
        if isinstance(last, nn.Tanh):
            return list(layers), True
    raise ParameterError(f"the actor of {type(policy).__name__} cannot be read; use MlpPolicy")


def _arrays(
    modules: list[nn.Module],
) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...], str, np.ndarray | None]:
    """Return weights, biases, activation and signs."""
    flat: list[nn.Module] = []
    signs = None
    for module in modules:
        given = getattr(module, "signs", None)
        if isinstance(given, torch.Tensor):  # a network made odd
            signs = given.detach().cpu().numpy().astype(float)
            module = module.net  # type: ignore[assignment]
        flat += list(module) if isinstance(module, nn.Sequential) else [module]
    linear = [m for m in flat if isinstance(m, nn.Linear)]
    others = [m for m in flat if not isinstance(m, nn.Linear)]
    kinds = {type(m) for m in others}
    orderly = all(isinstance(m, nn.Linear) == (k % 2 == 0) for k, m in enumerate(flat))
    if not orderly or len(kinds) > 1 or not kinds <= set(_ACTIVATIONS):
        raise ParameterError(
            f"the actor has the layers {[type(m).__name__ for m in flat]}; linear layers must "
            f"alternate with one of {sorted(_ACTIVATIONS.values())}"
        )

    def plain(tensor: torch.Tensor) -> np.ndarray:
        return tensor.detach().cpu().numpy().astype(float)

    activation = _ACTIVATIONS[next(iter(kinds))] if kinds else "tanh"
    return (
        tuple(plain(m.weight) for m in linear),
        tuple(plain(m.bias) for m in linear),
        activation,
        signs,
    )


def _normalization(vecnormalize: Any, width: int) -> Normalization:
    found = vecnormalize
    if isinstance(vecnormalize, (str, PathLike)):
        try:
            with open(vecnormalize, "rb") as file:
                found = pickle.load(file)
        except (pickle.UnpicklingError, EOFError, AttributeError) as e:
            raise ParameterError(f"{vecnormalize} is not a saved VecNormalize: {e}") from None
    if found is None:
        return Normalization(np.zeros(width), np.ones(width), 1e9)
    if not isinstance(found, VecNormalize):
        raise ParameterError(f"vecnormalize is {found!r}; it must be a VecNormalize, its file or None")
    if not found.norm_obs:
        return Normalization(np.zeros(width), np.ones(width), 1e9)
    statistics: Any = found.obs_rms
    checks.known("number of observations", [str(len(statistics.mean))], [str(width)])
    scale = np.sqrt(statistics.var + found.epsilon)
    return Normalization(statistics.mean.copy(), scale, float(found.clip_obs))
