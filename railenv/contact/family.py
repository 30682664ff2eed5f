"""Profiles between a new pair and a worn one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from railenv.contact.laws import ContactLaw, LinearContact
from railenv.contact.pair import FLANGE_SLOPE, ProfilePair, flange_top
from railenv.equations import shapes
from railenv.errors import ParameterError, shown
from railenv.fields import Number, number
from railenv.tables import Table

TABLE_STEP = 1e-5
"""Step (m) of the search for the flange."""


@dataclass(frozen=True)
class ProfileFamily(ContactLaw):
    """Profiles between a new pair and a worn one, by one number for the wear.

    Lift, rolling radius and contact place are taken between those of both pairs, in proportion to the
    wear. So conicity and contact angle go together, as they do in service. The normal contact stays
    conservative, since a mean of lifts is a lift.

    Parameters
    ----------
    new, worn : ProfilePair
    wear : float
        0 is the new pair, 1 the worn one.
    """

    kind = "family"
    law = shapes.BETWEEN
    example = MappingProxyType({"wear": 0.5})

    new: ProfilePair
    worn: ProfilePair
    wear: Number = number("1", "0 is the new pair, 1 the worn one", needed=True, low=0.0, high=1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("new", "worn"):
            given: Any = getattr(self, name)
            pair = ProfilePair.from_mapping(given) if isinstance(given, Mapping) else given
            if not isinstance(pair, ProfilePair):
                raise ParameterError(
                    f"{name} of ProfileFamily is {shown(pair)}; it must be a ProfilePair"
                )
            object.__setattr__(self, name, pair)

    @classmethod
    def table_fields(cls) -> list[str]:
        """Names of the fields that the equations read as tables."""
        return ["new", "worn"]

    def table(self, field: str) -> Table:
        """Return the table of one of the pairs."""
        pair: ProfilePair = getattr(self, field)
        return pair.table("profiles")

    @property
    def at(self) -> float:
        """The wear as a number."""
        if not isinstance(self.wear, (int, float)):
            raise ParameterError(f"wear is {shown(self.wear)}, which is known in a vehicle only")
        return float(self.wear)

    def _between(self, new: Any, worn: Any) -> Any:
        return new + self.at * (worn - new)

    def linear(self, amplitude: float = 3e-3) -> LinearContact:
        """Return conicity, contact angle and its rate by harmonic linearisation at an amplitude (m)."""
        pairs = zip(self.new.linear(amplitude), self.worn.linear(amplitude), strict=True)
        return LinearContact(*(self._between(a, b) for a, b in pairs))

    @cached_property
    def _slopes(self) -> tuple[Any, Any]:
        reach = min(self.new.reach[1], self.worn.reach[1])
        eta = np.arange(0.0, reach, TABLE_STEP)
        slopes = (np.tan(pair.angle(eta)) for pair in (self.new, self.worn))
        return eta, self._between(*slopes)

    @property
    def flange_angle(self) -> float:
        """Largest contact angle (rad)."""
        return float(np.arctan(self._slopes[1].max()))

    @property
    def flange_clearance(self) -> float:
        """Shift at which the contact reaches the flange (m); infinite where it does not."""
        eta, slope = self._slopes
        on = np.flatnonzero(slope >= FLANGE_SLOPE)
        return float(eta[on[0]]) if on.size else math.inf

    @property
    def flange_top(self) -> tuple[float, float] | None:
        """Shift and lift (m) behind which the flange is less steep again; None without a flange."""
        if not math.isfinite(self.flange_clearance):
            return None
        shift = flange_top(*self._slopes)
        return shift, float(self._between(self.new.height(shift), self.worn.height(shift)))

    def to_mapping(self) -> dict[str, Any]:
        """Return the family as plain values, for files."""
        pairs = {name: getattr(self, name).to_mapping() for name in ("new", "worn")}
        return {"law": self.kind, **pairs, "wear": self.wear}
