"""Drawings of spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

from design.cycles.labels import unit_of
from design.style import STABLE, UNSTABLE, axes_or_new, drawn_on, style

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

    from design.cycles.spectrum import Spectrum

_DECADES = 8.0  # of the density shown below its peak


def plot_spectrum(
    spectrum: Spectrum, ax: Axes | None = None, label: str | None = None, color: str | None = None
) -> control.ControlPlot:
    """Draw the power spectral density over frequency."""
    factor, unit = unit_of(spectrum.state)
    with style():
        ax = axes_or_new(ax)
        density = factor**2 * spectrum.density[1:]
        text = (
            f"main frequency {spectrum.main_frequency:.3f} Hz, rms {factor * spectrum.rms:.3g} {unit}"
        )
        if label is None:
            ax.axvline(spectrum.main_frequency, color=UNSTABLE, lw=1.0, ls="--", label=text)
        else:
            label = f"{label}: {text.removeprefix('main frequency ')}"
        line = color or STABLE
        ax.semilogy(spectrum.frequency[1:], density, color=line, lw=1.2, label=label)
        ax.set_xlim(0.0, 10.0 * spectrum.main_frequency)
        peak = float(density.max())
        ax.set_ylim(peak * 10.0**-_DECADES, 5.0 * peak)
        ax.set_xlabel("frequency (Hz)")
        square = f"({unit})²/Hz" if unit else "1/Hz"
        ax.set_ylabel(f"power spectral density of {spectrum.state} ({square})")
        ax.set_title("power spectral density")
        ax.legend()
        return drawn_on(ax)
