"""Training policies: ``agents.train`` and ``agents.resume``."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.controllers.learned import LearnedPolicy
from agents.controllers.scheduled import ScheduledController
from agents.learning.recipe import Recipe, recipe, recipe_of_run
from railenv.errors import ParameterError
from railenv.extras import require, require_rl
from railenv.files import write_whole

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from agents.learning.judging import Judged

RECORD = "run.json"
"""The recipe of a run in its directory; also usable as ``config``."""

_BASE = "base.npz"


@dataclass(frozen=True)
class Training:
    """The result of training.

    Attributes
    ----------
    recipe : Recipe
    policy : LearnedPolicy
        The best policy by the recipe's criterion; the last if nothing was evaluated.
    last : LearnedPolicy
    evaluations : tuple of Judged
    directory : Path or None
        Directory of the files.
    """

    recipe: Recipe
    policy: LearnedPolicy
    last: LearnedPolicy
    evaluations: tuple[Judged, ...]
    directory: Path | None

    def __str__(self) -> str:
        name = f"{self.recipe.algorithm} in {self.recipe.env_id}, {self.last.about['timesteps']} steps"
        if not self.evaluations:
            return f"{name}, not evaluated"
        first, best = self.evaluations[0], self.policy.about
        return (
            f"{name}: mean return {first.mean_return:.4g} at first, {best['mean_return']:.4g} at best "
            f"(after {best['timesteps']} steps, {best['derailed']:.0%} derailed, linear critical speed "
            f"{best['critical_speed']:.4g} m/s)"
        )

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the criterion at the evaluations over the steps."""
        from agents.learning.learning_plots import plot_training

        return plot_training(self, ax)


def train(
    algorithm: str,
    env_id: str,
    *,
    total_timesteps: int | None = None,
    seed: int | None = None,
    directory: str | PathLike[str] | None = None,
    config: str | PathLike[str] | None = None,
    changes: Mapping[str, Any] | None = None,
    base: ScheduledController | str | PathLike[str] | None = None,
    device: str | None = None,
    tensorboard: str | PathLike[str] | None = None,
    progress: bool = False,
) -> Training:
    """Train a policy with Stable-Baselines3 (extra ``rl``).

    Parameters
    ----------
    algorithm : {"ppo", "sac", "td3", "tqc"}
    env_id : str
        One of the registered tasks (:data:`railenv.tasks.TASKS`).
    total_timesteps : int, optional
        Environment steps; those of the recipe when left out.
    seed : int, optional
    directory : path, optional
        Directory for policy, checkpoints and evaluations; it must be new or empty. Nothing is written
        without it.
    config : path, optional
        Your own recipes (:func:`agents.learning.recipe.recipe`).
    changes : mapping, optional
        Changes of the recipe, such as ``{"env_kwargs.speed_range": (80, 140)}``.
    base : ScheduledController or path, optional
        Controller to whose action the policy's is added.
    device : str, optional
        Device that trains the network; the processor unless the recipe says otherwise.
    tensorboard : path, optional
        Folder for TensorBoard.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Training

    Raises
    ------
    UnknownNameError
        If the algorithm, the environment or a key is unknown.
    ParameterError
        If a value is not allowed, or the directory is in use.
    MissingPackageError
        If the extra ``rl`` is missing, or ``tensorboard`` where it is needed.
    """
    given = {"n_timesteps": total_timesteps, "seed": seed, "device": device, "base": _named(base)}
    own = {name: value for name, value in given.items() if value is not None}
    made = recipe(algorithm, env_id, {**(changes or {}), **own}, config)
    require_rl("training")
    law = base if isinstance(base, ScheduledController) else _linear(made.base)
    folder = None
    if directory is not None:
        made = _prepare(Path(directory), made, law)
        folder = Path(directory)
    return _run(made, law, folder, False, tensorboard, progress)


def resume(
    directory: str | PathLike[str],
    *,
    total_timesteps: int | None = None,
    tensorboard: str | PathLike[str] | None = None,
    progress: bool = False,
) -> Training:
    """Continue a run from its last checkpoint, as if it had never stopped.

    Parameters
    ----------
    directory : path
        Directory of the run. Its checkpoints contain pickles: resume only your own runs.
    total_timesteps : int, optional
        Total number of environment steps, if not that of the recipe.
    tensorboard : path, optional
        Folder for TensorBoard.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ParameterError
        If there is no run, or it has no checkpoint.
    MissingPackageError
        If the extra ``rl`` is missing, or ``tensorboard`` where it is needed.
    """
    require_rl("training")
    folder = Path(directory)
    record = folder / RECORD
    if not record.is_file():
        raise ParameterError(f"{folder} holds no training run ({RECORD} is not there)")
    made = recipe_of_run(record)
    if total_timesteps is not None:
        made = dataclasses.replace(made, n_timesteps=total_timesteps)
    law = _linear(str(folder / _BASE)) if made.base else None
    return _run(made, law, folder, True, tensorboard, progress)


def _named(base: ScheduledController | str | PathLike[str] | None) -> str | None:
    """Return a recipe's name of a base controller: its file, or the one that the run will write."""
    if base is None:
        return None
    return str(base) if isinstance(base, (str, PathLike)) else _BASE


def _linear(path: str | None) -> ScheduledController | None:
    if path is None:
        return None
    from agents.controllers.load import load

    found = load(path)
    if not isinstance(found, ScheduledController):
        raise ParameterError(f"the base controller in {path} is {found.name}; it must be linear")
    return found


def _prepare(folder: Path, made: Recipe, law: ScheduledController | None) -> Recipe:
    """Make a run's directory, with its recipe and base controller."""
    if folder.exists() and any(folder.iterdir()):
        raise ParameterError(
            f"directory {folder} is not empty; give a new one, or resume the run in it"
        )
    folder.mkdir(parents=True, exist_ok=True)
    if law is not None:
        law.save(folder / _BASE)
        made = dataclasses.replace(made, base=str(folder / _BASE))
    text = json.dumps({made.env_id: made.plain()}, indent=2)
    write_whole(folder / RECORD, text + "\n")
    return made


def _run(
    made: Recipe,
    law: ScheduledController | None,
    folder: Path | None,
    resumed: bool,
    tensorboard: str | PathLike[str] | None,
    progress: bool,
) -> Training:
    from agents.learning.trainer import Trainer

    if tensorboard is not None:
        require("tensorboard", "tensorboard", "writing for TensorBoard", "tensorboard")
    log = None if tensorboard is None else str(tensorboard)
    trainer = Trainer(made, law, folder, resumed, log)
    trainer.run(made.n_timesteps, progress)
    last, counted = trainer.policy(), trainer.counted
    if folder is not None:
        last.save(folder / "last.npz")
        if counted.policy is None:
            last.save(folder / "best.npz")
    return Training(made, counted.policy or last, last, tuple(counted.evaluations), folder)
