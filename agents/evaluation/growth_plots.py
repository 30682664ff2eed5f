"""Drawings of the growth rates of several controllers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import control
import matplotlib.pyplot as plt
import numpy as np

from agents.evaluation.colors import INK, colors
from design.style import drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray


def plot_growth(
    rates: Mapping[str, NDArray[np.float64]],
    speeds: Sequence[float],
    ax: Axes | None = None,
    palette: Mapping[str, str] | None = None,
) -> control.ControlPlot:
    """Draw the growth rate of the least stable mode over speed, with each controller.

    Parameters
    ----------
    rates : mapping of str to ndarray
        From :func:`agents.evaluation.growth.linear_growth_rates`, by the controllers' names.
    speeds : sequence of float
        m/s.
    ax : Axes, optional
    palette : mapping of str to str, optional
        Colours of the controllers, the same for several figures.
    """
    chosen = palette or colors(rates)
    with style():
        if ax is None:
            ax = plt.subplots(figsize=(6.8, 4.2))[1]
        for name, rate in rates.items():
            ax.plot(speeds, rate, color=chosen[name], label=name)
        ax.axhline(0.0, color=INK, lw=1.0)
        ax.set_xlabel("speed (m/s)")
        ax.set_ylabel("growth rate of the least stable mode (1/s)")
        ax.legend(loc="best")
        return drawn_on(ax)
