"""LaTeX of expressions in the order in which the code writes them.

Functions of :mod:`railenv.equations` are run on SymPy symbols with SymPy's evaluation off, so nothing
is reordered or expanded. ``tidy`` takes out what only the programming needs (``1.0 * x``, ``x - x``,
guards of divisors), ``latex`` prints what is left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy

from railenv.equations.symbolic import TableValue, WherePositive

LONGEST_LINE = 84
"""Width, in printed characters, beyond which a sum is broken into lines."""

_NAMES = {"atan": "arctan"}
_FUNCTIONS = sympy.tan | sympy.sin | sympy.cos | sympy.atan

Names = Mapping[sympy.Expr, sympy.Expr]


def traced(function: Callable[..., Any], *arguments: Any) -> Any:
    """Run a function on symbols, keeping its operations as they are written."""
    with sympy.evaluate(False):
        return function(*arguments)


def named(expressions: Sequence[sympy.Expr], names: Names) -> list[sympy.Expr]:
    """Put symbols in the place of expressions that have a name of their own, the largest first.

    Raises
    ------
    ValueError
        If an expression with a name does not occur.
    """
    found = [sympy.sympify(expression) for expression in expressions]
    size = {part: sum(1 for _ in sympy.preorder_traversal(part)) for part in names}
    with sympy.evaluate(False):
        for part, name in sorted(names.items(), key=lambda item: -size[item[0]]):
            # -(k x) is written as one product, so the negative of a name is looked for, too
            forms = {part: name, -part: -name}
            if not any(form in sympy.preorder_traversal(e) for form in forms for e in found):
                raise ValueError(f"{name} does not occur in {found}")
            found = [expression.xreplace(forms) for expression in found]
    return found


# ------------------------------------------------------------------------------- tidying


def tidy(expression: sympy.Expr, known: tuple[tuple[sympy.Expr, bool], ...] = ()) -> sympy.Expr:
    """Write numbers plainly, join nested sums and products, and drop guards that cannot matter.

    ``known`` has the conditions, and whether each is positive, of the alternatives around.
    """
    if expression.is_Float:
        return sympy.nsimplify(expression, rational=True)
    if not expression.args:
        return expression
    if isinstance(expression, WherePositive):
        condition, then, otherwise = expression.args
        for other, positive in known:
            if other == condition:
                return tidy(then if positive else otherwise, known)
        return WherePositive(
            tidy(condition, known),
            tidy(then, (*known, (condition, True))),
            tidy(otherwise, (*known, (condition, False))),
            evaluate=False,
        )
    arguments = [tidy(argument, known) for argument in expression.args]
    if expression.is_Add:
        return _sum(arguments)
    if expression.is_Mul:
        return _product(arguments)
    if expression.is_Pow and all(a.is_Number for a in arguments):
        return sympy.Pow(*arguments)
    return expression.func(*arguments, evaluate=False)


def _sum(arguments: Sequence[sympy.Expr]) -> sympy.Expr:
    terms: list[sympy.Expr] = []
    for term in (t for a in arguments for t in (a.args if a.is_Add else (a,)) if t != 0):
        opposite = _product([sympy.Integer(-1), term])
        alike = [i for i, other in enumerate(terms) if _rest(other) == _rest(term) != []]
        if opposite in terms:
            terms.remove(opposite)
        elif alike:
            terms[alike[0]] = _product([_number(terms[alike[0]]) + _number(term), *_rest(term)])
        else:
            terms.append(term)
    if len(terms) < 2:
        return terms[0] if terms else sympy.Integer(0)
    return sympy.Add(*terms, evaluate=False)


def _number(term: sympy.Expr) -> sympy.Expr:
    """Return the number by which a tidy term is multiplied."""
    return sympy.Mul(*(f for f in (term.args if term.is_Mul else (term,)) if f.is_Number))


def _rest(term: sympy.Expr) -> list[sympy.Expr]:
    """Return the factors of a tidy term that are no numbers, in an order of their own."""
    factors = term.args if term.is_Mul else (term,)
    return sorted((f for f in factors if not f.is_Number), key=sympy.default_sort_key)


def _product(arguments: Sequence[sympy.Expr]) -> sympy.Expr:
    coefficient = sympy.Integer(1)
    powers: dict[sympy.Expr, sympy.Expr] = {}
    if sum(a != 1 for a in arguments) > 1:
        arguments = [_signed(a) for a in arguments]
    for factor in (f for a in arguments for f in (a.args if a.is_Mul else (a,))):
        if factor.is_Number:
            coefficient *= factor
        else:
            base, exponent = factor.args if factor.is_Pow else (factor, sympy.Integer(1))
            if not exponent.is_Number:
                base, exponent = factor, sympy.Integer(1)
            powers[base] = powers.get(base, 0) + exponent
    if coefficient == 0:
        return coefficient
    factors = [b if e == 1 else sympy.Pow(b, e, evaluate=False) for b, e in powers.items() if e != 0]
    if coefficient != 1 or not factors:
        if len(factors) == 1 and factors[0].is_Add and coefficient == -1:
            return _sum([_product([coefficient, term]) for term in factors[0].args])
        factors.insert(0, coefficient)
    return factors[0] if len(factors) == 1 else sympy.Mul(*factors, evaluate=False)


def _signed(expression: sympy.Expr) -> sympy.Expr:
    """Take the sign out of a sum of negative terms."""
    if not (expression.is_Add and all(_sign(term)[0] for term in expression.args)):
        return expression
    positive = _sum([_sign(term)[1] for term in expression.args])
    return sympy.Mul(sympy.Integer(-1), positive, evaluate=False)


def over(expression: sympy.Expr, divisor: sympy.Expr) -> sympy.Expr:
    """Return the numerator of a tidy fraction with this divisor.

    Raises
    ------
    ValueError
        If the expression is not a fraction with this divisor.
    """
    inverse = sympy.Pow(divisor, -1, evaluate=False)
    factors = expression.args if expression.is_Mul else (expression,)
    if inverse not in factors:
        raise ValueError(f"{expression} is not divided by {divisor}")
    return _product([f for f in factors if f != inverse])


# ------------------------------------------------------------------------------ printing


def latex(expression: sympy.Expr) -> str:
    """Return the LaTeX of a tidy expression."""
    if expression.is_Add:
        return "".join(_terms(expression))
    if expression.is_Mul or expression.is_Rational:
        return _latex_product(expression)
    if expression.is_Pow:
        return _latex_power(*expression.args)
    if isinstance(expression, WherePositive):
        return _latex_choice(expression)
    if isinstance(expression, TableValue):
        return _latex_table(expression)
    if isinstance(expression, sympy.exp):
        return _latex_root(expression)
    if isinstance(expression, _FUNCTIONS):
        argument = latex(expression.args[0])
        name = _NAMES.get(expression.func.__name__, expression.func.__name__)
        return rf"\{name} {_bracketed(argument, expression.args[0].is_Symbol)}"
    if expression.is_Symbol:
        return str(expression.name)
    raise TypeError(f"no LaTeX for {expression!r}")


def _latex_table(expression: sympy.Expr) -> str:
    """Write a value of a table; the columns of one that has several are counted from 1."""
    name, x, order, column, columns = expression.args
    index = f"_{{{column + 1}}}" if columns > 1 else ""
    return rf"{latex(name)}{index}{chr(39) * int(order)}\left( {latex(x)} \right)"


def _latex_root(expression: sympy.Expr) -> str:
    """Write exp(log(x) / n), which is how equations take a root that is not square."""
    factors = expression.args[0].args
    root = sympy.Mul(*[1 / f for f in factors if f.is_Number])
    (logarithm,) = (f for f in factors if isinstance(f, sympy.log))
    return rf"\sqrt[{root}]{{{latex(logarithm.args[0])}}}"


def _bracketed(text: str, plain: bool) -> str:
    return text if plain else rf"\left( {text} \right)"


def _terms(expression: sympy.Expr) -> list[str]:
    """Terms of a sum with their signs; a leading plus is left out."""
    terms: list[str] = []
    for argument in expression.args:
        negative, rest = _sign(argument)
        text = latex(rest)
        if isinstance(rest, WherePositive) and not _is_positive_part(rest):
            text = rf"\left( {text} \right)" if negative else text
        terms.append(f"- {text}" if negative else f"+ {text}")
        if len(terms) == 1:
            terms = [f"-{text}" if negative else text]
    return [terms[0], *(f" {term}" for term in terms[1:])]


def _sign(expression: sympy.Expr) -> tuple[bool, sympy.Expr]:
    if expression.is_Number and expression < 0:
        return True, -expression
    if expression.is_Mul and expression.args[0].is_Number and expression.args[0] < 0:
        return True, _product([-expression.args[0], *expression.args[1:]])
    return False, expression


def _latex_product(expression: sympy.Expr) -> str:
    negative, expression = _sign(expression)
    above: list[str] = []
    below: list[str] = []
    aside: list[str] = []  # sums and choices stand beside a fraction
    factors = expression.args if expression.is_Mul else (expression,)
    for factor in factors:
        if factor.is_Rational:
            above += [str(factor.p)] if factor.p != 1 else []
            below += [str(factor.q)] if factor.q != 1 else []
        elif factor.is_Pow and factor.args[1] < 0:
            base, exponent = factor.args
            divisor = base if exponent == -1 else sympy.Pow(base, -exponent, evaluate=False)
            parts = divisor.args if divisor.is_Mul else (divisor,)
            alone = len(parts) == 1 and sum(_is_inverse(f) for f in factors) == 1
            below += [_factor(part) if not (part.is_Add and alone) else latex(part) for part in parts]
        elif factor.is_Add or (isinstance(factor, WherePositive) and not _is_positive_part(factor)):
            aside.append(latex(factor))
        else:
            above.append(_factor(factor))
    if not below:
        text = " ".join([*above, *(_bracketed(a, False) for a in aside)]) or "1"
    elif not above and len(aside) == 1:
        text = rf"\frac{{{aside[0]}}}{{{' '.join(below)}}}"
    else:
        fraction = rf"\frac{{{' '.join(above) or '1'}}}{{{' '.join(below)}}}"
        text = " ".join([fraction, *(_bracketed(a, False) for a in aside)])
    return f"-{text}" if negative else text


def _is_inverse(expression: sympy.Expr) -> bool:
    return bool(expression.is_Pow and expression.args[1] < 0) or bool(
        expression.is_Rational and expression.q != 1
    )


def _factor(expression: sympy.Expr) -> str:
    """One factor of a product, in brackets where it needs them."""
    choice = isinstance(expression, WherePositive) and not _is_positive_part(expression)
    return _bracketed(latex(expression), not (expression.is_Add or choice))


def _latex_power(base: sympy.Expr, exponent: sympy.Expr) -> str:
    if exponent == sympy.Rational(1, 2):
        return rf"\sqrt{{{latex(base)}}}"
    if exponent < 0:
        return _latex_product(sympy.Mul(1, sympy.Pow(base, exponent, evaluate=False), evaluate=False))
    if isinstance(base, sympy.tan | sympy.sin | sympy.cos):
        argument = base.args[0]
        name = rf"\{base.func.__name__}^{{{exponent}}}"
        return f"{name} {_bracketed(latex(argument), argument.is_Symbol)}"
    text = latex(base)
    plain = base.is_Symbol and (
        not any(mark in text for mark in ("^", "'", " ", r"\sin", r"\cos")) or text.startswith(r"\dot")
    )
    return f"{_bracketed(text, plain)}^{{{exponent}}}"


def _is_positive_part(expression: sympy.Expr) -> bool:
    if not isinstance(expression, WherePositive):
        return False
    condition, then, otherwise = expression.args
    return bool(condition == then and otherwise == 0)


def _latex_choice(expression: sympy.Expr) -> str:
    if _is_positive_part(expression):
        return rf"\max\left( 0, {latex(expression.args[0])} \right)"
    rows = []
    rest: sympy.Expr = expression
    while isinstance(rest, WherePositive) and not _is_positive_part(rest):
        condition, then, rest = rest.args
        rows.append(f"{latex(then)} & {_condition(condition)}")
    rows.append(rf"{latex(rest)} & \text{{otherwise}}")
    body = r" \\ ".join(rows)
    return rf"\begin{{cases}} {body} \end{{cases}}"


def _condition(expression: sympy.Expr) -> str:
    """Write ``expression > 0`` with what is subtracted on the other side."""
    terms = expression.args if expression.is_Add else (expression,)
    signed = [_sign(term) for term in terms]
    left = [term for negative, term in signed if not negative]
    right = [term for negative, term in signed if negative]
    if not left:
        (first, *others) = right
        return f"{latex(first)} < {latex(_sum([_product([sympy.Integer(-1), o]) for o in others]))}"
    return f"{latex(_sum(left))} > {latex(_sum(right))}"


# ----------------------------------------------------------------------------- equations


def equation(left: str, expression: sympy.Expr) -> str:
    """Return one row of an ``aligned`` environment; long sums go over several lines."""
    terms = _terms(expression) if expression.is_Add else [latex(expression)]
    rows, row = [], f"{left} &= "
    for term in terms:
        if _width(row + term) > LONGEST_LINE and not row.endswith("= "):
            rows.append(row)
            row = r"&\quad "
        row += term
    return " \\\\\n".join([*rows, row])


def _width(text: str) -> int:
    """Estimate the width of LaTeX in printed characters."""
    for mark in ("left", "right", "dot", "text", "quad", "mathrm"):
        text = text.replace(f"\\{mark}", "")
    characters = 0
    command = False
    for c in text:
        if c == "\\":
            command = True
            characters += 1
        elif command and c.isalpha():
            continue
        else:
            command = False
            characters += c not in " {}_^&"
    return characters


def block(rows: Sequence[str]) -> str:
    """Return a display of equations as Markdown."""
    if len(rows) == 1 and "\\\\\n" not in rows[0]:
        return f"$$\n{rows[0].replace('&= ', '= ')}\n$$"
    body = " \\\\\n".join(rows)
    return f"$$\n\\begin{{aligned}}\n{body}\n\\end{{aligned}}\n$$"
