"""Shapes drawn in page units onto a surface."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railenv.envs.rendering.colours import Colour
from railenv.envs.rendering.layout import Box
from railenv.kernels.loader import load_pictures

_FAR = 1e4


class Canvas:
    """A surface to draw on in page units; points are complex numbers, x to the right and y down.

    Parameters
    ----------
    size : tuple of int
        Width and height in pixels.
    scale : float
        Pixels of a page unit.
    origin : complex
        The point in the upper left corner.
    """

    def __init__(self, size: tuple[int, int], scale: float, origin: complex) -> None:
        import pygame

        self._draw = pygame.draw
        self._stroke = load_pictures().stroke
        # Surface and array share memory: red, green, blue and an unused byte.
        self.array: NDArray[np.uint32] = np.zeros((size[1], size[0]), dtype=np.uint32)
        self.surface = pygame.image.frombuffer(self.array.data.cast("B"), size, "RGBX")
        self.scale = scale
        self.origin = origin

    def pixels(self, points: Iterable[complex] | NDArray[np.complex128]) -> list[Any]:
        """Return points in pixels, as pairs of integers; an array gives nested lists of its shape.

        Points far outside are moved to where integers suffice.
        """
        scale, x, y = self.scale, self.origin.real, self.origin.imag
        if isinstance(points, np.ndarray):
            parts = ((points - self.origin) * scale).view(float).reshape(*points.shape, 2)
            whole: list[Any] = np.rint(np.clip(parts, -_FAR, _FAR)).astype(int).tolist()
            return whole
        return [
            (
                round(px if -_FAR < (px := (z.real - x) * scale) < _FAR else _far(px)),
                round(py if -_FAR < (py := (z.imag - y) * scale) < _FAR else _far(py)),
            )
            for z in points
        ]

    def polygon(
        self,
        points: Sequence[complex] | NDArray[np.complex128],
        fill: Colour | None,
        edge: Colour | None = None,
        width: float = 1.0,
    ) -> None:
        """Draw a filled polygon, its edge, or both; ``width`` is that of the edge."""
        pixels = self.pixels(points)
        if fill is not None:
            self._draw.polygon(self.surface, fill, pixels)
        if edge is not None:
            self._draw.lines(self.surface, edge, True, pixels, self.thickness(width))

    def polygons(self, corners: NDArray[np.complex128], fill: Colour) -> None:
        """Draw filled polygons narrower than the surface; each row has the corners of one."""
        width = self.surface.get_width()
        for pixels in self.pixels(corners):
            if any(0 <= column < width for column, _ in pixels):
                self._draw.polygon(self.surface, fill, pixels)

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
        """Draw a smooth line, just under two units thick, through more than one point."""
        if len(x) < 2:
            return
        px = (x - self.origin.real) * self.scale
        py = np.clip((y - self.origin.imag) * self.scale, -_FAR, _FAR)
        red, green, blue = colour
        number = np.uint32(red | green << 8 | blue << 16)
        self._stroke(self.array, px, py, max(0.5, 0.9 * self.scale), number)

    def steps(self, x: NDArray[np.float64], y: NDArray[np.float64], colour: Colour) -> None:
        """Draw a line of horizontal and vertical pieces, which need no smoothing."""
        if len(x) > 1:
            self._draw.lines(self.surface, colour, False, self.pixels(x + 1j * y), self.thickness(1.5))

    def thickness(self, width: float) -> int:
        """Return a width in whole pixels, at least one."""
        return max(1, round(width * self.scale))


def _far(pixel: float) -> float:
    return math.copysign(_FAR, pixel)
