"""The continuation of a curve from one of its points to both sides, and the reasons of its ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from design.curves.bordering import NoPoint
from design.curves.curve import BifurcationCurve, CurveError
from design.curves.ends import at_rest, bautin_near, closes, size
from design.curves.follower import Follower, Node
from design.curves.joined import Side, joined
from design.curves.locate import located, vanished
from design.curves.starts import Beginning
from design.curves.systems import System

Array = NDArray[np.float64]

_INACCURATE = 0.5  # error of the trivial multiplier
_LONGEST_PERIOD = 20.0  # times the first
_SMALLEST, _SMALLER = 0.02, 0.1  # of the model's scale, of the first: a smaller motion vanishes
_ON_END = 1e-9  # units of arclength from the end of a range
_LAST = {
    ("Hopf", "Bogdanov-Takens"): "the frequency goes to zero: a Bogdanov-Takens point",
    ("torus", "1:1 resonance"): "the two multipliers meet at 1",
    ("torus", "1:2 resonance"): "the two multipliers meet at -1",
}
"""Special points at which a kind of curve ends, with the reasons."""


class Run:
    """A curve while it is followed.

    Parameters
    ----------
    beginning : Beginning
    longest_step : float
        Longest step of arclength.
    """

    def __init__(self, beginning: Beginning, longest_step: float) -> None:
        self._kind = beginning.kind
        self._plane = beginning.plane
        self._system = beginning.system
        self._guess = beginning.guess
        self._at = beginning.at
        self._longest = longest_step

    def curve(self, points: int, progress: bool) -> BifurcationCurve:
        """Follow the curve to both sides, up to ``points`` points on each."""
        sides: list[Side] = []
        with _shown(progress, f"{self._kind}, {self._plane.model.name}", 2 * points) as update:
            for direction in (1, -1):
                side = Side()
                sides.append(side)
                try:
                    self._follow(side, direction, points, update)
                except KeyboardInterrupt:
                    side.ended, side.complete = "interrupted", False
                    if not sides[0].nodes:
                        raise
                    break
                if side.closed:
                    break
        return joined(self._kind, self._plane, sides)

    def _follow(self, side: Side, direction: int, points: int, update: Callable[[], None]) -> None:
        system = self._system()
        follower = Follower(system, self._longest)
        try:
            side.nodes.append(follower.start(self._guess, direction))
        except NoPoint:
            raise self._lost() from None
        if self._plane.left(side.nodes[0].values) is not None:
            raise self._lost()
        while len(side.nodes) < points:
            self._step(side, follower, system)
            update()
            if side.ended:
                return
        side.ended = f"{points} points were computed"

    def _lost(self) -> CurveError:
        start = ", ".join(
            f"{name} {v:.6g}" for name, v in zip(self._plane.parameters, self._guess[-2:], strict=True)
        )
        return CurveError(
            f"no {self._kind} point of {self._plane.model.name} within the ranges is found near the "
            f"start, {start}; the model must have the parameters that the start was found with"
        )

    # ------------------------------------------------------------------------------ steps

    def _step(self, side: Side, follower: Follower, system: System) -> None:
        """Add the next point and the special points before it; record the reason if the curve ends."""
        last, before = side.nodes[-1], len(side.special)
        try:
            self._advance(side, follower, system)
        except NoPoint:
            side.ended = ""
            del side.special[before:]
            if system.motion.refine():
                follower.restart()
                return
            side.ended = f"no step leads on from {self._told(last)}; the equations may jump there"
            side.complete = False

    def _advance(self, side: Side, follower: Follower, system: System) -> None:
        last, new = side.nodes[-1], follower.advance()
        if vanished(last, new) or self._shrunk(side, new):
            self._vanishes(side, new)
            return
        if self._beyond(side, new):
            return
        inside = self._within(side, follower, new)
        if inside is None:
            return
        new = inside
        for _, kind, point in sorted(located(follower, last, new), key=lambda found: found[0]):
            if len(side.nodes) == 1 and kind == self._at:
                continue  # the beginning itself
            side.special.append((kind, point, system.numbers(kind, point.z, point.scale)))
            reason = _LAST.get((self._kind, kind))
            if reason is not None:
                side.ended = f"{reason}, at {self._told(point)}"
                side.nodes.append(point)
                return
        side.nodes.append(new if side.ended else follower.accept(new))
        self._look_at(side)

    def _beyond(self, side: Side, new: Node) -> bool:
        """Return whether the first step, from a point at which the curve ends, leaves the curve."""
        if self._at is None or len(side.nodes) > 1 or new.features.smooth[self._at] > 0.0:
            return False
        side.special.append((self._at, side.nodes[0], {}))
        side.ended = f"{_LAST[self._kind, self._at]}, at {self._told(side.nodes[0])}"
        return True

    def _within(self, side: Side, follower: Follower, new: Node) -> Node | None:
        """Return the point, moved back onto the end of a range if it would pass it, and record that."""
        for _ in range(2):
            outside = self._plane.left(new.values)
            if outside is None:
                return new
            name = self._plane.parameters[outside[0]]
            side.ended = f"the end of the range, {name} {outside[1]:g}, is reached"
            try:
                new = follower.at_limit(new, *outside)
            except NoPoint:
                near = abs(side.nodes[-1].values[outside[0]] - outside[1])
                side.complete = bool(near < _ON_END * self._plane.units[outside[0]])
                if not side.complete:
                    side.ended = (
                        f"{name} {outside[1]:g}, the end of the range, is passed; on it none is found"
                    )
                return None
        return new

    def _look_at(self, side: Side) -> None:
        """Record why a curve ends at the last point, if it does."""
        first, last = side.nodes[0], side.nodes[-1]
        told, start = last.features, first.features
        if told.error > _INACCURATE:
            side.complete = False
            side.ended = (
                f"the motion at {self._told(last)} is too unstable to be integrated over its period "
                f"(the trivial multiplier is wrong by {told.error:.2g})"
            )
        elif (told.period or 0.0) > _LONGEST_PERIOD * (start.period or np.inf):
            side.ended = (
                f"the period grows without bound at {self._told(last)}, where it is {told.period:.4g} s"
            )
        elif len(side.nodes) > 3 and closes(first, side.nodes[-2], last, told.amplitudes is not None):
            side.nodes[-1] = first
            side.closed = True
            side.ended = "the curve is closed"

    def _told(self, point: Node) -> str:
        pairs = zip(self._plane.parameters, point.values, strict=True)
        return ", ".join(f"{name} {value:.6g}" for name, value in pairs)

    def _shrunk(self, side: Side, new: Node) -> bool:
        """Return whether a motion can no longer be distinguished from an equilibrium."""
        first, last, here = (
            size(self._plane, p.features) for p in (side.nodes[0], side.nodes[-1], new)
        )
        return here < min(_SMALLEST, _SMALLER * first, last)

    def _vanishes(self, side: Side, new: Node) -> None:
        """End where the amplitude goes to zero; for folds, search the Bautin point there."""
        smallest = min(side.nodes[-1], new, key=lambda node: size(self._plane, node.features))
        side.ended = f"the amplitude goes to zero, on a Hopf curve near {self._told(smallest)}"
        if self._kind == "fold of cycles":
            bautin = bautin_near(self._plane, smallest)
            if bautin is not None:
                side.special.append(("Bautin", bautin, {}))
                side.nodes.append(at_rest(bautin, side.nodes[-1]))
                side.ended = f"the amplitude goes to zero at a Bautin point, {self._told(bautin)}"


@contextmanager
def _shown(progress: bool, title: str, total: int) -> Iterator[Callable[[], None]]:
    """Show the number of points of a curve."""
    if not progress:
        yield lambda: None
        return
    from rich.progress import Progress

    with Progress(transient=True) as bar:
        task = bar.add_task(title, total=total)
        yield lambda: bar.advance(task)
