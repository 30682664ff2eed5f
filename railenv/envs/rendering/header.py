"""The read-outs at the top."""

from __future__ import annotations

from functools import partial

from railenv.envs.observation import CANT_BASE
from railenv.envs.rendering.colours import ALARM, INK, LABEL, SAFE, Colour
from railenv.envs.rendering.layout import HEADER
from railenv.envs.rendering.page import Page
from railenv.envs.rendering.scene import TANGENT, Scene
from railenv.envs.rendering.text import number

_Cell = tuple[float, str, str, str, Colour]
"""Width, caption, value, note and colour."""


def draw_header(page: Page, scene: Scene) -> None:
    """Write speed, critical speed, curve, cant and time."""
    cells: list[_Cell] = []
    cells.append(
        (192, "speed", f"{number(scene.speed)} m/s", f"{number(3.6 * scene.speed, 0)} km/h", INK)
    )
    if scene.critical_speed is not None:
        share = scene.speed / scene.critical_speed
        side, colour = ("above", ALARM) if share > 1.0 else ("below", SAFE)
        off = f"{number(100.0 * abs(share - 1.0), 0)} % {side}"
        cells.append((226, "critical speed", f"{number(scene.critical_speed)} m/s", off, colour))
    cells.append((236, "curve", *_curve_words(scene.curvature), INK))
    high = "" if round(1e3 * CANT_BASE * scene.cant) == 0 else f"{_hand(scene.cant)} rail high"
    cant = f"{number(1e3 * CANT_BASE * abs(scene.cant), 0)} mm"
    cells.append((184, f"cant over {CANT_BASE:g} m", cant, high, INK))
    page.kept(HEADER, tuple(cells), partial(_draw_cells, page, cells))
    clock = f"{number(scene.time, 2)} s"
    page.text(clock, complex(HEADER.right, HEADER.top + 16), 19, align="right", bold=True, width=104)


def _draw_cells(page: Page, cells: list[_Cell]) -> None:
    """Write all cells except the time, which differs in each frame."""
    x = HEADER.left
    for width, caption, value, note, colour in cells:
        page.text(caption, complex(x, HEADER.top), 11, LABEL, width=width - 12)
        used = page.text(value, complex(x, HEADER.top + 16), 19, colour, bold=True, width=width - 12)
        left = width - 12 - used - 8
        page.text(note, complex(x + used + 8, HEADER.top + 23), 12, colour, width=left)
        x += width
    page.text("time", complex(HEADER.right, HEADER.top), 11, LABEL, align="right")


def _hand(value: float) -> str:
    """Return the side of a signed quantity."""
    return "left" if value > 0.0 else "right"


def _curve_words(curvature: float) -> tuple[str, str]:
    if abs(curvature) < TANGENT:
        return "tangent", ""
    return f"R = {number(1.0 / abs(curvature), 0)} m", f"{_hand(curvature)} is outer"
