"""The renderer: scenes to arrays or into a window."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.envs.rendering.chart import draw_chart
from railenv.envs.rendering.front import show_front
from railenv.envs.rendering.header import draw_header
from railenv.envs.rendering.page import Page
from railenv.envs.rendering.plan import show_plan
from railenv.envs.rendering.scene import Scene
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import pygame

Mode = Literal["human", "rgb_array"]

_SMALLEST = (640, 400)

_SHOWING: weakref.WeakSet[Renderer] = weakref.WeakSet()
"""Renderers in mode "human": pygame has one window per process, closed by the last of them."""


class Renderer:
    """A renderer that draws scenes into arrays or into a window.

    Parameters
    ----------
    mode : {"human", "rgb_array"}
        Show every frame in a window at the pace of ``fps``, or return it as an array. Arrays need no
        display.
    fps : float
        Frames per second at which a window runs.
    size : tuple of int
        Width and height in pixels, at least 640 by 400; the page is 960 by 600 and scaled to fit.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        If pygame is not installed.
    ParameterError
        If an argument is not allowed.

    Examples
    --------
    >>> import numpy as np
    >>> from railenv.envs.rendering import History, Renderer, Scene
    >>> scene = Scene(
    ...     time=0.0,
    ...     speed=80.0,
    ...     curvature=1.0 / 6250.0,
    ...     cant=0.0873,
    ...     critical_speed=None,
    ...     bodies=np.zeros((3, 4)),
    ...     equilibrium=np.zeros((3, 4)),
    ...     rail=np.zeros(2),
    ...     half_gauge=0.7176,
    ...     half_wheelbase=1.2,
    ...     wheel_radius=0.4575,
    ...     flange_clearance=0.00923,
    ...     history=History.empty(),
    ... )
    >>> renderer = Renderer("rgb_array", fps=50)
    >>> renderer.draw(scene).shape
    (600, 960, 3)
    >>> renderer.close()
    """

    def __init__(self, mode: Mode, fps: float, size: tuple[int, int] = (960, 600)) -> None:
        checks.choice("mode", mode, get_args(Mode))
        try:
            import pygame
            import pygame.font
        except ImportError as error:
            from gymnasium.error import DependencyNotInstalled

            raise DependencyNotInstalled(
                "pygame is not installed; run `pip install 'railenv[render]'`"
            ) from error
        self._pygame = pygame
        self.mode = mode
        self.fps = checks.number("fps", fps, low=1.0, unit="1/s")
        self.size = _checked_size(size)
        self._page: Page | None = None
        self._clock: Any = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle the settings; a copy has no window yet."""
        return type(self), (self.mode, self.fps, self.size)

    def draw(self, scene: Scene) -> NDArray[np.uint8] | None:
        """Draw a frame.

        Returns
        -------
        array of shape (height, width, 3) or None
            Red, green and blue for "rgb_array"; None for "human", which shows the frame in the window.
        """
        if self._page is None:
            self._page = Page(self.size)
        _draw_scene(self._page, scene)
        if self.mode == "rgb_array":
            return self._page.array()
        self._show(self._page.surface)
        return None

    def _show(self, picture: pygame.Surface) -> None:
        display = self._pygame.display
        if not display.get_init():
            display.init()
        _SHOWING.add(self)
        window = display.get_surface()
        if window is None or window.get_size() != self.size:
            window = display.set_mode(self.size)
            display.set_caption("railenv")
        if self._clock is None:
            self._clock = self._pygame.time.Clock()
        window.blit(picture, (0, 0))
        self._pygame.event.pump()
        self._clock.tick(self.fps)
        display.flip()

    def close(self) -> None:
        """Close the window, unless another renderer shows its frames there; harmless when closed."""
        self._page = None
        self._clock = None
        if self in _SHOWING:
            _SHOWING.discard(self)
            if not _SHOWING:
                self._pygame.display.quit()


def _checked_size(size: Any) -> tuple[int, int]:
    try:
        width, height = (int(n) for n in size)
    except (TypeError, ValueError):
        raise ParameterError(f"size is {size!r}; it must be a width and a height in pixels") from None
    if width < _SMALLEST[0] or height < _SMALLEST[1]:
        raise ParameterError(
            f"size is {width} x {height} pixels; it must be at least {_SMALLEST[0]} x {_SMALLEST[1]}"
        )
    return width, height


def _draw_scene(page: Page, scene: Scene) -> None:
    draw_header(page, scene)
    show_plan(page, scene)
    show_front(page, scene)
    draw_chart(page, scene)
