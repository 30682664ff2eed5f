"""Vehicles by what a user calls them: a shipped one's name, or a file of either form."""

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
        If the file describes none.
    """
    if not name.endswith(".toml"):
        return preset(name)
    return described(files.read(name), name)


def described(data: Mapping[str, Any], source: str) -> Vehicle | Assembly:
    """Return the vehicle that the content of a file of either form describes.

    Raises
    ------
    ParameterError
        If it describes none; ``source`` names it.
    """
    kind = Assembly if files.describes_assembly(data) else Vehicle
    return kind.described(data, source)
