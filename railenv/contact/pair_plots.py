"""Drawings of a pair of profiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from railenv.contact.pair_picture import CONTACTS, furthest_shift, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from railenv.contact.pair import ProfilePair

_WHEEL, _RAIL, _CONTACT, _FAINT = "#1f6f8b", "#5c666b", "#c8432b", "#9aa5ab"
_STYLE: Any = {
    "axes.grid": True,
    "grid.color": "#e3e6e8",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#5c666b",
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "savefig.dpi": 150,
}
_AMPLITUDES = (0.0005, 0.008)  # m
_BOUND = 0.003  # m; the amplitude that standards name


def plot_pair(pair: ProfilePair) -> Figure:
    """Draw profiles with contacts, rolling-radius difference, contact angles and conicity."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    low, high = pair.reach
    furthest = furthest_shift(pair)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.6, 6.2), layout="constrained")
        figure.suptitle(str(pair), fontsize=11, x=0.01, ha="left")
        grid = figure.add_gridspec(2, 3, height_ratios=[1.05, 1.0])
        _profiles(figure.add_subplot(grid[0, :]), pair, furthest)
        _difference(figure.add_subplot(grid[1, 0]), pair, furthest)
        _angles(figure.add_subplot(grid[1, 1]), pair, furthest)
        _conicity(figure.add_subplot(grid[1, 2]), pair, min(-low, high))
        return figure


def _profiles(ax: Axes, pair: ProfilePair, furthest: float) -> None:
    """Both profiles, the wheel lifted off, with a line between the places that touch at each shift."""
    shown = picture(pair, furthest)
    ax.plot(*(1e3 * shown.rail), color=_RAIL, label="rail")
    ax.plot(*(1e3 * shown.wheel), color=_WHEEL, label="wheel, lifted")
    across, up = 1e3 * shown.contacts
    ax.plot(across, up, color=_CONTACT, lw=0.6)
    middle = across.shape[1] // 2
    ax.plot(across[:, middle], up[:, middle], color=_CONTACT, lw=1.6, label="contacts")
    ax.set_aspect("equal", adjustable="box")
    ax.set_title(f"places that touch, every {1e3 * CONTACTS:g} mm of shift")
    ax.set_xlabel("distance from the track's centre (mm)")
    ax.set_ylabel("height (mm)")
    ax.legend(loc="lower right")


def _difference(ax: Axes, pair: ProfilePair, furthest: float) -> None:
    y = np.linspace(-furthest, furthest, 1201)
    ax.plot(1e3 * y, 1e3 * pair.rolling_radius_difference(y), color=_WHEEL)
    ax.set_title("rolling-radius difference")
    ax.set_xlabel("shift to the left (mm)")
    ax.set_ylabel("left less right (mm)")


def _angles(ax: Axes, pair: ProfilePair, furthest: float) -> None:
    y = np.linspace(-furthest, furthest, 1201)
    for way, name, color in ((1.0, "left", _WHEEL), (-1.0, "right", _FAINT)):
        ax.plot(1e3 * y, np.degrees(pair.angle(way * y)), color=color, label=f"{name} wheel")
    # treads have some degrees, flanges seventy; this scale is smooth and shows both
    ax.set_yscale("asinh", linear_width=3.0)
    ticks = [-5, -2, 0, 2, 5, 10, 20, 40, 70]
    low, high = ax.get_ylim()
    ax.set_yticks(ticks, [str(t) for t in ticks])
    ax.set_yticks([], minor=True)
    ax.set_ylim(low, high)
    ax.set_title("contact angle")
    ax.set_xlabel("shift to the left (mm)")
    ax.set_ylabel("against the axle (degrees)")
    ax.legend(loc="upper center")


def _conicity(ax: Axes, pair: ProfilePair, widest: float) -> None:
    amplitude = np.linspace(_AMPLITUDES[0], min(_AMPLITUDES[1], widest), 76)
    en = pair.equivalent_conicity(amplitude)
    ax.plot(1e3 * amplitude, en, color=_WHEEL, label="EN 15302")
    ax.plot(
        1e3 * amplitude,
        pair.equivalent_conicity(amplitude, "harmonic"),
        color=_CONTACT,
        ls="--",
        lw=1.2,
        label="harmonic",
    )
    if amplitude[0] <= _BOUND <= amplitude[-1]:
        at = pair.equivalent_conicity(_BOUND)
        ax.plot([1e3 * _BOUND], [at], "o", color=_WHEEL, ms=5)
        ax.annotate(
            f"{at:.3f} at 3 mm", (1e3 * _BOUND, at), (4, -14), textcoords="offset points", fontsize=8
        )
    ax.set_ylim(0.0, None, auto=True)
    ax.set_title("equivalent conicity")
    ax.set_xlabel("amplitude (mm)")
    ax.legend(loc="upper left")
