"""Equations and numbers of the Cooperrider bogie on docs/physics.md."""

from __future__ import annotations

import sympy
from equations_shown import Shown, balances, rows
from symbols import COOPERRIDER, FRAME, RUN, WHEELSET, moving, names_of
from written import latex, traced

from railenv.equations import cooperrider
from railenv.vehicles import COOPERRIDER as COOPERRIDER_VALUES
from railenv.vehicles import CooperriderParameters, describe

_SOURCE = "Kaas-Petersen 1986"


def _cooperrider_creep() -> list[str]:
    y, psi, dy, dpsi = (sympy.Symbol(c) for c in ("y", r"\psi", r"\dot y", r"\dot\psi"))
    xi_x, xi_y, xi = traced(cooperrider.creepages, y, psi, dy, dpsi, RUN.speed, COOPERRIDER)
    marks = [sympy.Symbol(name) for name in (r"\xi_{x}", r"\xi_{y}", r"\xi")]
    floor = {sympy.Float(cooperrider.CREEPAGE_FLOOR_SQUARED): sympy.Symbol("10^{-18}")}
    stiffness = traced(cooperrider.creep_force, marks[2], COOPERRIDER)
    with sympy.evaluate(False):
        u = COOPERRIDER.creep_coefficient * marks[2] / COOPERRIDER.adhesion_force
    return [
        *rows(r"\xi_{x} ; \xi_{y}", [xi_x, xi_y]),
        *rows(r"\xi", [xi], {xi_x: marks[0], xi_y: marks[1]} | floor),
        *rows("u", [u]),
        *rows("q", [stiffness], {u: sympy.Symbol("u")}),
    ]


def _cooperrider_springs() -> list[str]:
    w = moving("i")
    primary = traced(
        cooperrider.primary, WHEELSET, w.y, w.psi, FRAME.y, FRAME.psi, FRAME.phi, COOPERRIDER
    )
    secondary = traced(
        cooperrider.secondary,
        FRAME.y,
        FRAME.psi,
        FRAME.phi,
        FRAME.dy,
        FRAME.dpsi,
        FRAME.dphi,
        COOPERRIDER,
    )
    flange = traced(cooperrider.flange_force, sympy.Symbol("y"), COOPERRIDER)
    return rows("A_{i} ; B_{i} ; A_{5} ; A_{6} ; A_{7} ; F_{T}(y)", [*primary, *secondary, flange])


def _cooperrider_parameters() -> list[str]:
    table = ["| symbol | value | unit | meaning |", "|---|---:|---|---|"]
    for row in describe(CooperriderParameters):
        value = f"{getattr(COOPERRIDER_VALUES, row.name):g}".replace("e+0", "e")
        symbol = latex(getattr(COOPERRIDER, row.name))
        table.append(f"| ${symbol}$ | {value} | {row.unit} | {row.meaning} |")
    return table


def _cooperrider() -> list[str]:
    p = COOPERRIDER
    one, two = moving("1"), moving("2")
    q = [one.y, one.psi, two.y, two.psi, FRAME.y, FRAME.psi, FRAME.phi]
    dq = [one.dy, one.dpsi, two.dy, two.dpsi, FRAME.dy, FRAME.dpsi, FRAME.dphi]
    u = [sympy.Symbol(name) for name in ("M_{w1}", "M_{w2}", "M_{b}")]
    found = traced(cooperrider.cooperrider_bogie, [*q, *dq], u, *RUN[:3], p)[7:]
    names: dict[sympy.Expr, sympy.Expr] = {}
    for s, w, i in ((+1, one, "1"), (-1, two, "2")):
        springs = traced(cooperrider.primary, s, w.y, w.psi, FRAME.y, FRAME.psi, FRAME.phi, p)
        names |= names_of(springs, [sympy.Symbol(f"A_{{{i}}}"), sympy.Symbol(f"B_{{{i}}}")])
        *creep, xi = traced(cooperrider.creepages, w.y, w.psi, w.dy, w.dpsi, RUN.speed, p)
        names |= names_of(creep, [sympy.Symbol(rf"\xi_{{{c}{i}}}") for c in "xy"])
        names[traced(cooperrider.creep_force, xi, p)] = sympy.Symbol(f"q_{{{i}}}")
        names[traced(cooperrider.flange_force, w.y, p)] = sympy.Symbol(f"F_{{T}}(y_{{{i}}})")
    frame = (FRAME.y, FRAME.psi, FRAME.phi, FRAME.dy, FRAME.dpsi, FRAME.dphi)
    reaction = traced(cooperrider.secondary, *frame, p)
    names |= names_of(reaction, [sympy.Symbol(f"A_{{{i}}}") for i in "567"])
    inertias = [p.wheelset_mass, p.wheelset_yaw_inertia] * 2
    inertias += [p.frame_mass, p.frame_yaw_inertia, p.frame_roll_inertia]
    left = [rf"\ddot {c}_{{{i}}}" for i in "12" for c in ("y", r"\psi")]
    left += [rf"\ddot {c}_{{b}}" for c in ("y", r"\psi", r"\phi")]
    return balances(" ; ".join(left), found, inertias, names)


BLOCKS = {
    "Cooperrider creep": Shown(
        (cooperrider.creepages, cooperrider.creep_force), _cooperrider_creep, _SOURCE
    ),
    "Cooperrider springs": Shown(
        (cooperrider.primary, cooperrider.secondary, cooperrider.flange_force),
        _cooperrider_springs,
        _SOURCE,
    ),
    "Cooperrider parameters": Shown((), _cooperrider_parameters, "", table=True),
    "Cooperrider bogie": Shown((cooperrider.cooperrider_bogie,), _cooperrider, _SOURCE),
}
"""Blocks of the page, by their names."""
