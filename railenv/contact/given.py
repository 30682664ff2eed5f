"""Contact laws from users and files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railenv import checks
from railenv.contact.family import ProfileFamily
from railenv.contact.laws import ArcProfile, Cone, ContactLaw, HollowTread, LinearProfile
from railenv.contact.pair import ProfilePair
from railenv.errors import ParameterError, shown
from railenv.fields import Number

LAWS: tuple[type[ContactLaw], ...] = (
    Cone,
    LinearProfile,
    HollowTread,
    ArcProfile,
    ProfilePair,
    ProfileFamily,
)
"""All contact laws."""


def contact_law(value: Any) -> ContactLaw:
    """Return a contact law from itself or from plain values, as files have them.

    Raises
    ------
    ParameterError
        If it is neither, or a value is not allowed.
    UnknownNameError
        If there is no such law, or it has no such field.
    """
    if isinstance(value, ContactLaw):
        return value
    by_kind = {law.kind: law for law in LAWS}
    if not isinstance(value, Mapping) or "law" not in value:
        raise ParameterError(
            f"contact is {shown(value)}; it must be a contact law such as railenv.Cone, or a mapping "
            f"with 'law' ({', '.join(map(repr, by_kind))}) and its fields"
        )
    checks.known("contact law", [value["law"]], list(by_kind))
    return by_kind[value["law"]].from_mapping(value)


def resolved(owner: str, conicity: Number, contact: Any) -> tuple[Number, ContactLaw]:
    """Return conicity and contact law, where one or both of them are given.

    ``conicity`` is the short form of a cone.

    Raises
    ------
    ParameterError
        If neither is given, or they contradict each other.
    """
    if contact is None and conicity is None:
        raise ParameterError(f"{owner} lacks contact; give a contact law, or conicity for a cone")
    law = Cone(conicity) if contact is None else contact_law(contact)
    own: Number = getattr(law, "conicity", None)
    if conicity is not None and conicity != own:
        has = f"a {law.called} of {shown(own)}" if own is not None else f"{law.called}, which has none"
        raise ParameterError(
            f"conicity of {owner} is {shown(conicity)} and its contact {has}; give one of them"
        )
    return own, law
