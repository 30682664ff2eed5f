"""``railenv warm``: kernels traced and compiled ahead of their first use."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import railenv
from railenv.cli.common import out, print_json
from railenv.cli.options import JsonOption
from railenv.errors import ParameterError
from railenv.kernels.loader import cache_directory, load_pictures
from railenv.vehicles.lookup import named

if TYPE_CHECKING:
    from railenv.models import Model

Job = tuple[str, Callable[[], object]]

_SPEED = 20.0  # m/s, for all calls; what is compiled does not depend on it


def warm(
    toml: Annotated[
        list[str] | None,
        typer.Option("--toml", help="A vehicle of your own, a file of parts; may be repeated."),
    ] = None,
    shipped: Annotated[
        bool,
        typer.Option("--shipped/--no-shipped", help="The package's own models and environments."),
    ] = True,
    as_json: JsonOption = False,
) -> None:
    """Trace and compile kernels ahead of their first use; kernels in the cache are kept."""
    jobs = [*(_shipped() if shipped else ()), *(job for file in toml or [] for job in _own(file))]
    start = time.perf_counter()
    done = []
    for name, run in jobs:
        before = time.perf_counter()
        if not as_json:
            out.print(f"{name} ...", end="", highlight=False)
        run()
        seconds = time.perf_counter() - before
        done.append({"kernels": name, "seconds": round(seconds, 2)})
        if not as_json:
            out.print(f" {seconds:.1f} s", highlight=False)
    total = time.perf_counter() - start
    if as_json:
        print_json({"directory": str(cache_directory()), "seconds": round(total, 2), "jobs": done})
        return
    said = f"{len(jobs)} sets of kernels in {cache_directory()}, {total:.1f} s"
    out.print(said, markup=False, highlight=False, soft_wrap=True)


def _shipped() -> Iterator[Job]:
    """Return the jobs for the package's own analyses, and for environments with their own vehicles."""
    vehicle, dual = railenv.HIGH_SPEED_COACH, railenv.DualWheelset(railenv.TABLE_1)
    for model in (railenv.Bogie(vehicle), dual, railenv.CooperriderBogie(), railenv.Coach(vehicle)):
        yield from _of_model(model)
    hollow = railenv.HIGH_SPEED_COACH_HOLLOW
    bogie, coach = railenv.Bogie(hollow), railenv.Coach(hollow)
    for model, place in (
        (bogie, "secondary"),
        (bogie, "primary"),
        (dual, "primary"),
        (coach, "secondary"),
    ):
        actuated = railenv.Equipped(model, place)  # type: ignore[arg-type]
        yield from _of_model(actuated, lanes=False)
        yield from _of_environments(actuated)
    yield "pictures of environments", _pictures


def _own(file: str) -> Iterator[Job]:
    """Return the jobs for a vehicle from a file."""
    vehicle = named(file)
    if isinstance(vehicle, railenv.Vehicle):
        raise ParameterError(
            f"{file} holds the numbers of a bogie, which has the kernels of the shipped ones; --toml "
            "is for files of parts"
        )
    model = railenv.Assembled(vehicle)
    yield from _of_model(model)
    if not model.guided:
        return
    actuated = railenv.Equipped(model)
    yield from _of_model(actuated, lanes=False)
    yield from _of_environments(actuated)


def _of_model(model: Model, *, lanes: bool = True) -> Iterator[Job]:
    yield f"{model.name}: analyses and simulation", partial(_analyses, model)
    if lanes:
        yield f"{model.name}: batches", partial(_batch, model)


def _of_environments(model: railenv.Equipped) -> Iterator[Job]:
    yield f"{model.name}: environment", partial(_environment, model, 0)
    yield f"{model.name}: vector environment", partial(_environment, model, 2)


def _analyses(model: Model) -> None:
    """Call the kernels of equilibria, eigenvalues, limit cycles and simulations."""
    from design.cycles.shooting import Setting, Shooting

    evaluator = model.evaluator()
    evaluator.set(model.guess, _SPEED)
    evaluator.rhs()
    evaluator.jacobian()
    if isinstance(model, railenv.Equipped):
        evaluator.signals()
    else:
        railenv.find_equilibrium(model, speed=_SPEED)
    still: dict[str, Any] = {"speed": _SPEED, "initial_state": model.guess, "step": 1e-3}
    railenv.simulate(model, duration=5e-3, **still)
    railenv.simulate(model, duration=5e-3, **{**still, "speed": lambda t: _SPEED})
    inputs = np.zeros(model.n_inputs)
    for parameter in ("speed", next(iter(model.parameters))):
        value = _SPEED if parameter == "speed" else model.parameters[parameter]
        shooting = Shooting(Setting(model, parameter, _SPEED, 0.0, 0.0, inputs), 1)
        shooting.shoot(model.guess, 1e-3, value)
        shooting.end(model.guess, 1e-3, value)


def _batch(model: Model) -> None:
    """Call the kernels of batches in lanes."""
    from railenv.batch import Batch

    batch = Batch([model])
    batch.conditions = [_SPEED, 0.0, 0.0]
    batch.rhs()
    batch.integrate(step=1e-3, steps=1)


def _pictures() -> None:
    """Call the kernels of pictures of environments."""
    kernels = load_pictures()
    pixels = np.zeros((4, 4), dtype=np.uint32)
    kernels.halve(pixels, pixels[:2, :2])
    kernels.pack(pixels.reshape(-1), np.zeros(12, dtype=np.uint32))
    kernels.stroke(pixels, np.zeros(2), np.zeros(2), 0.5, np.uint32(0))


def _environment(model: railenv.Equipped, count: int) -> None:
    """Call what an environment calls, or with a count that many in lanes."""
    import gymnasium

    name = "railenv/Bogie-v1"  # with a model of its own it is any vehicle
    keywords: dict[str, Any] = {"model": model, "speed_range": (_SPEED, _SPEED), "tangent_share": 1.0}
    if count:
        environments: Any = gymnasium.make_vec(
            name, num_envs=count, vectorization_mode="vector_entry_point", **keywords
        )
        environments.reset(seed=0)
        environments.step(environments.action_space.sample())
        environments.close()
        return
    environment: Any = gymnasium.make(name, disable_env_checker=True, **keywords)
    environment.reset(seed=0)
    environment.step(environment.action_space.sample())
    environment.close()
