"""Drawings of simulated bifurcation diagrams of closed loops."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import control
import matplotlib.pyplot as plt
import numpy as np

from agents.evaluation.colors import INK
from design.style import drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from agents.evaluation.diagram import ClosedLoopDiagram


def plot_diagram(diagram: ClosedLoopDiagram, ax: Axes | None = None) -> control.ControlPlot:
    """Draw final amplitudes after disturbances over speed: a simulated bifurcation diagram."""
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(6.8, 4.2))[1]
        for offset, left, marker in zip(diagram.offset, 1e3 * diagram.amplitude, "o^sDv", strict=False):
            plain: dict[str, Any] = {"ls": "", "marker": marker, "ms": 4.0, "mfc": "white"}
            known = np.isfinite(left)
            label = f"from {1e3 * offset:g} mm off"
            ax.plot(diagram.speed[known], left[known], color=INK, label=label, **plain)
        ax.set_ylim(-0.5, max(2.0, ax.get_ylim()[1]))
        ax.set_xlabel("speed (m/s)")
        ax.set_ylabel(f"amplitude of y_w1 after {diagram.duration:g} s (mm)")
        ax.set_title(diagram.controller)
        ax.legend(loc="upper left")
        return drawn_on(ax)
