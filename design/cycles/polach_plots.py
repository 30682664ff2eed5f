"""Drawings of speed ramps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from design.cycles.labels import INK, axis_label, unit_of
from design.style import STABLE, axes_or_new, drawn_on, style

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.cycles.polach import SpeedRamp


def plot_ramp(ramp: SpeedRamp, ax: Axes | None = None) -> control.ControlPlot:
    """Draw amplitude over speed along a ramp."""
    factor, _ = unit_of(ramp.state)
    with style():
        ax = axes_or_new(ax, (6.8, 4.4))
        ax.plot(ramp.speed, factor * ramp.amplitude, color=STABLE, lw=1.4, label=str(ramp))
        if ramp.critical_speed is not None:
            ax.axvline(ramp.critical_speed, color=INK, lw=1.0, ls=":")
        ax.set_xlabel("speed (m/s)")
        ax.set_ylabel(axis_label(ramp.state, "amplitude"))
        ax.set_title(f"{ramp.model_name}: slow change of speed")
        ax.legend(loc="upper left")
        return drawn_on(ax)
