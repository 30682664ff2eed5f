"""The package's own assemblies as templates, whose parts depend on those of the vehicle.

In ``bogie.toml`` and ``dual_wheelset.toml`` a part with ``needs`` exists only if the vehicle has that
group of fields (:mod:`railenv.vehicles.further`); entries under ``with`` and a group replace fields if
it has that group. Characteristics are named by the field of the vehicle that holds their points.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from railenv.fields import Points
from railenv.vehicles import files
from railenv.vehicles.elements import ELEMENTS
from railenv.vehicles.further import BODY

Data = dict[str, Any]

_CHARACTERISTIC = "force"
"""The field of elements that holds a characteristic."""


def data_of(name: str, groups: Collection[str]) -> Data:
    """Return one of the package's own assemblies with the parts of some groups, as in files."""
    data: Data = {}
    for key, value in files.shipped(name).items():
        if isinstance(value, list):
            tables = [
                _chosen(table, groups) for table in value if table.get("needs", "") in {"", *groups}
            ]
            if tables:
                data[key] = tables
        else:
            data[key] = value
    return {**under_body(data), "shifting_loads": True} if BODY in groups else data


def _chosen(table: Mapping[str, Any], groups: Collection[str]) -> Data:
    """Return the fields of a part for some groups."""
    found = {n: v for n, v in table.items() if n not in ("needs", "with")}
    for group, changes in table.get("with", {}).items():
        if group in groups:
            found |= changes
    return {n: v for n, v in found.items() if v is not False}


def characteristics(data: Data) -> dict[str, str]:
    """Return the field of a vehicle with the points of each characteristic, by element's name."""
    found: dict[str, str] = {}
    for table in _elements(data):
        field = table.get(_CHARACTERISTIC, found.get(table.get("like", "")))
        if isinstance(field, str):
            found[table["name"]] = field
    return found


def with_points(data: Data, points: Mapping[str, Points | None]) -> Data:
    """Return the same data with points in place of the fields that hold them."""
    found = {k: [dict(t) for t in v] if isinstance(v, list) else v for k, v in data.items()}
    for table in _elements(found):
        if isinstance(table.get(_CHARACTERISTIC), str):
            table[_CHARACTERISTIC] = points[table[_CHARACTERISTIC]]
    return found


def _elements(data: Data) -> list[Data]:
    return [table for kind in ELEMENTS for table in data.get(kind.kind, [])]


# ----------------------------------------------------------------- two bogies and a body


def under_body(bogie: Data) -> Data:
    """Return two bogies like the given one, one at each pivot, with the body given in it.

    Wheelsets are numbered from the front, frames become ``b1`` and ``b2``; other parts end in
    the number of their bogie.
    """
    coach: Data = {}
    for key, value in bogie.items():
        if not isinstance(value, list):
            coach[key] = value
            continue
        coach[key] = [
            _at_pivot(table, key, i) for i in (0, 1) for table in value if table["name"] != BODY
        ]
        coach[key] += [table for table in value if table["name"] == BODY]
    return coach


def _at_pivot(table: Data, kind: str, i: int) -> Data:
    """Return a part of the leading (0) or trailing (1) bogie."""
    found = {**table, "name": _name(table["name"], i)}
    if "like" in table:
        found["like"] = _name(table["like"], i)
    if "between" in table:
        found["between"] = [_body(end, i) for end in table["between"]]
        return found
    sign = "-" if i else ""
    inside = f" + {table['x']}" if "x" in table else ""
    return {**found, "x": f"{sign}half_pivot_distance{inside}"}


def _numbered(i: int) -> dict[str, str]:
    return {"w1": f"w{2 * i + 1}", "w2": f"w{2 * i + 2}", "b": f"b{i + 1}"}


def _body(name: str, i: int) -> str:
    return _numbered(i).get(name, name)


def _name(name: str, i: int) -> str:
    words = name.split("_")
    of_body = any(word in _numbered(i) for word in words)
    return "_".join(_body(word, i) for word in words) if of_body else f"{name}_{i + 1}"
