"""Equations of wheel and rail on docs/physics.md."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import sympy
from equations_shown import Shown, rows
from symbols import (
    ALPHA,
    BETA,
    CONTACT,
    CREEP,
    EPSILON,
    NORMAL,
    PLACE,
    RAIL,
    RAIL_FORCE,
    RUN,
    SIDE,
    TOUCH,
    WIDTH,
    P,
    W,
    acting,
    like,
    marks,
    names_of,
    point_symbols,
    wheel_symbols,
    wheelset_with,
)
from written import latex, named, tidy, traced

from railenv.equations import contact, creep, shapes

_SIDE = r"\sigma"
_AT = point_symbols(_SIDE)
_NORMAL = like(contact.Normal, NORMAL, _SIDE)


def _lefts(text: str, index: str = _SIDE) -> str:
    return " ; ".join(map(str, marks(text, index)))


def _arc_sine(kind: SimpleNamespace) -> dict[sympy.Expr, sympy.Expr]:
    """Name sine and cosine of the contact angle at the centre."""
    shown = map(sympy.Symbol, (r"\sin\gamma_{0}", r"\cos\gamma_{0}"))
    return dict(zip(traced(shapes.direction, kind), shown, strict=True))


def _geometry() -> list[str]:
    """Return the contact of one wheel, with the anchor and the place of a law that has its own."""
    shifts = []

    def touch(_: Any, eta: sympy.Expr) -> shapes.Touch:
        shifts.append(eta)
        return like(shapes.Touch, TOUCH, _SIDE)

    kind = shapes.Law(touch, round_rail=True)
    p = wheelset_with(kind)
    found = traced(contact.point, SIDE, W, RAIL, p)
    anchor = dict(zip(traced(contact.reference, p.left, p), (_AT.anchor, _AT.level), strict=True))
    incline = {found.incline: _AT.incline}
    place = {traced(contact.place, found.touch, found.incline, found.stretch, p.left): _AT.touch.place}
    return [
        *rows(r"\eta_{\sigma}", shifts, anchor),
        *rows(_lefts(PLACE).split(" ; ")[0], [found.compression], anchor),
        *rows(r"r_{\sigma} ; \tau_{\sigma}", [found.radius, found.incline]),
        *rows(r"\chi_{\sigma}", [found.stretch], incline),
        *rows(r"R_{y\sigma}", [found.arm], place),
    ]


def _reference() -> list[str]:
    """Return the anchor and the place of the contact for both kinds of rail, as a table."""
    table = ["| rail of | $a_0$ | $d_0$ | $B_\\sigma$ |", "|---|---|---|---|"]
    for label, kind in (
        ("all other laws", shapes.PROFILES),
        ("`ArcProfile`, an arc of radius $R_r$", shapes.ARCS),
    ):
        p = wheelset_with(kind)
        found = [*traced(contact.reference, p.left, p)]
        found.append(traced(contact.place, _AT.touch, _AT.incline, _AT.stretch, p.left))
        names = _arc_sine(p.left) if kind.round_rail else {}
        cells = [f"${latex(tidy(e))}$" for e in named(found, names)]
        table.append(f"| {label} | {' | '.join(cells)} |")
    return table


def _normal_load() -> list[str]:
    found = traced(contact.normal_contact, _AT, W, RAIL, P)
    load, thrust = map(sympy.Symbol, (r"N_{z\sigma}", r"P_{\sigma}"))
    with sympy.evaluate(False):
        along = found.vertical * _AT.touch.slope
    return [
        *rows(r"N_{z\sigma}", [found.vertical]),
        *rows(r"P_{\sigma}", [along], {found.vertical: load}),
        *rows(_lefts(NORMAL[len("N_{z@} ") :]), found[1:], {along: thrust, found.vertical: load}),
    ]


def _creepages() -> list[str]:
    found = traced(contact.creepages, _AT, W, RUN, P)
    return rows(r"\xi_{x\sigma} ; \xi_{y\sigma} ; \xi_{s\sigma}", found)


def _kalker() -> list[str]:
    xi = like(contact.Creepage, r"\xi_{x@} \xi_{y@} \xi_{s@}", _SIDE)
    size = traced(contact.growth, _NORMAL, P)
    found = traced(contact.kalker, xi, _NORMAL, P)
    return [
        *rows(r"g_{\sigma}", [size]),
        *rows(_lefts(CREEP), found, {size: sympy.Symbol(r"g_{\sigma}")}),
    ]


def _saturation() -> list[str]:
    left, right = wheel_symbols("L"), wheel_symbols("R")
    magnitude = traced(contact.creep_magnitude, wheel_symbols(_SIDE))
    sums = names_of(
        [traced(contact.creep_magnitude, w) for w in (left, right)],
        [sympy.Symbol("S_{L}"), sympy.Symbol("S_{R}")],
    )
    ratio = traced(contact.saturation_ratio, [left, right], P)
    floor = sympy.Float(contact.CREEP_FORCE_FLOOR**2)
    alpha = traced(contact.saturation, left, right, P)[0]
    return [
        *rows(r"S_{\sigma}", [magnitude], {floor: EPSILON**2}),
        *rows(r"\beta", [ratio], sums),
        *rows(r"\alpha", [alpha], {ratio: BETA}),
    ]


def _polach() -> list[str]:
    gradient, turn = sympy.Symbol(r"\epsilon"), sympy.Symbol(r"\pi")
    alpha = traced(creep.polach, BETA, P.polach_adhesion, P.polach_slip)
    with sympy.evaluate(False):
        steep = BETA * (creep.pi / 4.0)
        quarter = {sympy.Float(creep.pi / 4.0): turn / sympy.Integer(4)}
        two = {sympy.Float(2.0 / creep.pi): sympy.Integer(2) / turn}
    return [
        *rows(r"\epsilon", [steep], quarter),
        *rows(r"\alpha", [alpha], {steep: gradient, **two}),
    ]


def _creep_part(whole: sympy.Expr, normal: sympy.Expr) -> sympy.Expr:
    """Return a sum without its last term, the part of the normal contact."""
    *creep_terms, last = whole.args
    if last != normal:
        raise ValueError(f"{whole} does not end in {normal}")
    with sympy.evaluate(False):
        return creep_terms[0] if len(creep_terms) == 1 else sympy.Add(*creep_terms)


def _rail_force() -> list[str]:
    found = traced(contact.rail_force, wheel_symbols(_SIDE), ALPHA, W, P)
    across = _creep_part(found.force_y, _NORMAL.lateral)
    up = _creep_part(found.force_z, _NORMAL.vertical)
    creeping = marks("C_{x@} C_{y@} C_{z@}", _SIDE)
    names = dict(zip((found.force_x, across, up), creeping, strict=True))
    return [
        *rows(r"C_{x\sigma} ; C_{y\sigma} ; C_{z\sigma}", [found.force_x, across, up]),
        *rows(_lefts(RAIL_FORCE[len("@ F_{x@} ") :]), found[2:], names),
    ]


def _flange() -> list[str]:
    y = sympy.Symbol("y")
    spring = traced(contact.flange_spring, SIDE, y, P)
    sides = {
        traced(contact.flange_spring, side, y, P): sympy.Symbol(f"T_{{{name}}}(y)")
        for side, name in ((+1, "L"), (-1, "R"))
    }
    blend = sympy.Float(contact.FLANGE_BLEND**2)
    return [
        *rows(r"T_{\sigma}(y)", [spring], {blend: WIDTH**2}),
        *rows("F_{t}(y)", [traced(contact.flange_force, y, P)], sides),
    ]


def _contact() -> list[str]:
    forces = traced(contact.rail_forces, W, RAIL, RUN, P)
    names: dict[sympy.Expr, sympy.Expr] = {}
    for force, index in zip(forces, ("L", "R"), strict=True):
        names |= names_of(force[2:], like(contact.RailForce, RAIL_FORCE, index)[2:])
    with sympy.evaluate(False):
        flange = contact.flange_force(W.y - RAIL.align, P)
    names[flange] = sympy.Symbol(r"F_{t}(y - y_{t})")
    found = acting(traced(contact.contact, W, RAIL, RUN, P))
    return rows(CONTACT.replace(" ", " ; "), found, names)


BLOCKS = {
    "geometry": Shown((contact.point,), _geometry, "Of one wheel"),
    "reference": Shown(
        (contact.reference, contact.place), _reference, "What differs with the rail", table=True
    ),
    "normal load": Shown((contact.normal_contact,), _normal_load, "Eq 4"),
    "creepages": Shown((contact.creepages,), _creepages, "Eq 1, creepages"),
    "creep forces": Shown((contact.kalker, contact.growth, contact.wheel), _kalker, "Eq 1, forces"),
    "saturation": Shown(
        (
            contact.creep_magnitude,
            contact.saturation_ratio,
            contact.share,
            contact.saturation,
            creep.heuristic,
        ),
        _saturation,
        "Eqs 2 and 3",
    ),
    "Polach": Shown((creep.polach,), _polach, "Beyond the paper"),
    "rail forces": Shown((contact.rail_force, contact.rail_forces), _rail_force, "Eqs 9, 10 and 11"),
    "flange": Shown((contact.flange_spring, contact.flange_force), _flange, "Eq 5"),
    "contact": Shown((contact.contact,), _contact, "The sums over the wheels in eq 6"),
}
"""Blocks of the page, by their names."""
