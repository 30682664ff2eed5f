"""Power spectral density, main frequency and rms of a motion: the paper's Figs 12 and 13."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from railenv import checks
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_FEWEST = 16  # samples


@dataclass(frozen=True)
class Spectrum:
    """One-sided power spectral density of a state.

    Attributes
    ----------
    state : str
    frequency : ndarray
        Hz.
    density : ndarray
        Unit of the state squared per Hz.
    main_frequency : float
        Frequency of the largest density, refined between the lines of the spectrum, Hz.
    rms : float
        Root mean square about the mean, unit of the state.
    """

    state: str
    frequency: Array
    density: Array
    main_frequency: float
    rms: float

    def __str__(self) -> str:
        return f"{self.state}: main frequency {self.main_frequency:.4f} Hz, rms {self.rms:.4g}"

    def plot(
        self, ax: Axes | None = None, label: str | None = None, color: str | None = None
    ) -> control.ControlPlot:
        """Draw the density over frequency; with a ``label``, as one of several."""
        from design.cycles.spectrum_plots import plot_spectrum

        return plot_spectrum(self, ax, label, color)


def spectrum(
    response: control.TimeResponseData, state: str | None = None, *, skip: float = 0.0
) -> Spectrum:
    """Estimate the power spectral density of a simulated state, with its mean removed.

    This is a periodogram with Hann's window over the whole remaining time.

    Parameters
    ----------
    response : control.TimeResponseData
        From :func:`railenv.simulate`.
    state : str, optional
        State; the first when left out.
    skip : float
        Time at the start to leave out, s.
    """
    names = list(response.output_labels)
    name = names[0] if state is None else state
    checks.known("state", [name], names)
    time = np.asarray(response.time)
    kept = time >= checks.number("skip", skip, low=0.0, unit="s")
    if np.count_nonzero(kept) < _FEWEST:
        raise ParameterError(
            f"skip is {skip:g} s of {time[-1]:g} s; at least {_FEWEST} samples must be left"
        )
    values = np.asarray(response.outputs)[names.index(name), kept]
    rate = 1.0 / float(time[1] - time[0])
    frequency, density = signal.periodogram(values, rate, window="hann", detrend="constant")
    k = int(np.argmax(density[1:-1])) + 1
    # for Hann's window the logarithm of the peak is close to a parabola
    a, b, c = np.log(np.maximum(density[k - 1 : k + 2], 1e-300))
    shift = 0.5 * (a - c) / (a - 2.0 * b + c) if a - 2.0 * b + c else 0.0
    main = float(frequency[k] + shift * (frequency[1] - frequency[0]))
    return Spectrum(name, frequency, density, main, float(np.std(values)))
