"""Vehicles by what a user calls them: a shipped one's name, or a file of either form."""

from __future__ import annotations

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
    kind = Assembly if files.describes_assembly(files.read(name)) else Vehicle
    return kind.from_toml(name)
