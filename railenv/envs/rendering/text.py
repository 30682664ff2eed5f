"""Fonts, and the text of numbers."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pygame


def font(pixels: int, bold: bool) -> pygame.font.Font:
    """Return a font, loaded again if pygame has quit since: older ones crash it."""
    import pygame

    if not pygame.font.get_init():
        _load_font.cache_clear()
        pygame.font.init()
    return _load_font(pixels, bold)


@functools.cache
def _load_font(pixels: int, bold: bool) -> pygame.font.Font:
    """Load the font of matplotlib's figures, or pygame's own if that is not installed."""
    import matplotlib as mpl
    import pygame

    pygame.register_quit(_load_font.cache_clear)
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    path = Path(mpl.get_data_path()) / "fonts" / "ttf" / name
    return pygame.font.Font(path if path.is_file() else None, pixels)


def number(value: float, digits: int = 1) -> str:
    """Return a number with a true minus sign and without negative zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "\N{MINUS SIGN}")
