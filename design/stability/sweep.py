"""Critical speed against curve radius: the paper's Fig 5."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.progress import tracked
from design.stability.critical_speed import SPEED_RANGE, critical_speed
from design.stability.loss import CriticalSpeed
from railenv import checks
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class CurveSweep:
    """Critical speed against curve radius.

    Attributes
    ----------
    model_name : str
    cant : float
        rad.
    radius : ndarray
        m.
    results : tuple of CriticalSpeed
        One for each radius.
    """

    model_name: str
    cant: float
    radius: NDArray[np.float64]
    results: tuple[CriticalSpeed, ...]

    @property
    def speed(self) -> NDArray[np.float64]:
        """Critical speed (m/s) at each radius; NaN if there is none."""
        return np.array([np.nan if r.speed is None else r.speed for r in self.results])

    @property
    def highest_speed(self) -> float:
        """Highest speed searched, m/s."""
        return self.results[0].speed_range[1]

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Hunting frequency (Hz) at each radius; NaN if stability is not lost by hunting."""
        return np.array([np.nan if r.frequency is None else r.frequency for r in self.results])

    def plot(
        self, ax: Axes | None = None, label: str | None = None, color: str | None = None
    ) -> control.ControlPlot:
        """Draw critical speed over radius; markers show how steady running ends."""
        from design.stability.sweep_plots import plot_sweep

        return plot_sweep(self, ax, label, color)


def curve_sweep(
    model: Model,
    radii: ArrayLike,
    *,
    cant: float = 0.0,
    speed_range: tuple[float, float] = SPEED_RANGE,
    longest_step: float | None = None,
    progress: bool = False,
) -> CurveSweep:
    """Find the critical speed on curves of several radii.

    Parameters
    ----------
    model : Model
    radii : array_like
        Curve radii, m; ``math.inf`` is tangent track, negative the other hand.
    cant : float
        Cant angle on all of them, rad.
    speed_range : (float, float)
        Lowest and highest speed searched, m/s.
    longest_step : float, optional
        Longest step between sampled speeds, as in :func:`design.critical_speed`.
    progress : bool
        Show a progress bar.

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium on a curve at the lowest speed.
    """
    values = checks.numbers("radii", radii)
    todo = tracked(values.tolist(), f"critical speed, {model.name}", progress)
    results = [
        critical_speed(model, radius=r, cant=cant, speed_range=speed_range, longest_step=longest_step)
        for r in todo
    ]
    return CurveSweep(model.name, cant, values, tuple(results))
