"""Equations of the paper's bogie and dual wheelset on docs/physics.md, from their assemblies."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import sympy
from equations_shown import BEYOND, Shown, balances, rows
from symbols import (
    CONTACT,
    RAIL,
    REACTION,
    RUN,
    SECONDARY,
    SUSPENSION,
    WHEELSET,
    P,
    acting,
    marks,
    moving,
    names_of,
    parameters,
)
from written import latex, tidy, traced

from railenv.equations import bodies, contact, elements, loads, motion
from railenv.equations.coordinates import Rail, Running, Site, Wrench, at_site
from railenv.equations.elements import End, Relative
from railenv.equipment import Actuator, Sensors
from railenv.vehicles import TABLE_1, Vehicle, templates
from railenv.vehicles.assembly import Assembly

_TABLES = ("bogie.toml", "dual_wheelset.toml")

HERE: Running = traced(at_site, RUN, Site())
"""The running conditions at a body's place, which in a steady run are those of the vehicle."""


def assembled(name: str, symbols: Any = P) -> Any:
    """Return one of the package's assemblies with symbols in all fields."""
    numbers = TABLE_1.parameters()
    data = templates.data_of(name, ())
    return Assembly.described(data, name, parameters=numbers).with_numbers(vars(symbols))


class OnSymbols:
    """An assembly on symbols.

    Parameters
    ----------
    name : str
        Of one of the package's.
    indices : mapping of str to str
        Index of the coordinates of each body that moves.
    rail : Rail
        Under the leading wheelset.
    """

    def __init__(self, name: str, indices: Mapping[str, str], rail: Rail = RAIL) -> None:
        self.numbers = assembled(name)
        self.motions = {body: moving(index) for body, index in indices.items()}
        self.x = [c for m in self.motions.values() for c in m[:4]]
        self.x += [c for m in self.motions.values() for c in m[4:8]]
        driven = [e.name for e in self.numbers.elements if e.n_inputs]
        moments = [f"M_{{{indices.get(n[2:]) or 'w'}}}" for n in driven]
        trailing = Rail(*(sympy.Symbol(s.name.replace("t", "t2")) for s in RAIL))
        self.rails = (rail, trailing)
        irregularity = [part for pair in zip(*self.rails, strict=True) for part in pair]
        self.u = [*map(sympy.Symbol, moments), *irregularity]

    def seen(self, name: str) -> tuple[Any, End, End, Relative]:
        """Return an element, its ends in both bodies, and the motion that it sees."""
        e = next(e for e in self.numbers.elements if e.name == name)
        return e, *traced(motion.seen_by, self.numbers, e, self.motions, RUN)

    def wrench(self, name: str) -> Wrench:
        """Return what an element does to its first body, about the attachment."""
        e, _, _, seen = self.seen(name)
        found: Wrench = traced(e.law, e, seen, [], [])[0]
        return found

    def on(self, body: str, name: str) -> Wrench:
        """Return what an element does to a body, about its centre."""
        e, a, b, _ = self.seen(name)
        wrench = self.wrench(name)
        if body == e.between[0]:
            return traced(elements.at_centre, a.arm, wrench)
        return traced(elements.at_centre, b.arm, traced(elements.opposite, wrench))

    def balances(self, body: str, lefts: str, names: Mapping[Any, Any]) -> list[str]:
        """Return the equations of motion of a body, with names for what acts on it."""
        first = list(self.motions).index(body) * 4
        n = len(self.x) // 2
        found = traced(motion.rates, self.numbers, self.x, self.u, RUN, {})[n + first : n + first + 4]
        p = self.numbers.body(body)
        load = traced(loads.load, p, HERE, self.numbers.gravity)
        names = {**names, load.force_y: sympy.Symbol("W_{y}"), load.force_z: sympy.Symbol("W_{z}")}
        return balances(lefts, found, [p.mass, p.mass, p.roll_inertia, p.yaw_inertia], names)

    def names_on(self, wheelset: str, index: str) -> dict[Any, Any]:
        """Name what acts on a wheelset."""
        rail = self.rails[int(wheelset[1]) - 1]
        touching = traced(
            contact.contact, self.motions[wheelset], rail, HERE, self.numbers.body(wheelset)
        )
        damper = self.on(wheelset, f"damper_{wheelset}").yaw
        names = names_of(acting(self.on(wheelset, f"primary_{wheelset}")), marks(SUSPENSION, index))
        names |= names_of(acting(touching), marks(CONTACT.replace("}", "@}"), index))
        return {**names, damper: -sympy.Symbol(f"M_{{d{index}}}")}


BOGIE = OnSymbols("bogie", {"w1": "", "w2": "w2", "b": "b"})
BOTH = OnSymbols("bogie", {"w1": "w1", "w2": "w2", "b": "b"})
DUAL = OnSymbols(
    "dual_wheelset", {"w1": "w1", "w2": "w2"}, Rail(*(sympy.Symbol(f"{c}_{{t1}}") for c in "yzf"))
)


def _either(name: str) -> OnSymbols:
    """Return an assembly whose leading wheelset is on side s, and so may be either."""
    vehicle = OnSymbols(name, {"w1": "w", "w2": "w2"} | ({"b": "b"} if name == "bogie" else {}))
    with sympy.evaluate(False):
        vehicle.numbers.body("w1").x = WHEELSET * P.half_wheelbase
    return vehicle


# ----------------------------------------------------------------------- suspension


def _yaw_damper() -> list[str]:
    e = BOGIE.seen("damper_w1")[0]
    return rows("F_{d}(v)", [traced(elements.yaw_damper_force, sympy.Symbol("v"), e)])


def _primary_of(name: str) -> list[str]:
    vehicle = _either(name)
    spring, damper = vehicle.wrench("primary_w1"), vehicle.wrench("damper_w1")
    e, _, _, seen = vehicle.seen("damper_w1")
    with sympy.evaluate(False):
        speed = -e.y * seen.dyaw
        moment = -damper.yaw
    shown = sympy.Symbol(rf"F_{{d}}\left( {latex(tidy(speed))} \right)")
    force = {traced(elements.yaw_damper_force, speed, e): shown}
    lefts = " ; ".join(SUSPENSION.replace("@", "").split())
    return [*rows(lefts, acting(spring)), *rows("M_{d}", [moment], force)]


def _primary() -> list[str]:
    return _primary_of("bogie")


def _primary_at_rest() -> list[str]:
    return _primary_of("dual_wheelset")


def _primary_reaction() -> list[str]:
    _, _, frame, _ = _either("bogie").seen("primary_w1")
    f_y, f_z, m_x, m_z = marks(SUSPENSION)
    on_wheelset = Wrench(force_y=f_y, force_z=f_z, roll=m_x, yaw=m_z)
    found = traced(elements.at_centre, frame.arm, traced(elements.opposite, on_wheelset))
    return rows(" ; ".join(map(str, marks(REACTION))), acting(found))


def _secondary() -> list[str]:
    return rows(SECONDARY.replace(" ", " ; "), acting(BOGIE.on("b", "secondary")))


# ----------------------------------------------------------------------------- loads


def _loads() -> list[str]:
    m_y, m_z = sympy.Symbol("m_{y}"), sympy.Symbol("m_{z}")
    lateral = traced(loads.lateral_load, m_y, RUN, P.gravity)
    vertical = traced(loads.vertical_load, m_z, RUN, P.gravity)
    return rows("W_{y} ; W_{z}", [lateral, vertical])


def _load_height() -> list[str]:
    p = SimpleNamespace(
        mass=sympy.Symbol("m"),
        lateral_load_mass=sympy.Symbol("m_{y}"),
        vertical_load_mass=sympy.Symbol("m_{z}"),
        load_height=sympy.Symbol("h_{c}"),
        z=P.frame_height,
    )
    return rows("M_{x}", [traced(loads.load, p, RUN, P.gravity).roll])


def _turning() -> list[str]:
    p = SimpleNamespace(yaw_inertia=sympy.Symbol("I_{z}"))
    return rows("M_{z}", [traced(bodies.turning, RUN, p).yaw])


def _carried() -> list[str]:
    cases = (
        ("wheelset of `Bogie`", "bogie", "w1"),
        ("frame of `Bogie`", "bogie", "b"),
        ("wheelset of `DualWheelset`", "dual_wheelset", "w1"),
    )
    table = ["| body | `load_bookkeeping` | lateral, $m_y$ | vertical, $m_z$ |", "|---|---|---|---|"]
    for label, name, body in cases:
        for printed, choice in enumerate(("once", "printed")):
            p = assembled(name, parameters(Vehicle, Actuator, Sensors, printed_loads=printed)).body(
                body
            )
            carried = (p.lateral_load_mass, p.vertical_load_mass)
            masses = " | ".join(f"${latex(tidy(sympy.expand(m)))}$" for m in carried)
            table.append(f'| {label} | `"{choice}"` | {masses} |')
    return table


# ------------------------------------------------------------------ equations of motion


def _wheelset() -> list[str]:
    left = r"\ddot y ; \ddot z ; \ddot\phi ; \ddot\psi"
    return BOGIE.balances("w1", left, BOGIE.names_on("w1", ""))


def _frame() -> list[str]:
    names = names_of(acting(BOTH.on("b", "secondary")), marks(SECONDARY))
    for w in ("w1", "w2"):
        names |= names_of(acting(BOTH.on("b", f"primary_{w}")), marks(REACTION, w[1]))
        names[BOTH.on("b", f"damper_{w}").yaw] = sympy.Symbol(f"M_{{d{w[1]}}}")
    left = r"\ddot y_{b} ; \ddot z_{b} ; \ddot\phi_{b} ; \ddot\psi_{b}"
    return BOTH.balances("b", left, names)


def _dual_wheelset() -> list[str]:
    both: list[list[str]] = []
    for w in ("w1", "w2"):
        left = " ; ".join(rf"\ddot {c}_{{{w}}}" for c in ("y", "z", r"\phi", r"\psi"))
        both.append(DUAL.balances(w, left, DUAL.names_on(w, w[1])))
    leading, trailing = ([re.sub(r"(?<!\^\{)[12]\}", "i}", row) for row in found] for found in both)
    if leading != trailing:
        raise ValueError("the wheelsets have different equations; show both")
    return leading


BLOCKS = {
    "yaw damper": Shown((elements.yaw_damper_force,), _yaw_damper, "Eq 7"),
    "primary": Shown((elements.spring, elements.yaw_damper), _primary, "Eqs 8 and 12, on a wheelset"),
    "primary reaction": Shown(
        (elements.opposite, elements.at_centre), _primary_reaction, "Eq 12, on the frame"
    ),
    "primary at rest": Shown(
        (elements.spring, elements.yaw_damper),
        _primary_at_rest,
        "Eqs 8 and 12 with a frame at rest",
    ),
    "secondary": Shown((elements.spring,), _secondary, BEYOND),
    "loads": Shown((loads.lateral_load, loads.vertical_load, loads.load), _loads, "Loads of eq 6"),
    "load height": Shown((loads.load,), _load_height, BEYOND),
    "turning": Shown((bodies.turning,), _turning, BEYOND),
    "carried masses": Shown(_TABLES, _carried, "Masses whose load a body carries", table=True),
    "wheelset": Shown(
        (motion.rates, bodies.accelerations, bodies.gyroscopic), _wheelset, "Eq 6, wheelset"
    ),
    "frame": Shown((motion.rates,), _frame, "Eq 6, frame"),
    "dual wheelset": Shown((motion.rates,), _dual_wheelset, "Eq 6 without the frame"),
}
"""Blocks of the page, by their names."""
