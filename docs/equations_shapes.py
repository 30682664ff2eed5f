"""Contact laws on docs/physics.md: how a wheel rides up when it is shifted."""

from __future__ import annotations

import sympy
from equations_shown import BEYOND, Shown, rows
from symbols import law
from written import traced

from railenv.equations import shapes

_ETA = sympy.Symbol(r"\eta")
_SINE, _COSINE = sympy.Symbol(r"\sin\gamma_{0}"), sympy.Symbol(r"\cos\gamma_{0}")
_LEFTS = ("H", "H'", r"\rho", "B")


def _touch(kind: shapes.Law, count: int = 4) -> list[str]:
    """Return lift, its derivatives, radius and place, as far as the law has them."""
    found = traced(kind.touch, law(kind), _ETA)
    shown = [(left, e) for left, e in zip(_LEFTS, found, strict=True) if e != 0][:count]
    return rows(" ; ".join(left for left, _ in shown), [e for _, e in shown])


def _cone() -> list[str]:
    return _touch(shapes.CONE)


def _linear() -> list[str]:
    return _touch(shapes.LINEAR)


def _direction() -> list[str]:
    return rows(f"{_SINE} ; {_COSINE}", traced(shapes.direction, law(shapes.ARCS)))


def _nearness() -> list[str]:
    """Return what differs between arcs told by their radii and those told by their conicity."""
    found = []
    for kind, index in ((shapes.ARCS, "arcs"), (shapes.HOLLOW, "hollow")):
        touch = traced(kind.touch, law(kind), _ETA)
        # of the radius, (1 + R_r nu) H, without H
        factor = touch.radius.args[0].args[1].args[1]
        found += rows(rf"\nu_{{\mathrm{{{index}}}}}", [factor])
    return found


def _rolling_round() -> list[str]:
    """Return the touch of two arcs whose nearness is a symbol."""
    c, nu = law(shapes.ARCS), sympy.Symbol(r"\nu")
    start = dict(zip(traced(shapes.direction, c), (_SINE, _COSINE), strict=True))
    touch = traced(shapes._rolling_round, c, nu, _ETA)
    with sympy.evaluate(False):
        lean = traced(shapes.direction, c)[0] + nu * _ETA
    held = traced(shapes._held, lean)
    with sympy.evaluate(False):
        cosine = shapes.sqrt(1.0 - held * held)
        rise = (held + traced(shapes.direction, c)[0]) / (cosine + traced(shapes.direction, c)[1])
    guarded = {traced(shapes._guarded, nu): nu}
    at, sine, cos, mean = map(sympy.Symbol, ("l", r"\sin\gamma", r"\cos\gamma", "h"))
    upper, steepest = sympy.Symbol(r"\bar l"), sympy.Symbol("s_{m}")
    inner = held.args[2]  # held from above, then from below
    slope = sympy.Symbol("H'")
    top = {sympy.Float(shapes.STEEPEST): steepest}
    lift = {**guarded, **top, lean: at, held: sine, rise: mean, touch.slope: slope}
    return [
        *rows("l", [lean], {next(iter(start)): _SINE}),
        *rows(r"\bar l", [inner], {lean: at, **top}),
        *rows(r"\sin\gamma", [held], {inner: upper, **top}),
        *rows(r"\cos\gamma", [cosine], {held: sine}),
        *rows("H'", [touch.slope], {held: sine, cosine: cos}),
        *rows("h", [rise], {held: sine, cosine: cos, **start}),
        *rows("H", [touch.height], lift),
        *rows(r"\rho", [touch.radius], {touch.height: sympy.Symbol("H")}),
    ]


def _profiles() -> list[str]:
    return _touch(shapes.PROFILES)


def _between() -> list[str]:
    return _touch(shapes.BETWEEN)


BLOCKS = {
    "cone": Shown((shapes.cone,), _cone, "`Cone`, the paper's wheel"),
    "linear profile": Shown((shapes.linear,), _linear, f"`LinearProfile`, {BEYOND.lower()}"),
    "contact angle": Shown((shapes.direction,), _direction, "Contact angle at the centre"),
    "nearness": Shown((shapes.arcs, shapes.hollow), _nearness, "`ArcProfile` and `HollowTread`"),
    "arcs": Shown((shapes.arcs, shapes.hollow), _rolling_round, "What both make of it"),
    "profiles": Shown((shapes.profiles,), _profiles, "`ProfilePair`"),
    "family": Shown((shapes.between,), _between, "`ProfileFamily`"),
}
"""Blocks of the page, by their names."""
