"""Exceptions of the package; each message names the quantity, its value and what is allowed."""

from __future__ import annotations

import difflib
from typing import Any

_LONGEST = 120  # characters of a value in a message


class RailenvError(Exception):
    """Base of all exceptions of the package; they can be passed between processes."""

    def __reduce__(self) -> Any:
        return _restored, (type(self), self.args, self.__dict__)


def _restored(kind: type[RailenvError], args: Any, attributes: dict[str, Any]) -> RailenvError:
    """Return an exception as it was pickled, without its ``__init__``."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(attributes)
    return error


class ParameterError(RailenvError, ValueError):
    """A quantity has a value that is not allowed."""


def shown(value: Any) -> str:
    """Return a value as messages show it: on one line of limited length."""
    return one_line(repr(value), _LONGEST)


def one_line(text: str, longest: int = 300) -> str:
    """Return a text on one line of at most ``longest`` characters."""
    line = " ".join(text.split())
    return line if len(line) <= longest else f"{line[: longest - 3]}..."


class UnknownNameError(ParameterError):
    """A name does not exist."""

    def __init__(self, kind: str, names: Any, allowed: Any) -> None:
        told = ", ".join(_suggesting(names, allowed))
        super().__init__(f"unknown {kind}: {told}; allowed are {', '.join(allowed)}")


def _suggesting(names: Any, allowed: Any) -> list[str]:
    """Return unknown names, each with an existing name close to it."""
    parts = []
    for name in sorted([names] if isinstance(names, str) else names, key=str):
        close = difflib.get_close_matches(str(name)[:_LONGEST], allowed, n=1)
        parts.append(shown(name) + (f" (did you mean {close[0]!r}?)" if close else ""))
    return parts


class UnknownKeywordError(UnknownNameError, TypeError):
    """A keyword does not exist; also a TypeError in Python's wording.

    Libraries that try keywords on environments rely on both. Gymnasium remakes the error with a longer
    message, so it takes only a message; :meth:`of` writes one.
    """

    def __init__(self, message: str) -> None:
        ParameterError.__init__(self, message)

    @classmethod
    def of(cls, owner: str, names: Any, allowed: Any) -> UnknownKeywordError:
        """Return the error for some unknown keywords of an owner."""
        told = " and ".join(
            f"an unexpected keyword argument {name}" for name in _suggesting(names, allowed)
        )
        return cls(f"{owner} got {told}; allowed are {', '.join(allowed)}")


class MissingPackageError(RailenvError, ImportError):
    """A package of an extra is needed but not installed."""


class EquationError(RailenvError, TypeError):
    """Equations of motion contain something from which no kernel can be generated."""


class CompilationError(RailenvError, RuntimeError):
    """Kernels cannot be compiled in this process."""


class EquilibriumError(RailenvError):
    """No running equilibrium was found.

    Attributes
    ----------
    residual : float
        Largest derivative (m/s^2 or rad/s^2) that the best attempt leaves.
    reached : float or None
        Speed (m/s) up to which the branch could be followed, if following it failed.
    """

    def __init__(self, message: str, residual: float, reached: float | None = None) -> None:
        super().__init__(message)
        self.residual = residual
        self.reached = reached


class SimulationError(RailenvError):
    """A simulation reached values that are not finite.

    Attributes
    ----------
    response : control.TimeResponseData
        Response up to then.
    """

    def __init__(self, message: str, response: Any) -> None:
        super().__init__(message)
        self.response = response
