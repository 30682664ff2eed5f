"""Options that several commands share, each declared once; groups of them are dataclasses.

A command with a group among its parameters is decorated with :func:`with_groups`.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

import typer

from railenv.errors import ParameterError

VehicleModelName = Literal["bogie", "dual-wheelset", "coach"]
ModelName = Literal[VehicleModelName, "cooperrider"]

SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", help="Change a parameter, such as conicity=0.2; may be repeated."),
]
ControllerOption = Annotated[
    str | None, typer.Option("--controller", help="Close the loop: a shipped controller, or a file.")
]


def picture(path: Path | None) -> Path | None:
    """Check before anything is computed that a picture can be written."""
    return _checked_path(path, (".png", ".svg", ".pdf"))


def animation(path: Path | None) -> Path | None:
    """Check before anything is computed that an animation can be written."""
    return _checked_path(path, (".gif",))


def _checked_path(path: Path | None, suffixes: tuple[str, ...]) -> Path | None:
    if path is not None:
        if path.suffix.lower() not in suffixes:
            *others, last = suffixes
            allowed = f"{', '.join(others)} or {last}" if others else last
            raise ParameterError(f"{str(path)!r} must end in {allowed}")
        if not path.parent.is_dir():
            raise ParameterError(f"folder {str(path.parent)!r} of {path.name} does not exist")
    return path


JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")]
PlotOption = Annotated[
    Path | None,
    typer.Option("--plot", callback=picture, help="Draw into this file (.png, .svg or .pdf)."),
]


VehicleOption = Annotated[
    str,
    typer.Option(
        "--vehicle",
        "-v",
        help="A shipped vehicle (`railenv vehicles` lists them) or a TOML file: a bogie's numbers, "
        "or the parts of a vehicle.",
    ),
]


@dataclass(frozen=True)
class VehicleOptions:
    """The vehicle, and how much of it."""

    vehicle: VehicleOption = "HIGH_SPEED_COACH"
    model: Annotated[
        ModelName,
        typer.Option(
            "--model",
            "-m",
            help="Bogie of 12, dual wheelset of 8, whole coach of 31 or Cooperrider bogie of 7 degrees "
            "of freedom; a file of parts is its own model.",
        ),
    ] = "bogie"


@dataclass(frozen=True)
class ControlledVehicleOptions(VehicleOptions):
    """The vehicle on which controllers are designed and compared: that of the environments."""

    vehicle: VehicleOption = "HIGH_SPEED_COACH_HOLLOW"


@dataclass(frozen=True)
class CurveOptions:
    """The curve it runs on."""

    radius: Annotated[
        float,
        typer.Option(
            "--radius",
            "-r",
            help="Curve radius in m; inf is tangent track, negative is the other hand.",
        ),
    ] = math.inf
    cant: Annotated[
        float,
        typer.Option("--cant", "-c", help="Cant angle in rad; positive raises the left, outer rail."),
    ] = 0.0


@dataclass(frozen=True)
class TrackOptions:
    """The ends of the curve, and the irregularity of the track."""

    straight: Annotated[
        float | None, typer.Option(help="Straight track before the curve, m; with --transition.")
    ] = None
    transition: Annotated[
        float | None,
        typer.Option(
            help="Length of the transition into the curve, m; the whole track is the curve if left out."
        ),
    ] = None
    curve_length: Annotated[
        float | None,
        typer.Option(
            "--curve",
            help="Length of the full curve, m, after which a transition leads to a straight; it never "
            "ends if left out.",
        ),
    ] = None
    irregularity: Annotated[
        str | None,
        typer.Option(
            help="Irregularity of the track: low or high (ERRI B176), or a CSV file of a measured line."
        ),
    ] = None
    irregularity_unit: Annotated[
        str | None, typer.Option(help="Unit of the lengths in that file, m or mm.")
    ] = None
    irregularity_factor: Annotated[float, typer.Option(help="Factor on the irregularity.")] = 1.0


@dataclass(frozen=True)
class ControlOptions:
    """The controller that closes the loop, if any: a name, a file, or damping of the yaw rate."""

    controller: ControllerOption = None
    yaw_rate_gain: Annotated[
        float | None,
        typer.Option(help="Damp the yaw rate by actuators: opposing moment, N m per rad/s."),
    ] = None
    washout: Annotated[
        float | None,
        typer.Option(help="Corner frequency (Hz) below which it is not damped; none if left out."),
    ] = None
    delay: Annotated[
        float | None, typer.Option(help="Transport delay of the commands, s; 0.01 if left out.")
    ] = None
    period: Annotated[float | None, typer.Option(help="Control period, s; 0.005 if left out.")] = None


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of each group among its parameters, in place of the group."""
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    parameters = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name not in groups:
            parameters.append(parameter.replace(annotation=hints[name]))
            continue
        inner = get_type_hints(groups[name], include_extras=True)
        for field in fields(groups[name]):
            keyword = inspect.Parameter.KEYWORD_ONLY
            parameters.append(
                inspect.Parameter(
                    field.name, keyword, default=field.default, annotation=inner[field.name]
                )
            )

    @wraps(command)
    def run(**given: Any) -> None:
        made = {
            name: kind(**{field.name: given.pop(field.name) for field in fields(kind)})
            for name, kind in groups.items()
        }
        command(**given, **made)

    # Typer reads both
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run
