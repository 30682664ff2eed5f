"""Assemblies as TOML files: one table per part, texts for fields that read parameters.

Nothing in a file is ever executed; texts are arithmetic on names (:mod:`railenv.vehicles.expressions`).
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railenv import checks
from railenv.contact.laws import Cone, ContactLaw
from railenv.errors import ParameterError, shown
from railenv.vehicles import carried
from railenv.vehicles.elements import BODIES, ELEMENTS, Part

if TYPE_CHECKING:
    from railenv.vehicles.assembly import Assembly

KINDS: dict[str, type[Part]] = {kind.kind: kind for kind in (*BODIES, *ELEMENTS)}
"""Classes of the parts, by the name of their tables in a file."""

PLAIN: dict[str, tuple[str, str]] = {
    "name": ("", "what to call the vehicle; the file's name when left out"),
    "provenance": ("", "where its numbers come from"),
    "gravity": ("m/s^2", "acceleration due to gravity"),
    "wheelbase_curving": (
        "1",
        "1: bodies at different places see the track turn between them on a curve; 0: they do not",
    ),
    "shifting_loads": (
        "",
        "true: vertical forces act where bodies have moved to; false: at their places of rest",
    ),
    "parameters": ("", "numbers that several fields share, by names of your choice"),
}
"""Unit and meaning of a file's entries for the vehicle as a whole."""


def read(path: str | PathLike[str]) -> dict[str, Any]:
    """Return the content of a TOML file.

    Raises
    ------
    ParameterError
        If it is not TOML.
    """
    return parse(Path(path).read_bytes(), str(path))


def parse(content: bytes, source: str) -> dict[str, Any]:
    """Return the data of a TOML file from its bytes; ``source`` names it in errors.

    Raises
    ------
    ParameterError
        If it is not TOML.
    """
    try:
        return tomllib.loads(content.decode("utf-8"))
    except (RecursionError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError(f"{source} is not a TOML file: {error}") from None


def describes_assembly(data: Mapping[str, Any]) -> bool:
    """Return whether the content of a file is that of an assembly, not of a Vehicle's fields."""
    return "parameters" in data or any(
        isinstance(value, list) and (name in KINDS or any(isinstance(v, dict) for v in value))
        for name, value in data.items()
    )


def fields_of(data: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return the fields of the assembly that the content of a file describes.

    Raises
    ------
    ParameterError
        If a part lacks something or has a value that is not allowed; the message names the part.
    UnknownNameError
        If there is a name that a file cannot have.
    """
    checks.known(f"name in {source}", data, [*PLAIN, *KINDS, *carried.ACTUATORS, carried.SENSORS])
    plain = {name: data[name] for name in PLAIN if name in data}
    bodies = [part for kind in BODIES for part in _parts(kind, data, source)]
    elements = [part for kind in ELEMENTS for part in _parts(kind, data, source)]
    plain.setdefault("name", Path(source).stem)
    for name in ("name", "provenance"):
        if not isinstance(plain.get(name, ""), str):
            raise ParameterError(f"{name} in {source} is {shown(plain[name])}; it must be a text")
    equipment = {"actuators": carried.actuators(data, source), **carried.sensors(data, source)}
    return {**plain, "bodies": bodies, "elements": elements, **equipment}


def _parts(kind: type[Part], data: Mapping[str, Any], source: str) -> list[Part]:
    """Return the parts of one kind, in the order of the file."""
    tables = data.get(kind.kind, [])
    if not (isinstance(tables, list) and all(isinstance(t, dict) for t in tables)):
        raise ParameterError(f"{kind.kind} in {source} must be tables, each headed [[{kind.kind}]]")
    fields = [f.name for f in dataclasses.fields(kind)]
    found: list[Part] = []
    for number, table in enumerate(tables, 1):
        label = f"{table.get('name', f'{kind.kind} number {number}')} in {source}"
        checks.known(f"field of {label}", table, [*fields, "like"])
        values = {n: v for n, v in table.items() if n != "like"}
        if "like" in table:
            by_name = {part.name: part for part in found}
            checks.known(f"{kind.kind} that {label} is like", [table["like"]], list(by_name))
            if "name" not in values:
                raise ParameterError(f"{label} lacks name")
            name: Any = values.pop("name")
            found.append(by_name[table["like"]].like(name, **values))
            continue
        needed = [f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING]
        missing = [n for n in needed if n not in values]
        if missing:
            ends = ' (the two bodies to which it is attached, or one and "ground")'
            listed = [n + ends * (n == "between") for n in missing]
            raise ParameterError(f"{label} lacks {', '.join(listed)}")
        found.append(kind(**values))
    return found


def text_of(assembly: Assembly, units: Mapping[str, str] | None = None) -> str:
    """Return an assembly as the text of a TOML file, units and meanings as comments.

    Parameters
    ----------
    assembly : Assembly
    units : mapping of str to str, optional
        Comments on the shared parameters.
    """
    import tomlkit

    document = tomlkit.document()
    for name, (unit, meaning) in PLAIN.items():
        if name == "parameters":
            continue
        item = tomlkit.item(getattr(assembly, name))
        plain = isinstance(getattr(assembly, name), str) and not unit  # its meaning is obvious
        document.add(name, item if plain else item.comment(comment(unit, meaning)))
    if assembly.parameters:
        shared = tomlkit.table()
        for name, value in assembly.parameters.items():
            item = tomlkit.item(value)
            shared.add(name, item.comment(units[name]) if units and name in units else item)
        document.add("parameters", shared)
    for kind in (*BODIES, *ELEMENTS):
        tables = [_table(part) for part in assembly.parts if type(part) is kind]
        if tables:
            array = tomlkit.aot()
            for table in tables:
                array.append(table)
            document.add(kind.kind, array)
    for name, given in carried.tables(assembly.actuators).items():
        document.add(name, tomlkit.item(given))
    if assembly.sensors is not None or assembly.sensed is not None:
        bodies = {} if assembly.sensed is None else {"bodies": list(assembly.sensed)}
        numbers = {} if assembly.sensors is None else dataclasses.asdict(assembly.sensors)
        document.add(carried.SENSORS, tomlkit.item({**bodies, **numbers}))
    return tomlkit.dumps(document)


def comment(unit: str, meaning: str) -> str:
    """Return the comment after a number in a file."""
    return f"{meaning} [{unit}]" if unit else meaning


def _table(part: Part) -> Any:
    import tomlkit

    table = tomlkit.table()
    for f in dataclasses.fields(part):
        value: Any = getattr(part, f.name)
        if value is None or (f.name != "name" and value == f.default):
            continue
        if f.name == "conicity" and getattr(part, "contact", None) != Cone(value):
            continue  # a number of another law
        if isinstance(value, ContactLaw):
            if f.name == "right_contact" or not isinstance(value, Cone):
                table.add(f.name, tomlkit.item(value.to_mapping()))
            continue
        if isinstance(value, tuple):
            value = [list(v) if isinstance(v, tuple) else v for v in value]
        item = tomlkit.item(value)
        if "unit" in f.metadata:
            item.comment(comment(f.metadata["unit"], f.metadata["meaning"]))
        table.add(f.name, item)
    return table


@cache
def shipped(name: str) -> Mapping[str, Any]:
    """Return the content of one of the package's own assemblies."""
    text = resources.files("railenv.vehicles").joinpath(f"{name}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
