"""Drawings of creep laws."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from railenv.contact.creep_comparison import CreepComparison, Direction

_LINES: dict[str, dict[str, Any]] = {
    "kalker": {"color": "#9aa5ab", "lw": 1.2, "ls": "--"},
    "heuristic": {"color": "#c8432b", "lw": 1.6, "ls": "-"},
    "polach": {"color": "#d98b1f", "lw": 1.6, "ls": "-"},
    "fastsim": {"color": "#1f6f8b", "lw": 3.2, "ls": "-", "alpha": 0.55},
}
_NAMES = {
    "fastsim": "FASTSIM",
    "heuristic": "heuristic",
    "polach": "Polach",
    "kalker": "Kalker, linear",
}
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
    "legend.fontsize": 9,
    "legend.frameon": False,
}
_COLUMNS = 2
_HIGHEST = 1.15  # of the adhesion limit: where the linear theory is cut off


def plot_comparison(comparison: CreepComparison) -> Figure:
    """Draw a panel of longitudinal forces without spin, and one of lateral forces for each spin."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    first = int(np.argmin(np.abs(comparison.spin)))
    panels: list[tuple[Direction, int]] = [("longitudinal", first)]
    panels += [("lateral", i) for i in range(len(comparison.spin))]
    rows = -(-len(panels) // _COLUMNS)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(7.6, 0.5 + 2.7 * rows))
        figure.set_layout_engine("constrained", h_pad=0.08, w_pad=0.08)
        axes = figure.subplots(rows, _COLUMNS, squeeze=False, sharex=True, sharey=True).ravel()
        for ax, (direction, i) in zip(axes, panels, strict=False):
            plot_forces(comparison, direction, i, ax)
            ax.tick_params(labelbottom=True)
            if ax not in axes[::_COLUMNS]:
                ax.set_ylabel("")
        for ax in axes[len(panels) :]:
            ax.set_visible(False)
        figure.legend(handles=axes[0].get_lines(), loc="outside lower center", ncols=len(_NAMES))
    return figure


def plot_forces(comparison: CreepComparison, direction: Direction, i: int, ax: Axes) -> None:
    """Draw the forces of all laws in one direction at the spin of number ``i``."""
    forces = comparison.longitudinal if direction == "longitudinal" else comparison.lateral
    for law, name in _NAMES.items():
        force = -forces[law][i] / comparison.patch.adhesion
        ax.plot(1e3 * comparison.creepage, force, label=name, **_LINES[law])
    ax.set_xlim(1e3 * comparison.creepage[0], 1e3 * comparison.creepage[-1])
    ax.set_ylim(-_HIGHEST, _HIGHEST)
    ax.set_xlabel(f"{direction} creepage (‰)")
    ax.set_ylabel("creep force −F / μN")
    ax.set_title(f"{direction}, {_spin(comparison.spin[i])}")


def _spin(value: float) -> str:
    return f"spin {value:.3g} 1/m" if value else "no spin"
