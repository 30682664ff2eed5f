"""Roles of the bodies of a vehicle, from the elements between them: wheelset, frame, body or other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal

from railenv.equipment import Equipped
from railenv.models import Model
from railenv.mounting import assembly_of, neighbours
from railenv.vehicles.assembly import Assembly

Role = Literal["wheelset", "frame", "body", "other"]

_LIGHT = 0.5  # of the heaviest: lighter masses on or between frames and body are not vehicle bodies


def roles_of(model: Model) -> dict[str, Role]:
    """Return the role of each body that moves.

    A frame is sprung to wheelsets and to a heavier body above, or one at rest. A body is sprung to
    wheelsets only (as in a two-axle wagon) or stands on lighter frames. Light masses on or between
    them, such as a motor or a bolster, are others. A user's own equations do not give the elements
    between bodies: there, a frame is the body nearest to some wheelsets.
    """
    plant = model.plant if isinstance(model, Equipped) else model
    wheelsets = [g.name for g in plant.guided]
    rest = [name for name in plant.body_names if name not in wheelsets]
    found: dict[str, Role] = dict.fromkeys(wheelsets, "wheelset")
    assembly = assembly_of(plant)
    if assembly is not None:
        masses = {name: own["y"] for name, own in plant.body_inertias.items()}
        return found | _by_elements(assembly, wheelsets, rest, masses)
    over = over_wheelsets(plant, rest)
    return found | {name: "frame" if over[name] else "body" for name in rest}


def over_wheelsets(model: Model, bodies: Iterable[str]) -> dict[str, list[float]]:
    """Return for each of some bodies the distances (m) to the wheelsets to which it is nearest."""
    places = model.body_places
    over: dict[str, list[float]] = {name: [] for name in bodies}
    for wheelset in model.guided if over else ():
        nearest = min(over, key=lambda name: abs(places[name] - wheelset.x))
        over[nearest].append(abs(places[nearest] - wheelset.x))
    return over


def _by_elements(
    assembly: Assembly, wheelsets: list[str], rest: list[str], masses: Mapping[str, float]
) -> dict[str, Role]:
    """Return the roles of bodies that are not wheelsets, from the elements that join them."""
    joined = {name: set(neighbours(assembly, name)) for name in rest}
    over = [name for name in rest if joined[name] & set(wheelsets)]
    above = [name for name in rest if name not in over]
    found: dict[str, Role] = {}
    for name in over:
        at_rest = joined[name] - set(rest) - set(wheelsets)
        carried = _reached(joined[name], above, joined)
        heavier = any(masses[other] > masses[name] for other in carried)
        found[name] = "frame" if at_rest or heavier else "body"
    for name in above:
        together = _reached([name], above, joined)
        on = {n for n in over if joined[n] & together}
        heaviest = max(masses[n] for n in (*together, *(n for n in on if found[n] == "body")))
        stands = all(masses[name] > masses[n] for n in on if found[n] == "frame")
        found[name] = "body" if stands and masses[name] >= _LIGHT * heaviest else "other"
    return found


def _reached(start: Iterable[str], within: Iterable[str], joined: Mapping[str, set[str]]) -> set[str]:
    """Return those of some bodies that a chain of elements reaches through these bodies alone."""
    allowed = set(within)
    found = set(start) & allowed
    while more := {n for name in found for n in joined[name] & allowed} - found:
        found |= more
    return found
