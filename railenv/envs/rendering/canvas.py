"""Shapes drawn in page units onto a surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from railenv.envs.rendering.colours import Colour
from railenv.envs.rendering.layout import Box

if TYPE_CHECKING:
    import pygame

_FAR = 1e4


class Canvas:
    """A surface to draw on in page units; points are complex numbers, x to the right and y down."""

    def __init__(self, surface: pygame.Surface, scale: float, origin: complex) -> None:
        import pygame

        self._draw = pygame.draw
        self.surface = surface
        self.scale = scale
        self.origin = origin

    def pixels(self, points: Iterable[complex] | NDArray[np.complex128]) -> list[tuple[int, int]]:
        """Return points in pixels; those far outside are brought to where integers suffice."""
        scale, x, y = self.scale, self.origin.real, self.origin.imag
        if isinstance(points, np.ndarray):
            if len(points) > 16:
                parts = ((points - self.origin) * scale).view(float).reshape(-1, 2)
                whole: Any = np.rint(np.clip(parts, -_FAR, _FAR)).astype(int).tolist()
                return whole
            points = points.tolist()
        return [(_whole((z.real - x) * scale), _whole((z.imag - y) * scale)) for z in points]

    def polygon(
        self,
        points: Sequence[complex] | NDArray[np.complex128],
        fill: Colour | None,
        edge: Colour | None = None,
        width: float = 1.0,
    ) -> None:
        """Draw a filled polygon, its edge, or both; the width is that of the edge."""
        pixels = self.pixels(points)
        if fill is not None:
            self._draw.polygon(self.surface, fill, pixels)
        if edge is not None:
            self._draw.lines(self.surface, edge, True, pixels, self.thickness(width))

    def circle(self, centre: complex, radius: float, fill: Colour, edge: Colour | None = None) -> None:
        """Draw a disc, with an edge within its radius."""
        (pixel,) = self.pixels([centre])
        if edge is not None:
            self._draw.circle(self.surface, edge, pixel, radius * self.scale)
            radius -= 1.0
        self._draw.circle(self.surface, fill, pixel, radius * self.scale)

    def rectangle(self, box: Box, fill: Colour | None, edge: Colour | None = None) -> None:
        """Draw a box, filled, with an edge, or both."""
        (left, top), (right, bottom) = self.pixels(
            [complex(box.left, box.top), complex(box.right, box.bottom)]
        )
        area = (left, top, right - left, bottom - top)
        if fill is not None:
            self._draw.rect(self.surface, fill, area)
        if edge is not None:
            self._draw.rect(self.surface, edge, area, 1)

    def line(self, start: complex, end: complex, colour: Colour, width: float = 1.0) -> None:
        """Draw a straight line."""
        a, b = self.pixels([start, end])
        self._draw.line(self.surface, colour, a, b, self.thickness(width))

    def dashes(self, start: complex, end: complex, colour: Colour, dash: float = 12.0) -> None:
        """Draw a dashed straight line; a dash and a gap are each about ``dash`` long."""
        n = max(1, int(abs(end - start) / dash))
        ends = self.pixels([start + (end - start) * i / n for i in range(n + 1)])
        self.segments(ends, colour)

    def segments(self, ends: Sequence[tuple[int, int]], colour: Colour) -> None:
        """Draw every other piece of a line whose corners are given in pixels."""
        for a, b in zip(ends[::2], ends[1::2], strict=False):
            self._draw.line(self.surface, colour, a, b, self.thickness(1.0))

    def curve(self, x: NDArray[np.float64], y: NDArray[np.float64], colour: Colour) -> None:
        """Draw a smooth line, about one and a half units thick, through more than one point."""
        if len(x) < 2:
            return
        px = (x - self.origin.real) * self.scale
        py = np.clip((y - self.origin.imag) * self.scale, -_FAR, _FAR)
        for shift in (-0.35, 0.35):
            points = np.column_stack([px, py + shift * self.scale]).tolist()
            self._draw.aalines(self.surface, colour, False, points)

    def steps(self, x: NDArray[np.float64], y: NDArray[np.float64], colour: Colour) -> None:
        """Draw a line of horizontal and vertical pieces, which need no smoothing."""
        if len(x) > 1:
            self._draw.lines(self.surface, colour, False, self.pixels(x + 1j * y), self.thickness(1.5))

    def thickness(self, width: float) -> int:
        """Return a width in whole pixels, at least one."""
        return max(1, round(width * self.scale))


def _whole(pixel: float) -> int:
    return round(min(max(pixel, -_FAR), _FAR))
