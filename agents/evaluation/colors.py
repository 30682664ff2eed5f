"""Colours of controllers side by side."""

from __future__ import annotations

from collections.abc import Iterable

from design.style import NEUTRAL, SERIES

INK = "#333333"

_COLORS = (*SERIES, "#3f5aa8", "#b8577a", "#7a6a58", "#2f9e8f")
"""Palette for controllers side by side."""


def colors(names: Iterable[str]) -> dict[str, str]:
    """Return a colour for each of some controllers: grey for the passive vehicle, others in turn."""
    others = [name for name in names if name != "passive"]
    return {"passive": NEUTRAL, **{n: _COLORS[k % len(_COLORS)] for k, n in enumerate(others)}}
