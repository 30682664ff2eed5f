"""Running a recipe on Stable-Baselines3; needs the extra ``rl``."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecNormalize

from agents.controllers.from_sb3 import ALGORITHMS
from agents.controllers.learned import LearnedPolicy
from agents.controllers.scheduled import ScheduledController
from agents.learning import checkpoints
from agents.learning.judging import Judged, judge
from agents.learning.memory_env import MemoryVecEnv
from agents.learning.mirror import (
    MirrorActorCriticPolicy,
    MirroredMeanStd,
    MirrorSACPolicy,
    MirrorTD3Policy,
    MirrorTQCPolicy,
)
from agents.learning.recipe import Curriculum, Recipe
from agents.learning.sb3 import HuntingVecEnv
from railenv import checks
from railenv.errors import ParameterError
from railenv.files import write_whole

_MIRROR = {
    "ppo": MirrorActorCriticPolicy,
    "sac": MirrorSACPolicy,
    "td3": MirrorTD3Policy,
    "tqc": MirrorTQCPolicy,
}
_ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "elu": torch.nn.ELU}
_POLICY = ("net_arch", "activation_fn", "log_std_init", "ortho_init", "full_std", "n_critics")
_SCHEDULED = ("learning_rate", "clip_range", "clip_range_vf")
_SCHEDULE_MARK = "lin_"


class Trainer:
    """A training run: environments, model and the actions between rollouts.

    Parameters
    ----------
    recipe : Recipe
    base : ScheduledController or None
    directory : Path or None
        Directory of the files; none are written without it.
    resumed : bool
        Continue from the last checkpoint there.
    tensorboard : str or None
        Folder for TensorBoard's files.
    """

    def __init__(
        self,
        recipe: Recipe,
        base: ScheduledController | None,
        directory: Path | None,
        resumed: bool = False,
        tensorboard: str | None = None,
    ) -> None:
        self.recipe = recipe
        self.directory = directory
        if recipe.threads:
            torch.set_num_threads(recipe.threads)
        self.env = self._memory_env(recipe.n_envs, base)
        self.judged = self._memory_env(recipe.evaluation.episodes, base, evaluation=True)
        self.counted = Counted()
        kind = ALGORITHMS[recipe.algorithm]
        self.resumed = resumed and directory is not None
        if resumed and directory is not None:
            path = checkpoints.latest(directory)
            self.model, kept = checkpoints.load(path, kind, self.env, recipe.device)
            self.counted = Counted(**kept)
            self.model.tensorboard_log = tensorboard
        else:
            if recipe.curriculum is not None:
                self.counted.top = recipe.curriculum.start
                self.widen()
            self.model = self._new_model(kind, tensorboard, base)

    def _memory_env(
        self, n: int, base: ScheduledController | None, evaluation: bool = False
    ) -> MemoryVecEnv:
        recipe = self.recipe
        keywords = recipe.environment(evaluation)
        venv = HuntingVecEnv.make(recipe.env_id, num_envs=n, **keywords)
        return MemoryVecEnv(venv, recipe.memory, base, recipe.authority)

    def _new_model(
        self, kind: type[BaseAlgorithm], tensorboard: str | None, base: ScheduledController | None
    ) -> BaseAlgorithm:
        recipe = self.recipe
        venv: Any = self.env
        given = dict(recipe.hyperparameters)
        checks.known(f"keyword of {kind.__name__}", given, _keywords(kind))
        observations, rewards = recipe.normalizes
        if observations or rewards:
            venv = VecNormalize(
                venv, norm_obs=observations, norm_reward=rewards, gamma=given.get("gamma", 0.99)
            )
            if recipe.symmetric and observations:
                venv.obs_rms = MirroredMeanStd(self.env.memory.signs)
        for name in _SCHEDULED:
            given[name] = _schedule(given[name]) if name in given else None
        keywords = {name: value for name, value in given.items() if value is not None}
        keywords["policy_kwargs"] = policy = _policy_keywords(given.get("policy_kwargs") or {})
        if recipe.symmetric:
            policy["signs"] = self.env.memory.signs.tolist()
        if "action_noise_std" in keywords:
            keywords["action_noise"] = _noise(keywords.pop("action_noise_std"), venv.action_space)
        try:
            model = kind(
                policy=_MIRROR[recipe.algorithm] if recipe.symmetric else "MlpPolicy",
                env=venv,
                seed=recipe.seed,
                device=recipe.device,
                tensorboard_log=tensorboard,
                **keywords,
            )
        except (TypeError, AssertionError) as e:
            raise ParameterError(f"hyperparameters do not fit {kind.__name__}: {e}") from None
        if base is not None:
            _start_at_zero(model)
        return model

    # ------------------------------------------------------------------ running

    def run(self, total_timesteps: int, progress: bool) -> None:
        """Train up to a total number of environment steps."""
        left = total_timesteps - self.model.num_timesteps
        callback = Between(self, total_timesteps, progress)
        if left > 0:
            # a run resumed from its first checkpoint, at 0 steps, has been reset already
            self.model.learn(left, callback=callback, reset_num_timesteps=not self.resumed)

    def policy(self) -> LearnedPolicy:
        """Return the present policy."""
        about = {
            "algorithm": self.recipe.algorithm,
            "environment": self.recipe.env_id,
            "seed": self.recipe.seed,
            "timesteps": int(self.model.num_timesteps),
        }
        normalizer = self.model.get_vec_normalize_env()
        return LearnedPolicy.from_sb3(self.model, normalizer, self.env, about=about)

    def evaluate(self) -> None:
        """Judge the present policy, record the result and keep the policy if it is the best."""
        normalizer = self.model.get_vec_normalize_env()
        env: Any = self.judged
        if normalizer is not None and normalizer.norm_obs:
            env = VecNormalize(env, training=False, norm_reward=False)
            env.obs_rms, env.clip_obs = normalizer.obs_rms, normalizer.clip_obs
        policy, settings = self.policy(), self.env.hunting.vector_env.settings
        vehicle = self.env.hunting.vector_env.fleet.model
        how = self.recipe.evaluation
        found = judge(self.model, env, policy, vehicle, how, settings)
        counted = self.counted
        score = found.score(how.criterion, settings.speed_range[1])
        if score > counted.best:
            counted.best = score
            about = {**policy.about, **_finite(dataclasses.asdict(found))}
            counted.policy = dataclasses.replace(policy, about=about)
            self._write_best()
        counted.evaluations.append(found)
        self._write_evaluations()
        for name, value in _finite(dataclasses.asdict(found)).items():
            self.model.logger.record(f"eval/{name}", value)

    def widen(self, success: float | None = None) -> None:
        """Set the speeds of later episodes by the curriculum."""
        env = self.env.hunting.vector_env
        low, high = env.settings.speed_range
        env.set_speed_range(min(low, high), min(max(self.counted.top, low), high))

    def checkpoint(self) -> None:
        """Write a checkpoint, if there is a directory for it."""
        if self.directory is not None:
            checkpoints.save(self.directory, self.model, self.env, dict(vars(self.counted)))

    def _write_best(self) -> None:
        if self.directory is None or self.counted.policy is None:
            return
        self.counted.policy.save(self.directory / "best.npz")
        self.model.save(self.directory / "best_model.zip")
        normalizer = self.model.get_vec_normalize_env()
        if normalizer is not None:
            normalizer.save(str(self.directory / "best_vecnormalize.pkl"))

    def _write_evaluations(self) -> None:
        if self.directory is None:
            return
        text = io.StringIO()
        names = [f.name for f in dataclasses.fields(Judged)]
        writer = csv.DictWriter(text, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(dataclasses.asdict(e) for e in self.counted.evaluations)
        write_whole(self.directory / "evaluations.csv", text.getvalue())


@dataclasses.dataclass
class Counted:
    """The counts that change between rollouts, kept in checkpoints."""

    next_evaluation: int = 0
    next_checkpoint: int = 0
    top: float = np.inf
    outcomes: deque[bool] = dataclasses.field(default_factory=deque)
    best: tuple[float, float] = (-np.inf, -np.inf)
    policy: LearnedPolicy | None = None
    evaluations: list[Judged] = dataclasses.field(default_factory=list)


class Between(BaseCallback):
    """The callback between rollouts: curriculum, evaluation, checkpoint, progress bar."""

    def __init__(self, trainer: Trainer, total: int, progress: bool) -> None:
        super().__init__()
        self.trainer = trainer
        self.total = total
        self.bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            disable=not progress,
        )

    def _on_training_start(self) -> None:
        self.bar.start()
        self.task = self.bar.add_task("training", total=self.total, completed=self.num_timesteps)
        if self.trainer.recipe.curriculum is not None:
            self.trainer.widen()

    def _on_step(self) -> bool:
        dones = self.locals["dones"]
        if self.trainer.recipe.curriculum is not None and dones.any():
            infos = self.locals["infos"]
            outcomes = self.trainer.counted.outcomes
            outcomes.extend(not infos[i]["derailed"] for i in np.flatnonzero(dones))
        return True

    def _on_rollout_start(self) -> None:
        trainer, counted = self.trainer, self.trainer.counted
        self.bar.update(self.task, completed=self.num_timesteps)
        if trainer.recipe.curriculum is not None:
            self._widen(trainer.recipe.curriculum)
        evaluation = trainer.recipe.evaluation.every
        if evaluation and self.num_timesteps >= counted.next_evaluation:
            counted.next_evaluation = self.num_timesteps + evaluation
            trainer.evaluate()
            last = counted.evaluations[-1]
            self.bar.update(
                self.task,
                description=f"return {last.mean_return:.4g}, stable to {last.critical_speed:.4g} m/s",
            )
        every = trainer.recipe.checkpoint_every
        if every and self.num_timesteps >= counted.next_checkpoint:
            counted.next_checkpoint = self.num_timesteps + every
            trainer.checkpoint()

    def _widen(self, curriculum: Curriculum) -> None:
        counted = self.trainer.counted
        highest = self.trainer.env.hunting.vector_env.settings.speed_range[1]
        if curriculum.by == "progress":
            share = min(1.0, self.num_timesteps / (curriculum.share * self.total))
            counted.top = curriculum.start + share * (highest - curriculum.start)
        elif len(counted.outcomes) >= curriculum.episodes:
            recent = list(counted.outcomes)[-curriculum.episodes :]
            counted.outcomes = deque(recent)
            if np.mean(recent) >= curriculum.threshold and counted.top < highest:
                counted.top += curriculum.step
                counted.outcomes = deque()
        self.trainer.widen()
        self.logger.record("rollout/highest_speed", min(counted.top, highest))

    def _on_training_end(self) -> None:
        trainer = self.trainer
        if trainer.recipe.evaluation.every:
            trainer.evaluate()
        if trainer.recipe.checkpoint_every:
            trainer.checkpoint()
        self.bar.update(self.task, completed=self.num_timesteps)
        self.bar.stop()


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if np.isfinite(value)}


def _keywords(kind: type[BaseAlgorithm]) -> list[str]:
    """Return the keywords of an algorithm that a recipe may give."""
    import inspect

    own = {"self", "policy", "env", "seed", "device", "verbose", "tensorboard_log", "action_noise"}
    own |= {"_init_setup_model", "replay_buffer_class", "replay_buffer_kwargs", "rollout_buffer_class"}
    own |= {"rollout_buffer_kwargs", "optimize_memory_usage"}
    names = [name for name in inspect.signature(kind).parameters if name not in own]
    return [*names, "action_noise_std"] if issubclass(kind, OffPolicyAlgorithm) else names


def _start_at_zero(model: BaseAlgorithm) -> None:
    """Let a policy on top of a base start as the base alone, with its last layer at zero."""
    policy: Any = model.policy
    layers = [policy.action_net] if hasattr(policy, "action_net") else _last_layers(policy)
    with torch.no_grad():
        for layer in layers:
            layer.weight.zero_()
            layer.bias.zero_()


def _last_layers(policy: Any) -> list[torch.nn.Linear]:
    """Return the last layers of an off-policy algorithm's actors, which give the mean action."""
    found = []
    for actor in filter(None, (policy.actor, getattr(policy, "actor_target", None))):
        linear = [layer for layer in actor.mu.modules() if isinstance(layer, torch.nn.Linear)]
        found.append(linear[-1])
    return found


def _schedule(value: Any) -> Any:
    if isinstance(value, str):
        number = value.removeprefix(_SCHEDULE_MARK)
        try:
            start = float(number)
        except ValueError:
            raise ParameterError(
                f"a hyperparameter is {value!r}; it must be a number or a text such as 'lin_0.0003'"
            ) from None
        return LinearSchedule(start, 0.0, 1.0) if number != value else start
    return value


def _policy_keywords(given: dict[str, Any]) -> dict[str, Any]:
    if not isinstance(given, dict):
        raise ParameterError(f"policy_kwargs is {given!r}; it must be a mapping")
    checks.known("key of policy_kwargs", given, _POLICY)
    keywords = dict(given)
    if "activation_fn" in keywords:
        checks.known("activation_fn", [keywords["activation_fn"]], list(_ACTIVATIONS))
        keywords["activation_fn"] = _ACTIVATIONS[keywords["activation_fn"]]
    return keywords


def _noise(std: Any, action_space: Any) -> Any:
    from stable_baselines3.common.noise import NormalActionNoise

    std = checks.number("action_noise_std", std, low=0.0)
    size = action_space.shape
    return NormalActionNoise(np.zeros(size), std * np.ones(size))
