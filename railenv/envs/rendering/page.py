"""The picture: a canvas, layers with smooth edges, and text."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from railenv.envs.rendering.canvas import Canvas
from railenv.envs.rendering.colours import INK, WHITE, Colour
from railenv.envs.rendering.layout import HEIGHT, WIDTH, Box
from railenv.envs.rendering.text import font
from railenv.kernels.loader import load_pictures

if TYPE_CHECKING:
    import pygame

_TEXTS_KEPT = 512


class Page:
    """The picture: a canvas, layers drawn larger and scaled down smoothly, and text.

    Every box of the layout is drawn anew in each frame; the rest stays white.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        scale = min(size[0] / WIDTH, size[1] / HEIGHT)
        margin = complex(size[0] / scale - WIDTH, size[1] / scale - HEIGHT) / 2.0
        self._kernels = load_pictures()
        self.canvas = Canvas(size, scale, -margin)
        self.surface = self.canvas.surface
        self.surface.fill(WHITE)
        self._layers: dict[Box, tuple[Canvas, NDArray[np.uint32]]] = {}
        self._kept: dict[Box, tuple[Hashable, tuple[int, int], pygame.Surface]] = {}
        self._texts: dict[tuple[str, int, Colour, bool], pygame.Surface] = {}

    def layer(self, box: Box, draw: Callable[[Canvas], None]) -> None:
        """Draw into a box with smooth edges."""
        if box not in self._layers:
            left, top, width, height = self._area(box)
            origin = self.canvas.origin + complex(left, top) / self.canvas.scale
            canvas = Canvas((2 * width, 2 * height), 2.0 * self.canvas.scale, origin)
            target = self.canvas.array[top : top + height, left : left + width]
            self._layers[box] = canvas, target
        canvas, target = self._layers[box]
        canvas.surface.fill(WHITE)
        draw(canvas)
        self._kernels.halve(canvas.array, target)  # as pygame's smoothscale does, three times as fast

    def clear(self, box: Box) -> None:
        """Make a box white."""
        self.surface.fill(WHITE, self._area(box))

    def kept(self, box: Box, key: Hashable, draw: Callable[[], None]) -> None:
        """Clear a box and draw content that is constant as long as the key is the same.

        If the key is that of the last frame, the box is only restored.
        """
        if box not in self._kept or self._kept[box][0] != key:
            area = self._area(box)
            self.surface.fill(WHITE, area)
            draw()
            self._kept[box] = key, area[:2], self.surface.subsurface(area).copy()
        else:
            _, corner, picture = self._kept[box]
            self.surface.blit(picture, corner)

    def _area(self, box: Box) -> tuple[int, int, int, int]:
        """Return left, top, width and height of a box in pixels."""
        corners = [complex(box.left, box.top), complex(box.right, box.bottom)]
        (left, top), (right, bottom) = self.canvas.pixels(corners)
        return left, top, right - left, bottom - top

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
        x -= 0 if align == "left" else w if align == "right" else w // 2
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
        pixels = self.canvas.array.reshape(-1)
        picture = np.empty(3 * len(pixels), dtype=np.uint8)
        whole = len(pixels) // 4 * 4
        self._kernels.pack(pixels[:whole], picture[: 3 * whole].view(np.uint32))
        picture[3 * whole :].reshape(-1, 3)[:] = pixels[whole:].view(np.uint8).reshape(-1, 4)[:, :3]
        return picture.reshape(*self.canvas.array.shape, 3)
