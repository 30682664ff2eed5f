"""Special points between two neighbouring points of a branch, located by Brent's method."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy import optimize

from design.cycles.cycle import Cycle, Kind, SpecialPoint
from design.cycles.multipliers import REAL, log_modulus, mirrored, nearest_one, off_positive, outside
from design.cycles.periodic import NoCycle, PeriodicProblem
from design.cycles.points import between, position

_LOCATED = 1e-5  # of the step in which a special point lies
_ON_CIRCLE = 1e-2  # a located multiplier's distance from the unit circle; a collision is farther
UPRIGHT = 1e-6
"""Change of the parameter along the tangent below which a branch is vertical."""


def special_points(problem: PeriodicProblem, p: Cycle, q: Cycle, after: int) -> Iterator[SpecialPoint]:
    """Yield the special points between two neighbouring points, which follow ``after`` others."""
    turns = p.tangent[-1] * q.tangent[-1] < 0.0
    fold = turns and max(abs(p.tangent[-1]), abs(q.tangent[-1])) > UPRIGHT
    branches = p.orientation * q.orientation < 0
    if fold:
        yield from _located(problem, (p, q), lambda c: float(c.tangent[-1]), "fold", after)
    if branches:
        kind: Kind = "symmetry breaking" if mirrored(p) else "branch point"
        yield from _located(problem, (p, q), lambda c: nearest_one(c) - 1.0, kind, after)
    counts = [outside(off_positive(c)) for c in (p, q)]
    met = not (fold or branches) and outside(p.multipliers) == outside(q.multipliers)
    if counts[0] != counts[1] and not met:  # a pair that meets on the real axis crosses no circle
        k = min(counts)
        yield from _located(problem, (p, q), lambda c: log_modulus(c, k), None, after)


def _located(
    problem: PeriodicProblem,
    ends: tuple[Cycle, Cycle],
    test: Callable[[Cycle], float],
    kind: Kind | None,
    after: int,
) -> Iterator[SpecialPoint]:
    """Yield the zero of a test function between two points, if its sign changes."""
    p, q = ends
    found: dict[float, Cycle] = {0.0: p, 1.0: q}

    def along(fraction: float) -> float:
        if fraction not in found:
            found[fraction] = between(problem, p, q, fraction)
        return test(found[fraction])

    try:
        if along(0.0) * along(1.0) > 0.0:
            return
        root = float(optimize.brentq(along, 0.0, 1.0, xtol=_LOCATED, rtol=_LOCATED))
        cycle = found[root] if root in found else between(problem, p, q, root)
    except NoCycle:
        return
    if kind in ("fold", "symmetry breaking", "branch point"):
        multiplier = complex(nearest_one(cycle))
    else:
        off = off_positive(cycle)
        multiplier = complex(off[np.argmin(np.abs(np.abs(off) - 1.0))]) if off.size else 0j
        if abs(abs(multiplier) - 1.0) > _ON_CIRCLE:
            return  # two multipliers collided outside the circle; stability did not change
        kind = "period doubling" if abs(multiplier.imag) < REAL else "torus"
    assert kind is not None
    # at a fold the parameter is stationary, so its error is of second order in the step's
    slope = max(abs(float(cycle.tangent[-1])), _LOCATED) * float(cycle.scale[-1])
    length = float(np.linalg.norm((position(q) - position(p)) / p.scale))
    yield SpecialPoint(kind, cycle, multiplier, slope * length * _LOCATED, after)
