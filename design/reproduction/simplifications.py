"""The coach on several contacts, under a body at rest and a moving one.

``python -m benchmarks.simplifications`` computes the numbers.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import railenv
from railenv.contact.laws import ContactLaw
from railenv.contact.pair import ProfilePair
from railenv.models import Bogie, Coach

RESULTS = Path(__file__).with_name("data") / "simplifications.json"
"""Critical speeds of every case."""

AMPLITUDE = 3e-3
"""Amplitude (m) at which the conicity of profiles is usually stated."""

Body = Literal["at rest", "moving"]

BODIES: tuple[Body, ...] = ("at rest", "moving")

_PROFILES = ProfilePair()
_LINEAR = _PROFILES.linear(AMPLITUDE)

PAPERS = f"cone, conicity {railenv.TABLE_1.conicity:.3g}"
LINEAR = "linear profile"
PROFILES = "S1002 on UIC 60"

CONTACTS: dict[str, ContactLaw] = {
    PAPERS: railenv.Cone(railenv.TABLE_1.conicity),
    f"cone, conicity {_LINEAR.conicity:.3g}": railenv.Cone(_LINEAR.conicity),
    LINEAR: railenv.LinearProfile(_LINEAR.conicity, _LINEAR.contact_angle, _LINEAR.contact_angle_rate),
    PROFILES: _PROFILES,
}
"""Contacts from the simplest to the profiles, from which the two in the middle are derived."""


@dataclass(frozen=True)
class Simplified:
    """One contact under one body.

    Attributes
    ----------
    contact : str
        One of :data:`CONTACTS`.
    body : {"at rest", "moving"}
    tangent : float
        Linear critical speed on tangent track, m/s.
    persists_from : float
        Lowest speed (m/s) with a motion on the branch of limit cycles from there.
    without_curving, with_curving : float
        Linear critical speed on the paper's curve, where its angle does not turn the wheelsets of a
        bogie against the frame, and where it does (m/s).
    mode : str
        Name of the mode that loses stability on tangent track.
    """

    contact: str
    body: Body
    tangent: float
    persists_from: float
    without_curving: float
    with_curving: float
    mode: str


def model(contact: str, body: Body, *, curving: bool) -> Bogie | Coach:
    """Return the coach, or its bogie under a body at rest, on one of the contacts."""
    vehicle = railenv.HIGH_SPEED_COACH.replace(contact=CONTACTS[contact], wheelbase_curving=curving)
    return Bogie(vehicle) if body == "at rest" else Coach(vehicle)


def results() -> tuple[Simplified, ...]:
    """Return the results, the simplest contact first."""
    rows: list[dict[str, Any]] = json.loads(RESULTS.read_text(encoding="utf-8"))
    return tuple(Simplified(**row) for row in rows)


def of(found: Sequence[Simplified], contact: str, body: Body) -> Simplified:
    """Return one of the cases."""
    return next(one for one in found if (one.contact, one.body) == (contact, body))
