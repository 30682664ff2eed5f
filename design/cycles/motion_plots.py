"""Drawings of simulated motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import control
import numpy as np

from design.cycles.labels import INK, axis_label, unit_of
from design.style import STABLE, axes_or_new, drawn_on, style
from railenv import checks

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_response(
    response: control.TimeResponseData, names: list[str], ax: Axes | None = None, **line: Any
) -> control.ControlPlot:
    """Draw some displacements of a simulation over time, in mm and mrad."""
    with style():
        ax = axes_or_new(ax)
        for name in names:
            row = response.output_labels.index(name)
            ax.plot(response.time, 1e3 * response.outputs[row], label=name, **line)
        ax.set_xlabel("time (s)")
        if len(names) == 1:
            ax.set_ylabel(f"{names[0]} ({'mm' if names[0][0] in 'yz' else 'mrad'})")
        else:
            ax.set_ylabel("displacement (mm, mrad)")
            ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        return drawn_on(ax)


def phase_portrait(
    response: control.TimeResponseData,
    states: tuple[str, str] | None = None,
    *,
    skip: float = 0.0,
    ax: Axes | None = None,
    color: str = STABLE,
) -> control.ControlPlot:
    """Draw a simulated motion in the plane of two states, as in the paper's Figs 6 to 9.

    Parameters
    ----------
    response : control.TimeResponseData
        From :func:`railenv.simulate`.
    states : (str, str), optional
        The first state and its rate when left out.
    skip : float
        Time at the start to leave out, s.
    color : str
        Colour of the line.
    """
    names = list(response.output_labels)
    chosen = (names[0], names[len(names) // 2]) if states is None else states
    checks.known("state", chosen, names)
    kept = np.asarray(response.time) >= checks.number("skip", skip, low=0.0, unit="s")
    outputs = np.asarray(response.outputs)[:, kept]
    with style():
        ax = axes_or_new(ax, (5.2, 4.6))
        (fx, _), (fy, _) = (unit_of(name) for name in chosen)
        x, y = (outputs[names.index(name)] for name in chosen)
        ax.plot(fx * x, fy * y, color=color, lw=0.9)
        ax.plot(fx * x[-1], fy * y[-1], "o", color=INK, ms=5, label="end")
        ax.set_xlabel(axis_label(chosen[0]))
        ax.set_ylabel(axis_label(chosen[1]))
        ax.set_title(f"{response.sysname or 'motion'} from {skip:g} s")
        ax.legend()
        return drawn_on(ax)
