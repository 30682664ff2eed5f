"""Recipes of training runs: all settings, checked, from YAML files or keywords.

The files have the form of rl-zoo3's: one for each algorithm, an entry for each environment, whose keys
are either those below or keywords of the algorithm.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args

from agents.controllers.memory import MemorySettings
from railenv import checks
from railenv.errors import MissingPackageError, ParameterError, shown
from railenv.extras import require
from railenv.tasks import TASKS

Algorithm = Literal["ppo", "sac", "td3", "tqc"]
Criterion = Literal["critical_speed", "robust_critical_speed", "return"]

Normalized = Literal["rewards", "observations"]

ENVIRONMENTS = tuple(task.id for task in TASKS)
"""Environments in which policies can be trained."""


@dataclass(frozen=True)
class Curriculum:
    """Speeds that widen from the slow end of the environment's range during training.

    Attributes
    ----------
    start : float
        Highest speed at first, m/s.
    by : {"progress", "success"}
        Widen evenly over a ``share`` of the training, or by ``step`` whenever enough episodes since the
        last widening ended without derailment.
    share : float
        Share of the training after which the whole range is used (``progress``).
    step : float
        Widening, m/s (``success``).
    threshold : float
        Share of episodes without derailment (``success``).
    episodes : int
        Number of episodes that are judged (``success``).
    """

    start: float
    by: Literal["progress", "success"] = "progress"
    share: float = 0.5
    step: float = 5.0
    threshold: float = 0.9
    episodes: int = 100

    def __post_init__(self) -> None:
        checks.speed(self.start, "start of the curriculum")
        checks.known("curriculum by", [self.by], ["progress", "success"])
        checks.number("share of the curriculum", self.share, low=0.0, high=1.0, open_low=True)
        checks.number("step of the curriculum", self.step, low=0.0, open_low=True, unit="m/s")
        checks.number("threshold of the curriculum", self.threshold, low=0.0, high=1.0)
        checks.whole("episodes of the curriculum", self.episodes)


@dataclass(frozen=True)
class Evaluation:
    """Evaluations of the policy during training, in a separate environment.

    Attributes
    ----------
    every : int
        Environment steps between evaluations, rounded up to whole rollouts; 0 never evaluates.
    episodes : int
        Number of episodes, always the same ones.
    seed : int
        Seed of the first; episode i has ``seed + i``.
    criterion : {"critical_speed", "robust_critical_speed", "return"}
        Criterion of the best policy: linear critical speed on tangent track, from 20 m/s up to the
        highest speed trained, or its lowest value over the corners of ``randomize``, with ties decided
        by the mean return; or the mean return alone.
    env_kwargs : mapping
        Changes of the environment's keywords for evaluation.
    """

    every: int = 100_000
    episodes: int = 32
    seed: int = 1_000_000
    criterion: Criterion = "critical_speed"
    env_kwargs: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        checks.whole("steps between evaluations", self.every, low=0)
        checks.whole("episodes of an evaluation", self.episodes)
        checks.whole("seed of the evaluation", self.seed, low=0)
        checks.known("criterion", [self.criterion], get_args(Criterion))
        if not isinstance(self.env_kwargs, Mapping):
            raise ParameterError(
                f"env_kwargs of the evaluation is {shown(self.env_kwargs)}; it must be a mapping"
            )


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A training run.

    Attributes
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    env_id : str
        One of the registered tasks (:data:`railenv.tasks.TASKS`).
    n_timesteps : int
        Number of environment steps.
    seed : int
    n_envs : int
        Number of vehicles side by side.
    device : str
        torch's name of the device that trains the network: ``"cpu"``, ``"cuda"`` or ``"auto"``.
    threads : int
        Number of torch's threads on the processor, for the whole process; small networks are fastest
        with one. 0 leaves it to torch.
    symmetric : bool
        Whether the policy is odd under mirror symmetry by construction.
    normalize : {False, "rewards", "observations", True}
        Quantities normalised by running statistics; True is both. Observations already have a scale:
        normalised by their size in strong hunting they are small near the equilibrium, where policies
        then tend to be unstable.
    env_kwargs : mapping
        Changes of the task's keywords, as plain values.
    memory : MemorySettings
        Memory; ``history`` is that of ``env_kwargs``.
    authority : float
        Share of the moment's limit that the network commands.
    base : str, optional
        File of the controller to whose action the policy's is added.
    curriculum : Curriculum, optional
    evaluation : Evaluation
    checkpoint_every : int
        Environment steps between checkpoints, rounded up to whole rollouts; 0 makes none.
    hyperparameters : mapping
        Keywords of the algorithm's class. ``lin_0.001`` falls linearly to zero.
    """

    algorithm: Algorithm
    env_id: str
    n_timesteps: int
    seed: int = 0
    n_envs: int = 64
    device: str = "cpu"
    threads: int = 1
    symmetric: bool = True
    normalize: bool | Normalized = False
    env_kwargs: Mapping[str, Any] = field(default_factory=dict)
    memory: MemorySettings = field(default_factory=MemorySettings)
    authority: float = 1.0
    base: str | None = None
    curriculum: Curriculum | None = None
    evaluation: Evaluation = field(default_factory=Evaluation)
    checkpoint_every: int = 100_000
    hyperparameters: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        checks.known("algorithm", [self.algorithm], get_args(Algorithm))
        checks.known("environment", [self.env_id], ENVIRONMENTS)
        checks.whole("n_timesteps", self.n_timesteps)
        checks.whole("seed", self.seed, low=0)
        checks.whole("n_envs", self.n_envs)
        checks.whole("threads", self.threads, low=0)
        checks.whole("checkpoint_every", self.checkpoint_every, low=0)
        checks.number("authority", self.authority, low=0.0, high=1.0, open_low=True)
        if not isinstance(self.symmetric, bool):
            raise ParameterError(f"symmetric is {shown(self.symmetric)}; it must be true or false")
        if not isinstance(self.normalize, bool):
            checks.choice("normalize", self.normalize, get_args(Normalized))
        for name, kind in (
            ("env_kwargs", Mapping),
            ("hyperparameters", Mapping),
            ("memory", MemorySettings),
            ("evaluation", Evaluation),
            ("curriculum", (Curriculum, type(None))),
        ):
            if not isinstance(getattr(self, name), kind):
                raise ParameterError(f"{name} is {shown(getattr(self, name))}; it must be a mapping")
        for name in ("base", "device"):
            value = getattr(self, name)
            if not isinstance(value, str) and not (name == "base" and value is None):
                raise ParameterError(f"{name} is {shown(value)}; it must be a text")
        history = {**_keywords_of(self.env_id), **self.env_kwargs}.get("history", 0)
        object.__setattr__(self, "memory", dataclasses.replace(self.memory, history=history))
        sde = self.hyperparameters.get("use_sde", False)
        if sde and self.symmetric and self.algorithm == "sac":
            raise ParameterError("use_sde is true; symmetric policies of SAC cannot use it")

    @property
    def normalizes(self) -> tuple[bool, bool]:
        """Return whether observations and whether rewards are normalised."""
        chosen = self.normalize
        return chosen in (True, "observations"), chosen in (True, "rewards")

    def environment(self, evaluation: bool = False) -> dict[str, Any]:
        """Return the environment's keywords, as plain values.

        Parameters
        ----------
        evaluation : bool
            Return those of the evaluation.
        """
        changes = self.evaluation.env_kwargs if evaluation else {}
        return {**self.env_kwargs, **changes}

    def plain(self) -> dict[str, Any]:
        """Return the recipe as plain data, from which :meth:`of` makes an equal one."""
        data: dict[str, Any] = {}
        for f in dataclasses.fields(self):
            value = getattr(self, f.name)
            if f.name == "hyperparameters":
                data |= value
            else:
                record = isinstance(value, (MemorySettings, Curriculum, Evaluation))
                data[f.name] = dataclasses.asdict(value) if record else value
        data["memory"].pop("history")
        plain: dict[str, Any] = json.loads(json.dumps(data))
        return plain

    @classmethod
    def of(cls, algorithm: str, env_id: str, entry: Mapping[str, Any]) -> Recipe:
        """Return the recipe of an entry of a file.

        Raises
        ------
        UnknownNameError
            If a key belongs neither to a recipe nor to the keywords of the algorithm.
        ParameterError
            If a value is not allowed.
        """
        own = [f.name for f in dataclasses.fields(cls) if f.name != "hyperparameters"]
        values = {name: entry[name] for name in entry if name in own}
        values |= {"algorithm": algorithm, "env_id": env_id}
        kinds = {"memory": MemorySettings, "curriculum": Curriculum, "evaluation": Evaluation}
        for name, kind in kinds.items():
            if isinstance(values.get(name), Mapping):
                checks.known(f"key of {name}", values[name], [f.name for f in dataclasses.fields(kind)])
                _check_complete(name, kind, values[name])
                values[name] = kind(**values[name])
        _check_complete("recipe", cls, values)
        rest = {name: value for name, value in entry.items() if name not in own}
        return cls(**values, hyperparameters=rest)


def _keywords_of(env_id: str) -> Mapping[str, Any]:
    """Return the keywords that a task sets."""
    return next(task.keywords for task in TASKS if task.id == env_id)


def _check_complete(name: str, kind: type[Any], values: Mapping[str, Any]) -> None:
    """Raise ParameterError if a field without a default is missing."""
    for f in dataclasses.fields(kind):
        optional = (f.default, f.default_factory) != (dataclasses.MISSING, dataclasses.MISSING)
        if f.name not in values and not optional:
            raise ParameterError(f"{name} lacks {f.name}")


def recipe(
    algorithm: str,
    env_id: str,
    changes: Mapping[str, Any] | None = None,
    config: str | PathLike[str] | None = None,
) -> Recipe:
    """Return the shipped recipe for an environment, or one from a file, with some changes.

    Parameters
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    env_id : str
    changes : mapping, optional
        Keys of a recipe or keywords of the algorithm; nested mappings change single entries, which
        dots may also name, as in ``env_kwargs.speed_range``. None removes a key.
    config : path, optional
        YAML or JSON file in rl-zoo3's form, or the ``run.json`` of another run.

    Raises
    ------
    UnknownNameError
        If the algorithm, the environment or a key is unknown.
    ParameterError
        If the file cannot be read, or a value is not allowed.
    """
    checks.known("algorithm", [algorithm], get_args(Algorithm))
    checks.known("environment", [env_id], ENVIRONMENTS)
    shipped = resources.files("agents.learning") / "hyperparams" / f"{algorithm}.yml"
    where = shipped if config is None else Path(config)
    content = _parsed(where)
    checks.known(f"environment in {where}", [env_id], list(content))
    entry: dict[str, Any] = content[env_id]
    for name, value in checks.mapping("changes", changes).items():
        _change(entry, name.split("."), value)
    entry.pop("policy", None)  # rl-zoo3's files name it; there is only one
    return Recipe.of(algorithm, env_id, entry)


def recipe_of_run(path: Path) -> Recipe:
    """Return the recipe in the ``run.json`` of a run.

    Raises
    ------
    ParameterError
        If the file is damaged, or a value in it is not allowed.
    """
    content = _parsed(path)
    if len(content) != 1:
        raise ParameterError(f"{path} has entries for {len(content)} environments; it must have one")
    ((env_id, entry),) = content.items()
    return Recipe.of(entry.pop("algorithm", ""), env_id, entry)


def _parsed(path: Path | resources.abc.Traversable) -> dict[str, Any]:
    """Return the entries of a YAML or JSON file by environment."""
    json_file = path.name.endswith(".json")
    if not json_file:
        require("yaml", "PyYAML", f"reading {path}")
    try:
        text = path.read_text(encoding="utf-8")
        if json_file:
            content = json.loads(text)
        else:
            import yaml

            content = yaml.safe_load(text)
    except (MissingPackageError, OSError):
        raise
    except Exception as e:  # yaml's own errors have no common base with json's
        raise ParameterError(f"{path} cannot be read: {e}") from None
    if not isinstance(content, dict) or not all(isinstance(v, dict) for v in content.values()):
        raise ParameterError(f"{path} has no entries for environments")
    return content


def _change(entry: dict[str, Any], path: list[str], value: Any) -> None:
    name, *rest = path
    if rest:
        inner = entry.get(name)
        entry[name] = inner = dict(inner) if isinstance(inner, Mapping) else {}
        _change(inner, rest, value)
    elif value is None:
        entry.pop(name, None)
    elif isinstance(value, Mapping) and isinstance(entry.get(name), Mapping):
        entry[name] = {**entry[name], **value}
    else:
        entry[name] = value
