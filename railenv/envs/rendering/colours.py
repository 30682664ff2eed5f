"""Colours of the frames, including those of the package's figures."""

from __future__ import annotations

Colour = tuple[int, int, int]

LEADING: Colour = (0x1F, 0x6F, 0x8B)
TRAILING: Colour = (0xD9, 0x8B, 0x1F)
ALARM: Colour = (0xC8, 0x43, 0x2B)
NEUTRAL: Colour = (0x9A, 0xA5, 0xAB)
SAFE: Colour = (0x5B, 0x7F, 0x3A)
"""Colours of the package's figures: leading and trailing wheelset, contact, bogie frame, stable."""

WHITE: Colour = (255, 255, 255)
INK: Colour = (0x26, 0x2D, 0x31)
LABEL: Colour = (0x5C, 0x66, 0x6B)
GRID: Colour = (0xE3, 0xE6, 0xE8)
SLEEPER: Colour = (0xEE, 0xEA, 0xE4)
BAND: Colour = (0xF7, 0xDF, 0xB4)
RAIL: Colour = (0x4A, 0x52, 0x57)
GHOST: Colour = (0xB4, 0xBD, 0xC2)
ACTIONS: tuple[Colour, ...] = (SAFE, (0x8A, 0x4F, 0x7D), LABEL)


def of_wheelset(i: int, count: int) -> Colour:
    """Return the colour of a wheelset: those between the first and the last are paler."""
    own = LEADING if 2 * i < count else TRAILING
    return own if i in (0, count - 1) else mix(own, 0.6)


def mix(colour: Colour, share: float) -> Colour:
    """Return a colour mixed with white; ``share`` 1 is the colour."""
    r, g, b = (round(255.0 + share * (c - 255.0)) for c in colour)
    return r, g, b
