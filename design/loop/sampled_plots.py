"""Drawings of a sampled closed loop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import control
import numpy as np

from design.style import STABLE, UNSTABLE, axes_or_new, curve_title, drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.loop.sampled import ClosedLoop


def plot_multipliers(loop: ClosedLoop, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the multipliers of a closed loop in the unit circle."""
    with style():
        ax = axes_or_new(ax, (5.0, 5.0))
        angle = np.linspace(0.0, 2.0 * math.pi, 361)
        ax.plot(np.cos(angle), np.sin(angle), color="#333333", lw=1.0)
        values = loop.multipliers
        for chosen, color, label in (
            (np.abs(values) < 1.0, STABLE, "stable"),
            (np.abs(values) >= 1.0, UNSTABLE, "unstable"),
        ):
            if chosen.any():
                ax.plot(
                    values[chosen].real, values[chosen].imag, "x", color=color, mew=1.6, label=label
                )
        ax.set_aspect("equal")
        ax.set_xlabel("real part (1)")
        ax.set_ylabel("imaginary part (1)")
        ax.set_title(f"{loop.model_name}, {loop.speed:g} m/s, {curve_title(loop.radius, loop.cant)}")
        ax.legend(loc="upper right")
        return drawn_on(ax)
