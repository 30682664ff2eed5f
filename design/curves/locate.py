"""Special points between two neighbouring points of a curve, located by Brent's method."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from design.curves.bordering import NoPoint
from design.curves.features import VANISHING
from design.curves.follower import Follower, Node

_LOCATED = 1e-9  # of the step in which a special point lies
_ZERO = 0.03  # of the test function at the ends of the step: a pole or a jump leaves more


def located(follower: Follower, last: Node, new: Node) -> Iterator[tuple[float, str, Node]]:
    """Yield the special points of a step: their places in it, their kinds, and the points."""
    for kind, test in _tests(last, new):
        found: dict[float, Node] = {0.0: last, 1.0: new}

        def along(fraction: float, found: dict[float, Node] = found) -> Node:
            if fraction not in found:
                found[fraction] = follower.between(new, fraction)
            return found[fraction]

        def value(fraction: float, test: Callable[[Node], float] = test) -> float:
            return test(along(fraction))

        try:
            root = float(optimize.brentq(value, 0.0, 1.0, xtol=_LOCATED, rtol=_LOCATED))
            left, point = value(root), along(root)
        except (NoPoint, ValueError):  # a missing value has no sign
            continue
        if abs(left) <= _ZERO * max(abs(value(0.0)), abs(value(1.0))):
            yield root, kind, point


def _tests(last: Node, new: Node) -> Iterator[tuple[str, Callable[[Node], float]]]:
    """Yield the functions that change their sign in a step, by the kind of point they indicate."""
    before, after = last.features, new.features
    for kind in before.smooth:
        if kind == VANISHING or kind not in after.smooth:
            continue
        if before.smooth[kind] * after.smooth[kind] < 0.0:
            yield kind, _Smooth(kind)
    for kind, growths in before.growths.items():
        counts = [int((g > 0.0).sum()) for g in (growths, after.growths[kind])]
        if counts[0] != counts[1]:
            yield kind, _Growth(kind, min(counts))


@dataclass(frozen=True)
class _Smooth:
    """A smooth function along the curve."""

    kind: str

    def __call__(self, point: Node) -> float:
        return point.features.smooth.get(self.kind, np.nan)


@dataclass(frozen=True)
class _Growth:
    """The k-th growth of a kind, from the largest; a missing one is far below zero."""

    kind: str
    k: int

    def __call__(self, point: Node) -> float:
        growths = point.features.growths[self.kind]
        return float(growths[self.k]) if len(growths) > self.k else -1e300


def vanished(last: Node, new: Node) -> bool:
    """Return whether a motion has shrunk to an equilibrium and grows again, half a period shifted."""
    heading = [p.features.smooth.get(VANISHING, 1.0) for p in (last, new)]
    return heading[0] * heading[1] < 0.0
