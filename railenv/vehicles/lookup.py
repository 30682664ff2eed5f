"""Vehicles by a shipped one's name, or from a file of either form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railenv.vehicles import files
from railenv.vehicles.assembly import Assembly
from railenv.vehicles.vehicle import Vehicle, preset


def named(name: str) -> Vehicle | Assembly:
    """Return a shipped vehicle, or that of a TOML file: of a bogie's numbers, or of parts.

    Raises
    ------
    UnknownNameError
        If there is no such vehicle.
    ParameterError
        If the file does not describe a vehicle.
    """
    if not name.endswith(".toml"):
        return preset(name)
    return described(files.read(name), name)


def described(data: Mapping[str, Any], source: str) -> Vehicle | Assembly:
    """Return the vehicle that the content of a file of either form describes.

    Raises
    ------
    ParameterError
        If it does not describe a vehicle; the message names ``source``.
    """
    kind = Assembly if files.describes_assembly(data) else Vehicle
    return kind.described(data, source)
