"""Claims about the car body: its effect on the motion, and the cure of its hunting (section 4.4)."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from design.reproduction.body import (
    DAMPING,
    LOW_CONICITY,
    LOW_SPEED,
    body_damping,
    body_moves,
)
from design.reproduction.cases import COACH, VEHICLES
from design.reproduction.claims import MOST, SIGNIFICANT, Claim, Evidence, Finding, Rule
from design.reproduction.store import Piece

_NO_BODY = Finding("has no secondary suspension, so no body", "open")


def body_does_not_matter(evidence: Evidence) -> Claim:
    """Claim that the body moves without affecting the motion significantly."""
    found = evidence.data[body_moves().name]
    still, moving = found["at rest"], found["moving"]
    change = moving["speed"] / still["speed"] - 1.0
    text = (
        f"hunts from {moving['speed']:.1f} m/s; under a body at rest from {still['speed']:.1f} "
        f"({change:+.0%})"
    )
    finding = Finding(text, "agrees" if abs(change) < SIGNIFICANT else "differs")
    low = (
        f"At {LOW_SPEED:g} m/s hunting has {moving['low_frequency']:.2f} Hz and a damping ratio of "
        f"{moving['low_damping']:.2f} with the body, {still['low_frequency']:.2f} Hz and "
        f"{still['low_damping']:.2f} under one at rest."
    )
    return Claim(
        "body-moves",
        "section 4.4",
        "the car body does not affect the motion",
        "The car body moves without affecting the motion of the vehicle significantly.",
        "not significantly",
        _findings(finding),
        "The paper's models have no body. Here the whole coach on two bogies (31 degrees of freedom), "
        "tangent track, beside its bogie under a body at rest; significant is a change of the "
        f"critical speed by {SIGNIFICANT:.0%}. {low}",
    )


def damping_cures_body_hunting(evidence: Evidence) -> Claim:
    """Claim that more secondary lateral damping solves body hunting."""
    found = evidence.data[body_damping().name]
    helped = [_better(before, after) for before, after in pairwise(found) if _body_hunts(before)]
    share = sum(helped) / len(helped) if helped else 0.0
    told = f"more damping helps in {sum(helped)} of {len(helped)} steps; {_told(found)}"
    finding = Finding(told, "agrees" if share > MOST else "differs") if helped else None
    return Claim(
        "body-damping",
        "section 4.4",
        "body hunting is solved by lateral damping",
        "Hunting of the car body can usually be solved by increasing the secondary lateral damping.",
        "solved",
        _findings(finding or Finding("its body does not hunt", "open")),
        f"The whole coach on a conicity of {LOW_CONICITY:g}, where its body hunts, tangent track. A "
        "step helps if it ends body hunting or puts it off. With little damping it does; but with "
        "much, the dampers tie the body to the frames, and its hunting comes back. Of the values "
        f"tried, {_best(found):g} times the coach's own damping is best.",
    )


def _findings(coach: Finding) -> dict[str, Finding]:
    """Return the findings: of the coach, and that the paper's own vehicles carry no body."""
    return {v.name: coach if v is COACH.vehicle else _NO_BODY for v in VEHICLES}


def _body_hunts(one: dict[str, Any]) -> bool:
    return one["mode"] is not None and one["mode"].startswith("body hunting")


def _better(before: dict[str, Any], after: dict[str, Any]) -> bool:
    return not _body_hunts(after) or after["speed"] > before["speed"]


def _told(found: list[dict[str, Any]]) -> str:
    """Describe which multiples of the coach's damping make body or bogies hunt, and from what speed."""
    parts = [
        f"{factor:g}: {'body' if _body_hunts(one) else 'bogies'} from {one['speed']:.0f} m/s"
        for factor, one in zip(DAMPING, found, strict=True)
        if one["speed"] is not None
    ]
    return "multiples of its own damping: " + ", ".join(parts)


def _best(found: list[dict[str, Any]]) -> float:
    """Return the multiple of the coach's damping with the highest hunting speed."""
    speeds = [math.inf if one["speed"] is None else one["speed"] for one in found]
    return DAMPING[speeds.index(max(speeds))]


BODY_RULES: tuple[Rule, ...] = (body_does_not_matter, damping_cures_body_hunting)
"""Claims that need the whole coach."""


def body_pieces() -> tuple[Piece, ...]:
    """Return the computations for these claims."""
    return (body_moves(), body_damping())
