"""Readable symbols for everything that the equations of motion read and return."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import sympy

from railenv.equations import contact, shapes
from railenv.equations.coordinates import Motion, Rail, Running, Wrench
from railenv.equipment import Actuator, Sensors
from railenv.vehicles import CooperriderParameters, Vehicle, describe

_GREEK = {"lambda", "mu", "delta", "zeta", "Psi", "Phi", "phi", "psi"}
_SYMBOLS = {"G pi a b": "G", "mu N": r"\mu N", "M_max": r"M_{\max}", "dM_max": r"\dot M_{\max}"}
_SWITCHES = {"wheelbase_curving": "c", "printed_loads": "p"}


def _symbol_of(text: str) -> sympy.Symbol:
    """Turn a symbol of the tables of parameters into LaTeX: ``K_px``, ``lambda``."""
    if text in _SYMBOLS:
        return sympy.Symbol(_SYMBOLS[text])
    head, _, index = text.partition("_")
    head = f"\\{head}" if head in _GREEK else head
    index = rf"\mathrm{{{index}}}" if len(index) > 2 and head in "fb" else index
    return sympy.Symbol(f"{head}_{{{index}}}" if index else head)


def parameters(*records: type, **values: Any) -> SimpleNamespace:
    """Return symbols for all quantities of parameter records, under their names in the equations."""
    rows = [row for record in records for row in describe(record) if row.symbol]
    found = {row.name: _symbol_of(row.symbol) for row in rows}
    found |= {name: sympy.Symbol(symbol) for name, symbol in _SWITCHES.items()}
    found |= {f"actuator_{row.name}": _symbol_of(row.symbol) for row in describe(Actuator)}
    return SimpleNamespace(**{**found, **values})


def moving(index: str = "", star: str = "") -> Motion:
    """Return the coordinates and rates of a body."""
    subscript = f"_{{{index}}}" if index else star
    return Motion(
        *(sympy.Symbol(f"{c}{subscript}") for c in ("y", "z", r"\phi", r"\psi")),
        *(sympy.Symbol(rf"\dot {c}{subscript}") for c in ("y", "z", r"\phi", r"\psi")),
    )


def like(kind: Any, text: str, index: str) -> Any:
    """Return a record of symbols; ``text`` has the LaTeX of each field, ``@`` where the index goes."""
    return kind(*(sympy.Symbol(part.replace("@", index)) for part in text.split()))


def law(kind: shapes.Law) -> SimpleNamespace:
    """Return symbols for the numbers of a contact law."""
    numbers = {
        "conicity": r"\lambda",
        "contact_angle": r"\tau_{0}",
        "contact_angle_rate": r"\tau'_{0}",
        "wheel_profile_radius": "R_{w}",
        "rail_profile_radius": "R_{r}",
        "wear": "w",
        "profiles": "T",
        "new": r"T^{\mathrm{new}}",
        "worn": r"T^{\mathrm{worn}}",
    }
    return SimpleNamespace(law=kind, **{name: sympy.Symbol(text) for name, text in numbers.items()})


def wheelset_with(kind: shapes.Law, **values: Any) -> SimpleNamespace:
    """Return symbols for the numbers of a wheelset whose wheels have a contact law."""
    numbers = {
        "radius_difference": sympy.Symbol(r"\Delta r_{0}"),
        "creep_load": sympy.Symbol("N_{0}"),
        "saturation": "heuristic",
        "saturation_of": "wheelset",
    }
    laws = {"left": law(kind), "right": law(kind)}
    return parameters(Vehicle, Actuator, Sensors, **{**numbers, **laws, **values})


class Side(sympy.Symbol):
    """The side of a wheel, whose laws are those of the left one where both are alike."""

    def __gt__(self, other: Any) -> bool:
        """Choose the numbers of the left wheel."""
        return True


P = wheelset_with(shapes.CONE)
COOPERRIDER = parameters(CooperriderParameters)
RUN = Running(*map(sympy.Symbol, ("V", r"\kappa", r"\phi_{se}", r"\kappa'", r"\phi'_{se}")))
RAIL = Rail(*map(sympy.Symbol, ("y_{t}", "z_{t}", r"\phi_{t}")))
SIDE = Side(r"\sigma")
WHEELSET = sympy.Symbol("s")
W, FRAME = moving(), moving("b")
ALPHA, BETA = sympy.Symbol(r"\alpha"), sympy.Symbol(r"\beta")
EPSILON, WIDTH = sympy.Symbol(r"\varepsilon"), sympy.Symbol("w")

TOUCH = r"H_{@} H'_{@} \rho_{@} B_{@}"
PLACE = r"\Delta_{@} r_{@} \tau_{@} \chi_{@} R_{y@}"
NORMAL = "N_{z@} N_{y@} M_{Nx@} M_{Nz@} N_{@}"
CREEP = r"F^{\ast}_{x@} F^{\ast}_{y@} M^{\ast}_{z@}"
RAIL_FORCE = "@ F_{x@} F_{y@} F_{z@} M_{x@} M_{z@}"
SUSPENSION = "F_{sy@} F_{sz@} M_{sx@} M_{sz@}"
REACTION = r"\bar~F_{sy@} \bar~F_{sz@} \bar~M_{sx@} \bar~M_{sz@}"
SECONDARY = "F_{2y} F_{2z} M_{2x} M_{2z}"
CONTACT = "F_{cy} F_{cz} M_{cx} M_{cz}"


def point_symbols(index: str, kind: shapes.Law = shapes.CONE) -> contact.Point:
    """Return the contact of one wheel, as symbols."""
    side, anchor, level = map(sympy.Symbol, (index, "a_{0}", "d_{0}"))
    touch = like(shapes.Touch, TOUCH, index)
    return contact.Point(side, law(kind), anchor, level, touch, *marks(PLACE, index))


def wheel_symbols(index: str) -> contact.Wheel:
    """Return what one wheel feels, as symbols."""
    normal = like(contact.Normal, NORMAL, index)
    return contact.Wheel(point_symbols(index), normal, *marks(CREEP, index))


def acting(wrench: Wrench) -> list[Any]:
    """Return what of a wrench moves a body that does not pitch: along y and z, about x and z."""
    return [wrench.force_y, wrench.force_z, wrench.roll, wrench.yaw]


def marks(text: str, index: str = "") -> list[sympy.Symbol]:
    """Return the symbols of a text, ``@`` where the index goes, ``~`` where a space."""
    return [sympy.Symbol(part.replace("@", index).replace("~", " ")) for part in text.split()]


def names_of(results: Any, symbols: Any) -> dict[sympy.Expr, sympy.Expr]:
    """Name each result of a function by the symbol at the same place."""
    pairs = zip(results, symbols, strict=True)
    return {expression: symbol for expression, symbol in pairs if isinstance(expression, sympy.Expr)}
