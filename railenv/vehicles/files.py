"""Assemblies as TOML files: one table per part, texts for what reads parameters.

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
from typing import Any

from railenv import checks
from railenv.errors import ParameterError, shown
from railenv.vehicles.assembly import Assembly
from railenv.vehicles.elements import BODIES, ELEMENTS, Part

KINDS: dict[str, type[Part]] = {kind.kind: kind for kind in (*BODIES, *ELEMENTS)}
"""Classes of the parts, by the name of their tables in a file."""

_PLAIN = ("name", "provenance", "gravity", "wheelbase_curving", "parameters")


def read(path: str | PathLike[str]) -> dict[str, Any]:
    """Return what a TOML file holds.

    Raises
    ------
    ParameterError
        If it is not TOML.
    """
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (RecursionError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path} is not a TOML file: {error}") from None


def describes_assembly(data: Mapping[str, Any]) -> bool:
    """Whether the content of a file is that of an assembly, not of a Vehicle's fields."""
    return any(kind in data for kind in KINDS)


def assembly_of(data: Mapping[str, Any], source: str, **own: Any) -> Assembly:
    """Return the assembly that the content of a file describes; ``own`` replaces plain fields.

    Raises
    ------
    ParameterError
        If a part lacks something or has a value that is not allowed; the message names the part.
    UnknownNameError
        If there is a name that a file cannot have.
    """
    checks.known(f"name in {source}", data, [*_PLAIN, *KINDS])
    plain = {name: data[name] for name in _PLAIN if name in data} | own
    bodies = [part for kind in BODIES for part in _parts(kind, data, source)]
    elements = [part for kind in ELEMENTS for part in _parts(kind, data, source)]
    name = plain.pop("name", Path(source).stem)
    for text in ("name", "provenance"):
        value = name if text == "name" else plain.get(text, "")
        if not isinstance(value, str):
            raise ParameterError(f"{text} in {source} is {shown(value)}; it must be a text")
    return Assembly(name=name, bodies=tuple(bodies), elements=tuple(elements), **plain)  # type: ignore[arg-type]


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
        values = {n: tuple(v) if n == "between" else v for n, v in table.items() if n != "like"}
        if "like" in table:
            by_name = {part.name: part for part in found}
            checks.known(f"{kind.kind} that {label} is like", [table["like"]], list(by_name))
            name = values.pop("name", None)
            found.append(by_name[table["like"]].like(name, **values))  # type: ignore[arg-type]
            continue
        needed = [f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING]
        missing = [n for n in needed if n not in values]
        if missing:
            raise ParameterError(f"{label} lacks {', '.join(missing)}")
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
    document.add("name", tomlkit.item(assembly.name))
    document.add("provenance", tomlkit.item(assembly.provenance))
    for name, meaning in (("gravity", "m/s^2"), ("wheelbase_curving", "1 or 0")):
        document.add(name, tomlkit.item(getattr(assembly, name)).comment(meaning))
    if assembly.parameters:
        shared = tomlkit.table()
        for name, value in assembly.parameters.items():
            item = tomlkit.item(value)
            shared.add(name, item.comment((units or {}).get(name, "")) if units else item)
        document.add("parameters", shared)
    for kind in (*BODIES, *ELEMENTS):
        tables = [_table(part) for part in assembly.parts if type(part) is kind]
        if tables:
            array = tomlkit.aot()
            for table in tables:
                array.append(table)
            document.add(kind.kind, array)
    return tomlkit.dumps(document)


def _table(part: Part) -> Any:
    import tomlkit

    table = tomlkit.table()
    for f in dataclasses.fields(part):
        value: Any = getattr(part, f.name)
        if value is None or (f.name != "name" and value == f.default):
            continue
        if isinstance(value, tuple):
            value = [list(v) if isinstance(v, tuple) else v for v in value]
        item = tomlkit.item(value)
        if "unit" in f.metadata:
            item.comment(f"{f.metadata['unit']}: {f.metadata['meaning']}")
        table.add(f.name, item)
    return table


@cache
def shipped(name: str) -> Mapping[str, Any]:
    """Return the content of one of the package's own assemblies."""
    text = resources.files("railenv.vehicles").joinpath(f"{name}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
