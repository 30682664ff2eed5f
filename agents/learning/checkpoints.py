"""Checkpoints of a training run, from which it continues as if it had never stopped.

They hold everything that changes: networks and optimisers, normalisation, replay buffer, the vehicles'
states and random generators, those of torch, NumPy and Python, and the counts of the callback. They
contain pickles: open only your own. The hashes of their files are kept with them, so that damaged ones
are not opened. This module needs the extra ``rl``.
"""

from __future__ import annotations

import copy
import hashlib
import json
import os
import pickle
import random
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from agents.learning.memory_env import MemoryVecEnv
from railenv.errors import ParameterError

KEPT = 2
"""Number of checkpoints kept."""

_FOLDER = "checkpoints"
_PARTIAL = ".partial-"
_HASHES = "hashes.json"


def save(directory: Path, model: BaseAlgorithm, env: MemoryVecEnv, counted: dict[str, Any]) -> Path:
    """Write a checkpoint, whole or not at all, and remove old ones.

    Parameters
    ----------
    directory : Path
        Directory of the run.
    model : BaseAlgorithm
        The model, between rollouts.
    env : MemoryVecEnv
        Its environment, without normalisation.
    counted : dict
        Counts of the callback.
    """
    folder = directory / _FOLDER
    folder.mkdir(exist_ok=True)
    for left in folder.glob(f"{_PARTIAL}*"):  # of runs that were killed while writing
        shutil.rmtree(left)
    partial = Path(tempfile.mkdtemp(prefix=_PARTIAL, dir=folder))
    model.save(partial / "model.zip")
    if isinstance(model, OffPolicyAlgorithm):
        model.save_replay_buffer(partial / "replay.pkl")
    with open(partial / "state.pkl", "wb") as file:
        pickle.dump(_state(model, env, counted), file)
    (partial / _HASHES).write_text(json.dumps(_hashes(partial)), encoding="utf-8")
    target = folder / f"{model.num_timesteps:012d}"
    if target.exists():
        shutil.rmtree(target)
    os.replace(partial, target)
    for old in _complete(folder)[:-KEPT]:
        shutil.rmtree(old)
    return target


def latest(directory: Path) -> Path:
    """Return the last checkpoint of a run.

    Raises
    ------
    ParameterError
        If there is no checkpoint.
    """
    found = _complete(directory / _FOLDER)
    if not found:
        raise ParameterError(f"{directory} has no checkpoint to resume from")
    return found[-1]


def _complete(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if path.name.isdigit())


def _state(model: BaseAlgorithm, env: MemoryVecEnv, counted: dict[str, Any]) -> dict[str, Any]:
    normalizer = model.get_vec_normalize_env()
    return {
        "counted": counted,
        "vehicles": env.hunting.get_state(),
        "memory": env.memory,
        "normalizer": normalizer,
        "returns": None if normalizer is None else normalizer.returns,
        "action_space": model.action_space,
        "python": random.getstate(),
        "numpy": np.random.get_state(),  # noqa: NPY002 - Stable-Baselines3 uses the global one
        "torch": torch.get_rng_state(),
        "cuda": torch.cuda.get_rng_state_all() if torch.cuda.is_available() else [],
    }


def check(path: Path) -> None:
    """Raise ParameterError if a checkpoint has changed since it was written."""
    try:
        kept = json.loads((path / _HASHES).read_text(encoding="utf-8"))
        whole = kept == _hashes(path) and "model.zip" in kept
    except (OSError, ValueError):
        whole = False
    if not whole:
        raise ParameterError(
            f"checkpoint {path} is damaged; delete that folder to go on from the one before it"
        )


def _hashes(folder: Path) -> dict[str, str]:
    """Return the hash of every file of a checkpoint."""
    found = {}
    for path in sorted(folder.iterdir()):
        if path.name != _HASHES:
            with path.open("rb") as file:
                found[path.name] = hashlib.file_digest(file, "sha256").hexdigest()
    return found


def load(
    path: Path, kind: type[BaseAlgorithm], env: MemoryVecEnv, device: str
) -> tuple[BaseAlgorithm, dict[str, Any]]:
    """Return the model of a checkpoint in a restored environment, and the counts.

    Raises
    ------
    ParameterError
        If a file of it is damaged.
    """
    check(path)
    with open(path / "state.pkl", "rb") as file:
        state = pickle.load(file)
    venv: Any = env
    if state["normalizer"] is not None:
        venv = state["normalizer"]
        venv.set_venv(env)
    model = kind.load(path / "model.zip", env=venv, device=device, force_reset=False)
    if isinstance(model, OffPolicyAlgorithm):
        model.load_replay_buffer(path / "replay.pkl")
    env.hunting.set_state(state["vehicles"])
    env.memory = state["memory"]
    if isinstance(venv, VecNormalize):
        venv.returns = state["returns"]
    # last, because loading a model seeds every generator
    model.action_space = copy.deepcopy(state["action_space"])
    random.setstate(state["python"])
    np.random.set_state(state["numpy"])  # noqa: NPY002
    torch.set_rng_state(state["torch"])
    if state["cuda"]:
        torch.cuda.set_rng_state_all(state["cuda"])
    return model, state["counted"]
