"""How a pair of profiles is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

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
_FURTHEST = 0.010  # m; shifts that are drawn, at most
_BEYOND = 0.001  # m; how far beyond the flange's contact they go
_CONTACTS = 0.0005  # m between two shifts whose contacts are joined by lines
_SHALLOW = 0.022  # m below the top of the rail that are drawn
_GAP = 0.006  # m by which the wheel is lifted in the picture
_AMPLITUDES = (0.0005, 0.008)  # m
_BOUND = 0.003  # m; the amplitude that standards name


def plot_pair(pair: ProfilePair) -> Figure:
    """Draw profiles with contacts, rolling-radius difference, contact angles and conicity."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    low, high = pair.reach
    furthest = min(-low, high, _FURTHEST, pair.flange_clearance + _BEYOND)
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
    wheel, rail, offset = pair.surfaces
    at = pair.tape_place
    start = pair.place(0.0, absolute=True)
    count = int(furthest / _CONTACTS)
    eta = _CONTACTS * np.arange(-count, count + 1)
    on_rail = pair.place(eta, absolute=True)
    on_wheel = on_rail - eta
    rail_z = rail(np.clip(on_rail - at - offset, rail.y[0], rail.y[-1])).z
    wheel_z = wheel(np.clip(on_wheel - at, wheel.y[0], wheel.y[-1])).z
    top = float(rail(np.array([start - at - offset])).z[0])
    lifted = wheel(np.array([start - at])).z[0] - _GAP
    yr = np.linspace(rail.y[0], rail.y[-1], 2000)
    zr = rail(yr).z - top
    seen = zr > -_SHALLOW
    ax.plot(1e3 * (yr + offset + at)[seen], 1e3 * zr[seen], color=_RAIL, label="rail")
    yw = np.linspace(wheel.y[0], wheel.y[-1], 2000)
    ax.plot(1e3 * (yw + at), 1e3 * (wheel(yw).z - lifted), color=_WHEEL, label="wheel, lifted")
    ends = np.stack([on_wheel, on_rail]), np.stack([wheel_z - lifted, rail_z - top])
    ax.plot(1e3 * ends[0], 1e3 * ends[1], color=_CONTACT, lw=0.6)
    middle = [count, count]
    ax.plot(
        1e3 * ends[0][[0, 1], middle],
        1e3 * ends[1][[0, 1], middle],
        color=_CONTACT,
        lw=1.6,
        label="contacts",
    )
    ax.set_aspect("equal", adjustable="box")
    ax.set_title(f"places that touch, every {1e3 * _CONTACTS:g} mm of shift")
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
