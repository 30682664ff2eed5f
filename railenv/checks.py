"""Checks of arguments, with messages that name the quantity, its value and what is allowed."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv.errors import ParameterError, UnknownNameError, shown

CANT_LIMIT = 0.5
"""rad; the equations are for small cant angles, and 0.19 rad is the steepest track built."""


HIGHEST_SPEED = 1e4
"""m/s, far beyond anything that runs on rails; numbers above it are mistakes."""


LARGEST_COUNT = 2**63 - 1


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
        raise ParameterError(f"{name} is {shown(value)}, which is not a number") from None
    except OverflowError:
        raise ParameterError(f"{name} is too large for a number; it must be finite") from None
    if isinstance(value, (bool, np.bool_, str, bytes)):
        raise ParameterError(f"{name} is {shown(value)}, which is not a number")
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


def whole(name: str, value: Any, *, low: int = 1, high: int = LARGEST_COUNT) -> int:
    """Return ``value`` as a whole number within [low, high].

    Raises
    ------
    ParameterError
        If it is anything else.
    """
    try:
        result = operator.index(value)
    except TypeError:
        result = low - 1
    if isinstance(value, bool) or not low <= result <= high:
        limits = f"from {low}" + (f" to {high}" if high < LARGEST_COUNT or result > high else "")
        raise ParameterError(f"{name} is {shown(value)}; it must be a whole number {limits}")
    return result


def interval(
    name: str, value: Any, *, low: float = -math.inf, high: float = math.inf, unit: str = ""
) -> tuple[float, float]:
    """Return ``value`` as a pair of numbers within [low, high], the lowest first.

    Raises
    ------
    ParameterError
        If it is anything else.
    """
    try:
        first, last = value
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is {shown(value)}; it must be a pair (lowest, highest)") from None
    first = number(f"lowest of {name}", first, low=low, high=high, unit=unit)
    last = number(f"highest of {name}", last, low=low, high=high, unit=unit)
    if first > last:
        raise ParameterError(f"{name} is ({first:g}, {last:g}); the lowest must not exceed the highest")
    return first, last


def speeds(value: Any, name: str = "speed_range") -> tuple[float, float]:
    """Return lowest and highest forward speed in m/s, which must differ."""
    low, high = interval(name, value, unit="m/s")
    speed(low, f"lowest of {name}")
    if low == high:
        raise ParameterError(f"{name} is ({low:g}, {high:g}) m/s; the lowest must be below the highest")
    return low, high


def mapping(name: str, value: Any) -> dict[str, Any]:
    """Return a mapping as a dict; None is an empty one.

    Raises
    ------
    ParameterError
        If it is anything else.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise ParameterError(f"{name} is {shown(value)}; it must map names to values")
    return dict(value)


def numbers(name: str, value: Any, *, least: int = 1) -> NDArray[np.float64]:
    """Return a sequence of at least ``least`` numbers, without NaN, as a vector.

    Raises
    ------
    ParameterError
        If it is anything else.
    """
    try:
        result = np.atleast_1d(np.array(value, dtype=float))
    except (OverflowError, TypeError, ValueError):
        raise ParameterError(f"{name} is {shown(value)}, which is not an array of numbers") from None
    if result.ndim != 1 or result.size < least:
        raise ParameterError(
            f"{name} has shape {result.shape}; it must be a sequence of at least {least} numbers"
        )
    if np.isnan(result).any():
        raise ParameterError(f"{name} is {shown(value)}; no entry may be NaN")
    return result


def speed(value: Any, name: str = "speed") -> float:
    """Return a forward speed in m/s; it must be positive because creepages are relative to it."""
    return number(name, value, low=0.0, high=HIGHEST_SPEED, open_low=True, unit="m/s")


def cant(value: Any) -> float:
    """Return a cant angle in rad."""
    return number("cant", value, low=-CANT_LIMIT, high=CANT_LIMIT, unit="rad")


def curvature(radius: Any) -> float:
    """Return the curvature 1/R (1/m) of a curve radius in m; ``math.inf`` is tangent track."""
    if isinstance(radius, float) and math.isinf(radius):
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
        If the length is wrong, or an entry is not finite (the message names its label).
    """
    if value is None:
        return np.zeros(len(labels))
    try:
        result = np.array(value, dtype=float)
    except (OverflowError, TypeError, ValueError):
        raise ParameterError(f"{name} is {shown(value)}, which is not an array of numbers") from None
    if result.shape != (len(labels),):
        raise ParameterError(
            f"{name} has shape {result.shape}; it must be ({len(labels)},): {', '.join(labels)}"
        )
    if not np.isfinite(result).all():
        bad = int(np.flatnonzero(~np.isfinite(result))[0])
        raise ParameterError(f"{name} entry {labels[bad]} is {result[bad]}; it must be finite")
    return result


def known(kind: str, names: Iterable[Any], allowed: Sequence[str]) -> None:
    """Raise UnknownNameError unless every name is allowed."""
    unknown = [name for name in names if not (isinstance(name, str) and name in allowed)]
    if unknown:
        raise UnknownNameError(kind, unknown, allowed)


def choice(name: str, value: Any, allowed: Sequence[str]) -> None:
    """Raise ParameterError unless a value is one of the texts allowed."""
    if not (isinstance(value, str) and value in allowed):
        texts = [repr(text) for text in allowed]
        listed = " or ".join(filter(None, [", ".join(texts[:-1]), texts[-1]]))
        raise ParameterError(f"{name} is {shown(value)}; it must be {listed}")
