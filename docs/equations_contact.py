"""Equations of wheel and rail on docs/physics.md."""

from __future__ import annotations

import sympy
from equations_shown import Shown, rows
from symbols import (
    ALPHA,
    BETA,
    CONTACT,
    EPSILON,
    RAIL,
    RAIL_FORCE,
    RUN,
    SIDE,
    WIDTH,
    P,
    W,
    acting,
    like,
    names_of,
    wheel_symbols,
)
from written import traced

from railenv.equations import contact


def _geometry() -> list[str]:
    found = traced(contact.wheel, SIDE, W, RAIL, RUN, P)
    return rows(r"r_{\sigma} ; \gamma_{\sigma}", [found.radius, found.slope])


def _normal_load() -> list[str]:
    slope = sympy.Symbol(r"\gamma_{\sigma}")
    y, z, magnitude = traced(contact.normal_load, SIDE, slope, W, RAIL, P)
    n = sympy.Symbol(r"N_{z\sigma}")
    return [
        *rows(r"N_{z\sigma}", [z]),
        *rows(r"N_{y\sigma} ; N_{\sigma}", [y, magnitude], {z: n}),
    ]


def _creepages() -> list[str]:
    radius = sympy.Symbol(r"r_{\sigma}")
    found = traced(contact.creepages, SIDE, radius, W, RUN, P)
    return rows(r"\xi_{x\sigma} ; \xi_{y\sigma} ; \xi_{s\sigma}", found)


def _kalker() -> list[str]:
    xi = like(contact.Creepage, r"\xi_{x@} \xi_{y@} \xi_{s@}", r"\sigma")
    found = traced(contact.kalker, xi, sympy.Symbol(r"N_{z\sigma}"), P)
    return rows(r"F^{\ast}_{x\sigma} ; F^{\ast}_{y\sigma} ; M^{\ast}_{z\sigma}", found)


def _saturation() -> list[str]:
    left, right = wheel_symbols("L"), wheel_symbols("R")
    magnitude = traced(contact.creep_magnitude, wheel_symbols(r"\sigma"))
    sums = names_of(
        [traced(contact.creep_magnitude, w) for w in (left, right)],
        [sympy.Symbol("S_{L}"), sympy.Symbol("S_{R}")],
    )
    ratio = traced(contact.saturation_ratio, left, right, P)
    floor = sympy.Float(contact.CREEP_FORCE_FLOOR**2)
    return [
        *rows(r"S_{\sigma}", [magnitude], {floor: EPSILON**2}),
        *rows(r"\beta", [ratio], sums),
        *rows(r"\alpha", [traced(contact.saturation, left, right, P)], {ratio: BETA}),
    ]


def _rail_force() -> list[str]:
    found = traced(contact.rail_force, wheel_symbols(r"\sigma"), ALPHA, W, P)
    lefts = " ; ".join(str(s) for s in like(contact.RailForce, RAIL_FORCE, r"\sigma")[1:])
    return rows(lefts, found[1:])


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
        pairs = names_of(force, like(contact.RailForce, RAIL_FORCE, index))
        names |= {e: s for e, s in pairs.items() if str(s) != f"F_{{x{index}}}"} | {
            force.force_x: sympy.Symbol(f"F_{{x{index}}}")
        }
    with sympy.evaluate(False):
        flange = contact.flange_force(W.y - RAIL.align, P)
    names[flange] = sympy.Symbol(r"F_{t}(y - y_{t})")
    found = acting(traced(contact.contact, W, RAIL, RUN, P))
    return rows(CONTACT.replace(" ", " ; "), found, names)


BLOCKS = {
    "geometry": Shown((contact.wheel,), _geometry, "With eqs 1 and 4"),
    "normal load": Shown((contact.normal_load,), _normal_load, "Eq 4"),
    "creepages": Shown((contact.creepages,), _creepages, "Eq 1, creepages"),
    "creep forces": Shown((contact.kalker,), _kalker, "Eq 1, forces"),
    "saturation": Shown(
        (contact.creep_magnitude, contact.saturation_ratio, contact.saturation),
        _saturation,
        "Eqs 2 and 3",
    ),
    "rail forces": Shown((contact.rail_force, contact.rail_forces), _rail_force, "Eqs 9, 10 and 11"),
    "flange": Shown((contact.flange_spring, contact.flange_force), _flange, "Eq 5"),
    "contact": Shown((contact.contact,), _contact, "The sums over the wheels in eq 6"),
}
"""Blocks of the page, by their names."""
