"""Parts that the commands share: consoles, models from options, reports of results."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

import railenv
from railenv.cli.options import ModelName, VehicleModelName, VehicleOptions
from railenv.errors import ParameterError
from railenv.vehicles.lookup import named

if TYPE_CHECKING:
    from railenv.models import Assembled, Model

out = Console()
err = Console(stderr=True)


@dataclass(frozen=True)
class Found:
    """A result of a command: plain data, text to print, and a function that draws it."""

    summary: dict[str, Any]
    shown: list[Any]
    draw: Callable[[], Any]


def model_of(plant: VehicleOptions, changes: list[str] | None) -> Model:
    """Return the model that the options describe, with its parameters changed."""
    built = _model(plant.vehicle, plant.model)
    return built.replace(**assignments(changes, "--set")) if changes else built


def _model(vehicle: str, kind: ModelName) -> Model:
    if kind == "cooperrider":
        return railenv.CooperriderBogie()
    found = named(vehicle)
    if isinstance(found, railenv.Vehicle):
        return vehicle_model(found, kind)
    if kind != "bogie":
        raise ParameterError(
            f"--model is {kind}; {vehicle} describes the parts of a vehicle and is its own model, so "
            "leave --model out"
        )
    return railenv.Assembled(found)


def vehicle_model(vehicle: railenv.Vehicle, kind: VehicleModelName) -> Assembled:
    """Return a model of a vehicle: one of its bogies, that bogie's wheelsets, or the whole."""
    kinds = {"bogie": railenv.Bogie, "dual-wheelset": railenv.DualWheelset, "coach": railenv.Coach}
    return kinds[kind](vehicle)


def assignments(texts: list[str] | None, option: str) -> dict[str, Any]:
    """Return the values of an option that may be repeated as name=value."""
    values: dict[str, Any] = {}
    for text in texts or []:
        name, equals, value = text.partition("=")
        if not equals:
            raise ParameterError(f"{option} is {text!r}; it must be name=value")
        values[name.strip()] = _value(value.strip())
    return values


def _value(text: str) -> float | bool | str:
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text


def print_json(data: object) -> None:
    """Print JSON and nothing else."""
    print(json.dumps(data, indent=2, allow_nan=False))


def report(found: Found, plot: Path | None, as_json: bool) -> None:
    """Print what a command found, as text or as JSON, and draw it."""
    if as_json:
        print_json(found.summary)
    else:
        for part in found.shown:
            out.print(part, highlight=False, soft_wrap=isinstance(part, Text))
    if plot:
        save(found.draw(), plot, as_json)


def save(drawn: Any, path: Path, as_json: bool) -> None:
    """Write a figure, and say so."""
    drawn.figure.savefig(path)
    say_written(path, as_json)


def say_written(path: Path, as_json: bool) -> None:
    """Say that a file was written; not on standard output where that is JSON."""
    (err if as_json else out).print(f"wrote {path}", markup=False, highlight=False, soft_wrap=True)
