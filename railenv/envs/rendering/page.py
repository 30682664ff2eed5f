"""The picture: a canvas, layers with smooth edges, and text."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from railenv.envs.rendering.canvas import Canvas
from railenv.envs.rendering.colours import INK, WHITE, Colour
from railenv.envs.rendering.layout import HEIGHT, WIDTH, Box
from railenv.envs.rendering.text import font

if TYPE_CHECKING:
    import pygame

_SUPERSAMPLING = 2
_TEXTS_KEPT = 512


class Page:
    """The picture: a canvas, layers drawn larger and scaled down smoothly, and text."""

    def __init__(self, size: tuple[int, int]) -> None:
        import pygame

        self._pygame = pygame
        scale = min(size[0] / WIDTH, size[1] / HEIGHT)
        margin = complex(size[0] / scale - WIDTH, size[1] / scale - HEIGHT) / 2.0
        # Red, green, blue in this order in memory: the picture's bytes are the array's.
        masks = (0xFF, 0xFF00, 0xFF0000, 0)
        self.surface = pygame.Surface(size, 0, 32, masks)
        self._packed = pygame.Surface(size, 0, 24, masks)
        self.canvas = Canvas(self.surface, scale, -margin)
        self._layers: dict[Box, tuple[Canvas, pygame.Surface]] = {}
        self._texts: dict[tuple[str, int, Colour, bool], pygame.Surface] = {}

    def layer(self, box: Box, draw: Callable[[Canvas], None]) -> None:
        """Draw into a box with smooth edges."""
        if box not in self._layers:
            corners = [complex(box.left, box.top), complex(box.right, box.bottom)]
            (left, top), (right, bottom) = self.canvas.pixels(corners)
            size = right - left, bottom - top
            target = self.surface.subsurface((left, top, *size))
            large = self._pygame.Surface(
                (size[0] * _SUPERSAMPLING, size[1] * _SUPERSAMPLING), 0, self.surface
            )
            origin = self.canvas.origin + complex(left, top) / self.canvas.scale
            self._layers[box] = (Canvas(large, self.canvas.scale * _SUPERSAMPLING, origin), target)
        canvas, target = self._layers[box]
        canvas.surface.fill(WHITE)
        draw(canvas)
        self._pygame.transform.smoothscale(canvas.surface, target.get_size(), target)

    def text(
        self,
        content: str,
        at: complex,
        size: float,
        colour: Colour = INK,
        *,
        align: Literal["left", "centre", "right"] = "left",
        bold: bool = False,
        width: float | None = None,
    ) -> float:
        """Write one line, its top at ``at``; return its width, which ``width`` limits."""
        room = math.inf if width is None else width * self.canvas.scale
        picture = self._fit(content, size, colour, bold, room)
        ((x, y),) = self.canvas.pixels([at])
        w = picture.get_width()
        x -= {"left": 0, "centre": w // 2, "right": w}[align]
        self.surface.blit(picture, (x, y))
        return w / self.canvas.scale

    def _fit(
        self, content: str, size: float, colour: Colour, bold: bool, room: float
    ) -> pygame.Surface:
        picture = self._render(content, size, colour, bold)
        smallest = 0.75 * size
        while picture.get_width() > room and size > smallest:
            size -= 1.0
            picture = self._render(content, size, colour, bold)
        while picture.get_width() > room and len(content) > 1:
            content = content[:-2].rstrip() + "…"
            picture = self._render(content, size, colour, bold)
        return picture

    def _render(self, content: str, size: float, colour: Colour, bold: bool) -> pygame.Surface:
        pixels = max(7, round(size * self.canvas.scale))
        key = (content, pixels, colour, bold)
        if key not in self._texts:
            if len(self._texts) >= _TEXTS_KEPT:
                self._texts.clear()
            self._texts[key] = font(pixels, bold).render(content, True, colour)
        return self._texts[key]

    def array(self) -> NDArray[np.uint8]:
        """Return a copy of the picture, (height, width, 3)."""
        self._packed.blit(self.surface, (0, 0))
        width, height = self._packed.get_size()
        # The surface is locked as long as this view of its memory lives, here until the return.
        memory: Any = self._packed.get_buffer()
        rows = np.frombuffer(memory, dtype=np.uint8).reshape(height, -1)
        return rows[:, : 3 * width].reshape(height, width, 3).copy()
