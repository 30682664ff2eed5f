"""Places of the bodies of a vehicle, for pictures of its modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from design.stability.roles import over_wheelsets, roles_of
from railenv.models import Model

_SHORTEST = 0.5  # m, half the length of a body over a single wheelset, or of a mass between
_BEYOND = 1.12  # of the distance to its wheelsets, a frame's half length
_OVERHANG = 1.5  # m, of a vehicle's body beyond the outermost wheelsets


class Outline(NamedTuple):
    """A body in pictures.

    Attributes
    ----------
    name : str
    x, height : float
        Place along the vehicle, and height of its centre above the axles, m.
    half_length : float
        Half length of a body that is not a wheelset, m.
    y, z, phi, theta, psi : str or None
        Names of its displacements; None for one that it does not have.
    """

    name: str
    x: float
    height: float
    half_length: float
    y: str | None
    z: str | None
    phi: str | None
    theta: str | None
    psi: str | None


@dataclass(frozen=True)
class Geometry:
    """The geometry of a vehicle for pictures.

    Attributes
    ----------
    half_gauge, wheel_radius : float
        m.
    wheelsets, frames, others : tuple of Outline
        The others are a vehicle's bodies, over their wheelsets, and any further masses.
    """

    half_gauge: float
    wheel_radius: float
    wheelsets: tuple[Outline, ...]
    frames: tuple[Outline, ...]
    others: tuple[Outline, ...]

    @property
    def bodies(self) -> tuple[Outline, ...]:
        """All bodies: wheelsets, frames, others."""
        return (*self.wheelsets, *self.frames, *self.others)


def geometry_of(model: Model) -> Geometry | None:
    """Return the places of a model's bodies; None if it does not give them or has no wheelsets."""
    guided, places, heights = model.guided, model.body_places, model.body_heights
    if not guided:
        return None
    roles, states = roles_of(model), model.body_states
    on_rails = {g.name: g.x for g in guided}
    frames = [name for name in places if roles[name] == "frame"]
    bodies = [name for name in places if roles[name] == "body"]
    over = over_wheelsets(model, frames) | over_wheelsets(model, bodies)

    def reach(name: str) -> float:
        return max(over.get(name, []), default=0.0)

    def outline(name: str, half_length: float) -> Outline:
        x, height = on_rails.get(name, places[name]), heights[name]
        own = [states[name].get(c) for c in ("y", "z", "phi", "theta", "psi")]
        return Outline(name, x, height, half_length, *own)

    return Geometry(
        guided[0].half_gauge,
        guided[0].wheel_radius,
        tuple(outline(name, 0.0) for name in on_rails),
        tuple(outline(n, max(_BEYOND * reach(n), _SHORTEST)) for n in frames),
        (
            *(outline(n, reach(n) + _OVERHANG) for n in bodies),
            *(outline(n, _SHORTEST) for n in places if roles[n] == "other"),
        ),
    )
