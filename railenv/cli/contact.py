"""``railenv contact``: contact of a wheel's profile with a rail's."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer
from rich import box
from rich.table import Table

from railenv.cli.common import Found, report
from railenv.cli.options import JsonOption, PlotOption
from railenv.contact.pair import FINEST_STEP, STEP, WIDTH, ProfilePair
from railenv.contact.profiles import SHIPPED, Kind, Profile
from railenv.errors import ParameterError

_NARROW: Any = {"box": box.SIMPLE, "padding": (0, 1, 0, 0), "pad_edge": False}
"""Tables that fit a terminal of 80 columns."""

_SHIFTS = 0.001  # m between rows
_FURTHEST = 0.010  # m
_AMPLITUDES = 0.001 * np.arange(1, 7)  # m


def contact(
    wheel: Annotated[str, typer.Argument(help="Profile of the wheel: a name or a file.")] = "S1002",
    rail: Annotated[str, typer.Argument(help="Profile of the rail: a name or a file.")] = "UIC60",
    *,
    inclination: Annotated[
        float, typer.Option(help="Lean of the rail inwards, rad; 0 if it was measured in the track.")
    ] = 0.025,
    gauge: Annotated[float, typer.Option(help="Distance of the rails, m.")] = 1.435,
    gauge_depth: Annotated[
        float, typer.Option(help="Depth below the rail's top where the gauge is measured, m.")
    ] = 0.014,
    back_to_back: Annotated[
        float, typer.Option(help="Distance of the backs of the flanges, m.")
    ] = 1.360,
    tape_circle: Annotated[
        float, typer.Option(help="Distance of the tape circle from the back of the flange, m.")
    ] = 0.070,
    nominal_radius: Annotated[float, typer.Option(help="Radius at the tape circle, m.")] = 0.46,
    width: Annotated[float, typer.Option(help="Width of the contact's weights, m.")] = WIDTH,
    amplitude: Annotated[float, typer.Option(help="Amplitude of the linear parameters, m.")] = 0.003,
    units: Annotated[
        Literal["m", "mm"] | None, typer.Option(help="Units of files that do not state theirs.")
    ] = None,
    mirror_rail: Annotated[
        bool, typer.Option("--mirror-rail", help="The y of the rail's file points to the gauge side.")
    ] = False,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print contact geometry and equivalent conicity of a pair of profiles, and draw them.

    Files end in .prw or .prr (SIMPACK), .whl or .ban (MiniProf), .csv, .txt or .dat (two columns).
    """
    pair = ProfilePair(
        wheel=_profile(wheel, "wheel", units, mirror=False),
        rail=_profile(rail, "rail", units, mirror=mirror_rail),
        inclination=inclination,
        gauge=gauge,
        back_to_back=back_to_back,
        nominal_radius=nominal_radius,
        tape_circle=tape_circle,
        gauge_depth=gauge_depth,
        width=width,
        step=max(FINEST_STEP, STEP * min(1.0, width / WIDTH)),
    )
    report(_found(pair, amplitude), plot, as_json)


def _profile(text: str, kind: Kind, units: Literal["m", "mm"] | None, *, mirror: bool) -> Profile:
    if text in SHIPPED:
        if mirror:
            raise ParameterError(f"--mirror-rail is for files; {text} is already the right way round")
        return Profile.named(text)
    if not Path(text).suffix:
        names = ", ".join(name for name, of in SHIPPED.items() if of == kind)
        raise ParameterError(f"{kind} is {text!r}; it must be a file or one of {names}")
    return Profile.read(text, kind=kind, units=units, mirror=mirror)


def _found(pair: ProfilePair, amplitude: float) -> Found:
    low, high = pair.reach
    furthest = min(-low, high)
    count = int(min(furthest, _FURTHEST) / _SHIFTS + 1e-6)
    y = _SHIFTS * np.arange(count + 1)
    amplitudes = _AMPLITUDES[furthest + 1e-9 >= _AMPLITUDES]
    linear = pair.linear(amplitude)
    clearance = pair.flange_clearance
    columns = {
        "y": y,
        "rolling_radius_difference": pair.rolling_radius_difference(y),
        "contact_angle_left": pair.angle(y),
        "contact_angle_right": pair.angle(-y),
        "roll": pair.roll(y),
    }
    conicity = {
        "amplitude": amplitudes,
        "EN 15302": pair.equivalent_conicity(amplitudes),
        "harmonic": pair.equivalent_conicity(amplitudes, "harmonic"),
    }
    summary = {
        "wheel": pair.wheel.name,
        "rail": pair.rail.name,
        "flange_clearance": clearance if math.isfinite(clearance) else None,
        "flange_angle": pair.flange_angle,
        "linear": {"amplitude": amplitude, **linear._asdict()},
        "contact": {name: values.tolist() for name, values in columns.items()},
        "conicity": {name: values.tolist() for name, values in conicity.items()},
    }
    reached = f"{1e3 * clearance:.2f} mm" if math.isfinite(clearance) else "no shift"
    shown = [
        _table(
            f"{pair}; wheelset shifted to the left",
            {
                "y\nmm": (1e3 * y, ".0f"),
                "radius difference\nmm": (1e3 * columns["rolling_radius_difference"], ".3f"),
                "angle left\nrad": (columns["contact_angle_left"], ".4f"),
                "angle right\nrad": (columns["contact_angle_right"], ".4f"),
                "roll\nmrad": (1e3 * columns["roll"], ".3f"),
            },
        ),
        _table(
            "Equivalent conicity",
            {
                "amplitude\nmm": (1e3 * amplitudes, ".0f"),
                "EN 15302": (conicity["EN 15302"], ".3f"),
                "harmonic": (conicity["harmonic"], ".3f"),
            },
        ),
        f"linear at {1e3 * amplitude:g} mm: conicity {linear.conicity:.4f}, contact angle "
        f"{linear.contact_angle:.4f} rad, its rate {linear.contact_angle_rate:.2f} rad/m",
        f"flange: reached at {reached}, largest contact angle {pair.flange_angle:.4f} rad",
    ]
    return Found(summary, shown, lambda: _Drawn(pair))


class _Drawn:
    """A figure as :func:`railenv.cli.common.save` writes it."""

    def __init__(self, pair: ProfilePair) -> None:
        self.figure = pair.plot()


def _table(title: str, columns: dict[str, tuple[Any, str]]) -> Table:
    table = Table(title=title, title_justify="left", **_NARROW)
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    for row in zip(*(values for values, _ in columns.values()), strict=True):
        forms = (form for _, form in columns.values())
        table.add_row(*(f"{value:{form}}" for value, form in zip(row, forms, strict=True)))
    return table
