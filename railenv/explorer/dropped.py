"""Files dropped on the page: read from their bytes, never from a path."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath
from typing import Any, Literal

from railenv import Assembly, Profile, Vehicle
from railenv.contact import files as profile_files
from railenv.contact.profiles import SHIPPED, Kind
from railenv.errors import ParameterError, one_line
from railenv.vehicles import files
from railenv.vehicles.lookup import described

LARGEST = 2**21
"""Largest size of a dropped file, bytes."""

VEHICLE_ENDING = ".toml"
PROFILE_ENDINGS = profile_files.ENDINGS


def vehicle(name: str, content: bytes) -> Vehicle | Assembly:
    """Return the vehicle of a dropped TOML file: a bogie's numbers, or parts.

    Raises
    ------
    ParameterError
        If it is too large, is not a vehicle's file, or names a profile by a path, which is not read.
    """
    source = _checked(name, content)
    if not source.lower().endswith(VEHICLE_ENDING):
        raise ParameterError(f"{source} must end in {VEHICLE_ENDING}, the format of vehicles")
    data = files.parse(content, source)
    for kind, path in _paths(data):
        raise ParameterError(
            f"{source} names the file {one_line(path, 60)!r} as its {kind}; the page reads no file "
            f"that is not dropped on it: drop that profile as {kind}, or put its points into the file"
        )
    return described(data, source)


def profile(
    name: str,
    content: bytes,
    kind: Kind,
    *,
    units: Literal["m", "mm"] | None = None,
    mirror: bool = False,
) -> Profile:
    """Return the profile of a dropped file.

    Raises
    ------
    ParameterError
        If it is too large, or its points are not valid.
    """
    source = _checked(name, content)
    return profile_files.parse(content, source, kind=kind, units=units, mirror=mirror)


def _checked(name: str, content: bytes) -> str:
    """Return the plain name of a dropped file of an allowed size."""
    source = PurePath(name.replace("\\", "/")).name or "the dropped file"
    if len(content) > LARGEST:
        raise ParameterError(f"{source} has {len(content)} bytes; a dropped file has at most {LARGEST}")
    if not content.strip():
        raise ParameterError(f"{source} is empty")
    return source


def _paths(value: Any) -> Iterator[tuple[str, str]]:
    """Yield the profiles of wheels and rails that are named but not shipped."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key in ("wheel", "rail") and isinstance(inner, str) and inner not in SHIPPED:
                yield key, inner
            yield from _paths(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _paths(inner)
