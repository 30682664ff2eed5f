"""Common parts of drawings of limit cycles and of simulated motions: units, labels, a line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from design.style import NEUTRAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes


INK = "#333333"

PARAMETER_LABELS = {"speed": "speed (m/s)", "curvature": "curvature (1/m)", "cant": "cant (rad)"}


def unit_of(state: str) -> tuple[float, str]:
    """Return the factor and the unit in which a state is drawn."""
    kind = state.split("_", maxsplit=1)[0]
    units = {"y": "mm", "z": "mm", "phi": "mrad", "psi": "mrad"}
    units |= {f"d{name}": f"{unit}/s" for name, unit in units.items()}
    return (1e3, units[kind]) if "_" in state and kind in units else (1.0, "")


def axis_label(state: str, what: str = "") -> str:
    """Return the label of an axis for a state, or for ``what`` of it."""
    unit = unit_of(state)[1]
    text = f"{what} of {state}" if what else state
    return f"{text} ({unit})" if unit else text


def clearance_line(ax: Axes, clearance: float | None, factor: float) -> None:
    """Draw the flange clearance as a line, if there is one."""
    if clearance is not None:
        label = f"flange clearance {factor * clearance:.3g} mm"
        ax.axhline(factor * clearance, color=NEUTRAL, lw=1.2, ls=":", label=label)
