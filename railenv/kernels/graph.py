"""From equations of motion to straight-line assignments, and their exact derivatives.

The equations are run on SymPy symbols; common-subexpression elimination turns the result into a list
of assignments, one small operation each. Derivatives are taken on that list: every assignment gives
the local partial derivatives of its value, and intermediate values are then eliminated one by one
(the chain rule in the order that multiplies least, Markowitz's; see Griewank and Walther, *Evaluating
Derivatives*, ch. 9). Nothing is ever expanded, so this takes a second where differentiating the
expanded expressions takes minutes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import sympy
from sympy.core.parameters import distribute

from railenv.equations import functions
from railenv.equations.symbolic import TableValue, WherePositive
from railenv.errors import EquationError, ParameterError, RailenvError, UnknownNameError, shown

CONDITIONS = ("speed", "curvature", "cant")

Assignment = tuple[sympy.Symbol, sympy.Expr]

_FUNCTIONS = {name for name in functions.__all__ if hasattr(sympy, name)}
_ADVICE = (
    "equations may use +, -, *, /, ** with a constant exponent, abs() and the functions of "
    "railenv.equations.functions"
)


@dataclass(frozen=True)
class Graph:
    """Assignments that compute the right-hand side, and the symbols they start from and end in."""

    states: tuple[sympy.Symbol, ...]
    inputs: tuple[sympy.Symbol, ...]
    conditions: tuple[sympy.Symbol, ...]
    parameters: tuple[sympy.Symbol, ...]
    assignments: tuple[Assignment, ...]
    outputs: tuple[sympy.Expr, ...]  # derivatives of the states; a symbol or a number each
    signals: tuple[sympy.Expr, ...] = ()  # further results, likewise

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """What the Jacobian is taken with respect to, in the order of its columns."""
        return (*self.states, *self.inputs, *self.conditions)


@dataclass(frozen=True)
class Jacobian:
    """Assignments that compute the nonzero entries of the Jacobian, given those of its Graph."""

    assignments: tuple[Assignment, ...]
    entries: tuple[tuple[int, int, sympy.Expr], ...]  # row, column, value (a symbol or a number)

    @property
    def cells(self) -> tuple[tuple[int, int], ...]:
        """Row and column of each entry."""
        return tuple((row, column) for row, column, _ in self.entries)

    @property
    def values(self) -> list[sympy.Expr]:
        """Value of each entry."""
        return [value for _, _, value in self.entries]


def trace(
    equations: Callable[..., Sequence[Any]],
    states: Sequence[str],
    inputs: Sequence[str],
    parameters: Sequence[str],
    signals: Callable[..., Sequence[Any]] | None = None,
) -> Graph:
    """Run equations of motion on symbols and flatten the result into assignments.

    Parameters
    ----------
    equations : callable
        ``f(x, u, speed, curvature, cant, p)``, returning one derivative per state.
    states, inputs, parameters : sequence of str
        Names of the entries of ``x`` and ``u``, and of the attributes of ``p`` (tables among them).
    signals : callable, optional
        Further results to compute, of the same arguments as the equations.

    Raises
    ------
    ParameterError
        If the number of derivatives is not the number of states.
    UnknownNameError
        If the equations read a parameter that there is not.
    EquationError
        If the equations do with symbols what only numbers can do, or use what cannot be compiled.
    """
    x, u, conditions, p = (
        tuple(map(sympy.Symbol, names)) for names in (states, inputs, CONDITIONS, parameters)
    )
    with distribute(False):  # keep 2*(a + b) as it was written
        arguments = (x, u, *conditions, _Parameters(**dict(zip(parameters, p, strict=True))))
        derivatives, further = _called(equations, signals, arguments)
        if len(derivatives) != len(states):
            raise ParameterError(
                f"the equations return {len(derivatives)} derivatives for {len(states)} states; "
                "they must return one per state, in the order of `states`"
            )
        known = {*x, *u, *conditions, *p}
        labels = [
            *(f"derivative of {name}" for name in states),
            *(f"signal {k}" for k in range(len(further))),
        ]
        results = [
            _compilable(value, label, known)
            for value, label in zip((*derivatives, *further), labels, strict=True)
        ]
        assignments, atoms = _flattened(results)
    n = len(states)
    return Graph(x, u, conditions, p, assignments, atoms[:n], atoms[n:])


def _called(
    equations: Callable[..., Sequence[Any]],
    signals: Callable[..., Sequence[Any]] | None,
    arguments: Sequence[Any],
) -> tuple[list[Any], list[Any]]:
    """Return what equations and signals give for symbols."""
    try:
        return list(equations(*arguments)), list(signals(*arguments)) if signals else []
    except RailenvError:
        raise
    except (ArithmeticError, TypeError, ValueError) as error:
        raise EquationError(
            f"the equations cannot be run on symbols: {error}. Use Python's operators and the "
            "functions of railenv.equations.functions (not those of math or NumPy), and "
            "where_positive instead of `if`, max or min"
        ) from error


def _flattened(
    expressions: Sequence[sympy.Expr],
) -> tuple[tuple[Assignment, ...], tuple[sympy.Expr, ...]]:
    """Return assignments that compute some expressions, and the symbol or number of each of these."""
    names = sympy.numbered_symbols("_c")
    replacements, reduced = sympy.cse(expressions, symbols=names, order="none")
    flat = _Flattener()
    for symbol, expression in replacements:
        flat.assign(symbol, expression)
    atoms = tuple(flat.atom(expression) for expression in reduced)
    return tuple(flat.assignments), atoms


def differentiate(graph: Graph, variables: Sequence[sympy.Symbol] | None = None) -> Jacobian:
    """Differentiate a graph with respect to its states, inputs and running conditions.

    Other ``variables``, such as ``graph.parameters``, take their place where they are given.
    """
    with distribute(False):
        return _Elimination(graph, graph.variables if variables is None else tuple(variables)).run()


def needed(assignments: Sequence[Assignment], results: Sequence[sympy.Expr]) -> list[Assignment]:
    """Keep only the assignments that ``results`` depend on."""
    wanted = {symbol for result in results for symbol in result.free_symbols}
    kept = []
    for symbol, expression in reversed(assignments):
        if symbol in wanted:
            wanted |= expression.free_symbols
            kept.append((symbol, expression))
    return kept[::-1]


class _Parameters(SimpleNamespace):
    """The parameters as attributes; says which there are where one is not known."""

    def __getattr__(self, name: str) -> Any:
        raise UnknownNameError("parameter in the equations", name, list(vars(self)))


def _compilable(value: Any, label: str, known: set[sympy.Symbol]) -> sympy.Expr:
    """Return what the equations gave as an expression of nothing but what kernels can compute.

    Absolute values become a choice, and constants such as sympy.pi numbers.
    """
    try:
        expression = sympy.sympify(value, strict=True)
    except sympy.SympifyError:
        expression = None
    if not isinstance(expression, sympy.Expr):
        raise EquationError(f"the {label} is {shown(value)}; it must be a number or an expression")
    nodes = _nodes(expression)
    for node in nodes:
        if node.is_Symbol:
            allowed = node in known
        elif not node.args:
            allowed = bool(node.is_number and node.is_real) and _is_float(node)
        else:
            allowed = (
                node.is_Add
                or node.is_Mul
                or node.is_Pow
                or isinstance(node, (sympy.Abs, TableValue, WherePositive))
                or (node.is_Function and node.func.__name__ in _FUNCTIONS)
            )
        if not allowed:
            raise EquationError(
                f"the {label} contains {_text(node)}, which cannot be compiled; {_ADVICE}"
            )
        if node.is_Pow and node.exp.free_symbols:
            raise EquationError(f"the {label} contains {_text(node)}, whose exponent varies; {_ADVICE}")
    constants = {c: sympy.Float(float(c)) for c in nodes if isinstance(c, sympy.NumberSymbol)}
    # floats that are whole numbers become integers, so that 1.0 * x and 0.0 + x become x
    floats = (f for f in nodes if isinstance(f, sympy.Float) and float(f).is_integer())
    constants |= {f: sympy.Integer(int(f)) for f in floats}
    return _rebuilt(expression, constants)


def _rebuilt(expression: sympy.Expr, constants: Mapping[sympy.Basic, sympy.Expr]) -> sympy.Expr:
    """Return an expression with other constants, and choices for absolute values; each part once."""
    found: dict[sympy.Basic, Any] = dict(constants)
    left: list[sympy.Basic] = [expression]
    while left:
        node = left[-1]
        waiting = [part for part in node.args if part not in found]
        if node in found or waiting:
            left.pop() if node in found else left.extend(waiting)
            continue
        parts = [found[part] for part in node.args]
        if isinstance(node, sympy.Abs):
            found[node] = WherePositive(parts[0], parts[0], -parts[0])
        elif any(new is not old for new, old in zip(parts, node.args, strict=True)):
            found[node] = node.func(*parts)
        else:
            found[node] = node
        left.pop()
    return found[expression]


def _nodes(expression: sympy.Expr) -> list[sympy.Basic]:
    """Return all parts of an expression, each once: written out it may be exponentially larger.

    A part stands before those that it is made of.
    """
    found: dict[sympy.Basic, None] = {}
    left = [expression]
    while left:
        node = left.pop()
        if node not in found:
            found[node] = None
            left.extend(reversed(node.args))
    return list(found)


def _text(node: sympy.Basic) -> str:
    try:
        return f"{node!s:.60}"
    except ValueError:  # Python writes no integers of more than 4300 digits
        return "a number with too many digits"


def _is_float(number: sympy.Expr) -> bool:
    try:
        return math.isfinite(float(number))
    except (OverflowError, TypeError):
        return False


class _Flattener:
    """Breaks expressions into assignments whose operands are symbols and numbers."""

    def __init__(self) -> None:
        self.assignments: list[Assignment] = []
        self._known: dict[sympy.Expr, sympy.Expr] = {}
        self._renamed: dict[sympy.Symbol, sympy.Expr] = {}

    def assign(self, symbol: sympy.Symbol, expression: sympy.Expr) -> None:
        """Let ``symbol``, a name for a common subexpression, stand for ``expression``."""
        self._renamed[symbol] = self.atom(expression)

    def atom(self, expression: sympy.Expr) -> sympy.Expr:
        """Return a symbol or number equal to ``expression``, assigning what it takes."""
        if expression.is_Symbol:
            return self._renamed.get(expression, expression)
        if expression.is_Number:
            return expression
        operation = self._operation(expression)
        if operation.is_Symbol or operation.is_Number:
            return operation
        if operation not in self._known:
            symbol = sympy.Symbol(f"_{len(self.assignments)}")
            self.assignments.append((symbol, operation))
            self._known[operation] = symbol
        return self._known[operation]

    def _operation(self, expression: sympy.Expr) -> sympy.Expr:
        if expression.is_Add:  # a sum of products of atoms is one operation
            return expression.func(
                *[self._product(term) if term.is_Mul else self.atom(term) for term in expression.args]
            )
        return self._product(expression)

    def _product(self, term: sympy.Expr) -> sympy.Expr:
        if term.is_Symbol or term.is_Number:
            return self.atom(term)
        if term.is_Pow:
            base, exponent = term.args
            return sympy.Pow(self.atom(base), exponent)
        if term.is_Mul:
            return term.func(*[self.atom(factor) for factor in term.args])
        return term.func(*[self.atom(arg) for arg in term.args])


def _local_partials(symbol: sympy.Symbol, operation: sympy.Expr) -> dict[sympy.Symbol, sympy.Expr]:
    """Partial derivatives of one assignment with respect to its operands.

    Where the value itself appears in its derivative, ``symbol`` stands for it, which saves computing
    the function again: (1/x)' = -(1/x)^2, sqrt(x)' = 1/(2 sqrt(x)), tan(x)' = 1 + tan(x)^2.
    """
    if operation.is_Pow:
        base, exponent = operation.args
        if exponent == -1:
            return {base: -symbol * symbol}
        if exponent == sympy.Rational(1, 2):
            return {base: sympy.Rational(1, 2) / symbol}
    if isinstance(operation, sympy.tan):
        return {operation.args[0]: 1 + symbol * symbol}
    if isinstance(operation, sympy.tanh):
        return {operation.args[0]: 1 - symbol * symbol}
    if isinstance(operation, sympy.exp):
        return {operation.args[0]: symbol}
    operands = sorted(operation.free_symbols, key=lambda s: s.name)
    terms = operation.args if operation.is_Add else (operation,)
    if all(_is_product(term) for term in terms):
        return {operand: _partial_of_sum(terms, operand) for operand in operands}
    return {operand: sympy.diff(operation, operand) for operand in operands}


def _is_product(term: sympy.Expr) -> bool:
    """Whether a term is a product of symbols, numbers and powers of symbols."""
    factors = term.args if term.is_Mul else (term,)
    return all(
        f.is_Symbol or f.is_Number or (f.is_Pow and f.base.is_Symbol and f.exp.is_Number)
        for f in factors
    )


def _partial_of_sum(terms: Sequence[sympy.Expr], operand: sympy.Symbol) -> sympy.Expr:
    """Partial derivative of a sum of products; SymPy's own differentiation takes ten times as long."""
    parts = []
    for term in terms:
        factors = term.args if term.is_Mul else (term,)
        for k, factor in enumerate(factors):
            if factor == operand:
                parts.append(sympy.Mul(*factors[:k], *factors[k + 1 :]))
            elif factor.is_Pow and factor.base == operand:
                power = factor.exp * sympy.Pow(operand, factor.exp - 1)
                parts.append(sympy.Mul(power, *factors[:k], *factors[k + 1 :]))
    return sympy.Add(*parts)


class _Elimination:
    """Eliminates the intermediate values of a graph from its local partial derivatives."""

    def __init__(self, graph: Graph, variables: tuple[sympy.Symbol, ...]) -> None:
        self.graph = graph
        self.variables = variables
        self.assignments: list[Assignment] = []
        self._names: dict[sympy.Expr, sympy.Symbol] = {}
        # partials[v][u] = dv/du over direct edges; users[u] = the values that u enters directly.
        self.partials: dict[Any, dict[Any, sympy.Expr]] = {}
        self.users: dict[Any, dict[Any, None]] = {v: {} for v in variables}
        for symbol, operation in graph.assignments:
            partials = _local_partials(symbol, operation)
            active = {u: d for u, d in partials.items() if u in self.users and d != 0}
            if active:
                self._add_vertex(symbol, active)
        for row, output in enumerate(graph.outputs):
            active = {output: sympy.Integer(1)} if output in self.users else {}
            self._add_vertex(("row", row), active)

    def _add_vertex(self, vertex: Any, partials: dict[Any, sympy.Expr]) -> None:
        self.partials[vertex] = partials
        self.users[vertex] = {}
        for u in partials:
            self.users[u][vertex] = None

    def _name(self, expression: sympy.Expr) -> sympy.Expr:
        """Return a symbol for a partial derivative that is more than a symbol or a number."""
        if expression.is_Symbol or expression.is_Number or (-expression).is_Symbol:
            return expression
        if expression not in self._names:
            symbol = sympy.Symbol(f"_d{len(self.assignments)}")
            self.assignments.append((symbol, expression))
            self._names[expression] = symbol
        return self._names[expression]

    def _eliminate(self, vertex: Any) -> None:
        incoming = {u: self._name(d) for u, d in self.partials.pop(vertex).items()}
        for user in self.users.pop(vertex):
            outer = self._name(self.partials[user].pop(vertex))
            for u, inner in incoming.items():
                self.partials[user][u] = self.partials[user].get(u, 0) + outer * inner
                self.users[u][user] = None
        for u in incoming:
            del self.users[u][vertex]

    def run(self) -> Jacobian:
        """Eliminate all intermediate values, the one that costs least first."""
        left = {symbol: i for i, (symbol, _) in enumerate(self.graph.assignments)}
        left = {symbol: i for symbol, i in left.items() if symbol in self.partials}

        def cost(vertex: Any) -> tuple[int, int]:
            return len(self.partials[vertex]) * len(self.users[vertex]), -left[vertex]

        while left:
            vertex = min(left, key=cost)
            self._eliminate(vertex)
            del left[vertex]
        column = {symbol: j for j, symbol in enumerate(self.variables)}
        entries = []
        for row in range(len(self.graph.outputs)):
            for u, derivative in sorted(self.partials["row", row].items(), key=lambda e: column[e[0]]):
                if derivative != 0:
                    entries.append((row, column[u], self._name(derivative)))
        return Jacobian(tuple(self.assignments), tuple(entries))
