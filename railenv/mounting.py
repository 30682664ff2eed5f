"""Places of actuators and sensors on a model: the usual ones, and checks of those given."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, Literal, NamedTuple, get_args

from railenv import checks
from railenv.equations.coordinates import GROUND
from railenv.equations.equipped import Mount
from railenv.errors import ParameterError, shown
from railenv.model import Model
from railenv.vehicles.assembly import AssembledEquations, Assembly
from railenv.vehicles.declared import DeclaredEquations

Place = Literal["none", "secondary", "primary", "both", "lateral"]
PLACES = get_args(Place)


class Mounting(NamedTuple):
    """Actuators at one of the usual places.

    ``groups`` gives the kind of actuator by prefix, "secondary", "primary" or "lateral";
    ``places`` has the places of lateral ones (m).
    """

    mounts: tuple[Mount, ...]
    groups: dict[str, str]
    places: dict[str, float]


def places(plant: Model) -> list[str]:
    """Return the usual places at which a plant can carry actuators."""
    primary, secondary = bool(_primary(plant)), bool(_secondary(plant))
    possible = {
        "none": True,
        "secondary": secondary,
        "primary": primary,
        "both": primary and secondary,
        "lateral": bool(_lateral(plant)),
    }
    return [place for place in PLACES if possible[place]]


def usual(plant: Model, place: Any) -> Mounting:
    """Return the actuators of a place: lateral ones at "lateral", yaw actuators at the others.

    Raises
    ------
    ParameterError
        If it is not a place, or the plant has no such bodies.
    """
    possible = places(plant)
    if not isinstance(place, str) or place not in possible:
        allowed = ", ".join(map(repr, possible))
        raise ParameterError(f"place is {shown(place)}; actuators of a {plant.name} are at {allowed}")
    if place == "lateral":
        return _lateral_mounting(plant)
    pairs = {"primary": _primary(plant), "secondary": _secondary(plant)}
    wanted = {"both": ("primary", "secondary"), "none": ()}.get(place, (place,))
    mounts, groups = [], {}
    for kind in wanted:
        group = f"{kind}_" if place == "both" else ""
        groups[group] = kind
        mounts += [Mount(a, (a, b), "yaw", group) for a, b in pairs[kind]]
    return Mounting(tuple(mounts), groups or {"": "secondary"}, {})


def _lateral_mounting(plant: Model) -> Mounting:
    """Return lateral actuators between each frame and the body it carries, at its springs."""
    pairs = _lateral(plant)
    mounts = tuple(Mount(a, (a, b), "lateral", "") for a, b in pairs)
    places: dict[str, float] = {}
    for a, b in pairs:
        places[f"{a}_x"], places[f"{a}_z"] = _where_joined(plant, a, b)
    return Mounting(mounts, {"": "lateral"}, places)


def _where_joined(plant: Model, first: str, second: str) -> tuple[float, float]:
    """Return place and height (m) of the first element that joins two bodies, in an assembly.

    In a user's own equations it is the centre of the first body, on which their inputs act.
    """
    numbers = SimpleNamespace(**plant.parameters, **plant.tables)
    x, z = plant.equations.places(numbers)[first]
    assembly = assembly_of(plant)
    if assembly is not None:
        for e in assembly.with_numbers(vars(numbers)).elements:
            other = next((n for n in e.between if n != first), first)
            if first in e.between and not e.n_inputs and _moving(plant, other) == second:
                return float(x if e.x is None else e.x), float(e.z)
    return float(x), float(z)


def first_place(plant: Model) -> Place:
    """Return the place of a plant's usual actuators: above its frames, or else at its wheelsets.

    Raises
    ------
    ParameterError
        If it has no place for actuators.
    """
    if _secondary(plant):
        return "secondary"
    if _primary(plant):
        return "primary"
    raise ParameterError(f"{plant.name} has no frame and no wheelset on which actuators could act")


def assembly_of(plant: Model) -> Assembly | None:
    """Return the parts of a plant; None for a user's own equations."""
    equations = plant.equations
    return equations.assembly if isinstance(equations, AssembledEquations) else None


def _wheelsets(plant: Model) -> list[str]:
    assembly = assembly_of(plant)
    if assembly is not None:
        return [w.name for w in assembly.wheelsets]
    return [body.name for body in plant.equations.bodies if body.is_wheelset]


def neighbours(assembly: Assembly, name: str) -> list[str]:
    """Return the bodies (or the ground) to which elements join a body, in the order of the elements."""
    found = [
        e.between[1 - e.between.index(name)]
        for e in assembly.elements
        if name in e.between and not e.n_inputs
    ]
    return list(dict.fromkeys(found))


def _primary(plant: Model) -> list[tuple[str, str]]:
    """Return each wheelset with the frame to which it is sprung."""
    assembly, wheelsets = assembly_of(plant), _wheelsets(plant)
    if assembly is None:
        acted = {b.name for b in plant.equations.bodies if b.yaw_moment}
        frame = next((n for n in frames(plant) if n in acted), GROUND)
        return [(w, frame) for w in wheelsets if w in acted]
    pairs = []
    for w in wheelsets:
        above = [n for n in neighbours(assembly, w) if n not in wheelsets]
        pairs += [(w, _moving(plant, n)) for n in above[:1]]
    return pairs


def _moving(plant: Model, name: str) -> str:
    return name if name in plant.body_names else GROUND


def frames(plant: Model) -> list[str]:
    """Return the bodies that move and are sprung to wheelsets.

    In a user's own equations these are all bodies that are not wheelsets.
    """
    assembly, wheelsets = assembly_of(plant), _wheelsets(plant)
    others = [name for name in plant.body_names if name not in wheelsets]
    if assembly is None or not wheelsets:
        return others
    return [name for name in others if set(neighbours(assembly, name)) & set(wheelsets)]


def joined(plant: Model, name: str, among: Sequence[str]) -> list[str]:
    """Return those of some bodies to which elements join a body; none in a user's own equations."""
    assembly = assembly_of(plant)
    found = [] if assembly is None else neighbours(assembly, name)
    return [other for other in among if other in found]


def _secondary(plant: Model) -> list[tuple[str, str]]:
    """Return each frame with the body that it carries, or the ground."""
    assembly, wheelsets = assembly_of(plant), _wheelsets(plant)
    own = frames(plant)
    if assembly is None:
        acted = {b.name for b in plant.equations.bodies if b.yaw_moment}
        return [(name, GROUND) for name in own if name in acted]
    pairs = []
    for name in own:
        above = [n for n in neighbours(assembly, name) if n not in (*wheelsets, *own)]
        pairs += [(name, _moving(plant, n)) for n in above[:1]]
    return pairs


def _lateral(plant: Model) -> list[tuple[str, str]]:
    """Return each frame with the body it carries, where lateral forces can act."""
    if assembly_of(plant) is not None:
        return _secondary(plant)
    pushed = {b.name for b in plant.equations.bodies if b.lateral_force}
    return [(name, GROUND) for name in frames(plant) if name in pushed]


def carried(plant: Model) -> list[str]:
    """Return the moving bodies that are not sprung to wheelsets: those above the frames."""
    below = {*_wheelsets(plant), *frames(plant)}
    return [name for name in plant.body_names if name not in below]


def sensed_bodies(plant: Model, given: Sequence[str] | None) -> tuple[str, ...]:
    """Return the bodies with sensors: those given, or frames and bodies on them, or wheelsets."""
    if given is None:
        usual = [*frames(plant), *carried(plant)]
        return tuple(usual or _wheelsets(plant) or plant.body_names)
    if isinstance(given, str):
        raise ParameterError(f"sensed is {given!r}; it must be a sequence of names of bodies")
    names = tuple(given)
    checks.known("sensed body", names, plant.body_names)
    if len(set(names)) < len(names):
        raise ParameterError(f"sensed is {names}; names must differ")
    return names


def lateral_rates(plant: Model, sensed: Sequence[str]) -> tuple[str, ...]:
    """Return the state that is the lateral velocity of each sensed body.

    Raises
    ------
    ParameterError
        If a body does not move sideways.
    """
    if assembly_of(plant) is not None:
        return tuple(f"dy_{name}" for name in sensed)
    by_name = {body.name: body for body in plant.equations.bodies}
    found = []
    for name in sensed:
        rate = by_name[name].states.get("dy")
        if rate is None:
            raise ParameterError(f"{name} of {plant.name} has no lateral motion that a sensor reads")
        found.append(rate)
    return tuple(found)


def wheelsets_with_forces(plant: Model) -> tuple[str, ...]:
    """Return the wheelsets whose guiding forces the equations give."""
    assembly = assembly_of(plant)
    return () if assembly is None else tuple(w.name for w in assembly.wheelsets)


def check(plant: Model, between: Sequence[str], acts: str, name: str) -> None:
    """Raise unless an actuator can act between two bodies of a plant."""
    allowed = [*plant.body_names, GROUND]
    checks.known(f"body of actuator {name}", between, allowed)
    equations: Any = plant.equations
    if not isinstance(equations, DeclaredEquations):
        return
    channel = "yaw_moment" if acts == "yaw" else "lateral_force"
    by_name = {body.name: body for body in equations.bodies}
    for body in between:
        if body != GROUND and getattr(by_name[body], channel) is None:
            raise ParameterError(
                f"actuator {name} acts on {body} of {plant.name}, which has no {channel} among its "
                "inputs; name it in railenv.MovingBody"
            )
