"""Blocks of equations of docs/physics.md: what they come from, and how their rows are written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy
from symbols import WHEELSET
from written import Names, block, equation, latex, named, over, tidy

BEYOND = "Beyond the paper"


@dataclass(frozen=True)
class Shown:
    """Equations of the page that one or more functions give.

    Attributes
    ----------
    origin : tuple of callable or str
        What the equations come from: functions, or files.
    rows : callable
        Returns the equations.
    paper : str
        Where they stand in the paper.
    table : bool
        Whether the rows are those of a table, not equations.
    """

    origin: tuple[Callable[..., Any] | str, ...]
    rows: Callable[[], list[str]]
    paper: str
    table: bool = False

    def markdown(self) -> str:
        """Return caption and equations."""
        origin = ", ".join(
            f"`{f if isinstance(f, str) else f'{_module(f)}.{f.__qualname__}'}`" for f in self.origin
        )
        shown = "\n".join(self.rows()) if self.table else block(self.rows())
        return f"*{self.paper}: {origin}*\n\n{shown}" if origin else shown


def _module(function: Callable[..., Any]) -> str:
    return function.__module__.rpartition(".")[2]


def rows(lefts: str, expressions: Sequence[sympy.Expr], names: Names | None = None) -> list[str]:
    """Return one equation for each expression; ``lefts`` has the left-hand sides, parted by `` ; ``."""
    right = [_of_a_side(tidy(expression)) for expression in named(expressions, names or {})]
    return [equation(a.strip(), b) for a, b in zip(lefts.split(" ; "), right, strict=True)]


def balances(
    lefts: str, expressions: Sequence[sympy.Expr], inertias: Sequence[sympy.Expr], names: Names
) -> list[str]:
    """Return equations of motion, accelerations multiplied by the inertia that they are divided by."""
    right = [over(tidy(e), m) for e, m in zip(named(expressions, names), inertias, strict=True)]
    left = [f"{latex(m)} {a.strip()}" for m, a in zip(inertias, lefts.split(" ; "), strict=True)]
    return [equation(a, b) for a, b in zip(left, right, strict=True)]


def _of_a_side(expression: sympy.Expr) -> sympy.Expr:
    """Leave out the square of a sign, which is 1."""
    square = sympy.Pow(WHEELSET, 2)
    if not expression.has(square):
        return expression
    with sympy.evaluate(False):
        plain = expression.xreplace({square: sympy.Integer(1)})
    return tidy(plain)
