"""Readable symbols for everything that the equations of motion read and return."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import sympy

from railenv.equations import contact
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


P = parameters(Vehicle, Actuator, Sensors)
COOPERRIDER = parameters(CooperriderParameters)
RUN = Running(*map(sympy.Symbol, ("V", r"\kappa", r"\phi_{se}")))
RAIL = Rail(*map(sympy.Symbol, ("y_{t}", "z_{t}", r"\phi_{t}")))
SIDE = sympy.Symbol(r"\sigma")
WHEELSET = sympy.Symbol("s")
W, FRAME = moving(), moving("b")
ALPHA, BETA = sympy.Symbol(r"\alpha"), sympy.Symbol(r"\beta")
EPSILON, WIDTH = sympy.Symbol(r"\varepsilon"), sympy.Symbol("w")

WHEEL = r"@ r_{@} \gamma_{@} N_{y@} N_{z@} N_{@} F^{\ast}_{x@} F^{\ast}_{y@} M^{\ast}_{z@}"
RAIL_FORCE = r"@ F_{x@} F_{y@} F_{z@} M_{x@} M_{z@} R_{x@} R_{y@} R_{z@}"
SUSPENSION = "F_{sy@} F_{sz@} M_{sx@} M_{sz@}"
REACTION = r"\bar~F_{sy@} \bar~F_{sz@} \bar~M_{sx@} \bar~M_{sz@}"
SECONDARY = "F_{2y} F_{2z} M_{2x} M_{2z}"
CONTACT = "F_{cy} F_{cz} M_{cx} M_{cz}"


def wheel_symbols(index: str) -> contact.Wheel:
    """Return what one wheel feels, as symbols."""
    return like(contact.Wheel, WHEEL, index)


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
