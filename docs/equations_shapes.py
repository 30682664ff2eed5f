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


def _hollow() -> list[str]:
    return _touch(shapes.HOLLOW)


def _arcs() -> list[str]:
    """Return the touch of two arcs, step by step."""
    c = law(shapes.ARCS)
    sine0, cosine0 = traced(shapes.direction, c)
    touch = traced(shapes.arcs, c, _ETA)
    with sympy.evaluate(False):
        nearness = 1.0 / (c.wheel_profile_radius - c.rail_profile_radius)
        lean = sine0 + nearness * _ETA
    held = traced(shapes._held, lean)
    with sympy.evaluate(False):
        cosine = shapes.sqrt(1.0 - held * held)
        rise = (held + sine0) / (cosine + cosine0)
        beyond = (lean - held) / nearness
    nu, at, upper, sine, cos, mean, more, slope, height = map(
        sympy.Symbol,
        (r"\nu", "l", r"\bar l", r"\sin\gamma", r"\cos\gamma", "h", r"\eta^{+}", "H'", "H"),
    )
    inner = held.args[2]  # held from above, then from below
    top = {sympy.Float(shapes.STEEPEST): sympy.Symbol("s_{m}")}
    start = {sine0: _SINE, cosine0: _COSINE}
    return [
        *rows(r"\nu", [nearness]),
        *rows("l", [lean], {sine0: _SINE, nearness: nu}),
        *rows(r"\bar l", [inner], {lean: at, **top}),
        *rows(r"\sin\gamma", [held], {inner: upper, **top}),
        *rows(r"\cos\gamma", [cosine], {held: sine}),
        *rows("H'", [touch.slope], {held: sine, cosine: cos}),
        *rows("h", [rise], {held: sine, cosine: cos, **start}),
        *rows(r"\eta^{+}", [beyond], {lean: at, held: sine, nearness: nu}),
        *rows("H", [touch.height], {rise: mean, beyond: more, touch.slope: slope}),
        *rows(r"\rho", [touch.radius], {touch.height: height, nearness: nu}),
    ]


def _profiles() -> list[str]:
    return _touch(shapes.PROFILES)


def _between() -> list[str]:
    return _touch(shapes.BETWEEN)


BLOCKS = {
    "cone": Shown((shapes.cone,), _cone, "`Cone`, the paper's wheel"),
    "linear profile": Shown((shapes.linear,), _linear, f"`LinearProfile`, {BEYOND.lower()}"),
    "hollow tread": Shown((shapes.hollow,), _hollow, f"`HollowTread`, {BEYOND.lower()}"),
    "contact angle": Shown((shapes.direction,), _direction, "Contact angle at the centre"),
    "arcs": Shown((shapes.arcs,), _arcs, f"`ArcProfile`, {BEYOND.lower()}"),
    "profiles": Shown((shapes.profiles,), _profiles, "`ProfilePair`"),
    "family": Shown((shapes.between,), _between, "`ProfileFamily`"),
}
"""Blocks of the page, by their names."""
