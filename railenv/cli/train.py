"""``railenv train``: training policies."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from railenv.cli.common import out
from railenv.cli.options import JsonOption
from railenv.errors import ParameterError

if TYPE_CHECKING:
    from agents.learning.training import Training


def train(
    algorithm: Annotated[
        str | None, typer.Argument(help="ppo, sac, td3 or tqc; not needed with --resume.")
    ] = None,
    environment: Annotated[
        str, typer.Argument(help="A registered task, such as railenv/BogieSensors-v1.")
    ] = "railenv/BogieSensors-v1",
    directory: Annotated[
        Path, typer.Option("--out", help="Directory of the run; new or empty unless resumed.")
    ] = Path("results/training"),
    steps: Annotated[
        int | None,
        typer.Option(
            help="Environment steps, rounded up to whole rollouts; those of the recipe when left out."
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of everything random.")] = None,
    config: Annotated[
        Path | None, typer.Option(help="Your own recipes, YAML or JSON (or a run.json).")
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Change the recipe, such as env_kwargs.speed_range=[40,200]; null removes a key; "
            "may be repeated.",
        ),
    ] = None,
    vehicle: Annotated[
        str | None,
        typer.Option(
            "--vehicle", "-v", help="A shipped vehicle or a TOML file, as env_kwargs.vehicle."
        ),
    ] = None,
    base: Annotated[
        Path | None, typer.Option(help="Controller file; the policy's action is added to its own.")
    ] = None,
    device: Annotated[str | None, typer.Option(help="cpu, cuda or auto.")] = None,
    tensorboard: Annotated[
        Path | None, typer.Option(help="Folder for TensorBoard (extra tensorboard).")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in --out from its last checkpoint.")
    ] = False,
    show: Annotated[
        bool, typer.Option("--show", help="Print the recipe as JSON and do not train.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Train a policy with Stable-Baselines3, or go on with a run."""
    import agents

    bar = Console(stderr=True).is_terminal
    if resume:
        if algorithm or config or changes or vehicle or base or device or seed is not None or show:
            raise ParameterError("--resume takes the run's own recipe; give only --out and --steps")
        done = agents.resume(directory, total_timesteps=steps, tensorboard=tensorboard, progress=bar)
        _report(done, directory, as_json)
        return
    if algorithm is None:
        raise ParameterError("algorithm is missing; it must be ppo, sac, td3 or tqc")
    given = dict(_change(text) for text in changes or [])
    if vehicle is not None:
        given["env_kwargs.vehicle"] = vehicle
    if show:
        own = {"n_timesteps": steps, "seed": seed, "device": device}
        given |= {name: value for name, value in own.items() if value is not None}
        _show(algorithm, environment, given, config)
        return
    done = agents.train(
        algorithm,
        environment,
        total_timesteps=steps,
        seed=seed,
        directory=directory,
        config=config,
        changes=given,
        base=base,
        device=device,
        tensorboard=tensorboard,
        progress=bar,
    )
    _report(done, directory, as_json)


def _show(algorithm: str, environment: str, changes: dict[str, Any], config: Path | None) -> None:
    """Print a recipe as JSON."""
    from agents.learning.recipe import recipe

    made = recipe(algorithm, environment, changes, config)
    print(json.dumps({environment: made.plain()}, indent=2))


def _report(done: Training, directory: Path, as_json: bool) -> None:
    """Print the result of a run."""
    if as_json:
        print(json.dumps({"directory": str(directory), "best": done.policy.about}, indent=2))
        return
    out.print(str(done), highlight=False, soft_wrap=True)
    out.print(f"wrote {directory / 'best.npz'}", markup=False, highlight=False, soft_wrap=True)


def _change(text: str) -> tuple[str, Any]:
    name, equals, value = text.partition("=")
    if not equals:
        raise ParameterError(f"--set is {text!r}; it must be name=value")
    try:
        return name.strip(), json.loads(value)
    except json.JSONDecodeError:
        return name.strip(), value.strip()
