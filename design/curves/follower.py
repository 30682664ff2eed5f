"""Pseudo-arclength continuation of one-dimensional solution sets, through their turning points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from design.curves.bordering import NoPoint
from design.curves.features import Features

Array = NDArray[np.float64]

_NEWTON_TOLERANCE = 1e-7  # last correction, in units of arclength
_NEWTON_STEPS = 10
_STALLED, _SHRINKS, _IDLE = 1e-4, 0.5, 2  # corrections that no longer shrink, where this is allowed
_FARTHEST_CORRECTION = 30.0
_FIRST_STEP, _SMALLEST_STEP = 0.02, 1e-6
_GROWTH, _FEW_STEPS = 1.5, 4  # of the step, after a corrector with so few Newton steps
_LARGEST_MISS = 0.3  # of the step, between the prediction along the tangent and the curve
_FARTHEST_TURN, _CORNER = 0.85, 1e-3  # cosine of the tangent's turn in a step; shorter steps may
_GENTLE = 0.5  # turn of the tangent in a step (rad) up to which the prediction follows the curvature
_LIMIT = 1e-12  # of a unit of arclength: accuracy of a last point on the end of a range


class Equations(Protocol):
    """N equations of N + 1 unknowns, the last two of which are the parameters."""

    def scale(self, z: Array) -> Array:
        """Return the size of one unit of arclength near a solution."""

    def system(self, z: Array, scale: Array) -> tuple[Array, Array]:
        """Return residual and derivatives in scaled unknowns; raise NoPoint if there are none."""

    def settle(self, z: Array, scale: Array) -> Array:
        """Refer everything to a new solution; return the derivatives there."""

    def features(self, z: Array, scale: Array) -> Features:
        """Return the features of a solution, which are reported and tested."""


@dataclass(frozen=True)
class Node:
    """A point of a curve while it is followed.

    Attributes
    ----------
    z : ndarray, shape (size,)
    scale : ndarray, shape (size,)
        Size of one unit of arclength here.
    tangent : ndarray, shape (size,)
        Unit tangent, divided by ``scale``.
    features : Features
        Its features from the equations.
    """

    z: Array
    scale: Array
    tangent: Array
    features: Features

    @property
    def values(self) -> Array:
        """The two parameters."""
        return self.z[-2:]


class Follower:
    """The continuation of a curve from one of its points in one direction.

    Parameters
    ----------
    equations : Equations
    longest_step : float
        Longest step of arclength.
    """

    def __init__(self, equations: Equations, longest_step: float) -> None:
        self._equations = equations
        self._longest = longest_step
        self._step = min(_FIRST_STEP, longest_step)
        self._bent: Array | None = None  # curvature of the curve at the last point
        self._last: Node

    def start(self, guess: Array, direction: int) -> Node:
        """Return the point of the curve nearest to a guess; the curve leaves it in a direction.

        Parameters
        ----------
        guess : ndarray, shape (size,)
        direction : {1, -1}
            Whether the first parameter grows or falls (the second, if the first is stationary).

        Raises
        ------
        NoPoint
            If Newton's method does not converge.
        """
        scale = self._equations.scale(guess)
        z, _, _ = self._solve(guess, None, scale)
        scale = self._equations.scale(z)
        tangent = np.linalg.svd(self._equations.settle(z, scale))[2][-1]
        moving = tangent[-2:][np.abs(tangent[-2:]) > 1e-9 * np.abs(tangent[-2:]).max()]
        tangent = tangent * direction * np.sign(moving[0])
        self._last = Node(z, scale, tangent, self._equations.features(z, scale))
        return self._last

    def advance(self) -> Node:
        """Return the next point; it becomes the last one only on acceptance.

        Raises
        ------
        NoPoint
            If no step succeeds.
        """
        last = self._last
        bend = np.zeros_like(last.z) if self._bent is None else self._bent
        while True:
            straight = last.z + self._step * last.tangent * last.scale
            gentle = np.linalg.norm(bend) * self._step < _GENTLE
            guess = straight + gentle * 0.5 * self._step**2 * bend * last.scale
            try:
                z, rows, steps = self._solve(guess, last.tangent, last.scale)
                miss = float(np.linalg.norm((z - straight) / last.scale))
                new = self._node(z, rows, last)
                if not miss <= _LARGEST_MISS * self._step or self._turned(new):
                    raise NoPoint
                break
            except NoPoint:
                self._step /= 2.0
                if self._step < _SMALLEST_STEP:
                    raise
        if steps <= _FEW_STEPS:
            self._step = min(_GROWTH * self._step, self._longest)
        return new

    def restart(self) -> None:
        """Try again with short steps after a refinement of the equations."""
        self._step = min(_FIRST_STEP, self._longest)

    def accept(self, new: Node) -> Node:
        """Accept a point; return it with its tangent for the new phase."""
        rows = self._equations.settle(new.z, new.scale)
        tangent = _tangent(rows, new.tangent)
        last = self._last
        length = float(np.linalg.norm((new.z - last.z) / new.scale))
        earlier = last.tangent * last.scale / new.scale
        self._bent = (new.tangent - earlier / np.linalg.norm(earlier)) / length
        self._last = Node(new.z, new.scale, tangent, new.features)
        return self._last

    def at_limit(self, new: Node, parameter: int, limit: float) -> Node:
        """Return the point between the last and a new one where a parameter has a value.

        Raises
        ------
        NoPoint
            If there is none.
        """
        last, k = self._last, len(new.z) - 2 + parameter
        if abs(new.z[k] - last.z[k]) < _LIMIT * last.scale[k]:
            raise NoPoint
        fraction = (limit - last.z[k]) / (new.z[k] - last.z[k])
        guess = cubic(last, new, fraction)
        guess[k] = limit
        normal = np.zeros(len(guess))
        normal[k] = np.sign(new.z[k] - last.z[k])
        z, rows, _ = self._solve(guess, normal, last.scale)
        z[k] = limit
        return self._node(z, rows, last)

    def between(self, new: Node, fraction: float) -> Node:
        """Return the point at a fraction of the way from the last one to a new one.

        Raises
        ------
        NoPoint
            If Newton's method does not converge.
        """
        last = self._last
        chord = (new.z - last.z) / last.scale
        normal = chord / np.linalg.norm(chord)
        z, rows, _ = self._solve(cubic(last, new, fraction), normal, last.scale)
        return self._node(z, rows, last)

    # ---------------------------------------------------------------------------- inside

    def _solve(self, guess: Array, normal: Array | None, scale: Array) -> tuple[Array, Array, int]:
        """Solve by Newton's method in the hyperplane through a guess with a normal; near it without.

        If the equations have kinks, the derivatives of a period jump a little as a kink moves from one
        time step to the next, and so does the condition. Corrections then stop shrinking at some
        distance from a fold; the error of its parameters is only the square of that.
        """
        z, smallest, idle = guess, np.inf, 0
        for steps in range(1, _NEWTON_STEPS + 1):
            residual, rows = self._equations.system(z, scale)
            if normal is None:
                change = np.linalg.lstsq(rows, residual, rcond=None)[0]
            else:
                residual = np.append(residual, normal @ ((z - guess) / scale))
                change = _solved(np.vstack([rows, normal]), residual)
            size = float(np.abs(change).max())
            if not size < _FARTHEST_CORRECTION:
                raise NoPoint
            z = z - change * scale
            if size < _NEWTON_TOLERANCE or (idle and size < _STALLED):
                return z, rows, steps
            smallest, idle = min(size, smallest), idle + (size >= _SHRINKS * smallest)
            if idle > _IDLE:
                break
        raise NoPoint

    def _node(self, z: Array, rows: Array, last: Node) -> Node:
        scale = self._equations.scale(z)
        tangent = _tangent(rows * (scale / last.scale), last.tangent * last.scale / scale)
        return Node(z, scale, tangent, self._equations.features(z, scale))

    def _turned(self, new: Node) -> bool:
        """Return whether the tangent turned so far that the step may have left the curve."""
        last = self._last
        tangent = new.tangent * new.scale / last.scale
        cosine = float(tangent @ last.tangent / np.linalg.norm(tangent))
        return cosine < _FARTHEST_TURN and self._step > _CORNER


def cubic(last: Node, new: Node, t: float) -> Array:
    """Return Hermite's cubic between two points, at a fraction of the way."""
    way = new.z - last.z
    length = float(np.linalg.norm(way / last.scale))
    start, end = (length * node.tangent * node.scale for node in (last, new))
    guess = last.z + (3.0 * t**2 - 2.0 * t**3) * way
    return np.asarray(guess + (t - 2.0 * t**2 + t**3) * start + (t**3 - t**2) * end)


def _tangent(rows: Array, towards: Array) -> Array:
    """Return the unit null vector of N rows that points to the side of another vector."""
    matrix = np.vstack([rows, towards / np.linalg.norm(towards)])
    found = _solved(matrix, np.append(np.zeros(len(rows)), 1.0))
    return np.asarray(found / np.linalg.norm(found))


def _solved(matrix: Array, right: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        raise NoPoint from None
