"""Ends of curves other than at the end of a range."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from design.curves.bordering import NoPoint
from design.curves.features import Features
from design.curves.follower import Follower, Node, cubic
from design.curves.locate import located
from design.curves.plane import Plane
from design.curves.systems import hopf_system
from design.cycles.shooting import displacement

_CLOSED = 0.1  # of a step: distance at which a closed curve passes its first point
_STEP, _STEPS = 0.1, 12  # longest step to a Bautin point, and number of steps on either side
_FARTHEST = 0.5  # units of arclength from the place of zero amplitude to the Bautin point


def bautin_near(plane: Plane, smallest: Node) -> Node | None:
    """Return the Bautin point at which a curve of folds of periodic motions ends.

    Parameters
    ----------
    plane : Plane
    smallest : Node
        Its last point, a motion of small amplitude.

    Returns
    -------
    Node or None
        Point where the first Lyapunov coefficient changes its sign along the curve of Hopf points; None
        if it does not do so nearby, as with equations that are not smooth enough to have one.
    """
    n, period = plane.model.n_states, float(smallest.z[-3])
    guess = np.concatenate([smallest.z[:n], smallest.values])
    found = []
    for direction in (1, -1):
        follower = Follower(hopf_system(plane, 2j * math.pi / period), _STEP)
        try:
            last = follower.start(guess, direction)
            for _ in range(_STEPS):
                new = follower.advance()
                found += [node for _, kind, node in located(follower, last, new) if kind == "Bautin"]
                last = follower.accept(new)
        except NoPoint:
            continue
    off = [float(np.abs((node.values - smallest.values) / plane.units).max()) for node in found]
    return found[int(np.argmin(off))] if off and min(off) < _FARTHEST else None


def at_rest(bautin: Node, last: Node) -> Node:
    """Return a Bautin point as the motion of zero amplitude in which a curve of folds ends.

    The parameters change with the square of the amplitude, so they are stationary there.
    """
    told, n = bautin.features, len(bautin.z) - 2
    assert told.period is not None
    multipliers = np.exp(told.spectrum * told.period)
    z = np.concatenate([bautin.z[:n], [told.period], bautin.values])
    tangent = last.tangent.copy()
    tangent[-2:] = 0.0
    end = replace(
        last.features,
        period=told.period,
        amplitudes=np.zeros(n),
        spectrum=np.delete(multipliers, int(np.argmin(np.abs(multipliers - 1.0)))),
        coefficient=0.0,
    )
    return Node(z, last.scale, tangent / np.linalg.norm(tangent), end)


def size(plane: Plane, told: Features) -> float:
    """Return the largest amplitude of a displacement in the model's scale, infinite without one."""
    if told.amplitudes is None:
        return math.inf
    return displacement(plane.model, told.amplitudes)


def closes(first: Node, last: Node, new: Node, phased: bool) -> bool:
    """Return whether a step passes the first point of the curve in the first direction.

    The state of a periodic motion is left out: its phase has moved.
    """
    k = slice(-3 if phased else 0, None)
    chord = (new.z - last.z)[k] / last.scale[k]
    length = float(np.linalg.norm(chord))
    t = float((first.z - last.z)[k] / last.scale[k] @ chord) / length**2
    if not 0.0 < t <= 1.0 or float((first.tangent * first.scale / last.scale)[k] @ chord) <= 0.0:
        return False
    off = (cubic(last, new, t) - first.z)[k] / last.scale[k]
    return float(np.linalg.norm(off)) < _CLOSED * length
