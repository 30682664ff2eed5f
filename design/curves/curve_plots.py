"""Drawings of curves of bifurcations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from design.cycles.labels import PARAMETER_LABELS
from design.style import NEUTRAL, SERIES, STABLE, UNSTABLE, axes_or_new, drawn_on, style

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.curves.curve import BifurcationCurve

_COLOURS = {
    "Hopf": UNSTABLE,
    "fold of equilibria": NEUTRAL,
    "fold of cycles": STABLE,
    "period doubling": SERIES[1],
    "torus": SERIES[2],
    "symmetry breaking": SERIES[3],
}
_MARKERS = {
    "Bautin": "o",
    "Hopf-Hopf": "D",
    "fold-Hopf": "^",
    "Bogdanov-Takens": "X",
    "cusp": "P",
    "fold-flip": "v",
    "fold-torus": "s",
    "flip-torus": "<",
    "double torus": ">",
    "1:1 resonance": "1",
    "1:2 resonance": "2",
    "1:3 resonance": "3",
    "1:4 resonance": "4",
}
_OTHER = "*"


def plot_curve(curve: BifurcationCurve, ax: Axes | None = None) -> control.ControlPlot:
    """Draw a curve in the plane of its parameters; dashed where the motion that leaves is unstable."""
    with style():
        ax = axes_or_new(ax, (6.8, 4.6))
        x, y = (curve.value[name] for name in curve.parameters)
        colour = _COLOURS[curve.kind]
        gentle = _gentle(curve)
        for on, line, label in (
            (gentle, "-", curve.kind),
            (~gentle, "--", f"{curve.kind}, subcritical"),
        ):
            if on.any():
                ax.plot(*_where(x, y, on), line, color=colour, label=label)
        for kind in dict.fromkeys(s.kind for s in curve.special):
            at = np.array([s.values for s in curve.special if s.kind == kind])
            marker = _MARKERS.get(kind, _OTHER)
            edge = colour if marker.isdigit() else "white"
            ax.plot(*at.T, marker, color=colour, ms=7, mec=edge, label=kind, zorder=3)
        first, second = curve.parameters
        ax.set_xlabel(PARAMETER_LABELS.get(first, first.replace("_", " ")))
        ax.set_ylabel(PARAMETER_LABELS.get(second, second.replace("_", " ")))
        ax.set_title(f"{curve.model_name}: bifurcations over two parameters")
        handles, labels = ax.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))  # several curves of a kind share their label
        ax.legend(list(once.values()), list(once), loc="best")
        return drawn_on(ax)


def _gentle(curve: BifurcationCurve) -> np.ndarray:
    """Return where the curve is drawn solid: everywhere but at subcritical Hopf points and flips."""
    sign = {"Hopf": -1.0, "period doubling": 1.0, "symmetry breaking": 1.0}.get(curve.kind)
    if sign is None:
        return np.ones(len(curve), dtype=bool)
    return ~(sign * curve.coefficient < 0.0)


def _where(x: np.ndarray, y: np.ndarray, on: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the pieces of a line that begin or end at chosen points; NaN between them."""
    shown = on | np.append(on[1:], False)  # up to the first point of the next piece
    return np.where(shown, x, np.nan), np.where(shown, y, np.nan)
