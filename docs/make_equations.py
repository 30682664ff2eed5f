"""Write the equations of docs/physics.md from the code: ``python docs/make_equations.py``.

The functions of :mod:`railenv.equations` are run on symbols, and what they return is printed in the
order in which it is written there. A function's result that another one uses appears there under its
name. The text around the equations is edited in the page itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import sympy
from blocks import refilled
from symbols import (
    ALPHA,
    BETA,
    CONTACT,
    COOPERRIDER,
    EPSILON,
    FRAME,
    RAIL,
    RAIL_FORCE,
    RUN,
    SIDE,
    SUSPENSION,
    WHEELSET,
    WIDTH,
    P,
    W,
    like,
    motion,
    names_of,
    wheel_symbols,
)
from written import Names, block, equation, latex, named, over, tidy, traced

from railenv.equations import (
    actuator,
    bogie,
    contact,
    cooperrider,
    dual_wheelset,
    equipped,
    loads,
    sensors,
    suspension,
    wheelset,
)
from railenv.equations.coordinates import AT_REST, Motion, Rail
from railenv.vehicles import COOPERRIDER as COOPERRIDER_VALUES
from railenv.vehicles import CooperriderParameters, describe

PAGE = Path(__file__).resolve().parent / "physics.md"

Function = Callable[..., Any]

# ------------------------------------------------------------------------------ equations


@dataclass(frozen=True)
class Shown:
    """Equations of the page that one or more functions give.

    Attributes
    ----------
    functions : tuple of callable
        What the equations come from.
    rows : callable
        Returns the equations.
    paper : str
        Where they stand in the paper.
    table : bool
        Whether the rows are those of a table, not equations.
    """

    functions: tuple[Function, ...]
    rows: Callable[[], list[str]]
    paper: str
    table: bool = False

    def markdown(self) -> str:
        """Return caption and equations."""
        origin = ", ".join(
            f"`{f.__module__.rpartition('.')[2]}.{f.__qualname__}`" for f in self.functions
        )
        shown = "\n".join(self.rows()) if self.table else block(self.rows())
        return f"*{self.paper}: {origin}*\n\n{shown}" if origin else shown


def rows(lefts: str, expressions: Sequence[sympy.Expr], names: Names | None = None) -> list[str]:
    """Return one equation for each expression; ``lefts`` has their left-hand sides, parted by ``;``."""
    right = [tidy(expression) for expression in named(expressions, names or {})]
    return [equation(a.strip(), b) for a, b in zip(lefts.split(";"), right, strict=True)]


def balances(
    lefts: str, expressions: Sequence[sympy.Expr], inertias: Sequence[sympy.Expr], names: Names
) -> list[str]:
    """Return equations of motion, accelerations multiplied by the inertia that they are divided by."""
    right = [over(tidy(e), m) for e, m in zip(named(expressions, names), inertias, strict=True)]
    left = [f"{latex(m)} {a.strip()}" for m, a in zip(inertias, lefts.split(";"), strict=True)]
    return [equation(a, b) for a, b in zip(left, right, strict=True)]


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
    found = traced(contact.contact, W, RAIL, RUN, P)
    return rows(CONTACT.replace(" ", ";"), found, names)


def _yaw_damper() -> list[str]:
    return rows("F_{d}(v)", [traced(suspension.yaw_damper_force, sympy.Symbol("v"), P)])


def _damper_of(w: Motion, frame: Motion) -> dict[sympy.Expr, sympy.Expr]:
    """Name the force of the yaw damper in the primary suspension, with the speed it sees."""
    with sympy.evaluate(False):
        speed = -P.primary_arm * (frame.dpsi - w.dpsi)
    shown = sympy.Symbol(rf"F_{{d}}\left( {latex(tidy(speed))} \right)")
    return {traced(suspension.yaw_damper_force, speed, P): shown}


def _primary() -> list[str]:
    w = motion("w")
    found = traced(suspension.primary, WHEELSET, w, FRAME, RUN, P)
    lefts = " ; ".join(SUSPENSION.replace("@", "").split())
    return rows(lefts, found, _damper_of(w, FRAME))


def _primary_at_rest() -> list[str]:
    w = motion("w")
    found = traced(suspension.primary, WHEELSET, w, AT_REST, RUN, P)
    lefts = " ; ".join(SUSPENSION.replace("@", "").split())
    return rows(lefts, found, _damper_of(w, AT_REST))


def _primary_reaction() -> list[str]:
    on_wheelset = like(suspension.SuspensionForce, SUSPENSION, "")
    found = traced(suspension.primary_reaction, WHEELSET, on_wheelset, P)
    return rows(r"\bar F_{sy} ; \bar F_{sz} ; \bar M_{sx} ; \bar M_{sz}", found)


def _secondary() -> list[str]:
    lefts = "F_{2y} ; F_{2z} ; M_{2x} ; M_{2z}"
    return rows(lefts, traced(suspension.secondary, FRAME, P))


CARRIED = loads.CarriedMass(sympy.Symbol("m_{y}"), sympy.Symbol("m_{z}"))


def _loads() -> list[str]:
    lateral = traced(loads.lateral_load, CARRIED, RUN, P)
    vertical = traced(loads.vertical_load, CARRIED, RUN, P)
    return rows("W_{y} ; W_{z}", [lateral, vertical])


def _carried() -> list[str]:
    cases = (
        ("wheelset of `Bogie`", loads.bogie_wheelset_load),
        ("frame of `Bogie`", loads.bogie_frame_load),
        ("wheelset of `DualWheelset`", loads.dual_wheelset_load),
    )
    table = ["| body | `load_bookkeeping` | lateral, $m_y$ | vertical, $m_z$ |", "|---|---|---|---|"]
    for body, function in cases:
        for printed, choice in enumerate(("once", "printed")):
            p = SimpleNamespace(**{**vars(P), "printed_loads": printed})
            masses = " | ".join(f"${latex(tidy(sympy.expand(m)))}$" for m in function(p))
            table.append(f'| {body} | `"{choice}"` | {masses} |')
    return table


def _load_names(carried: loads.CarriedMass) -> dict[sympy.Expr, sympy.Expr]:
    return {
        traced(loads.lateral_load, carried, RUN, P): sympy.Symbol("W_{y}"),
        traced(loads.vertical_load, carried, RUN, P): sympy.Symbol("W_{z}"),
    }


def _wheelset() -> list[str]:
    forces = like(suspension.SuspensionForce, SUSPENSION, "")
    moment = sympy.Symbol("M_{w}")
    found = traced(wheelset.accelerations, W, RAIL, forces, moment, CARRIED, RUN, P)
    names = names_of(traced(contact.contact, W, RAIL, RUN, P), map(sympy.Symbol, CONTACT.split()))
    inertias = [P.wheelset_mass, P.wheelset_mass, P.wheelset_roll_inertia, P.wheelset_yaw_inertia]
    left = r"\ddot y ; \ddot z ; \ddot\phi ; \ddot\psi"
    return balances(left, found, inertias, names | _load_names(CARRIED))


def _plant(equations: Function, inputs: Sequence[str], count: int) -> tuple[list[Any], Any]:
    """Run the equations of a plant on symbols; the rates of its bodies, and the motions."""
    motions = [motion(index) for index in ("w1", "w2", "b")[:count]]
    x = [c for m in motions for c in m[:4]] + [c for m in motions for c in m[4:]]
    u = [sympy.Symbol(re.sub("_(.+)", r"_{\1}", name)) for name in inputs]
    return traced(equations, x, u, *RUN, P), motions


def _reactions(motions: Sequence[Motion]) -> dict[sympy.Expr, sympy.Expr]:
    names: dict[sympy.Expr, sympy.Expr] = {}
    for s, w, index in zip((+1, -1), motions, "12", strict=False):
        on = traced(suspension.primary, s, w, motions[2], RUN, P)
        reaction = traced(suspension.primary_reaction, s, on, P)
        marks = (r"\bar F_{sy@}", r"\bar F_{sz@}", r"\bar M_{sx@}", r"\bar M_{sz@}")
        names |= names_of(reaction, [sympy.Symbol(m.replace("@", index)) for m in marks])
    return names


def _frame() -> list[str]:
    found, motions = _plant(bogie.bogie, bogie.INPUTS, 3)
    secondary = traced(suspension.secondary, motions[2], P)
    marks = map(sympy.Symbol, ("F_{2y}", "F_{2z}", "M_{2x}", "M_{2z}"))
    names = _reactions(motions) | names_of(secondary, marks)
    names |= _load_names(traced(loads.bogie_frame_load, P))
    inertias = [P.frame_mass, P.frame_mass, P.frame_roll_inertia, P.frame_yaw_inertia]
    left = r"\ddot y_{b} ; \ddot z_{b} ; \ddot\phi_{b} ; \ddot\psi_{b}"
    return balances(left, found[-4:], inertias, names)


def _dual_wheelset() -> list[str]:
    found, motions = _plant(dual_wheelset.dual_wheelset, dual_wheelset.INPUTS, 2)
    u = [sympy.Symbol(re.sub("_(.+)", r"_{\1}", name)) for name in dual_wheelset.INPUTS]
    carried = traced(loads.dual_wheelset_load, P)
    names = _load_names(carried)
    for i, (s, w) in enumerate(zip((+1, -1), motions, strict=True)):
        index = str(i + 1)
        on = traced(suspension.primary, s, w, AT_REST, RUN, P)
        names |= names_of(on, like(suspension.SuspensionForce, SUSPENSION, index))
        rail = Rail(u[2 + i], u[4 + i], u[6 + i])
        marks = [sympy.Symbol(m.replace("}", index + "}")) for m in CONTACT.split()]
        names |= names_of(traced(contact.contact, w, rail, RUN, P), marks)
    inertias = [P.wheelset_mass, P.wheelset_mass, P.wheelset_roll_inertia, P.wheelset_yaw_inertia]
    left = " ; ".join(rf"\ddot {c}_{{w{i}}}" for i in (1, 2) for c in ("y", "z", r"\phi", r"\psi"))
    both = balances(left, found[-8:], inertias * 2, names)
    leading, trailing = both[:4], both[4:]
    if trailing != [re.sub(r"1\}", "2}", row) for row in leading]:
        raise ValueError("the wheelsets have different equations; show both")
    return [re.sub(r"1\}", "i}", row) for row in leading]


# -------------------------------------------------------------------- actuators, sensors

_STATE = actuator.ActuatorState(sympy.Symbol("T"), sympy.Symbol("q"))
_TURN = {sympy.Float(actuator.TWO_PI): sympy.Symbol(r"2 \pi")}


def _clip(x: sympy.Expr, limit: sympy.Expr, text: str) -> dict[sympy.Expr, sympy.Expr]:
    shown = rf"\mathrm{{clip}}\left( {text}, {latex(limit)} \right)"
    return {traced(actuator.clamp, x, limit): sympy.Symbol(shown)}


def _actuator() -> list[str]:
    x, limit, command = (sympy.Symbol(name) for name in ("x", "x_{m}", "u"))
    found = traced(actuator.actuator_rates, _STATE, command, P)
    clips = _clip(command, P.actuator_limit, "u") | _clip(_STATE.rate, P.actuator_rate_limit, "q")
    applied = traced(actuator.applied_moment, _STATE, P)
    return [
        *rows(r"\dot T ; \dot q", found, clips | _TURN),
        *rows("M", [applied], _clip(_STATE.moment, P.actuator_limit, "T")),
        *rows(r"\mathrm{clip}\left( x, x_{m} \right)", [traced(actuator.clamp, x, limit)]),
    ]


def _parallel_damper() -> list[str]:
    rate = sympy.Symbol(r"\Delta\dot\psi")
    return rows("M_{p}", [traced(actuator.parallel_damper_moment, rate, P)])


def _sensors() -> list[str]:
    acceleration = sympy.Symbol(r"\ddot y")
    force = traced(sensors.specific_force, acceleration, W, RUN, P)
    rate = traced(sensors.inertial_yaw_rate, W, RUN)
    state = sensors.SensorState(sympy.Symbol("A"), sympy.Symbol("G"))
    names = {force: sympy.Symbol("f_{y}"), rate: sympy.Symbol(r"\omega_{z}")}
    filtered = traced(sensors.sensor_rates, state, acceleration, W, RUN, P)
    return [
        *rows(r"f_{y} ; \omega_{z}", [force, rate]),
        *rows(r"\dot A ; \dot G", filtered, names | _TURN),
    ]


def _signals() -> list[str]:
    equipment = equipped.EQUIPMENT["bogie", "none"]
    motions = [motion(index) for index in ("w1", "w2", "b")]
    x = [c for m in motions for c in m[:4]] + [c for m in motions for c in m[4:]]
    x += [sympy.Symbol("A"), sympy.Symbol("G")]
    u = [sympy.Symbol(re.sub("_(.+)", r"_{\1}", name)) for name in equipment.inputs]
    found = traced(equipment.signals, x, u, *RUN, P)[1:5]
    rail = Rail(u[3], u[5], u[7])
    names: dict[sympy.Expr, sympy.Expr] = {}
    with sympy.evaluate(False):
        y = motions[0].y - rail.align
    for force, index in zip(traced(contact.rail_forces, motions[0], rail, RUN, P), "LR", strict=True):
        marks = like(contact.RailForce, RAIL_FORCE, index)
        names |= {force.force_y: marks.force_y, force.force_z: marks.force_z}
        spring = traced(contact.flange_spring, force.side, y, P)
        names[spring] = sympy.Symbol(f"T_{{{index}}}(y - y_{{t}})")
    return rows("Y_{L} ; Q_{L} ; Y_{R} ; Q_{R}", found, names)


# --------------------------------------------------------------------------- Cooperrider


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
    w = motion("i")
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
    one, two = motion("1"), motion("2")
    q = [one.y, one.psi, two.y, two.psi, FRAME.y, FRAME.psi, FRAME.phi]
    dq = [one.dy, one.dpsi, two.dy, two.dpsi, FRAME.dy, FRAME.dpsi, FRAME.dphi]
    u = [sympy.Symbol(name) for name in ("M_{w1}", "M_{w2}", "M_{b}")]
    found = traced(cooperrider.cooperrider_bogie, [*q, *dq], u, *RUN, p)[7:]
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


# ---------------------------------------------------------------------------------- page

_BEYOND = "Beyond the paper"

SHOWN = {
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
    "yaw damper": Shown((suspension.yaw_damper_force,), _yaw_damper, "Eq 7"),
    "primary": Shown((suspension.primary,), _primary, "Eqs 8 and 12, on a wheelset"),
    "primary reaction": Shown((suspension.primary_reaction,), _primary_reaction, "Eq 12, on the frame"),
    "primary at rest": Shown(
        (suspension.primary,), _primary_at_rest, "Eqs 8 and 12 with a frame at rest"
    ),
    "secondary": Shown((suspension.secondary,), _secondary, _BEYOND),
    "loads": Shown((loads.lateral_load, loads.vertical_load), _loads, "Loads of eq 6"),
    "carried masses": Shown(
        (
            loads.bogie_load_mass,
            loads.bogie_wheelset_load,
            loads.bogie_frame_load,
            loads.dual_wheelset_load,
        ),
        _carried,
        "Masses whose load a body carries",
        table=True,
    ),
    "wheelset": Shown((wheelset.accelerations,), _wheelset, "Eq 6, wheelset"),
    "frame": Shown((bogie.bogie,), _frame, "Eq 6, frame"),
    "dual wheelset": Shown((dual_wheelset.dual_wheelset,), _dual_wheelset, "Eq 6 without the frame"),
    "actuator": Shown(
        (actuator.actuator_rates, actuator.applied_moment, actuator.clamp), _actuator, _BEYOND
    ),
    "parallel damper": Shown((actuator.parallel_damper_moment,), _parallel_damper, _BEYOND),
    "sensors": Shown(
        (sensors.specific_force, sensors.inertial_yaw_rate, sensors.sensor_rates), _sensors, _BEYOND
    ),
    "signals": Shown((equipped.Equipment.signals,), _signals, _BEYOND),
    "Cooperrider creep": Shown(
        (cooperrider.creepages, cooperrider.creep_force), _cooperrider_creep, "Kaas-Petersen 1986"
    ),
    "Cooperrider springs": Shown(
        (cooperrider.primary, cooperrider.secondary, cooperrider.flange_force),
        _cooperrider_springs,
        "Kaas-Petersen 1986",
    ),
    "Cooperrider parameters": Shown((), _cooperrider_parameters, "", table=True),
    "Cooperrider bogie": Shown((cooperrider.cooperrider_bogie,), _cooperrider, "Kaas-Petersen 1986"),
}
"""Every block of equations of the page, by the name in its comments."""


def page(text: str) -> str:
    """Return the page with all its equations made anew."""
    return refilled(text, {name: shown.markdown for name, shown in SHOWN.items()})


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PAGE}")
