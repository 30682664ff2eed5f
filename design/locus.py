"""Speed locus: the eigenvalues of a vehicle about its running equilibrium, over speed."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any

import control
import numpy as np
from control.pzmap import PoleZeroData
from numpy.typing import ArrayLike, NDArray

from design.critical_speed import CriticalSpeed, critical_speed
from railenv.equilibrium import LOW_SPEED, follow_speeds
from railenv.errors import EquilibriumError, ParameterError
from railenv.models import Model

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Complex = NDArray[np.complex128]

_SHAPE_WEIGHT = 0.5  # of a change of mode shape against a relative change of eigenvalue


class SpeedLocus(PoleZeroData):
    """Eigenvalues over speed, as python-control's data of a root locus whose gain is the speed.

    Attributes
    ----------
    speeds, gains : ndarray, shape (n_speeds,)
        m/s (the same array under python-control's name).
    loci : ndarray, shape (n_speeds, n_states)
        Eigenvalues (1/s); each column follows one mode.
    poles : ndarray, shape (n_states,)
        Eigenvalues at the lowest speed.
    states : ndarray, shape (n_speeds, n_states)
        Running equilibrium at each speed.
    least_damped : int
        Column of the mode whose real part is largest anywhere in the range.
    critical : CriticalSpeed
        Where stability is lost, searched up to the highest speed.
    radius, cant : float
        m (``math.inf`` on tangent track), rad.
    ended : str or None
        Why the locus ends below the highest speed asked for, if it does.
    """

    def __init__(
        self,
        speeds: NDArray[np.float64],
        loci: Complex,
        *,
        states: NDArray[np.float64],
        critical: CriticalSpeed,
        radius: float,
        cant: float,
        model_name: str,
        ended: str | None,
    ) -> None:
        super().__init__(
            loci[0], np.empty(0), gains=speeds, loci=loci, dt=0, sysname=model_name, sort_loci=False
        )
        self.speeds = speeds
        self.states = states
        self.critical = critical
        self.radius = radius
        self.cant = cant
        self.ended = ended
        largest = np.where(loci.imag >= 0.0, loci.real, -np.inf).max(axis=0)
        self.least_damped = int(np.argmax(largest))

    @property
    def damping(self) -> NDArray[np.float64]:
        """Damping ratio of every mode at every speed, shape (n_speeds, n_states)."""
        magnitude = np.abs(self.loci)
        return -self.loci.real / np.where(magnitude > 0.0, magnitude, 1.0)

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Frequency (Hz) of every mode at every speed, shape (n_speeds, n_states)."""
        return np.abs(self.loci.imag) / (2.0 * math.pi)

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the loci, with the least damped mode and the critical speed marked."""
        from design.plots import plot_locus

        return plot_locus(self, ax)


def speed_locus(
    model: Model, speeds: ArrayLike, *, radius: float = math.inf, cant: float = 0.0
) -> SpeedLocus:
    """Compute the eigenvalues about the running equilibrium at some speeds, sorted into modes.

    Parameters
    ----------
    model : Model
    speeds : array_like
        At least two increasing speeds, m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).

    Returns
    -------
    SpeedLocus
        If the equilibrium ends before the highest speed, the locus ends there too, with a warning, and
        ``ended`` says why.

    Raises
    ------
    EquilibriumError
        If there is no equilibrium at the second speed already.
    """
    targets = np.atleast_1d(np.asarray(speeds, dtype=float))
    if targets.ndim != 1 or targets.size < 2:
        raise ParameterError(f"speeds is {speeds!r}; a locus needs at least two speeds")
    points = []
    ended: str | None = None
    try:
        for point in follow_speeds(model, targets, radius=radius, cant=cant):
            points.append(point)
    except EquilibriumError as error:
        if len(points) < 2:
            raise
        ended = str(error)
        warnings.warn(f"the speed locus ends early: {ended}", UserWarning, stacklevel=2)
    n = model.n_states
    decompositions = [np.linalg.eig(p.jacobian[:, :n]) for p in points]
    reached = targets[: len(points)]
    search = (min(float(reached[0]), LOW_SPEED), float(targets[-1]))
    return SpeedLocus(
        reached,
        _sorted(decompositions),
        states=np.array([p.state for p in points]),
        critical=critical_speed(model, radius=radius, cant=cant, speed_range=search),
        radius=float(radius),
        cant=cant,
        model_name=model.name,
        ended=ended,
    )


def _sorted(decompositions: list[Any]) -> Complex:
    """Follow modes from one decomposition to the next by eigenvalue, extrapolated, and shape."""
    from scipy.optimize import linear_sum_assignment

    values, vectors = decompositions[0]
    rows = [values]
    for next_values, next_vectors in decompositions[1:]:
        predicted = 2.0 * rows[-1] - rows[-2] if len(rows) > 1 else rows[-1]
        size = np.abs(predicted)[:, None] + np.abs(next_values) + 1e-12
        distance = np.abs(predicted[:, None] - next_values) / size
        likeness = np.abs(vectors.conj().T @ next_vectors)
        _, order = linear_sum_assignment(distance + _SHAPE_WEIGHT * (1.0 - likeness))
        rows.append(next_values[order])
        vectors = next_vectors[:, order]
    return np.array(rows, dtype=complex)
