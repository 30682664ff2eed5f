"""Checks of arguments, with messages that name the quantity, its value and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv.errors import ParameterError, UnknownNameError

CANT_LIMIT = 0.5
"""rad; the equations are written for small cant angles, 0.19 rad is the steepest track built."""


def number(
    name: str,
    value: Any,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    open_low: bool = False,
    unit: str = "",
) -> float:
    """Return ``value`` as a finite float within [low, high], or (low, high] with ``open_low``.

    Raises
    ------
    ParameterError
        If it is not a number, not finite or out of range.
    """
    unit = f" {unit}" if unit not in ("", "1") else ""
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is {value!r}, which is not a number") from None
    except OverflowError:
        raise ParameterError(f"{name} is too large for a number; it must be finite") from None
    if isinstance(value, (bool, np.bool_, str, bytes)):
        raise ParameterError(f"{name} is {value!r}, which is not a number")
    inside = low < result if open_low else low <= result
    if not (math.isfinite(result) and inside and result <= high):
        bounds = []
        if low > -math.inf:
            bounds.append(f"{'greater than' if open_low else 'at least'} {low:g}{unit}")
        if high < math.inf:
            bounds.append(f"at most {high:g}{unit}")
        allowed = " and ".join(["finite", *bounds])
        raise ParameterError(f"{name} is {result:g}{unit}; it must be {allowed}")
    return result


def whole(name: str, value: Any, *, low: int = 1) -> int:
    """Return ``value`` as a whole number from ``low`` on.

    Raises
    ------
    ParameterError
        If it is anything else.
    """
    if not hasattr(value, "__index__") or isinstance(value, bool) or value < low:
        raise ParameterError(f"{name} is {value!r}; it must be a whole number from {low}")
    return int(value)


def speed(value: Any, name: str = "speed") -> float:
    """Return a forward speed in m/s; it must be positive, for creepages are relative to it."""
    return number(name, value, low=0.0, open_low=True, unit="m/s")


def cant(value: Any) -> float:
    """Return a cant angle in rad."""
    return number("cant", value, low=-CANT_LIMIT, high=CANT_LIMIT, unit="rad")


def curvature(radius: Any) -> float:
    """Return the curvature 1/R (1/m) of a curve radius in m; ``math.inf`` is tangent track."""
    if isinstance(radius, (int, float)) and not isinstance(radius, bool) and math.isinf(radius):
        return 0.0
    value = number("radius", radius, unit="m")
    if abs(value) < 1.0:
        raise ParameterError(
            f"radius is {value:g} m; its magnitude must be at least 1 m "
            "(math.inf is tangent track, a negative radius the other hand)"
        )
    return 1.0 / value


def vector(name: str, value: ArrayLike | None, labels: Sequence[str]) -> NDArray[np.float64]:
    """Return a finite float vector with one entry per label; None is all zeros.

    Raises
    ------
    ParameterError
        If the length is another, or an entry is not finite (its label is named).
    """
    if value is None:
        return np.zeros(len(labels))
    try:
        result = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is {value!r}, which is not an array of numbers") from None
    if result.shape != (len(labels),):
        raise ParameterError(
            f"{name} has shape {result.shape}; it must be ({len(labels)},): {', '.join(labels)}"
        )
    if not np.isfinite(result).all():
        bad = int(np.flatnonzero(~np.isfinite(result))[0])
        raise ParameterError(f"{name} entry {labels[bad]} is {result[bad]}; it must be finite")
    return result


def known(kind: str, names: Iterable[str], allowed: Sequence[str]) -> None:
    """Raise UnknownNameError unless every name is among those allowed."""
    unknown = set(names) - set(allowed)
    if unknown:
        raise UnknownNameError(kind, unknown, allowed)
