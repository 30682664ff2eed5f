"""Participation of each body and coordinate of a vehicle in a mode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, Self

from design.stability.roles import Role, roles_of
from railenv import checks
from railenv.equations.coordinates import COORDINATES
from railenv.models import Model

Measure = Literal["kinetic energy", "squared amplitude"]

_ANGLES = ("phi", "theta", "psi")


@dataclass(frozen=True)
class Structure:
    """The data of a vehicle from which names and shares of its modes follow.

    Attributes
    ----------
    roles : mapping of str to {"wheelset", "frame", "body", "other"}
        Role of each body that moves.
    displacements : mapping of str to mapping of str to str
        Name of each coordinate (``y``, ``psi``) of each body.
    weights : mapping of str to float
        Weights of squared displacements: masses (kg) and moments of inertia (kg m^2).
    places : mapping of str to float
        Place along the vehicle of each body, m.
    measure : {"kinetic energy", "squared amplitude"}
        Quantity that is shared. A user's own equations give no masses: their squared amplitudes count,
        angles at half the gauge.
    """

    roles: Mapping[str, Role]
    displacements: Mapping[str, Mapping[str, str]]
    weights: Mapping[str, float]
    places: Mapping[str, float]
    measure: Measure

    @classmethod
    def of(cls, model: Model) -> Self | None:
        """Return the structure of a model; None if it does not name its bodies."""
        states, inertias, guided = model.body_states, model.body_inertias, model.guided
        if not states:
            return None
        displacements = {
            name: {c: own[c] for c in COORDINATES if c in own} for name, own in states.items()
        }
        arm = guided[0].half_gauge if guided else 1.0
        weights = {
            state: inertias[name][c] if inertias else (arm**2 if c in _ANGLES else 1.0)
            for name, own in displacements.items()
            for c, state in own.items()
        }
        measure: Measure = "kinetic energy" if inertias else "squared amplitude"
        return cls(roles_of(model), displacements, weights, model.body_places, measure)

    def having(self, role: Role) -> list[str]:
        """Return the bodies of a role, from the front."""
        found = [name for name, own in self.roles.items() if own == role]
        return sorted(found, key=lambda name: -self.places[name])

    def shares(self, shape: Mapping[str, complex]) -> Participation:
        """Return the participation of each displacement in a mode."""
        parts = {name: weight * abs(shape[name]) ** 2 for name, weight in self.weights.items()}
        total = sum(parts.values()) or 1.0
        return Participation({name: part / total for name, part in parts.items()}, self)


@dataclass(frozen=True)
class Participation:
    """Shares of the bodies in the motion of a mode.

    Attributes
    ----------
    shares : mapping of str to float
        Share of each displacement, such as ``y_w1``; they add up to 1. All displacements of a mode have
        the same frequency, so shares of kinetic energy are those of mass times squared amplitude.
    structure : Structure
    """

    shares: Mapping[str, float]
    structure: Structure

    @property
    def measure(self) -> Measure:
        """Quantity that is shared: kinetic energy, or squared amplitude if no masses are known."""
        return self.structure.measure

    @property
    def bodies(self) -> dict[str, float]:
        """Share of each body."""
        own = self.structure.displacements
        return {name: sum(self.shares[s] for s in states.values()) for name, states in own.items()}

    @property
    def roles(self) -> dict[Role, float]:
        """Total share of the wheelsets, of the frames, of the bodies and of any others."""
        found: dict[Role, float] = {}
        for name, share in self.bodies.items():
            role = self.structure.roles[name]
            found[role] = found.get(role, 0.0) + share
        return found

    def of(self, bodies: list[str], coordinates: tuple[str, ...] = COORDINATES) -> float:
        """Return the share of some bodies in some of their coordinates.

        Raises
        ------
        UnknownNameError
            If a body is not a moving one.
        """
        own = self.structure.displacements
        checks.known("body", bodies, list(own))
        return sum(
            self.shares[state] for b in bodies for c, state in own[b].items() if c in coordinates
        )
