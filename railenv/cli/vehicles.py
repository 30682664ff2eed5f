"""``railenv vehicles``: the parameters of vehicles, for people and for documents."""

from __future__ import annotations

import dataclasses
import re
from typing import Annotated, Any

import typer
from rich import box
from rich.table import Table

import railenv
from railenv import vehicles as vehicle_records
from railenv.cli.common import out, print_json, vehicle_model
from railenv.cli.options import JsonOption, VehicleModelName
from railenv.cli.vehicle_page import numeric, own_numbers, page, told, written
from railenv.contact.laws import ContactLaw
from railenv.errors import ParameterError
from railenv.vehicles import files
from railenv.vehicles.assembly import Assembly
from railenv.vehicles.lookup import named
from railenv.vehicles.vehicle import COMMENTS

_NARROW: Any = {"box": box.SIMPLE, "padding": (0, 1, 0, 0), "pad_edge": False}
"""Tables that fit a terminal of 80 columns."""

_SIDE_BY_SIDE = 3
"""Vehicles in one table, so that it fits 80 columns."""


def vehicles(
    name: Annotated[
        str | None, typer.Argument(help="A shipped vehicle or a TOML file; all vehicles when left out.")
    ] = None,
    toml: Annotated[
        bool,
        typer.Option("--toml", help="Print the vehicle's parts as a TOML file to start your own from."),
    ] = False,
    model: Annotated[
        VehicleModelName,
        typer.Option(
            "--model", "-m", help="With --toml: the bogie, its wheelsets alone, or the whole coach."
        ),
    ] = "bogie",
    markdown: Annotated[
        bool, typer.Option("--markdown", help="Print a table of all vehicles for a document.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Print the parameters of vehicles, with symbol, unit, meaning and source."""
    forms = {"--toml": toml, "--markdown": markdown, "--json": as_json}
    if sum(forms.values()) > 1:
        given = " and ".join(form for form, is_given in forms.items() if is_given)
        raise ParameterError(f"{given} exclude each other; give one of them")
    if toml and name is None:
        raise ParameterError("--toml needs the name of one vehicle")
    if model != "bogie" and not toml:
        raise ParameterError(
            f"--model is {model}; it is for --toml, all other output is for all models"
        )
    found = named(name) if name else None
    if isinstance(found, Assembly):
        if model != "bogie":
            raise ParameterError(f"--model is {model}; {name} describes its own parts, so leave it out")
        if markdown:
            raise ParameterError(f"--markdown is for bogies' numbers; {name} describes parts")
        _show_parts(found, toml, as_json)
        return
    shown = list(railenv.PRESETS) if found is None else [found]
    if toml:
        print(vehicle_model(shown[0], model).assembly.to_toml(units=COMMENTS), end="")
        return
    rows = vehicle_records.describe(railenv.Vehicle)
    if markdown:
        print(page(shown, rows))
        return
    if as_json:
        print_json([{row.name: _plain(getattr(v, row.name)) for row in rows} for v in shown])
        return
    if name is None:
        for first in range(0, len(shown), _SIDE_BY_SIDE):
            out.print(_comparison(shown[first : first + _SIDE_BY_SIDE], rows))
    else:
        out.print(_description(shown[0], rows))
    for v in shown:
        out.print(f"{v.name}: {v.provenance}", markup=False, highlight=False)
        if contact := told(v.contact):
            out.print(f"contact of {v.name}: {contact}", markup=False, highlight=False)


def _show_parts(vehicle: Assembly, toml: bool, as_json: bool) -> None:
    """Print a vehicle that is described by its parts."""
    if toml:
        print(vehicle.to_toml(), end="")
        return
    if as_json:
        parts = [
            {
                "kind": part.kind,
                **{f.name: _plain(getattr(part, f.name)) for f in dataclasses.fields(part)},
            }
            for part in vehicle.parts
        ]
        plain = {name: getattr(vehicle, name) for name in files.PLAIN}
        print_json({**plain, "parts": parts, "values": vehicle.values})
        return
    table = Table(title=f"{vehicle.name}: parameters, which --set changes", **_NARROW)
    for title in ("parameter", "value", "unit"):
        table.add_column(title, no_wrap=True)
    table.add_column("meaning")
    own = {
        f"{part.name}_{field.name}": (
            field.metadata["unit"],
            f"{part.kind} {part.name}: {field.metadata['meaning']}",
        )
        for part in vehicle.parts
        for field in dataclasses.fields(part)
        if "bounds" in field.metadata
    }
    for name, value in vehicle.values.items():
        table.add_row(name, written(value), *(own.get(name) or _shared(vehicle, name)))
    out.print(table)
    listed = ", ".join(f"{part.kind} {part.name}" for part in vehicle.parts)
    out.print(f"{vehicle.name}: {vehicle.provenance or listed}", markup=False, highlight=False)


def _shared(vehicle: Assembly, name: str) -> tuple[str, str]:
    """Return unit and meaning of a parameter that several fields read, from those fields."""
    if name in files.PLAIN:
        return files.PLAIN[name]
    readers = [
        (text.strip() == name, field.metadata["unit"], f"{field.name} of {part.name}")
        for part in vehicle.parts
        for field in dataclasses.fields(part)
        if "bounds" in field.metadata and isinstance(text := getattr(part, field.name), str)
        if name in re.findall(r"[A-Za-z_]\w*", text)
    ]
    unit = next((unit for alone, unit, _ in readers if alone), "")
    listed = [said for _, _, said in readers]
    more = f" and {len(listed) - 2} more" if len(listed) > 2 else ""
    return unit, f"read by {', '.join(listed[:2])}{more}" if listed else "read by no field"


def _comparison(shown: list[railenv.Vehicle], rows: list[vehicle_records.FieldDescription]) -> Table:
    table = Table(title="Vehicles; name one to see meanings and sources", **_NARROW)
    for title in ("field", "unit"):
        table.add_column(title, no_wrap=True)
    for v in shown:
        table.add_column(v.name.replace("_", "_\n"), justify="right", no_wrap=True)
    for row in numeric(rows):
        if any(getattr(v, row.name) is not None for v in shown):
            table.add_row(row.name, row.unit, *(_short(getattr(v, row.name)) for v in shown))
    return table


def _short(value: object) -> str:
    """Return a value for a table of several vehicles, contact laws by their kind only."""
    if isinstance(value, tuple):
        return "table"
    return value.kind if isinstance(value, ContactLaw) else written(value)


def _description(vehicle: railenv.Vehicle, rows: list[vehicle_records.FieldDescription]) -> Table:
    table = Table(title=vehicle.name, **_NARROW)
    for title in ("field", "value", "unit"):
        table.add_column(title, no_wrap=True)
    table.add_column("meaning (symbol; source)")
    for row in numeric(rows):
        value = getattr(vehicle, row.name)
        if value is None:
            continue  # a part that the vehicle lacks
        meaning = f"{row.meaning} ({'; '.join(filter(None, (row.symbol, row.source)))})"
        if isinstance(value, tuple):
            meaning += "".join(f"\n{x:g}: {y:g}" for x, y in zip(*value, strict=True))
        table.add_row(row.name, _short(value), row.unit, meaning)
        if row.name == "contact":
            for f in own_numbers(vehicle.contact):
                unit, meaning = f.metadata["unit"], f"{f.metadata['meaning']} (contact)"
                table.add_row(f.name, written(getattr(vehicle.contact, f.name)), unit, meaning)
    return table


def _plain(value: object) -> object:
    """Return a value as JSON has it."""
    return value.to_mapping() if isinstance(value, ContactLaw) else value
