"""Elementary functions for equations of motion, on floats, complex numbers and SymPy expressions.

The equations of motion are written once, as plain Python functions of scalars. They run

- on floats: the oracle that the generated kernels are tested against;
- on complex numbers: complex-step derivatives, the oracle of the analytic Jacobians;
- on SymPy symbols: the expression graph from which the kernels are generated.

Python's operators serve all three as they are; only the functions below need to look at the type of
their argument. Use them, not :mod:`math` or NumPy, in equations of your own, and never ``if`` on a
state: write :func:`where_positive` instead, which every generated kernel compiles to a branch-free
select.
"""

from __future__ import annotations

import cmath
import math
from typing import Any, TypeAlias

__all__ = [
    "atan",
    "cos",
    "exp",
    "log",
    "positive_part",
    "sin",
    "sqrt",
    "table",
    "tan",
    "tanh",
    "where_positive",
]

Scalar: TypeAlias = Any
"""A float, a complex number or a SymPy expression."""


def _apply(name: str, x: Scalar) -> Scalar:
    if isinstance(x, (float, int)):
        return getattr(math, name)(x)
    if isinstance(x, complex):
        return getattr(cmath, name)(x)
    import sympy

    if isinstance(x, sympy.Basic):
        from sympy.core.parameters import distribute

        # SymPy looks for a sign to take out of odd and even functions, which never ends for a sum
        # whose signs it may not distribute
        with distribute(True):
            return getattr(sympy, name)(x)
    raise TypeError(
        f"{name}() of {x!r}: equations take floats, complex numbers or SymPy expressions, "
        f"not {type(x).__name__}"
    )


def sqrt(x: Scalar) -> Scalar:
    """Square root."""
    return _apply("sqrt", x)


def sin(x: Scalar) -> Scalar:
    """Sine of an angle in rad."""
    return _apply("sin", x)


def cos(x: Scalar) -> Scalar:
    """Cosine of an angle in rad."""
    return _apply("cos", x)


def tan(x: Scalar) -> Scalar:
    """Tangent of an angle in rad."""
    return _apply("tan", x)


def atan(x: Scalar) -> Scalar:
    """Arc tangent, rad."""
    return _apply("atan", x)


def tanh(x: Scalar) -> Scalar:
    """Hyperbolic tangent."""
    return _apply("tanh", x)


def exp(x: Scalar) -> Scalar:
    """Exponential."""
    return _apply("exp", x)


def log(x: Scalar) -> Scalar:
    """Natural logarithm."""
    return _apply("log", x)


def where_positive(condition: Scalar, then: Scalar, otherwise: Scalar) -> Scalar:
    """``then`` where ``condition > 0``, else ``otherwise``.

    Both alternatives are evaluated, so neither may raise where it is not chosen (guard divisors).
    The derivative is that of the alternative chosen; for complex arguments the real part decides.
    """
    if isinstance(condition, (float, int)):
        return then if condition > 0.0 else otherwise
    if isinstance(condition, complex):
        return then if condition.real > 0.0 else otherwise
    from railenv.equations.symbolic import WherePositive

    return WherePositive(condition, then, otherwise)


def positive_part(x: Scalar) -> Scalar:
    """``max(x, 0)``."""
    return where_positive(x, x, 0.0)


def table(
    characteristic: Scalar, x: Scalar, order: int = 0, column: int = 0, columns: int = 1
) -> Scalar:
    """Value at ``x`` of a characteristic given as a table, or its derivative of an ``order`` up to 2.

    ``characteristic`` is a :class:`railenv.tables.Table` for numbers; on symbols it is the name under
    which kernels find the numbers, which are arguments of theirs and never compiled in. ``columns`` is
    how many columns the table has, ``column`` the one to read.
    """
    if isinstance(x, (float, int, complex)):
        return characteristic(x, order, column)
    from railenv.equations.symbolic import TableValue

    return TableValue(characteristic, x, order, column, columns)
