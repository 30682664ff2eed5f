"""Names of modes in engineering terms, from their shapes.

Names depend on shares of kinetic energy and on phases, never on frequencies:

- *Hunting* is a motion in which the wheelsets roll along their own wave: they point in the direction of
  their motion, so their yaw leads their lateral motion by a quarter of a period, and they move sideways
  further than the body. It is *body hunting* if the body has more than half of the energy, *bogie
  hunting* if frames move with the wheelsets, *wheelset hunting* otherwise.
- Any other mode is named after the wheelsets, frames or bodies with most of the energy, and after their
  motion. A body that rolls about an axis below its centre is in *lower sway*, about one above it in
  *upper sway*.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from design.stability.participation import Participation, Structure
from design.stability.roles import Role

Shape = Mapping[str, complex]

_OSCILLATES = 0.1  # imaginary part of an eigenvalue, least, as a share of its magnitude
_ROLLING = 0.7  # cosine of the phase between a wheelset's yaw and its path's direction, least
_FOLLOWING = 0.5  # of the frames' lateral motion: wheelsets that move less do not drive it
_LATERAL = 0.5  # share of lateral, roll and yaw motion, least
_CARRIED = 0.5  # share of the body above which hunting is the body's
_FRAMES_MOVE = 0.1  # least share of frames in the energy of wheelsets and frames in bogie hunting
_PURE = 0.05  # share of sway below which lateral motion, or roll, counts as zero
_PHASE = 0.5  # cosine of a phase, least for motions in phase or opposite
_ONE_SIDED = 0.3  # likewise for lateral motion and roll
_DOMINATES = 0.8  # share of one of several equal bodies

_MOTIONS = {"y": "lateral", "z": "bounce", "phi": "roll", "theta": "pitch", "psi": "yaw"}
_ROLES: tuple[Role, ...] = ("wheelset", "frame", "body")


def mode_name(shape: Shape, eigenvalue: complex, share: Participation) -> str:
    """Return the name of a mode.

    Parameters
    ----------
    shape : mapping of str to complex
        Displacements by their names.
    eigenvalue : complex
        1/s.
    share : Participation
        Shares of the same mode.
    """
    structure = share.structure
    if _hunts(shape, eigenvalue, share):
        return _hunting(shape, share)
    bodies = share.bodies
    groups = [(role, structure.having(role)) for role in _ROLES]
    groups += [("other", [name]) for name in structure.having("other")]
    role, members = max(groups, key=lambda group: sum(bodies[name] for name in group[1]))
    largest = max(members, key=lambda name: bodies[name])
    label = largest.replace("_", " ") if role == "other" else role
    if role == "body":
        if len(members) > 1 and bodies[largest] > _DOMINATES * share.of(members):
            return f"{largest} {_body_motion(shape, share, largest)}"
        motion = _body_motion(shape, share, largest)
    else:
        motion = _MOTIONS[_coordinate(share, members)]
    return f"{label} {motion}{_pattern(shape, structure, members, _coordinate(share, members))}"


def roll_axis(shape: Shape, structure: Structure, body: str) -> float | None:
    """Return the height (m) of the axis about which a body rolls above its centre of mass.

    The lateral motion in phase with its roll counts; None if the body does not roll.
    """
    own = structure.displacements[body]
    if "y" not in own or "phi" not in own or shape[own["phi"]] == 0.0:
        return None
    return float((shape[own["y"]] / shape[own["phi"]]).real)


# ----------------------------------------------------------------------------- hunting


def _hunts(shape: Shape, eigenvalue: complex, share: Participation) -> bool:
    """Return whether the wheelsets roll along their own wave and drive the other bodies."""
    structure = share.structure
    everything = list(structure.roles)
    wheelsets, frames = structure.having("wheelset"), structure.having("frame")
    if abs(eigenvalue.imag) < _OSCILLATES * abs(eigenvalue) or not wheelsets:
        return False
    guided = [(own["y"], own["psi"]) for own in (structure.displacements[w] for w in wheelsets)]
    across = [eigenvalue * shape[y] for y, _ in guided]
    along = [shape[psi] for _, psi in guided]
    size = math.sqrt(sum(abs(v) ** 2 for v in across) * sum(abs(v) ** 2 for v in along))
    agreeing = sum((v.conjugate() * w).real for v, w in zip(across, along, strict=True))
    if not size or agreeing < _ROLLING * size:
        return False
    own, of_frames = (_lateral(shape, structure, names) for names in (wheelsets, frames))
    others = [_lateral(shape, structure, [b]) for b in structure.having("body")]
    running = [*wheelsets, *frames]
    return (
        own >= _FOLLOWING * of_frames
        and own >= max(others, default=0.0)
        and share.of(everything, ("y", "phi", "psi")) > _LATERAL
        and share.of(running, ("y",)) > max(share.of(running, (c,)) for c in ("phi", "psi"))
    )


def _lateral(shape: Shape, structure: Structure, bodies: Sequence[str]) -> float:
    """Return the lateral motion of some bodies, in root mean square."""
    own = [structure.displacements[b].get("y") for b in bodies]
    squares = [abs(shape[y]) ** 2 for y in own if y is not None]
    return math.sqrt(sum(squares) / len(squares)) if squares else 0.0


def _hunting(shape: Shape, share: Participation) -> str:
    structure = share.structure
    wheelsets, frames = structure.having("wheelset"), structure.having("frame")
    bodies = structure.having("body")
    if share.of(bodies) > _CARRIED:
        largest = max(bodies, key=lambda name: share.bodies[name])
        label = "body" if len(bodies) == 1 else largest
        return f"{label} hunting ({_body_motion(shape, share, largest)})"
    if share.of(frames) > _FRAMES_MOVE * share.of([*wheelsets, *frames]):
        return f"bogie hunting{_pattern(shape, structure, frames, 'y')}"
    return f"wheelset hunting{_pattern(shape, structure, wheelsets, 'y')}"


# ----------------------------------------------------------------------------- motions


def _body_motion(shape: Shape, share: Participation, body: str) -> str:
    """Return the kind of a body's motion; lateral motion and roll together are its sway."""
    lateral, roll = share.of([body], ("y",)), share.of([body], ("phi",))
    sway = lateral + roll
    others = {c: share.of([body], (c,)) for c in ("psi", "z", "theta")}
    largest = max(others, key=lambda c: others[c])
    if others[largest] > sway:
        return _MOTIONS[largest]
    height = roll_axis(shape, share.structure, body)
    if height is None or roll < _PURE * sway:
        return "lateral"
    own = share.structure.displacements[body]
    y, phi = shape[own["y"]], shape[own["phi"]]
    if lateral < _PURE * sway or abs(height) < _ONE_SIDED * abs(y / phi):
        return "roll" if roll > lateral else "lateral"
    return "upper sway" if height > 0.0 else "lower sway"


def _coordinate(share: Participation, bodies: Sequence[str]) -> str:
    """Return the coordinate with the largest share of some bodies."""
    return max(_MOTIONS, key=lambda c: share.of(list(bodies), (c,)))


def _pattern(shape: Shape, structure: Structure, bodies: Sequence[str], coordinate: str) -> str:
    """Describe how equal bodies, from the front, move relative to each other in a coordinate."""
    own = [structure.displacements[b].get(coordinate) for b in bodies]
    moved = [shape[name] for name in own if name is not None]
    if len(moved) < 2 or len(moved) < len(bodies):
        return ""
    squares = [abs(v) ** 2 for v in moved]
    first = squares.index(max(squares))
    if squares[first] > _DOMINATES * sum(squares):
        return f", {('leading', 'trailing')[first]}" if len(moved) == 2 else f", {bodies[first]}"
    phases = [(v / moved[first]).real / abs(v / moved[first]) if v else 0.0 for v in moved]
    if min(map(abs, phases)) < _PHASE:
        return ""
    if min(phases) > 0.0:
        return ", in phase"
    if len(moved) == 2:
        return ", opposite"
    signs = ["+" if p * phases[0] > 0.0 else "-" for p in phases]
    return f" ({' '.join(signs)})"
