"""Frames that show a running bogie: plan view, wheel-rail contact, strip chart, read-outs.

The renderer knows nothing of environments; it draws a `Scene`. It needs pygame, the package's optional
extra ``render``, and no display unless a window is asked for.
"""

from __future__ import annotations

import cmath
import functools
import math
import weakref
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railenv import checks
from railenv.envs.observation import CANT_BASE
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import pygame

Mode = Literal["human", "rgb_array"]
Colour = tuple[int, int, int]

LEADING: Colour = (0x1F, 0x6F, 0x8B)
TRAILING: Colour = (0xD9, 0x8B, 0x1F)
ALARM: Colour = (0xC8, 0x43, 0x2B)
NEUTRAL: Colour = (0x9A, 0xA5, 0xAB)
SAFE: Colour = (0x5B, 0x7F, 0x3A)
"""Colours of the package's figures: leading and trailing wheelset, contact, bogie frame, stable."""

_WHITE: Colour = (255, 255, 255)
_INK: Colour = (0x26, 0x2D, 0x31)
_LABEL: Colour = (0x5C, 0x66, 0x6B)
_GRID: Colour = (0xE3, 0xE6, 0xE8)
_SLEEPER: Colour = (0xEE, 0xEA, 0xE4)
_BAND: Colour = (0xF7, 0xDF, 0xB4)
_RAIL: Colour = (0x4A, 0x52, 0x57)
_GHOST: Colour = (0xB4, 0xBD, 0xC2)
_ACTIONS: tuple[Colour, ...] = (SAFE, (0x8A, 0x4F, 0x7D), _LABEL)

_WIDTH, _HEIGHT = 960.0, 600.0
_SMALLEST = (640, 400)
_SUPERSAMPLING = 2
_TEXTS_KEPT = 512
_FAR = 1e4

GROUND_SLOWDOWN = 20.0
"""The sleepers pass this many times slower than in reality, where they would blur."""

_SLEEPER_SPACING = 0.6
_TANGENT = 1e-6
_BEND_CURVATURE = 5e-4
_LIFT_ROLL = 2e-3

_PLAN_HALF_GAUGE = 58.0
_PLAN_BEND = 60.0
_FRONT_HALF_GAUGE = 84.0
_FRONT_CONE = 0.1
_FACTORS = (1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 75.0, 100.0)
_RANGES = (
    (5.0, 2.5),
    (10.0, 5.0),
    (15.0, 5.0),
    (20.0, 10.0),
    (30.0, 10.0),
    (50.0, 25.0),
    (100.0, 50.0),
)
_WINDOWS = (
    *((1.0, 0.2), (2.0, 0.5), (3.0, 0.5), (4.0, 1.0), (5.0, 1.0), (6.0, 1.0), (8.0, 2.0), (10.0, 2.0)),
    *((15.0, 5.0), (20.0, 5.0), (30.0, 5.0), (40.0, 10.0), (60.0, 10.0), (120.0, 20.0), (300.0, 60.0)),
)

# ------------------------------------------------------------------------------ scene


def _array(name: str, value: ArrayLike, shape: tuple[int | None, ...], meaning: str) -> Any:
    try:
        result = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(f"{name} is {value!r}, which is not an array of numbers") from None
    wanted = (
        "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," * (len(shape) == 1)) + ")"
    )
    fits = result.ndim == len(shape) and all(
        n is None or n == m for n, m in zip(shape, result.shape, strict=True)
    )
    if not fits:
        raise ParameterError(f"{name} has shape {result.shape}; it must be {wanted}: {meaning}")
    if not np.isfinite(result).all():
        raise ParameterError(f"{name} has entries that are not finite numbers")
    return result


@dataclass(frozen=True, eq=False)
class History:
    """What the strip chart shows, oldest first.

    Parameters
    ----------
    time : array of shape (n,)
        Instants, s, increasing.
    y : array of shape (n, 2)
        Lateral displacements of the leading and the trailing wheelset, m.
    action : array of shape (n, n_actuators)
        Normalised actions in [-1, 1]; ``n_actuators`` may be 0.

    Raises
    ------
    ParameterError
        If a shape does not fit, an entry is not finite or time does not increase.
    """

    time: NDArray[np.float64]
    y: NDArray[np.float64]
    action: NDArray[np.float64]

    def __post_init__(self) -> None:
        time = _array("history.time", self.time, (None,), "instants")
        n = len(time)
        if (np.diff(time) <= 0.0).any():
            raise ParameterError("history.time must increase from entry to entry")
        y = _array("history.y", self.y, (n, 2), "displacements of both wheelsets at every instant")
        action = _array("history.action", self.action, (n, None), "the action at every instant")
        _set(self, time=time, y=y, action=action)

    @classmethod
    def empty(cls, n_actuators: int = 0) -> History:
        """Return a history without instants."""
        return cls(np.zeros(0), np.zeros((0, 2)), np.zeros((0, n_actuators)))


@dataclass(frozen=True, eq=False)
class Scene:
    """What one frame shows; SI units.

    Parameters
    ----------
    time, speed : float
        Time (s) and forward speed (m/s).
    curvature, cant : float
        Curvature (1/m, positive: the outer rail is the left one) and cant angle (rad, positive: the
        left rail is raised).
    critical_speed : float or None
        Critical speed (m/s), shown beside the speed when given.
    bodies : array of shape (2, 4) or (3, 4)
        y, z (m), phi and psi (rad) of leading wheelset, trailing wheelset and, for a bogie, the frame.
    equilibrium : array of the same shape
        The running equilibrium, drawn as a ghost.
    rail : array of shape (2,)
        Lateral displacement (m) of the rails under leading and trailing wheelset.
    half_gauge, half_wheelbase, wheel_radius, flange_clearance : float
        Geometry of the vehicle, m.
    history : History
        The last seconds, for the strip chart.
    derailed : str or None
        The reason, once derailed.

    Raises
    ------
    ParameterError
        If a shape does not fit or a value is not allowed.
    """

    time: float
    speed: float
    curvature: float
    cant: float
    critical_speed: float | None
    bodies: NDArray[np.float64]
    equilibrium: NDArray[np.float64]
    rail: NDArray[np.float64]
    half_gauge: float
    half_wheelbase: float
    wheel_radius: float
    flange_clearance: float
    history: History
    derailed: str | None = None

    def __post_init__(self) -> None:
        meaning = "y, z, phi, psi of both wheelsets and, for a bogie, the frame"
        bodies = _array("bodies", self.bodies, (None, 4), meaning)
        if len(bodies) not in (2, 3):
            raise ParameterError(
                f"bodies has shape {bodies.shape}; it must be (2, 4) or (3, 4): {meaning}"
            )
        equilibrium = _array("equilibrium", self.equilibrium, bodies.shape, "as bodies")
        rail = _array("rail", self.rail, (2,), "displacement of the rails under each wheelset")
        for name in ("half_gauge", "half_wheelbase", "wheel_radius", "flange_clearance"):
            value = checks.number(name, getattr(self, name), low=0.0, open_low=True, unit="m")
            _set(self, **{name: value})
        if not isinstance(self.history, History):
            raise ParameterError(f"history is {self.history!r}; it must be a History")
        if not (self.derailed is None or isinstance(self.derailed, str)):
            raise ParameterError(f"derailed is {self.derailed!r}; it must be a reason, or None")
        if self.critical_speed is not None:
            _set(self, critical_speed=checks.speed(self.critical_speed, "critical_speed"))
        _set(
            self,
            time=checks.number("time", self.time, unit="s"),
            speed=checks.speed(self.speed),
            curvature=checks.number("curvature", self.curvature, low=-1.0, high=1.0, unit="1/m"),
            cant=checks.cant(self.cant),
            bodies=bodies,
            equilibrium=equilibrium,
            rail=rail,
        )

    @property
    def exaggeration(self) -> float:
        """Factor by which lateral motion and yaw are drawn larger than they are."""
        room = 0.35 * self.half_gauge / self.flange_clearance
        return max((f for f in _FACTORS if f <= room), default=1.0)


def _set(record: Any, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(record, name, value)


# ----------------------------------------------------------------------------- canvas


class _Box(NamedTuple):
    """A rectangle of the page, which measures 960 by 600 units whatever the picture's size."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        return self.left + self.width

    @property
    def bottom(self) -> float:
        return self.top + self.height

    @property
    def centre(self) -> complex:
        return complex(self.left + self.width / 2.0, self.top + self.height / 2.0)


_HEADER = _Box(8, 4, 944, 48)
_PLAN = _Box(8, 56, 618, 320)
_PLAN_VIEW = _Box(9, 76, 616, 280)
_FRONT = _Box(634, 56, 318, 320)
_FRONT_VIEW = _Box(635, 76, 316, 200)
_CHART = _Box(8, 382, 944, 212)


class _Canvas:
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
        pixels = self.pixels(points)
        if fill is not None:
            self._draw.polygon(self.surface, fill, pixels)
        if edge is not None:
            self._draw.lines(self.surface, edge, True, pixels, self.thickness(width))

    def circle(self, centre: complex, radius: float, fill: Colour, edge: Colour | None = None) -> None:
        (pixel,) = self.pixels([centre])
        if edge is not None:
            self._draw.circle(self.surface, edge, pixel, radius * self.scale)
            radius -= 1.0
        self._draw.circle(self.surface, fill, pixel, radius * self.scale)

    def rectangle(self, box: _Box, fill: Colour | None, edge: Colour | None = None) -> None:
        (left, top), (right, bottom) = self.pixels(
            [complex(box.left, box.top), complex(box.right, box.bottom)]
        )
        area = (left, top, right - left, bottom - top)
        if fill is not None:
            self._draw.rect(self.surface, fill, area)
        if edge is not None:
            self._draw.rect(self.surface, edge, area, 1)

    def line(self, start: complex, end: complex, colour: Colour, width: float = 1.0) -> None:
        a, b = self.pixels([start, end])
        self._draw.line(self.surface, colour, a, b, self.thickness(width))

    def dashes(self, start: complex, end: complex, colour: Colour, dash: float = 12.0) -> None:
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
        return max(1, round(width * self.scale))


def _whole(pixel: float) -> int:
    return round(min(max(pixel, -_FAR), _FAR))


class _Page:
    """The picture: a canvas, layers drawn larger and scaled down smoothly, and text."""

    def __init__(self, size: tuple[int, int]) -> None:
        import pygame

        self._pygame = pygame
        scale = min(size[0] / _WIDTH, size[1] / _HEIGHT)
        margin = complex(size[0] / scale - _WIDTH, size[1] / scale - _HEIGHT) / 2.0
        # Red, green, blue in this order in memory: the picture's bytes are the array's.
        masks = (0xFF, 0xFF00, 0xFF0000, 0)
        self.surface = pygame.Surface(size, 0, 32, masks)
        self._packed = pygame.Surface(size, 0, 24, masks)
        self.canvas = _Canvas(self.surface, scale, -margin)
        self._layers: dict[_Box, tuple[_Canvas, pygame.Surface]] = {}
        self._texts: dict[tuple[str, int, Colour, bool], pygame.Surface] = {}

    def layer(self, box: _Box, draw: Callable[[_Canvas], None]) -> None:
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
            self._layers[box] = (_Canvas(large, self.canvas.scale * _SUPERSAMPLING, origin), target)
        canvas, target = self._layers[box]
        canvas.surface.fill(_WHITE)
        draw(canvas)
        self._pygame.transform.smoothscale(canvas.surface, target.get_size(), target)

    def text(
        self,
        content: str,
        at: complex,
        size: float,
        colour: Colour = _INK,
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
            self._texts[key] = _font(pixels, bold).render(content, True, colour)
        return self._texts[key]

    def array(self) -> NDArray[np.uint8]:
        """Return a copy of the picture, (height, width, 3)."""
        self._packed.blit(self.surface, (0, 0))
        width, height = self._packed.get_size()
        # The surface is locked as long as this view of its memory lives, here until the return.
        memory: Any = self._packed.get_buffer()
        rows = np.frombuffer(memory, dtype=np.uint8).reshape(height, -1)
        return rows[:, : 3 * width].reshape(height, width, 3).copy()


def _font(pixels: int, bold: bool) -> pygame.font.Font:
    """Return a font, which is loaded again when pygame was quit since: older ones crash it."""
    import pygame

    if not pygame.font.get_init():
        _load_font.cache_clear()
        pygame.font.init()
    return _load_font(pixels, bold)


@functools.cache
def _load_font(pixels: int, bold: bool) -> pygame.font.Font:
    """Load the font of matplotlib's figures, or pygame's own where that is not installed."""
    import matplotlib as mpl
    import pygame

    pygame.register_quit(_load_font.cache_clear)
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    path = Path(mpl.get_data_path()) / "fonts" / "ttf" / name
    return pygame.font.Font(path if path.is_file() else None, pixels)


def _mix(colour: Colour, share: float) -> Colour:
    """Return a colour mixed with white; ``share`` 1 is the colour."""
    r, g, b = (round(255.0 + share * (c - 255.0)) for c in colour)
    return r, g, b


def _number(value: float, digits: int = 1) -> str:
    """Return a number with a true minus sign and without negative zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "\N{MINUS SIGN}")


# ---------------------------------------------------------------------------- header


def _draw_header(page: _Page, scene: Scene) -> None:
    cells: list[tuple[float, str, str, str, Colour]] = []
    cells.append(
        (192, "speed", f"{_number(scene.speed)} m/s", f"{_number(3.6 * scene.speed, 0)} km/h", _INK)
    )
    if scene.critical_speed is not None:
        share = scene.speed / scene.critical_speed
        side, colour = ("above", ALARM) if share > 1.0 else ("below", SAFE)
        off = f"{_number(100.0 * abs(share - 1.0), 0)} % {side}"
        cells.append((226, "critical speed", f"{_number(scene.critical_speed)} m/s", off, colour))
    cells.append((236, "curve", *_curve_words(scene.curvature), _INK))
    high = "" if round(1e3 * CANT_BASE * scene.cant) == 0 else f"{_hand(scene.cant)} rail high"
    cant = f"{_number(1e3 * CANT_BASE * abs(scene.cant), 0)} mm"
    cells.append((184, f"cant over {CANT_BASE:g} m", cant, high, _INK))
    x = _HEADER.left
    for width, caption, value, note, colour in cells:
        page.text(caption, complex(x, _HEADER.top), 11, _LABEL, width=width - 12)
        used = page.text(value, complex(x, _HEADER.top + 16), 19, colour, bold=True, width=width - 12)
        left = width - 12 - used - 8
        page.text(note, complex(x + used + 8, _HEADER.top + 23), 12, colour, width=left)
        x += width
    page.text("time", complex(_HEADER.right, _HEADER.top), 11, _LABEL, align="right")
    clock = f"{_number(scene.time, 2)} s"
    page.text(clock, complex(_HEADER.right, _HEADER.top + 16), 19, align="right", bold=True, width=104)


def _hand(value: float) -> str:
    return "left" if value > 0.0 else "right"


def _curve_words(curvature: float) -> tuple[str, str]:
    if abs(curvature) < _TANGENT:
        return "tangent", ""
    return f"R = {_number(1.0 / abs(curvature), 0)} m", f"{_hand(curvature)} is outer"


# ------------------------------------------------------------------------- plan view


_Pose = Callable[[Iterable[complex]], list[complex]]
"""From a body's own points (forward + left * 1j, in page units) to the page."""


class _Plan:
    """Plan view: from track coordinates (along and to the left, in page units) to the page."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.scale = min(
            _PLAN_HALF_GAUGE / scene.half_gauge,
            0.36 * _PLAN_VIEW.width / (scene.half_wheelbase + scene.wheel_radius),
        )
        self.lateral = self.scale * scene.exaggeration
        self.gauge = self.scale * scene.half_gauge
        self.base = self.scale * scene.half_wheelbase
        self.clearance = self.lateral * scene.flange_clearance
        self.reach = _PLAN_VIEW.width / 2.0
        k = scene.curvature
        self.bend = _PLAN_BEND * k / (abs(k) + _BEND_CURVATURE)

    def track(self, along: Any, left: Any) -> Any:
        """Return the page's points of some track coordinates."""
        tangent = self.heading(along)
        plan = along - 1j * self.bend * (along / self.reach) ** 2 + 1j * tangent * left
        return _PLAN_VIEW.centre + np.conj(plan)

    def heading(self, along: Any) -> Any:
        """Return the direction of the track, a complex number of magnitude 1, y to the left."""
        slope = -2.0 * self.bend * along / self.reach**2
        return (1.0 + 1j * slope) / np.sqrt(1.0 + slope**2)

    def alignment(self, along: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement of the rails, joined smoothly from wheelset to wheelset."""
        u = np.clip((along + self.base) / (2.0 * self.base), 0.0, 1.0)
        lead, trail = (self.lateral * self.scene.rail).tolist()
        return trail + (lead - trail) * u * u * (3.0 - 2.0 * u)

    def pose(self, along: float, y: float, yaw: float) -> _Pose:
        """Return the map from a body's own coordinates to the page."""
        turn = math.atan(self.scene.exaggeration * yaw)
        centre = complex(self.track(along, self.lateral * y))
        angle = complex(self.heading(along)) * cmath.exp(1j * turn)
        return lambda points: [centre + (z * angle).conjugate() for z in points]


def _draw_plan(canvas: _Canvas, scene: Scene) -> None:
    plan = _Plan(scene)
    _draw_ground(canvas, plan)
    along = np.linspace(-1.2 * plan.reach, 1.2 * plan.reach, 33)
    shift = plan.alignment(along)
    for side in (1.0, -1.0):
        edge, inner = side * plan.gauge, side * (plan.gauge - plan.clearance)
        _draw_strip(canvas, plan, along, shift, (inner, edge), _BAND)
    ends = ((plan.base, 0, LEADING), (-plan.base, 1, TRAILING))
    for at, i, colour in ends:
        _draw_treads(canvas, plan, at, i, colour)
    for side in (1.0, -1.0):
        _draw_strip(canvas, plan, along, shift, (side * plan.gauge, side * (plan.gauge + 5.0)), _RAIL)
    for at, i, _ in ends:
        _draw_wheelset_ghost(canvas, plan, at, i)
    for at, i, colour in ends:
        _draw_axle(canvas, plan, at, i, colour)
    if len(scene.bodies) == 3:
        _draw_frame(canvas, plan)


def _draw_ground(canvas: _Canvas, plan: _Plan) -> None:
    scene = plan.scene
    pitch = plan.scale * _SLEEPER_SPACING
    passed = scene.speed * scene.time / GROUND_SLOWDOWN * plan.scale
    half_length, half_width = 1.8 * plan.gauge, 0.2 * pitch
    start = -1.2 * plan.reach - passed % pitch
    at = np.arange(start, 1.2 * plan.reach, pitch)[:, None]
    along = at + np.array([-half_width, half_width, half_width, -half_width])
    ends = np.array([-half_length, -half_length, half_length, half_length])
    for sleeper in plan.track(along, ends):
        canvas.polygon(sleeper, _SLEEPER)
    middle = canvas.pixels(plan.track(np.arange(-1.2 * plan.reach, 1.2 * plan.reach, 12.0), 0.0))
    canvas.segments(middle, _GHOST)


def _draw_strip(
    canvas: _Canvas,
    plan: _Plan,
    along: NDArray[np.float64],
    shift: NDArray[np.float64],
    edges: tuple[float, float],
    colour: Colour,
) -> None:
    there = plan.track(along, shift + edges[0])
    back = plan.track(along[::-1], shift[::-1] + edges[1])
    canvas.polygon(np.concatenate([there, back]), colour)


def _wheel(plan: _Plan, side: float) -> tuple[float, float, float, float]:
    """Return inner edge of flange, outer edge of flange, outer edge of tread, half length."""
    face = plan.gauge - plan.clearance
    width = 2.0 * plan.clearance + 8.0
    return side * (face - 6.0), side * face, side * (face + width), plan.scale * plan.scene.wheel_radius


def _touching(scene: Scene, i: int, side: float) -> bool:
    """Return whether the flange of a wheel has reached the rail."""
    return bool(side * (scene.bodies[i, 0] - scene.rail[i]) >= scene.flange_clearance)


def _rectangle(half_length: float, left: float, right: float) -> list[complex]:
    return [
        complex(-half_length, left),
        complex(half_length, left),
        complex(half_length, right),
        complex(-half_length, right),
    ]


def _body_pose(plan: _Plan, at: float, i: int) -> _Pose:
    y, _, _, psi = plan.scene.bodies[i].tolist()
    return plan.pose(at, y, psi)


def _draw_treads(canvas: _Canvas, plan: _Plan, at: float, i: int, colour: Colour) -> None:
    """Draw the treads, which lie below the rails in the picture so that these stay visible."""
    place = _body_pose(plan, at, i)
    for side in (1.0, -1.0):
        _, face, outer, half = _wheel(plan, side)
        paint = ALARM if _touching(plan.scene, i, side) else colour
        canvas.polygon(place(_rectangle(half, face, outer)), _mix(paint, 0.45), paint, 1.5)


def _draw_axle(canvas: _Canvas, plan: _Plan, at: float, i: int, colour: Colour) -> None:
    place = _body_pose(plan, at, i)
    end = plan.gauge + 1.0 * plan.clearance + 32.0
    canvas.polygon(place(_rectangle(4.0, -end, end)), _mix(colour, 0.8), None)
    for side in (1.0, -1.0):
        inner, face, _, half = _wheel(plan, side)
        paint = ALARM if _touching(plan.scene, i, side) else colour
        canvas.polygon(place(_rectangle(half + 5.0, inner, face)), paint)


def _draw_wheelset_ghost(canvas: _Canvas, plan: _Plan, at: float, i: int) -> None:
    y, _, _, psi = plan.scene.equilibrium[i].tolist()
    place = plan.pose(at, y, psi)
    for side in (1.0, -1.0):
        inner, _, outer, half = _wheel(plan, side)
        canvas.polygon(place(_rectangle(half + 5.0, inner, outer)), None, _GHOST, 1.5)


def _frame_parts(plan: _Plan, grow: float = 0.0) -> list[list[complex]]:
    beam = plan.gauge + plan.clearance + 18.0
    half, thick = plan.base + 24.0 + grow, 7.0 + grow
    return [
        _rectangle(half, beam - thick, beam + thick),
        _rectangle(half, -beam - thick, -beam + thick),
        _rectangle(11.0 + grow, -beam, beam),
    ]


def _draw_frame(canvas: _Canvas, plan: _Plan) -> None:
    y, _, _, psi = plan.scene.equilibrium[2].tolist()
    place = plan.pose(0.0, y, psi)
    for part in _frame_parts(plan):
        canvas.polygon(place(part), None, _GHOST, 1.5)
    place = _body_pose(plan, 0.0, 2)
    for grow, colour in ((1.0, _RAIL), (0.0, NEUTRAL)):
        for part in _frame_parts(plan, grow):
            canvas.polygon(place(part), colour)
    canvas.circle(complex(place([0.0])[0]), 5.0, _WHITE, _RAIL)


def _label_plan(page: _Page, scene: Scene) -> None:
    page.canvas.rectangle(_PLAN, None, _GRID)
    page.text("plan view", complex(_PLAN.left + 8, _PLAN.top + 3), 12, bold=True)
    travel = "travelling to the right \N{RIGHTWARDS ARROW}"
    page.text(travel, complex(_PLAN.right - 8, _PLAN.top + 3), 12, _LABEL, align="right")
    words = f"lateral motion and yaw \N{MULTIPLICATION SIGN} {scene.exaggeration:g}"
    x, y = _PLAN.left + 8, _PLAN.bottom - 18
    x += page.text(words, complex(x, y), 12, _LABEL) + 18
    page.canvas.rectangle(_Box(x, y + 3, 14, 9), _BAND)
    clearance = f"flange clearance {_number(1e3 * scene.flange_clearance)} mm"
    x += page.text(clearance, complex(x + 19, y), 12, _LABEL) + 37
    page.canvas.rectangle(_Box(x, y + 3, 14, 9), None, NEUTRAL)
    page.text("equilibrium", complex(x + 19, y), 12, _LABEL)
    slow = f"ground speed \N{DIVISION SIGN} {GROUND_SLOWDOWN:g}"
    page.text(slow, complex(_PLAN.right - 8, y), 12, _LABEL, align="right")
    if abs(scene.curvature) >= _TANGENT:
        side = 1.0 if scene.curvature > 0.0 else -1.0
        plan = _Plan(scene)
        beside = complex(plan.track(40.0 - plan.reach, side * (plan.gauge + 18.0))).imag
        page.text("outer rail", complex(_PLAN.left + 8, beside - 7), 12, _RAIL, bold=True)


def _draw_banner(page: _Page, reason: str) -> None:
    box = _Box(_PLAN.left, _PLAN.top, _PLAN.width, 28)
    page.canvas.rectangle(box, ALARM)
    at = complex(box.centre.real, box.top + 5)
    page.text(f"DERAILED: {reason}", at, 15, _WHITE, align="centre", bold=True, width=box.width - 20)


# ------------------------------------------------------------------------ front view


class _Front:
    """The leading wheelset on its rails, looking forward: points are left + up * 1j, in page units."""

    def __init__(self, scene: Scene) -> None:
        scale = _FRONT_HALF_GAUGE / scene.half_gauge
        self.scene = scene
        self.gauge = _FRONT_HALF_GAUGE
        self.radius = min(scale * scene.wheel_radius, 70.0)
        self.clearance = scale * scene.exaggeration * scene.flange_clearance
        offset = scale * scene.exaggeration * float(scene.bodies[0, 0] - scene.rail[0])
        self.offset = max(-1.8 * self.clearance, min(1.8 * self.clearance, offset))
        self.roll = _FRONT_CONE * self.offset / self.gauge + self._lift()
        self.tilt = cmath.exp(1j * scene.cant)
        self.origin = _FRONT_VIEW.centre + 44j

    def _lift(self) -> float:
        """Return the drawn roll beyond rolling on the cones: only the roll of a wheel that lifts."""
        roll = float(self.scene.bodies[0, 2] - self.scene.equilibrium[0, 2])
        beyond = math.copysign(max(0.0, abs(roll) - _LIFT_ROLL), roll)
        return max(-0.3, min(0.3, self.scene.exaggeration * beyond))

    def track(self, points: Iterable[complex]) -> list[complex]:
        """Return the page's points of points on the track; rails' tops are at height 0."""
        return [self.origin - (z * self.tilt).real - 1j * (z * self.tilt).imag for z in points]

    def wheelset(self, points: Iterable[complex]) -> list[complex]:
        """Return the page's points of points on the wheelset, whose axle is at height 0."""
        turn = cmath.exp(1j * self.roll)
        lift = self.gauge * abs(self.roll - _FRONT_CONE * self.offset / self.gauge)
        centre = complex(self.offset, self.radius + lift)
        return self.track(z * turn + centre for z in points)

    def tread(self, v: float) -> float:
        """Return the radius of the cone at a distance from the wheelset's middle."""
        return self.radius + _FRONT_CONE * (self.gauge - v)


def _draw_front(canvas: _Canvas, scene: Scene) -> None:
    front = _Front(scene)
    _draw_bed(canvas, front)
    axle = [complex(v, w) for v, w in ((-140, -5), (140, -5), (140, 5), (-140, 5))]
    canvas.polygon(front.wheelset(axle), _mix(LEADING, 0.8))
    for side in (1.0, -1.0):
        _draw_wheel_section(canvas, front, side)


def _draw_bed(canvas: _Canvas, front: _Front) -> None:
    half, top = front.gauge + 60.0, -34.0
    level = front.track([complex(0.0, top - 7.0)])[0]
    if abs(front.scene.cant) > 1e-4:
        canvas.dashes(level - half, level + half, _GHOST)
    sleeper = [
        complex(v, w) for v, w in ((-half, top - 14), (half, top - 14), (half, top), (-half, top))
    ]
    canvas.polygon(front.track(sleeper), _SLEEPER, _GRID)
    for side in (1.0, -1.0):
        gap = front.gauge - front.clearance + side * front.offset
        if gap < front.gauge:
            free = [(gap, -11.0), (front.gauge, -11.0), (front.gauge, 0.0), (gap, 0.0)]
            canvas.polygon(front.track([complex(side * v, w) for v, w in free]), _BAND)
        g, m = front.gauge, front.gauge + 7.0
        profile = [(g, 0), (g, -11), (m - 2.5, -14), (m - 2.5, -29), (m - 12, -34)]
        outline = profile + [(2.0 * m - v, w) for v, w in reversed(profile)]
        canvas.polygon(front.track([complex(side * v, w) for v, w in outline]), _RAIL)


def _draw_wheel_section(canvas: _Canvas, front: _Front, side: float) -> None:
    """Draw a wheel cut along its axle: flange, coned rim and web, above and below the axle."""
    paint = ALARM if _touching(front.scene, 0, side) else LEADING
    face = front.gauge - front.clearance
    outer = front.gauge + front.clearance + 16.0
    flange = front.radius + 12.0
    for way in (-1.0, 1.0):
        rim = [
            (face - 9.0, front.radius - 12.0),
            (face - 9.0, flange - 3.0),
            (face - 6.0, flange),
            (face - 2.0, flange - 1.0),
            (face, front.tread(face)),
            (outer, front.tread(outer)),
            (outer, front.tread(outer) - 10.0),
        ]
        section = front.wheelset([complex(side * v, way * w) for v, w in rim])
        canvas.polygon(section, paint)
        web = [(face + 6.0, 0.0), (face + 14.0, 0.0), (face + 14.0, front.radius - 8.0)]
        web.append((face + 6.0, front.radius - 8.0))
        canvas.polygon(front.wheelset([complex(side * v, way * w) for v, w in web]), _mix(paint, 0.6))
    hub = [(face - 6.0, -11.0), (face + 26.0, -11.0), (face + 26.0, 11.0), (face - 6.0, 11.0)]
    canvas.polygon(front.wheelset([complex(side * v, w) for v, w in hub]), paint)


def _label_front(page: _Page, scene: Scene) -> None:
    page.canvas.rectangle(_FRONT, None, _GRID)
    used = page.text(
        "leading wheelset", complex(_FRONT.left + 8, _FRONT.top + 3), 12, LEADING, bold=True
    )
    at = complex(_FRONT.left + 14 + used, _FRONT.top + 3)
    page.text(
        f"looking forward, lateral \N{MULTIPLICATION SIGN} {scene.exaggeration:g}", at, 12, _LABEL
    )
    names = ("leading", "trailing")
    for i, top in enumerate((_FRONT_VIEW.bottom + 4, _FRONT_VIEW.bottom + 52)):
        _draw_gauge(page, scene, i, top, names[i])


def _draw_gauge(page: _Page, scene: Scene, i: int, top: float, name: str) -> None:
    """Draw the clearance left and right of a wheelset as two bars that meet at the wheelset."""
    delta = scene.flange_clearance
    y = float(scene.bodies[i, 0] - scene.rail[i])
    box = _Box(_FRONT.left + 10, top + 19, _FRONT.width - 20, 12)
    share = min(1.0, max(0.0, 0.5 * (1.0 - y / delta)))
    middle = box.left + share * box.width
    own = LEADING if i == 0 else TRAILING
    colour = ALARM if abs(y) >= delta else own
    page.canvas.rectangle(_Box(box.left, box.top, middle - box.left, box.height), _mix(colour, 0.45))
    page.canvas.rectangle(_Box(middle, box.top, box.right - middle, box.height), _mix(colour, 0.2))
    page.canvas.rectangle(box, None, NEUTRAL)
    page.canvas.rectangle(_Box(middle - 2, box.top - 3, 4, box.height + 6), colour)
    page.text(name, complex(box.centre.real, top + 3), 12, own, align="centre", width=70)
    sides: tuple[tuple[Literal["left", "right"], float, float], ...]
    sides = (("left", delta - y, box.left), ("right", delta + y, box.right))
    for side, free, end in sides:
        words = f"{side} {_number(1e3 * free)} mm" if free > 0.0 else f"{side}: contact"
        paint = own if free > 0.0 else ALARM
        page.text(words, complex(end, top + 2), 13, paint, align=side, bold=True, width=112)


# ----------------------------------------------------------------------- strip chart


class _Axes(NamedTuple):
    """One diagram of the strip chart; values from -limit to limit, time up to ``now``."""

    box: _Box
    limit: float
    now: float
    window: float
    every: float

    def x(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.box.right + (time - self.now) / self.window * self.box.width

    def y(self, value: Any) -> Any:
        return self.box.centre.imag - np.clip(value / self.limit, -1.0, 1.0) * self.box.height / 2.0


def _draw_chart(page: _Page, scene: Scene) -> None:
    history = scene.history
    page.canvas.rectangle(_CHART, None, _GRID)
    page.text(
        "lateral displacement, mm (left +)", complex(_CHART.left + 8, _CHART.top + 3), 12, bold=True
    )
    span = float(history.time[-1] - history.time[0]) if len(history.time) else 0.0
    window, every = next((w for w in _WINDOWS if w[0] >= span - 1e-9), (span, span / 5.0))
    now = float(history.time[-1]) if len(history.time) else scene.time
    left, width = _CHART.left + 40, _CHART.width - 92
    actuated = history.action.shape[1] > 0
    box = _Box(left, _CHART.top + 22, width, 98 if actuated else 168)
    delta = 1e3 * scene.flange_clearance
    largest = max(1.25 * delta, 1e3 * float(np.abs(history.y).max(initial=0.0)))
    limit, step = next((r for r in _RANGES if r[0] >= largest), _RANGES[-1])
    axes = _Axes(box, limit, now, window, every)
    _draw_scales(page, axes, step, bottom=not actuated)
    _draw_clearance(page, axes, delta)
    legend = _CHART.right - 52
    for i, colour in ((1, TRAILING), (0, LEADING)):
        page.canvas.curve(*_trace(axes, history.time, 1e3 * history.y[:, i]), colour)
        words = f"{('leading', 'trailing')[i]} {_number(1e3 * float(scene.bodies[i, 0]))}"
        page.text(words, complex(legend, _CHART.top + 3), 12, colour, align="right", bold=True)
        legend -= 130
    if actuated:
        below = _Box(left, box.bottom + 26, width, _CHART.bottom - 18 - box.bottom - 26)
        _draw_action(page, _Axes(below, 1.0, now, window, every), history)


def _draw_scales(page: _Page, axes: _Axes, step: float, *, bottom: bool) -> None:
    box = axes.box
    for k in range(-int(axes.limit / step), int(axes.limit / step) + 1):
        y = float(axes.y(k * step))
        page.canvas.line(complex(box.left, y), complex(box.right, y), NEUTRAL if k == 0 else _GRID)
        if abs(k * step) < axes.limit or axes.limit == 1.0:
            words = _number(k * step, 0 if step.is_integer() else 1)
            page.text(words, complex(box.left - 6, y - 7), 11, _LABEL, align="right")
    for k in range(int(axes.window / axes.every + 1e-9) + 1):
        x = box.right - k * axes.every / axes.window * box.width
        page.canvas.line(complex(x, box.top), complex(x, box.bottom), _GRID)
        if bottom:
            words = f"\N{MINUS SIGN}{k * axes.every:g} s" if k else "now"
            page.text(words, complex(x, box.bottom + 3), 11, _LABEL, align="centre")


def _draw_clearance(page: _Page, axes: _Axes, delta: float) -> None:
    for side in (1.0, -1.0):
        y = float(axes.y(side * delta))
        page.canvas.dashes(complex(axes.box.left, y), complex(axes.box.right, y), ALARM)
        page.text("flange", complex(axes.box.right + 6, y - 7), 11, ALARM, width=44)


def _draw_action(page: _Page, axes: _Axes, history: History) -> None:
    _draw_scales(page, axes, 1.0, bottom=True)
    box = axes.box
    n = history.action.shape[1]
    x = (
        _CHART.left
        + 8
        + page.text("action", complex(_CHART.left + 8, box.top - 23), 12, bold=True)
        + 12
    )
    for i in range(n):
        colour = _ACTIONS[i % len(_ACTIONS)]
        # Held from one instant to the next.
        time = np.repeat(history.time, 2)[1:]
        value = np.repeat(history.action[:, i], 2)[:-1]
        page.canvas.steps(*_trace(axes, time, value), colour)
        last = _number(float(history.action[-1, i]), 2) if len(history.time) else ""
        words = f"{i + 1}:  {last}" if n > 1 else last
        x += page.text(words, complex(x, box.top - 23), 12, colour, bold=True) + 16


def _trace(
    axes: _Axes, time: NDArray[np.float64], value: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a signal on the page; of a long one the extremes in every column, which scroll along."""
    columns = int(axes.box.width / 2.0)
    if len(time) > 2 * columns:
        column = np.floor(time * (columns / axes.window))
        first = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
        low, high = np.minimum.reduceat(value, first), np.maximum.reduceat(value, first)
        last = np.append(first[1:], len(value)) - 1
        value = np.where(value[last] >= value[first], [low, high], [high, low]).T.ravel()
        time = np.column_stack([time[first], time[last]]).ravel()
    return axes.x(time), np.asarray(axes.y(value))


# -------------------------------------------------------------------------- renderer

_SHOWING: weakref.WeakSet[Renderer] = weakref.WeakSet()
"""Renderers in mode "human": pygame has one window per process, closed by the last of them."""


class Renderer:
    """Draws scenes, into arrays or into a window.

    Parameters
    ----------
    mode : {"human", "rgb_array"}
        Show every frame in a window at the pace of ``fps``, or return it as an array. Arrays need no
        display.
    fps : int
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
    >>> from railenv.envs.observation import CANT_BASE
    from railenv.envs.rendering import History, Renderer, Scene
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

    def __init__(self, mode: Mode, fps: int, size: tuple[int, int] = (960, 600)) -> None:
        if mode not in get_args(Mode):
            raise ParameterError(f"mode is {mode!r}; it must be 'human' or 'rgb_array'")
        try:
            import pygame
            import pygame.font
        except ImportError as error:
            from gymnasium.error import DependencyNotInstalled

            raise DependencyNotInstalled(
                "pygame is not installed; run `pip install railenv[render]`"
            ) from error
        self._pygame = pygame
        self.mode = mode
        self.fps = int(checks.number("fps", fps, low=1.0, unit="1/s"))
        self.size = _checked_size(size)
        self._page: _Page | None = None
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
            self._page = _Page(self.size)
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


def _draw_scene(page: _Page, scene: Scene) -> None:
    page.surface.fill(_WHITE)
    page.layer(_PLAN_VIEW, lambda canvas: _draw_plan(canvas, scene))
    page.layer(_FRONT_VIEW, lambda canvas: _draw_front(canvas, scene))
    _draw_header(page, scene)
    _label_plan(page, scene)
    _label_front(page, scene)
    _draw_chart(page, scene)
    if scene.derailed is not None:
        _draw_banner(page, scene.derailed)
