"""The computations after a change, step by step, and their reports."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from railenv.errors import RailenvError
from railenv.explorer import computations as compute
from railenv.explorer.state import State


@dataclass(frozen=True)
class Doing:
    """The computation in progress, and the share of all that is done."""

    what: str
    share: float


@dataclass(frozen=True)
class Refused:
    """An impossible state; the previous one stays."""

    state: State
    why: str


@dataclass(frozen=True)
class Accepted:
    """A possible state."""

    state: State


@dataclass(frozen=True)
class Missing:
    """A result that does not exist for this state, and the reason."""

    what: str
    why: str


@dataclass(frozen=True)
class Done:
    """Everything is computed."""


Update = (
    Doing
    | Refused
    | Accepted
    | Missing
    | Done
    | compute.Stability
    | compute.Present
    | compute.Motion
    | compute.ContactCurves
)


@dataclass
class Kept:
    """The last results, so that a change computes only what depends on it."""

    stability: tuple[State, compute.Stability] | None = None
    contact: tuple[object, object] | None = None


def refresh(state: State, kept: Kept) -> Iterator[Update]:
    """Yield all results for a state, the quick ones first."""
    yield Doing("the vehicle", 0.0)
    try:
        model = state.model()
        state.feedback()
        yield Accepted(state)
        yield Doing("kernels, compiled once for each structure", 0.1)
        model.kernels()
    except RailenvError as error:
        yield Refused(state, str(error))
        return
    yield from _stability(state, kept)
    yield Doing("the motion", 0.7)
    try:
        yield compute.motion(state)
    except RailenvError as error:
        yield Missing("motion", str(error))
    yield Doing("the contact", 0.9)
    yield from _contact(state, kept)
    yield Done()


def _stability(state: State, kept: Kept) -> Iterator[Update]:
    key = replace(state, speed=state.speed_range[0], offset=0.0, duration=1.0)
    if kept.stability is None or kept.stability[0] != key:
        yield Doing("eigenvalues over speed", 0.2)
        kept.stability = None
        try:
            found = compute.stability(state)
        except RailenvError as error:
            yield Missing("stability", str(error))
            return
        yield found
        # a task that was given up does not get here, and delivers nothing
        kept.stability = (key, found)
    try:
        yield compute.present(state, kept.stability[1])
    except RailenvError as error:
        yield Missing("present", str(error))


def _contact(state: State, kept: Kept) -> Iterator[Update]:
    key = (state.law, getattr(state.vehicle_shown, "flange_clearance", None))
    if kept.contact == key:
        return
    kept.contact = None
    try:
        found = compute.contact(state)
    except RailenvError as error:
        yield Missing("contact", str(error))
        return
    if found is None:
        yield Missing("contact", "the parts of this vehicle have contact laws of their own")
    else:
        yield found
    kept.contact = key
