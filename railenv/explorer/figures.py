"""The figures of the page: made once, then updated with results through their data sources."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from bokeh.core.properties import value as constant
from bokeh.models import (
    ColumnDataSource,
    CustomJS,
    FixedTicker,
    HoverTool,
    LabelSet,
    Legend,
    Range1d,
    Slider,
    Span,
    Toggle,
)
from bokeh.plotting import figure
from numpy.typing import NDArray

from design.stability import outlines
from design.stability.mode_geometry import geometry_of
from design.stability.mode_views import magnification
from design.style import NEUTRAL, SERIES, STABLE, UNSTABLE
from railenv import Model as VehicleModel
from railenv.explorer.computations import (
    AMPLITUDE,
    ContactCurves,
    Diagram,
    Motion,
    Present,
    Stability,
)
from railenv.explorer.steps import DIAGRAM_OFFSETS
from railenv.explorer.style import FONT

Array = NDArray[np.float64]

INK, EDGE, GRID = "#333333", "#5c666b", "#e3e6e8"
LEADING, TRAILING = SERIES[0], SERIES[1]

FRAMES = 250
"""Number of pictures of a motion."""

PHASES = 40
"""Number of pictures of a period of a mode."""

_LARGEST_OFFSET, _LARGEST_ANGLE, _LARGEST_END = 0.28, 0.22, 0.5  # m, rad, m, as modes are drawn
_ROUND = (1.0, 2.0, 5.0)
_DECADES = 7.0  # of a spectral density, below its peak
_NAN = math.nan


def plot(title: str, x: str, y: str, *, height: int = 300, **more: Any) -> Any:
    """Return an empty figure in the package's style."""
    f = figure(
        title=title,
        x_axis_label=x,
        y_axis_label=y,
        height=height,
        min_width=240,
        sizing_mode="stretch_width",
        tools="pan,wheel_zoom,box_zoom,reset,save",
        active_drag=None,
        active_scroll=None,
        output_backend="canvas",
        **more,
    )
    f.toolbar.autohide = True
    f.toolbar.logo = None
    f.outline_line_color = None
    f.background_fill_color = f.border_fill_color = "#ffffff"
    f.title.text_font = FONT
    f.title.text_font_size = "13px"
    f.title.text_color = INK
    for axis in f.axis:
        axis.axis_label_text_font = axis.major_label_text_font = FONT
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size = "12px"
        axis.major_label_text_font_size = "11px"
        axis.axis_label_text_color = axis.major_label_text_color = EDGE
        axis.axis_line_color = axis.major_tick_line_color = EDGE
        axis.minor_tick_line_color = None
    f.grid.grid_line_color = GRID
    return f


def legend(f: Any, entries: Mapping[str, Any], columns: int = 3) -> Legend:
    """Put a legend beside a figure, so that it hides nothing."""
    items = [
        (name, glyphs if isinstance(glyphs, list) else [glyphs]) for name, glyphs in entries.items()
    ]
    made = Legend(
        items=items,
        orientation="horizontal",
        border_line_color=None,
        label_text_font=FONT,
        label_text_font_size="11px",
        label_text_color=EDGE,
        padding=2,
        margin=4,
        spacing=12,
        glyph_width=18,
        glyph_height=14,
        background_fill_alpha=0.0,
        ncols=columns,
        location="center",
    )
    f.add_layout(made, "below")
    return made


def source(*names: str) -> ColumnDataSource:
    """Return a data source with some empty columns."""
    return ColumnDataSource({name: [] for name in names})


def upright(f: Any, **line: Any) -> Span:
    """Add a vertical line."""
    span = Span(location=0.0, dimension="height", **line)
    f.add_layout(span)
    return span


# ----------------------------------------------------------------------- eigenvalues


class LocusFigure:
    """Eigenvalues over speed in the upper half plane."""

    def __init__(self) -> None:
        f = plot(
            "Eigenvalues",
            "real part (1/s)",
            "imaginary part (rad/s)",
            height=430,
            x_range=Range1d(-1, 1),
            y_range=Range1d(0, 1),
        )
        self.figure = f
        upright(f, line_color=INK, line_width=1)
        self.others = source("xs", "ys")
        self.unstable = source("xs", "ys", "width")
        self.least = source("x", "y", "speed")
        self.ticks = source("x", "y", "text")
        self.now = source("x", "y", "frequency", "damping")
        self.worst = source("x", "y", "color", "frequency", "damping")
        self.critical = source("x", "y", "color")
        others = f.multi_line("xs", "ys", source=self.others, color=NEUTRAL, line_width=1.3)
        least = f.line("x", "y", source=self.least, color=STABLE, line_width=3)
        red = f.multi_line("xs", "ys", source=self.unstable, color=UNSTABLE, line_width="width")
        f.scatter("x", "y", source=self.ticks, color=INK, size=4)
        f.add_layout(
            LabelSet(
                x="x",
                y="y",
                text="text",
                source=self.ticks,
                x_offset=7,
                y_offset=-5,
                text_font=constant(FONT),
                text_font_size="10px",
                text_color=EDGE,
            )
        )
        now = f.scatter(
            "x", "y", source=self.now, marker="diamond", size=9, fill_color="#ffffff", line_color=INK
        )
        worst = f.scatter(
            "x",
            "y",
            source=self.worst,
            marker="diamond",
            size=16,
            fill_color="color",
            line_color="#ffffff",
            line_width=1.5,
        )
        critical = f.scatter(
            "x",
            "y",
            source=self.critical,
            size=12,
            fill_color="#ffffff",
            line_color="color",
            line_width=2.5,
        )
        told = [("frequency", "@frequency{0.000} Hz"), ("damping ratio", "@damping{+0.0000}")]
        f.add_tools(HoverTool(renderers=[now, worst], tooltips=told))
        f.add_tools(HoverTool(renderers=[least], tooltips=[("speed", "@speed{0.0} m/s")]))
        legend(
            f,
            {
                "least damped mode": least,
                "other modes": others,
                "unstable": red,
                "now": [now, worst],
                "stability lost": critical,
            },
        )

    def show(self, found: Stability) -> None:
        """Draw the locus with its critical point."""
        locus = found.locus
        k = locus.least_damped
        columns = [c for c in range(locus.loci.shape[1]) if c != k]
        self.others.data = {
            "xs": [locus.loci[:, c].real for c in columns],
            "ys": [locus.loci[:, c].imag for c in columns],
        }
        marked = locus.loci[:, k]
        self.least.data = {"x": marked.real, "y": marked.imag, "speed": locus.values}
        growing = [c for c in range(locus.loci.shape[1]) if (locus.growth[:, c] > 0.0).any()]
        masks = [np.where(locus.growth[:, c] > 0.0, 1.0, _NAN) for c in growing]
        self.unstable.data = {
            "xs": [locus.loci[:, c].real * m for c, m in zip(growing, masks, strict=True)],
            "ys": [locus.loci[:, c].imag * m for c, m in zip(growing, masks, strict=True)],
            "width": [3.0 if c == k else 1.3 for c in growing],
        }
        self.ticks.data = _round_speeds(locus.values, marked)
        critical = found.critical.eigenvalue
        at = [] if critical is None else [critical]
        self.critical.data = {
            "x": [v.real for v in at],
            "y": [v.imag for v in at],
            "color": [UNSTABLE for _ in at],
        }
        across, up = locus.window
        self.figure.x_range.update(start=across[0], end=across[1])
        self.figure.y_range.update(start=up[0], end=up[1])
        self.figure.title.text = f"Eigenvalues, {locus.values[0]:g} to {locus.values[-1]:.4g} m/s"

    def show_present(self, now: Present) -> None:
        """Mark the eigenvalues at the present speed."""
        values = now.modes.eigenvalues
        k = now.modes.least_damped
        upper = [v for i, v in enumerate(values) if v.imag >= 0.0 and i != k]
        self.now.data = _marked(upper)
        worst = complex(values[k].real, abs(values[k].imag))
        color = UNSTABLE if worst.real > 0.0 else STABLE
        self.worst.data = {**_marked([worst]), "color": [color]}

    def clear(self) -> None:
        """Show nothing."""
        for s in (self.others, self.unstable, self.least, self.ticks, self.critical):
            _empty(s)
        self.clear_present()

    def clear_present(self) -> None:
        """Mark no present speed."""
        _empty(self.now)
        _empty(self.worst)


def _marked(values: Sequence[complex]) -> dict[str, Any]:
    return {
        "x": [v.real for v in values],
        "y": [v.imag for v in values],
        "frequency": [abs(v.imag) / (2.0 * math.pi) for v in values],
        "damping": [-v.real / max(abs(v), 1e-300) for v in values],
    }


def _round_speeds(speeds: Array, marked: NDArray[np.complex128]) -> dict[str, Any]:
    """Return some round speeds with their places on the locus, without overlaps."""
    from matplotlib.ticker import MaxNLocator

    ticks = np.asarray(
        MaxNLocator(nbins=8, steps=[1, 2, 2.5, 5, 10]).tick_values(speeds[0], speeds[-1])
    )
    span = max(float(np.ptp(marked.real)), float(np.ptp(marked.imag)), 1e-300)
    x: list[float] = []
    y: list[float] = []
    text: list[str] = []
    for value in ticks[(ticks >= speeds[0]) & (ticks <= speeds[-1])]:
        at = [float(np.interp(value, speeds, part)) for part in (marked.real, marked.imag)]
        near = x and math.hypot(at[0] - x[-1], at[1] - y[-1]) < 0.05 * span
        if not near:
            x.append(at[0])
            y.append(at[1])
            text.append(f"{value:g} m/s" if not text else f"{value:g}")
    return {"x": x, "y": y, "text": text}


class DampingFigures:
    """Damping ratio and frequency over speed."""

    def __init__(self) -> None:
        self.upper = plot("Damping and frequency", "speed (m/s)", "damping ratio (%)", height=220)
        self.lower = plot("", "speed (m/s)", "frequency (Hz)", height=210, x_range=self.upper.x_range)
        self.upper.xaxis.axis_label = None
        self.upper.y_range.only_visible = False
        self.upper.add_layout(Span(location=0.0, dimension="width", line_color=INK, line_width=1))
        self.lower.y_range.start = 0.0
        now = {"line_color": INK, "line_width": 1.2, "line_dash": "dotted", "visible": False}
        self.now = [upright(f, **now) for f in (self.upper, self.lower)]
        lost = {"line_color": UNSTABLE, "line_width": 1.2, "line_dash": "dashed", "visible": False}
        self.lost = [upright(f, **lost) for f in (self.upper, self.lower)]
        self.others = [source("xs", "ys") for _ in range(2)]
        self.least = [source("x", "y", "unstable") for _ in range(2)]
        self.marks = [source("x", "y", "color") for _ in range(2)]
        for f, others, least, marks in zip(
            (self.upper, self.lower), self.others, self.least, self.marks, strict=True
        ):
            f.multi_line("xs", "ys", source=others, color=NEUTRAL, line_width=1.3)
            line = f.line("x", "y", source=least, color=STABLE, line_width=3)
            f.line("x", "unstable", source=least, color=UNSTABLE, line_width=3)
            f.scatter(
                "x",
                "y",
                source=marks,
                marker="diamond",
                size=14,
                fill_color="color",
                line_color="#ffffff",
                line_width=1.5,
            )
            unit = "@y{+0.00} %" if f is self.upper else "@y{0.000} Hz"
            f.add_tools(HoverTool(renderers=[line], tooltips=[("speed", "@x{0.0} m/s"), ("", unit)]))

    @property
    def figures(self) -> tuple[Any, Any]:
        """Both figures, the upper one first."""
        return self.upper, self.lower

    def show(self, found: Stability) -> None:
        """Draw the slower modes and the critical speed."""
        locus = found.locus
        k = locus.least_damped
        unstable = np.where(locus.growth[:, k] > 0.0, 1.0, _NAN)
        for data, others, least in zip(
            (100.0 * locus.damping, locus.frequency), self.others, self.least, strict=True
        ):
            shown = {
                c: np.where(locus.eigenvalues[:, c].imag > 0.0, data[:, c], _NAN)
                for c in locus.beside_least_damped
            }
            others.data = {"xs": [locus.values for _ in shown], "ys": list(shown.values())}
            own = data[:, k]
            least.data = {"x": locus.values, "y": own, "unstable": own * unstable}
        speed = found.critical.speed
        for span in self.lost:
            span.update(location=speed or 0.0, visible=speed is not None)

    def show_present(self, now: Present) -> None:
        """Mark the least damped mode at the present speed."""
        self.show_speed(now.speed)
        color = UNSTABLE if now.shape.damping < 0.0 else STABLE
        for marks, value in zip(
            self.marks, (100.0 * now.shape.damping, now.shape.frequency), strict=True
        ):
            marks.data = {"x": [now.speed], "y": [value], "color": [color]}

    def show_speed(self, speed: float) -> None:
        """Draw the present speed as a line."""
        for span in self.now:
            span.update(location=speed, visible=True)

    def clear(self) -> None:
        """Show nothing."""
        for s in (*self.others, *self.least):
            _empty(s)
        for span in self.lost:
            span.visible = False
        self.clear_present()

    def clear_present(self) -> None:
        """Mark no mode."""
        for s in self.marks:
            _empty(s)


# ---------------------------------------------------------------------------- motion


class HistoryFigures:
    """Lateral displacement of the first and the last wheelset over time, and its spectrum."""

    def __init__(self) -> None:
        self.history = plot("Time history", "time (s)", "lateral displacement (mm)", height=290)
        self.spectrum = plot(
            "Spectrum",
            "frequency (Hz)",
            "power spectral density (mm²/Hz)",
            height=290,
            y_axis_type="log",
        )
        self.spectrum.yaxis.formatter.min_exponent = 0
        self.lines = {"leading": source("x", "y"), "trailing": source("x", "y")}
        drawn = {
            f"{name} wheelset": self.history.line("x", "y", source=s, color=color, line_width=1.6)
            for (name, s), color in zip(self.lines.items(), (LEADING, TRAILING), strict=True)
        }
        dashed: Any = {"dimension": "width", "line_color": NEUTRAL, "line_dash": "dashed"}
        self.flanges = [Span(location=0.0, visible=False, line_width=1.3, **dashed) for _ in range(2)]
        for span in self.flanges:
            self.history.add_layout(span)
        self.cursor = upright(self.history, line_color=INK, line_width=1, line_dash="dotted")
        drawn["flange clearance"] = self.history.line(
            [_NAN], [_NAN], color=NEUTRAL, line_dash="dashed", line_width=1.3
        )
        legend(self.history, drawn)
        self.density = source("x", "y")
        line = self.spectrum.line("x", "y", source=self.density, color=LEADING, line_width=1.4)
        self.main = upright(
            self.spectrum, line_color=UNSTABLE, line_width=1, line_dash="dashed", visible=False
        )
        self.spectrum.add_tools(
            HoverTool(renderers=[line], tooltips=[("", "@x{0.00} Hz"), ("", "@y mm²/Hz")])
        )
        self.spectrum.x_range = Range1d(0.0, 10.0)
        self.spectrum.y_range = Range1d(1e-6, 1.0)

    def show(self, moved: Motion) -> None:
        """Draw the motion."""
        time = np.asarray(moved.response.time)
        ends = {"leading": moved.wheelsets[0], "trailing": moved.wheelsets[-1]}
        for name, s in self.lines.items():
            if name == "trailing" and len(moved.wheelsets) < 2:
                _empty(s)
            else:
                s.data = {"x": time, "y": 1e3 * moved[ends[name]]}
        for span, side in zip(self.flanges, (1.0, -1.0), strict=True):
            clear = moved.clearance
            span.update(location=side * 1e3 * (clear or 0.0), visible=clear is not None)
        self.history.title.text = (
            f"Time history: amplitude {1e3 * moved.amplitude:.3g} mm in the last second"
        )
        found = moved.spectrum
        self.main.visible = found is not None
        if found is None:
            _empty(self.density)
            return
        density = 1e6 * found.density[1:]
        self.density.data = {"x": found.frequency[1:], "y": density}
        peak = max(float(density.max()), 1e-30)
        self.main.location = found.main_frequency
        self.spectrum.x_range.update(start=0.0, end=max(10.0 * found.main_frequency, 1.0))
        self.spectrum.y_range.update(start=peak * 10.0**-_DECADES, end=5.0 * peak)
        self.spectrum.title.text = (
            f"Spectrum: main frequency {found.main_frequency:.2f} Hz, rms {1e3 * found.rms:.2g} mm"
        )

    def clear(self) -> None:
        """Show nothing."""
        for s in (*self.lines.values(), self.density):
            _empty(s)
        for span in (*self.flanges, self.main):
            span.visible = False
        self.history.title.text, self.spectrum.title.text = "Time history", "Spectrum"


_DRAWN: Mapping[str, dict[str, Any]] = {
    "body": {"color": INK, "line_width": 1.5, "line_dash": "dashed"},
    "frame": {"color": INK, "line_width": 2.5},
    "axle": {"color": STABLE, "line_width": 2.5},
    "wheels": {"color": STABLE, "line_width": 7},
}
"""Line styles of each kind, as in the pictures of modes."""

_MOVE = """
const k = Math.min(picture.value, frames.data.time.length - 1)
for (const [name, drawn] of Object.entries(sources)) {
  const x = frames.data[name + "_x"], y = frames.data[name + "_y"]
  const n = x.length / frames.data.time.length
  const part = (all) => Array.prototype.slice.call(all, k * n, (k + 1) * n)
  drawn.data = {x: part(x), y: part(y)}
}
cursor.location = frames.data.time[k]
"""
"""Show a picture of the motion; this runs in the browser, without a round trip to the server."""

_PLAY = """
clearInterval(picture.timer)
if (play.active) {
  picture.timer = setInterval(() => {
    picture.value = picture.value >= picture.end ? 0 : picture.value + 1
  }, %d)
}
play.label = play.active ? "Pause" : "Play"
"""
"""Show picture after picture."""

PICTURE_TIME = 50
"""Time between two pictures, ms."""


class VehicleFigures:
    """The vehicle from above and from behind, as it moves."""

    def __init__(self, cursor: Span) -> None:
        self.plan = plot("Plan view", "along the track (m)", "across (m)", height=260)
        self.front = plot("From behind", "across (m)", "above the axles (m)", height=260)
        for f in (self.plan, self.front):
            f.grid.visible = False
            f.x_range, f.y_range = Range1d(-2, 2), Range1d(-1, 1)
        self.front.xaxis.ticker = FixedTicker(ticks=[-1, 0, 1])
        self.cursor = cursor
        self.rails = {view: source("xs", "ys", "width") for view in ("plan", "front")}
        self.frames = ColumnDataSource({"time": [0.0]})
        self.sources: dict[str, ColumnDataSource] = {}
        # the browser does not report its own moves to the server
        cursor.syncable = False
        for view, f in (("plan", self.plan), ("front", self.front)):
            f.multi_line("xs", "ys", source=self.rails[view], color=NEUTRAL, line_width="width")
            for kind, style in _DRAWN.items():
                s = ColumnDataSource({"x": [], "y": []}, syncable=False)
                self.sources[f"{view}_{kind}"] = s
                f.line("x", "y", source=s, **style)
        self.frames.data = {"time": np.zeros(1), **self._nothing()}
        self.picture = Slider(
            start=0,
            end=1,
            step=1,
            value=0,
            title="",
            show_value=False,
            bar_color=STABLE,
            syncable=False,
        )
        self.picture.update(sizing_mode="stretch_width", min_width=120, margin=(8, 14))
        self.play = Toggle(label="Pause", active=True, width=80, margin=(4, 6))
        moved: dict[str, Any] = {"frames": self.frames, "sources": self.sources, "cursor": cursor}
        move = CustomJS(args={**moved, "picture": self.picture}, code=_MOVE)
        self.picture.js_on_change("value", move)
        self.frames.js_on_change("data", move)
        play = CustomJS(args={"picture": self.picture, "play": self.play}, code=_PLAY % PICTURE_TIME)
        self.play.js_on_change("active", play)
        self.begin = (move, play)

    def show_motion(self, model: VehicleModel, moved: Motion) -> None:
        """Take over a motion in time."""
        time = np.asarray(moved.response.time)
        chosen = np.unique(np.linspace(0, len(time) - 1, min(FRAMES, len(time))).astype(int))
        geometry = geometry_of(model)
        names = (
            [n for b in geometry.bodies for n in (b.y, b.z, b.phi, b.theta, b.psi) if n]
            if geometry
            else []
        )
        moves = {n: moved[n][chosen] for n in names}
        for (
            name
        ) in names:  # the springs' deflection under load is already in pictures of bodies at rest
            if name.startswith(("z_", "theta_")):
                moves[name] = moves[name] - moved[name][0]
        factor = enlargement(geometry, moves)
        self._take(model, {n: factor * v for n, v in moves.items()}, time[chosen])
        self.plan.title.text = f"Plan view: displacements × {factor:g}"
        self.front.title.text = f"From behind: × {factor:g}"

    def show_mode(self, model: VehicleModel, now: Present) -> None:
        """Take over a period of the least damped mode."""
        phase = np.linspace(0.0, 2.0 * math.pi, PHASES, endpoint=False)
        shape = now.shape
        factor = magnification(shape) if shape.geometry else 1.0
        moves = {
            n: factor * (d * np.exp(1j * phase)).real
            for n, d in zip(shape.names, shape.displacements, strict=True)
        }
        self._take(model, moves, np.zeros(PHASES))
        self.plan.title.text = f"Plan view: {shape.name}, {shape.frequency:.2f} Hz"
        self.front.title.text = "From behind"

    def _take(self, model: VehicleModel, moves: Mapping[str, Array], time: Array) -> None:
        geometry = geometry_of(model)
        data: dict[str, Any] = {"time": time, **self._nothing(len(time))}
        if geometry is not None:
            for view in ("plan", "front"):
                by_kind: dict[str, list[Any]] = {kind: [] for kind in _DRAWN}
                for line in outlines.lines(geometry, view, moves):
                    if line.kind in by_kind:
                        points = np.broadcast_to(line.points, (len(time), line.points.shape[-1]))
                        gap = np.full((len(time), 1), complex(_NAN, _NAN))
                        by_kind[line.kind] += [points, gap]
                for kind, parts in by_kind.items():
                    if parts:
                        joined = np.concatenate(parts, axis=1)
                        data[f"{view}_{kind}_x"] = joined.real.astype(np.float32)
                        data[f"{view}_{kind}_y"] = joined.imag.astype(np.float32)
            self._show_rails(geometry)
        self.frames.data = data
        self.picture.end = max(len(time) - 1, 1)

    def _nothing(self, count: int = 1) -> dict[str, Any]:
        return {f"{name}_{c}": np.full((count, 1), _NAN) for name in self.sources for c in "xy"}

    def _show_rails(self, geometry: Any) -> None:
        """Draw the track, and set the limits."""
        a, radius = geometry.half_gauge, geometry.wheel_radius
        start, end = outlines.along(geometry)
        self.rails["plan"].data = {
            "xs": [[start, end]] * 3,
            "ys": [[-a, -a], [a, a], [0.0, 0.0]],
            "width": [4.0, 4.0, 0.8],
        }
        side = a + (0.9 if geometry.others else 0.62)
        self.plan.x_range.update(start=start, end=end)
        self.plan.y_range.update(start=-side, end=side)
        top = outlines.top(geometry)
        self.rails["front"].data = {
            "xs": [[-a - 0.08, -a + 0.08], [a - 0.08, a + 0.08], [0.0, 0.0]],
            "ys": [[-radius, -radius], [-radius, -radius], [-radius, top]],
            "width": [7.0, 7.0, 0.8],
        }
        reach = outlines.SIDE * a + 1.0
        self.front.x_range.update(start=-reach, end=reach)
        self.front.y_range.update(start=-radius - 0.2, end=top + 0.4)


def enlargement(geometry: Any, moves: Mapping[str, Array]) -> float:
    """Return a round factor that enlarges a motion to the size of the pictures of modes."""
    if geometry is None:
        return 1.0

    def size(name: str | None) -> float:
        return 0.0 if name is None else float(np.abs(moves[name]).max())

    shares = [1e-4]
    for body in geometry.bodies:
        shares += [max(size(body.y), size(body.z)) / _LARGEST_OFFSET]
        shares += [max(size(n) for n in (body.phi, body.theta, body.psi)) / _LARGEST_ANGLE]
    for body in geometry.others:
        for shift, turn in ((body.y, body.psi), (body.z, body.theta)):
            shares.append((size(shift) + body.half_length * size(turn)) / _LARGEST_END)
    most = 1.0 / max(shares)
    decade = 10.0 ** math.floor(math.log10(most)) if most > 0.0 else 1.0
    return max([1.0, *(r * decade for r in _ROUND if r * decade <= most * (1.0 + 1e-9))])


# --------------------------------------------------------------------------- contact


class ContactFigures:
    """Profiles with the places that touch, radius difference, contact angles, equivalent conicity."""

    def __init__(self) -> None:
        self.profiles = plot(
            "Places that touch",
            "distance from the track's centre (mm)",
            "height (mm)",
            height=260,
            match_aspect=True,
        )
        self.difference = plot(
            "Rolling-radius difference", "shift to the left (mm)", "left less right (mm)", height=260
        )
        self.angles = plot(
            "Contact angle", "shift to the left (mm)", "against the axle (degrees)", height=260
        )
        self.conicity = plot("Equivalent conicity", "amplitude (mm)", "conicity (1)", height=260)
        self.conicity.y_range.start = 0.0
        self.conicity.x_range = Range1d(0.0, 8.0)
        self.wheel, self.rail = source("x", "y"), source("x", "y")
        self.touching = source("xs", "ys", "width")
        rail = self.profiles.line("x", "y", source=self.rail, color=EDGE, line_width=1.8)
        wheel = self.profiles.line("x", "y", source=self.wheel, color=STABLE, line_width=1.8)
        touching = self.profiles.multi_line(
            "xs", "ys", source=self.touching, color=UNSTABLE, line_width="width"
        )
        legend(self.profiles, {"wheel, lifted": wheel, "rail": rail, "contacts": touching})
        self.curves = source("shift", "difference", "left", "right")
        self.difference.line("shift", "difference", source=self.curves, color=STABLE, line_width=2)
        left = self.angles.line("shift", "left", source=self.curves, color=STABLE, line_width=2)
        right = self.angles.line("shift", "right", source=self.curves, color=NEUTRAL, line_width=2)
        legend(self.angles, {"left wheel": left, "right wheel": right})
        self.amplitudes = source("amplitude", "conicity", "harmonic")
        self.bound = source("x", "y")
        harmonic = self.conicity.line(
            "amplitude",
            "harmonic",
            source=self.amplitudes,
            color=UNSTABLE,
            line_width=1.4,
            line_dash="dashed",
        )
        en = self.conicity.line(
            "amplitude", "conicity", source=self.amplitudes, color=STABLE, line_width=2
        )
        at = self.conicity.scatter("x", "y", source=self.bound, size=8, color=STABLE)
        legend(self.conicity, {"EN 15302": [en, at], "harmonic": harmonic})

    @property
    def figures(self) -> tuple[Any, ...]:
        """All figures."""
        return self.profiles, self.difference, self.angles, self.conicity

    def show(self, found: ContactCurves) -> None:
        """Draw the contact."""
        shown = found.picture
        self.profiles.visible = shown is not None
        if shown is not None:
            self.rail.data = dict(zip("xy", 1e3 * shown.rail, strict=True))
            self.wheel.data = dict(zip("xy", 1e3 * shown.wheel, strict=True))
            across, up = 1e3 * shown.contacts
            count = across.shape[1]
            self.touching.data = {
                "xs": list(across.T),
                "ys": list(up.T),
                "width": [2.4 if k == count // 2 else 0.8 for k in range(count)],
            }
        self.curves.data = {
            "shift": 1e3 * found.shift,
            "difference": 1e3 * found.radius_difference,
            "left": np.degrees(found.angles[0]),
            "right": np.degrees(found.angles[1]),
        }
        self.amplitudes.data = {
            "amplitude": 1e3 * found.amplitude,
            "conicity": found.conicity,
            "harmonic": found.harmonic,
        }
        self.bound.data = {"x": [1e3 * AMPLITUDE], "y": [found.at_bound]}
        self.conicity.title.text = f"Equivalent conicity: {found.at_bound:.3f} at 3 mm"
        self.conicity.y_range.end = 1.15 * float(max(found.conicity.max(), found.harmonic.max()))


# ---------------------------------------------------------------------- bifurcation


class DiagramFigure:
    """Amplitude of limit cycles over speed."""

    def __init__(self) -> None:
        f = plot(
            "Bifurcation diagram", "speed (m/s)", "amplitude of the leading wheelset (mm)", height=380
        )
        self.figure = f
        f.visible = False  # until there is something
        f.y_range.start = 0.0
        self.stable, self.unstable = source("x", "y"), source("x", "y")
        self.steady, self.lost = source("x", "y"), source("x", "y")
        self.hopf, self.folds = source("x", "y"), source("x", "y")
        self.simulated = [source("x", "y") for _ in DIAGRAM_OFFSETS]
        stable = [
            f.line("x", "y", source=s, color=STABLE, line_width=2.4) for s in (self.stable, self.steady)
        ]
        unstable = [
            f.line("x", "y", source=s, color=UNSTABLE, line_width=2.0, line_dash="dashed")
            for s in (self.unstable, self.lost)
        ]
        white: Any = {"fill_color": "#ffffff", "line_color": INK, "line_width": 1.8}
        hopf = f.scatter("x", "y", source=self.hopf, marker="star", size=14, color=INK)
        fold = f.scatter("x", "y", source=self.folds, size=10, **white)
        colors = (SERIES[0], SERIES[1], SERIES[3])
        drawn = {
            f"simulated, from {1e3 * offset:g} mm": f.scatter(
                "x", "y", source=s, size=8, color=c, alpha=0.8
            )
            for offset, s, c in zip(DIAGRAM_OFFSETS, self.simulated, colors, strict=True)
        }
        self.now = upright(f, line_color=INK, line_width=1.2, line_dash="dotted", visible=False)
        self.clearance = Span(
            location=0.0, dimension="width", line_color=NEUTRAL, line_dash="dashed", visible=False
        )
        f.add_layout(self.clearance)
        self.legend = legend(
            f, {"stable": stable, "unstable": unstable, "Hopf point": hopf, "fold": fold, **drawn}
        )

    def show(self, found: Diagram) -> None:
        """Draw the present part of the diagram."""
        self.clear()
        self.figure.visible = True
        for item in self.legend.items:
            item.visible = item.label.value.startswith("simulated") == bool(found.simulated)
        if found.branch is not None:
            self._show_branch(found)
        for k, s in enumerate(self.simulated):
            parts = found.simulated
            y = [1e3 * float(p.amplitude[k, 0]) for p in parts]
            s.data = {
                "x": [float(p.speed[0]) for p, v in zip(parts, y, strict=True) if math.isfinite(v)],
                "y": [v for v in y if math.isfinite(v)],
            }

    def _show_branch(self, found: Diagram) -> None:
        branch = found.branch
        assert branch is not None
        model = branch.setting.model
        guided = model.guided
        name = max(guided, key=lambda w: w.x).y if guided else model.state_names[0]
        value, amplitude, stable = branch.value, 1e3 * branch.amplitude[name], branch.stable
        hopf = branch.hopf.speed if branch.hopf is not None else None
        if hopf is not None:
            value = np.concatenate([[hopf], value])
            amplitude = np.concatenate([[0.0], amplitude])
            stable = np.concatenate([stable[:1], stable])
            low, high = float(value.min()), float(value.max())
            low -= 0.1 * max(high - low, 1.0)
            self.steady.data = {"x": [low, hopf], "y": [0.0, 0.0]}
            self.lost.data = {"x": [hopf, max(high, 1.03 * hopf)], "y": [0.0, 0.0]}
            self.hopf.data = {"x": [hopf], "y": [0.0]}
        self.stable.data, self.unstable.data = _by_stability(value, amplitude, stable)
        folds = branch.folds
        k = model.state_names.index(name)
        self.folds.data = {
            "x": [fold.value for fold in folds],
            "y": [1e3 * float(fold.cycle.amplitudes[k]) for fold in folds],
        }
        clear = model.flange_clearance
        self.clearance.update(location=1e3 * (clear or 0.0), visible=clear is not None)

    def show_speed(self, speed: float) -> None:
        """Draw the present speed as a line."""
        self.now.update(location=speed, visible=True)

    def clear(self) -> None:
        """Show nothing."""
        for s in (self.stable, self.unstable, self.steady, self.lost, self.hopf, self.folds):
            _empty(s)
        for s in self.simulated:
            _empty(s)
        self.clearance.visible = False


def _by_stability(
    x: Array, y: Array, stable: NDArray[np.bool_]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the stable and the unstable stretches of a branch, with gaps between."""
    from design.cycles.cycle_plots import stability_runs

    found: dict[bool, tuple[list[float], list[float]]] = {True: ([], []), False: ([], [])}
    for part, is_stable in stability_runs(stable):
        found[is_stable][0].extend([*x[part].tolist(), _NAN])
        found[is_stable][1].extend([*y[part].tolist(), _NAN])
    return tuple({"x": found[k][0], "y": found[k][1]} for k in (True, False))  # type: ignore[return-value]


def _empty(s: ColumnDataSource) -> None:
    s.data = {name: [] for name in s.data}
