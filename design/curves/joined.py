"""The two sides of a curve, joined into a result."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from design.curves.curve import BifurcationCurve, CurveKind, CurvePoint, CurveSpecialPoint
from design.curves.follower import Node
from design.curves.plane import Plane

Array = NDArray[np.float64]


@dataclass
class Side:
    """One side of a curve while it is followed.

    Attributes
    ----------
    nodes : list of Node
        Points from the start on.
    special : list of (str, Node, dict)
        Kind, point and numbers.
    ended : str
        Reason why it ends; empty while it goes on.
    complete : bool
        Whether it ends as intended.
    closed : bool
        Whether it comes back to its start.
    """

    nodes: list[Node] = field(default_factory=list)
    special: list[tuple[str, Node, dict[str, float]]] = field(default_factory=list)
    ended: str = ""
    complete: bool = True
    closed: bool = False


def joined(kind: CurveKind, plane: Plane, sides: list[Side]) -> BifurcationCurve:
    """Return one or two sides as one curve, in the direction of the first."""
    forward = sides[0]
    backward = sides[1] if len(sides) > 1 else Side([], [], forward.ended)
    nodes = [*backward.nodes[:0:-1], *forward.nodes]
    pieces = [_piece(q, p, -1.0) for p, q in pairwise(backward.nodes)][::-1]
    pieces += [_piece(p, q, 1.0) for p, q in pairwise(forward.nodes)]
    return BifurcationCurve(
        kind=kind,
        plane=plane,
        points=tuple(_point(plane, node) for node in nodes),
        special=tuple(
            CurveSpecialPoint(what, _point(plane, node), numbers)
            for what, node, numbers in [*backward.special[::-1], *forward.special]
        ),
        ended=(backward.ended, forward.ended),
        complete=forward.complete and backward.complete,
        _pieces=tuple(pieces),
    )


def _piece(p: Node, q: Node, sign: float) -> Array:
    """Return Hermite's cubics of the parameters from one point (0) to the next (1), shape (2, 4)."""
    length = float(np.linalg.norm((q.z - p.z) / p.scale))
    start, end = (sign * length * (node.tangent * node.scale)[-2:] for node in (p, q))
    way = q.values - p.values
    return np.stack([start + end - 2.0 * way, 3.0 * way - 2.0 * start - end, start, p.values], axis=1)


def _point(plane: Plane, node: Node) -> CurvePoint:
    told, n = node.features, plane.model.n_states
    x, y = node.values.tolist()
    speed, curvature, cant = plane.conditions((x, y))
    return CurvePoint(
        parameters=(plane.parameter, plane.second),
        values=(x, y),
        speed=speed,
        curvature=curvature,
        cant=cant,
        state=node.z[:n].copy(),
        period=told.period,
        amplitudes=told.amplitudes,
        critical=told.critical,
        spectrum=told.spectrum,
        coefficient=told.coefficient,
        steps=told.steps,
    )
