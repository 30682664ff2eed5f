"""Drawings of stability maps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, TwoSlopeNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullLocator
from numpy.typing import NDArray

from design.style import NEUTRAL, RADIUS_TICKS, axes_or_new, curve_title, drawn_on, style

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.studies.stability_map import Axis, StabilityMap

Array = NDArray[np.float64]

_TANGENT_GAP = 1.6  # factor of the place of tangent track beyond the last radius on a logarithmic axis
_GEOMETRIC = 1e-6  # relative scatter of the ratios of geometrically spaced values
_OUTLIERS = 2.0  # percentile at either end beyond which colours do not change
_SMALLEST_SIDE = 0.05  # of the colours' range: width of the side of zero that hardly occurs
_FEW = 0.08  # of the cells: kinds of loss with fewer get no contours

_HATCHES = {"fold": "///", "end": "xxx", "divergence": "..."}
_LOSSES = {
    "fold": "tread equilibrium ends in a fold",
    "end": "equilibrium ends, a wheel lifts",
    "divergence": "divergence",
}
_CATEGORIES = {
    "none": ("#cfe3e9", "stable over the whole range"),
    "unstable at start": ("#efb9ae", "unstable already at the lowest speed"),
    "": (NEUTRAL, "no running equilibrium"),
}
_LABELS = {
    "critical_speed": "critical speed (m/s)",
    "damping": "least damping ratio of a mode (1)",
    "growth": "largest growth rate of a mode (1/s)",
}


@dataclass(frozen=True)
class _Coordinate:
    """Places of an axis's values in a picture."""

    positions: Array
    edges: Array
    label: str
    log: bool
    tangent: float | None

    @classmethod
    def of(cls, axis: Axis) -> _Coordinate:
        values = axis.values
        label = f"{axis.meaning} ({axis.unit})" if axis.unit else axis.meaning.replace("_", " ")
        if axis.name == "radius" and (values < 0).any():  # through tangent track to the other hand
            return cls._made(1e3 / values, "curvature of the track (1/km)", False, None)
        finite = values[np.isfinite(values)]
        if finite.size < 2:  # two radii, one of them tangent track
            return cls._made(1e3 / values, "curvature of the track (1/km)", False, None)
        log = axis.name == "radius" or _geometric(finite)
        if finite.size == values.size:
            return cls._made(values, label, log, None)
        tangent = float(finite.max()) * _TANGENT_GAP
        return cls._made(np.where(np.isinf(values), tangent, values), label, log, tangent)

    @classmethod
    def _made(cls, positions: Array, label: str, log: bool, tangent: float | None) -> _Coordinate:
        measure = np.log(positions) if log else positions
        middle = 0.5 * (measure[1:] + measure[:-1])
        ends = 1.5 * measure[[0, -1]] - 0.5 * measure[[1, -2]]
        edges = np.concatenate([ends[:1], middle, ends[1:]])
        return cls(positions, np.exp(edges) if log else edges, label, log, tangent)

    def apply(self, ax: Axes, which: str) -> None:
        """Set scale, limits, ticks and label of an axis of the picture."""
        axis = ax.xaxis if which == "x" else ax.yaxis
        getattr(ax, f"set_{which}label")(self.label)
        if self.log:
            getattr(ax, f"set_{which}scale")("log")
        getattr(ax, f"set_{which}lim")(sorted((self.edges[0], self.edges[-1])))
        if not self.log:
            return
        if self.label.startswith("curve radius"):
            last = np.inf if self.tangent is None else self.tangent / 1.3
            low = min(self.edges[0], self.edges[-1])
            ticks = [r for r in RADIUS_TICKS if low <= r < last]
            shown = [*ticks, self.tangent] if self.tangent else ticks
            axis.set_major_locator(FixedLocator(shown))
            axis.set_minor_locator(NullLocator())
        else:
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(self._text))

    def _text(self, value: float, _: int | None = None) -> str:
        if self.tangent is not None and math.isclose(value, self.tangent):
            return "tangent"
        return f"{value:g}"


def _geometric(values: Array) -> bool:
    """Return whether values are spaced geometrically, not arithmetically."""
    if values.size < 3 or values.min() <= 0.0:
        return False
    ratios = values[1:] / values[:-1]
    return bool(np.ptp(ratios) < _GEOMETRIC * ratios.mean() and abs(ratios.mean() - 1.0) > 1e-3)


def plot_stability_map(chart: StabilityMap, ax: Axes | None = None) -> control.ControlPlot:
    """Draw a stability map: the first axis across, the second up."""
    with style():
        ax = axes_or_new(ax, (7.0, 5.4))
        x, y = (_Coordinate.of(axis) for axis in chart.axes)
        ax.grid(False)
        x.apply(ax, "x")
        y.apply(ax, "y")
        draw = _critical_speeds if chart.quantity == "critical_speed" else _dampings
        handles = draw(chart, ax, x, y)
        if x.tangent is not None:  # the gap before tangent track
            ax.axvline(x.edges[-2] if x.positions[-1] == x.tangent else x.edges[1], color="white", lw=3)
        if y.tangent is not None:
            ax.axhline(y.edges[-2] if y.positions[-1] == y.tangent else y.edges[1], color="white", lw=3)
        ax.set_title(_title(chart))
        if handles:
            ax.legend(
                handles=handles,
                loc="upper center",
                bbox_to_anchor=(0.5, -0.14),
                ncols=2,
                fontsize=8,
                handlelength=2.2,
            )
        return drawn_on(ax)


def _title(chart: StabilityMap) -> str:
    held = []
    if "radius" in chart.held:
        held.append(curve_title(chart.held["radius"], chart.held.get("cant", math.nan)))
    elif "cant" in chart.held:
        held.append(f"cant {chart.held['cant']:g} rad")
    if "radius" in chart.held and "cant" not in chart.held:
        held[0] = (
            "tangent track" if math.isinf(chart.held["radius"]) else f"R = {chart.held['radius']:g} m"
        )
    if "speed" in chart.held:
        held.append(f"{chart.held['speed']:g} m/s")
    loop = "" if chart.period is None else " with its controller"
    text = f"{chart.model_name.replace('_', ' ')}{loop}: {', '.join(held)}"
    return f"{text} ({chart.ended})" if chart.ended else text


def _critical_speeds(chart: StabilityMap, ax: Axes, x: _Coordinate, y: _Coordinate) -> list[Any]:
    assert chart.critical_speed is not None
    assert chart.loss is not None
    speed, loss = chart.critical_speed.T, chart.loss.T
    handles: list[Any] = []
    if np.isfinite(speed).any():
        mesh = ax.pcolormesh(
            x.edges, y.edges, np.ma.masked_invalid(speed), cmap="viridis", rasterized=True
        )
        ax.figure.colorbar(mesh, ax=ax, label=_LABELS["critical_speed"])
        for kind in np.unique(loss[np.isfinite(speed)]):  # no contour from one kind to another
            if (loss == kind).mean() > _FEW:
                _contours(ax, x, y, np.where(loss == kind, speed, np.nan))
    done = chart.notes.T != "not computed"
    for kind, (colour, text) in _CATEGORIES.items():
        chosen = (loss == kind) & done
        if chosen.any():
            _flat(ax, x, y, chosen, colour)
            handles.append(Patch(facecolor=colour, label=text))
    for kind, hatch in _HATCHES.items():
        if (loss == kind).any():
            _hatched(ax, x, y, loss == kind, hatch)
            handles.append(
                Patch(facecolor=_viridis(), edgecolor="white", lw=0, hatch=hatch, label=_LOSSES[kind])
            )
    if handles and (loss == "hunting").any():
        handles.insert(0, Patch(facecolor=_viridis(), label="hunting"))
    return handles


def _dampings(chart: StabilityMap, ax: Axes, x: _Coordinate, y: _Coordinate) -> list[Any]:
    value = chart.value.T
    handles: list[Any] = []
    # stable is blue: positive damping, negative growth
    colours = "RdBu" if chart.quantity == "damping" else "RdBu_r"
    found = np.isfinite(value)
    if found.any():
        low, high = np.percentile(value[found], [_OUTLIERS, 100.0 - _OUTLIERS])
        largest = max(abs(low), abs(high)) or 1.0
        low, high = min(low, -_SMALLEST_SIDE * largest), max(high, _SMALLEST_SIDE * largest)
        mesh = ax.pcolormesh(
            x.edges,
            y.edges,
            np.ma.masked_invalid(value),
            cmap=colours,
            norm=TwoSlopeNorm(0.0, low, high),
            rasterized=True,
        )
        beyond = value[found].min() < low, value[found].max() > high
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(
            beyond, "neither"
        )
        sides = (
            MaxNLocator(nbins=3).tick_values(low, 0.0),
            MaxNLocator(nbins=4).tick_values(0.0, high),
        )
        ticks = [v for side in sides for v in side if low <= v <= high]
        bar = ax.figure.colorbar(mesh, ax=ax, label=_LABELS[chart.quantity], extend=extend)
        bar.set_ticks(ticks, labels=[f"{v:g}" for v in ticks])
        if (value[found] > 0).any() and (value[found] < 0).any():
            ax.contour(x.positions, y.positions, value, levels=[0.0], colors="black", linewidths=2.2)
            handles.append(Line2D([], [], color="black", lw=2.2, label="boundary of stability"))
    missing = ~found & (chart.notes.T != "not computed")
    if missing.any():
        colour, text = _CATEGORIES[""]
        _flat(ax, x, y, missing, colour)
        handles.append(Patch(facecolor=colour, label=text))
    return handles


def _viridis() -> Any:
    return mpl.colormaps["viridis"](0.4)


def _contours(ax: Axes, x: _Coordinate, y: _Coordinate, value: Array) -> None:
    """Draw thin labelled contours at round values."""
    low, high = np.nanmin(value), np.nanmax(value)
    inside = [v for v in MaxNLocator(nbins=7).tick_values(low, high) if low < v < high]
    if not inside:
        return
    lines = ax.contour(
        x.positions,
        y.positions,
        np.ma.masked_invalid(value),
        inside,
        colors="white",
        linewidths=0.8,
        linestyles="solid",
    )
    ax.clabel(lines, fontsize=7.5, fmt="%g")


def _flat(ax: Axes, x: _Coordinate, y: _Coordinate, chosen: Any, colour: str) -> None:
    """Fill some cells with one colour."""
    cells = np.ma.masked_where(~chosen, np.ones(chosen.shape))
    ax.pcolormesh(x.edges, y.edges, cells, cmap=ListedColormap([colour]), rasterized=True)


def _hatched(ax: Axes, x: _Coordinate, y: _Coordinate, chosen: Any, hatch: str) -> None:
    """Hatch some cells."""
    corners = []
    for row, column in np.argwhere(chosen):
        left, right = x.edges[column : column + 2]
        low, high = y.edges[row : row + 2]
        corners.append([(left, low), (right, low), (right, high), (left, high)])
    cells = PolyCollection(corners, facecolors="none", edgecolors="white", linewidths=0.0, hatch=hatch)
    ax.add_collection(cells, autolim=False)
