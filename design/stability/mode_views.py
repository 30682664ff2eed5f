"""Views of a vehicle moving in a mode: from above, from the side, and from behind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from design.stability import outlines
from design.style import NEUTRAL, STABLE, UNSTABLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.stability.mode_shape import ModeShape

_DARK = "#333333"
_LARGEST_OFFSET = 0.28  # m, to which displacements are magnified
_LARGEST_ANGLE = 0.22  # rad, likewise
_LARGEST_END = 0.5  # m, likewise at the ends of a vehicle's body

_STYLES: dict[outlines.Kind, dict[str, Any]] = {
    "body": {"color": _DARK, "lw": 1.2, "ls": "--", "zorder": 2},
    "frame": {"color": _DARK, "lw": 2.0, "zorder": 2},
    "axle": {"color": STABLE, "lw": 2.2, "zorder": 3},
    "wheels": {"color": STABLE, "lw": 5.0, "zorder": 4, "solid_capstyle": "butt"},
    "wheel": {"color": STABLE, "lw": 2.2, "zorder": 4},
    "centre": {"color": UNSTABLE, "marker": "o", "ms": 4, "ls": "", "zorder": 5},
}


def magnification(shape: ModeShape) -> float:
    """Return the factor by which all displacements are magnified."""
    assert shape.geometry is not None
    sizes = [1e-6]
    for body in shape.geometry.bodies:
        across, up = (_size(shape, name) for name in (body.y, body.z))
        angle = max(_size(shape, name) for name in (body.phi, body.theta, body.psi))
        sizes += [max(across, up) / _LARGEST_OFFSET, angle / _LARGEST_ANGLE]
    for body in shape.geometry.others:
        for shift, turn in ((body.y, body.psi), (body.z, body.theta)):
            end = _size(shape, shift) + body.half_length * _size(shape, turn)
            sizes.append(end / _LARGEST_END)
    return 1.0 / max(sizes)


def _size(shape: ModeShape, name: str | None) -> float:
    return 0.0 if name is None else abs(shape[name])


class View:
    """A picture of a vehicle in some axes: lines that are moved from phase to phase."""

    view: outlines.View

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        assert shape.geometry is not None
        self.shape, self.geometry = shape, shape.geometry
        self.a = self.geometry.half_gauge
        self.ax = ax
        self.factor = magnification(shape)
        self._lines: dict[str, Any] = {}
        ax.set_aspect("equal")
        ax.grid(visible=False)

    def draw(self, phase: float) -> list[Any]:
        """Place the bodies at a phase (rad)."""
        moved = dict(zip(self.shape.names, self.factor * self.shape.at(phase), strict=True))
        for line in outlines.lines(self.geometry, self.view, moved):
            if line.name not in self._lines:
                self._lines[line.name] = self.ax.plot([], [], **_STYLES[line.kind])[0]
            self._lines[line.name].set_data(line.points.real, line.points.imag)
        return list(self._lines.values())


class PlanView(View):
    """A vehicle seen from above; it runs to the right, left is up."""

    view = "plan"

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        super().__init__(shape, ax)
        start, end = outlines.along(self.geometry)
        for rail in (-self.a, self.a):
            ax.plot([start, end], [rail, rail], color=NEUTRAL, lw=2.5, zorder=1)
        ax.plot([start, end], [0.0, 0.0], color=NEUTRAL, lw=0.8, ls=":", zorder=1)
        ax.set_xlim(start, end)
        side = 0.9 if self.geometry.others else 0.62
        ax.set_ylim(-self.a - side, self.a + side)
        ax.set_xlabel("along the track (m)")
        ax.set_ylabel("across (m)")


class SideView(View):
    """A vehicle seen from its right; it runs to the right."""

    view = "side"

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        super().__init__(shape, ax)
        start, end = outlines.along(self.geometry)
        radius = self.geometry.wheel_radius
        ax.plot([start, end], [-radius, -radius], color=NEUTRAL, lw=2.5, zorder=1)
        ax.set_xlim(start, end)
        ax.set_ylim(-radius - 0.3, outlines.top(self.geometry) + 0.6)
        ax.set_xlabel("along the track (m)")
        ax.set_ylabel("above the axles (m)")


class FrontView(View):
    """The leading end of a vehicle, seen from behind: left is left."""

    view = "front"

    def __init__(self, shape: ModeShape, ax: Axes) -> None:
        super().__init__(shape, ax)
        radius, top = self.geometry.wheel_radius, outlines.top(self.geometry)
        for rail in (-self.a, self.a):
            ax.plot([rail - 0.08, rail + 0.08], [-radius, -radius], color=NEUTRAL, lw=4.0, zorder=1)
        ax.plot([0.0, 0.0], [-radius, top], color=NEUTRAL, lw=0.8, ls=":", zorder=1)
        reach = outlines.SIDE * self.a + 1.0
        ax.set_xlim(-reach, reach)
        ax.set_ylim(-radius - 0.2, top + 0.4)
        ax.set_xticks([-1, 0, 1])
        ax.set_xlabel("from behind (m)")
