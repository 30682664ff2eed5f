"""Drawings of stability margins: Nyquist curves with the disk that they avoid."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import control
import numpy as np

from design.style import SERIES, UNSTABLE, axes_or_new, curve_title, drawn_on, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from design.loop.margins import ChannelMargins, Margins

_DARK = "#333333"
_SMALLEST_VIEW, _LARGEST_VIEW = 1.6, 6.0  # of the negative real axis


def plot_margins(margins: Margins, ax: Axes | None = None) -> control.ControlPlot:
    """Draw the loop of each channel in the Nyquist plane, with -1, the unit circle and the disk.

    An unstable closed loop has no margins; its multipliers are drawn instead.
    """
    if not margins.stable:
        return margins.closed_loop.plot(ax)
    with style():
        ax = axes_or_new(ax, (5.8, 6.2))
        angle = np.linspace(0.0, 2.0 * math.pi, 361)
        ax.plot(np.cos(angle), np.sin(angle), color=_DARK, lw=0.8, ls=":", label="unit circle")
        for k, channel in enumerate(margins.channels):
            _channel(channel, SERIES[k % len(SERIES)], "--" if k else "-", ax)  # they may coincide
        ax.plot(-1.0, 0.0, "+", color=UNSTABLE, ms=11, mew=2.2, label="−1, the edge of stability")
        lower = [1.2 / c.gain_reduction for c in margins.channels if c.gain_reduction > 0.0]
        reach = max([_SMALLEST_VIEW, *(x for x in lower if x < _LARGEST_VIEW)])
        height = max(1.3, 0.55 * (reach + 1.4))
        ax.set_xlim(-reach, 1.4)
        ax.set_ylim(-height, height)
        ax.set_aspect("equal")
        ax.set_xlabel("real part (1)")
        ax.set_ylabel("imaginary part (1)")
        loop = margins.closed_loop
        if margins.delay_margin is None:
            bears = f"more than {1e3 * margins.longest_delay:.0f} ms"
        else:
            bears = f"{1e3 * margins.delay_margin:.1f} ms"
        ax.set_title(
            f"{loop.model_name}, {loop.speed:g} m/s, {curve_title(loop.radius, loop.cant)}:\n"
            f"open loop; it bears {bears} more delay"
        )
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=1)
        return drawn_on(ax)


def _said(channel: ChannelMargins) -> str:
    return (
        f"{channel.channel}: gain {channel.gain_reduction:.3g} to {channel.gain_margin:.3g}, phase "
        f"{math.degrees(channel.phase_margin):.1f}°, disk {channel.disk_margin:.3f}"
    )


def _channel(channel: ChannelMargins, color: str, dashes: str, ax: Axes) -> None:
    from design.loop.margins import frequencies, response

    loop = channel.loop
    omega = frequencies(loop)
    values = response(loop, omega)[:, 0, 0]
    ax.plot(values.real, values.imag, color=color, lw=1.8, ls=dashes, label=_said(channel))
    ax.plot(
        values.real, -values.imag, color=color, lw=0.9, ls=dashes, alpha=0.5
    )  # negative frequencies
    half = channel.disk_margin / 2.0
    if half < 1.0:
        small, large = (1.0 - half) / (1.0 + half), (1.0 + half) / (1.0 - half)
        angle = np.linspace(0.0, 2.0 * math.pi, 181)
        centre, radius = -(small + large) / 2.0, (large - small) / 2.0
        ax.fill(
            centre + radius * np.cos(angle), radius * np.sin(angle), color=color, alpha=0.12, lw=0.0
        )
    for factor in (channel.gain_margin, channel.gain_reduction):
        if math.isfinite(factor) and factor > 0.0:
            ax.plot(-1.0 / factor, 0.0, "o", color=color, ms=5)
