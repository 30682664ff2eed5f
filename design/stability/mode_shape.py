"""Mode shapes: how the bodies of a vehicle move against each other in one mode."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.equipment import Equipped
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Geometry:
    """What a plan view of a bogie needs.

    Attributes
    ----------
    half_gauge, half_wheelbase : float
        m.
    """

    half_gauge: float
    half_wheelbase: float


@dataclass(frozen=True)
class ModeShape:
    """Complex displacements of one mode.

    Attributes
    ----------
    model_name : str
    names : tuple of str
        The displacements, such as ``y_w1`` (m) or ``psi_w1`` (rad); all states of a model whose states
        are not displacements and their rates.
    displacements : ndarray of complex, shape (n_names,)
        Scaled so that the largest is 1. The motion is the real part of
        ``displacements * exp(eigenvalue * t)``.
    eigenvalue : complex
        1/s.
    condition : str
        Where the mode was computed, as "speed = 116.1 m/s".
    geometry : Geometry or None
        Dimensions of the bogie; None for models that are drawn as a bar chart.
    """

    model_name: str
    names: tuple[str, ...]
    displacements: Complex
    eigenvalue: complex
    condition: str
    geometry: Geometry | None

    @classmethod
    def of(cls, model: Model, vector: Complex, eigenvalue: complex, condition: str) -> Self:
        """Take the shape from an eigenvector whose first entries are the model's states."""
        chosen = displacement_rows(model)
        shape = np.asarray(vector, dtype=complex)[chosen]
        names = tuple(model.state_names[k] for k in chosen)
        return cls(model.name, names, normalized(shape), eigenvalue, condition, _geometry(model, names))

    def __getitem__(self, name: str) -> complex:
        """Return one displacement by its name."""
        checks.known("displacement", [name], self.names)
        return complex(self.displacements[self.names.index(name)])

    @property
    def frequency(self) -> float:
        """Frequency, Hz."""
        return abs(self.eigenvalue.imag) / (2.0 * math.pi)

    @property
    def damping(self) -> float:
        """Damping ratio; negative where the mode grows."""
        return -self.eigenvalue.real / max(abs(self.eigenvalue), 1e-300)

    def at(self, phase: float) -> NDArray[np.float64]:
        """Return the displacements at a phase (rad) of the motion, its growth or decay left out."""
        return np.asarray((self.displacements * np.exp(1j * phase)).real)

    def __str__(self) -> str:
        largest = ", ".join(
            f"{self.names[k]} {abs(self.displacements[k]):.3f} at "
            f"{math.degrees(np.angle(self.displacements[k])) + 0.0:.0f}°"
            for k in np.argsort(-np.abs(self.displacements))[:4]
        )
        return (
            f"{self.model_name}, {self.condition}: {self.frequency:.4f} Hz, damping ratio "
            f"{self.damping:+.5f}; {largest}"
        )

    def plot(
        self, ax: Axes | None = None, *, phases: Sequence[float] = (0.0, 45.0, 90.0, 135.0)
    ) -> control.ControlPlot:
        """Draw the bogie in plan view at some phases of a period; other models as bars.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            For a plan view: draws the first phase only, into these axes.
        phases : sequence of float
            Degrees.
        """
        from design.stability.mode_plots import plot_bars, plot_plan

        return plot_bars(self, ax) if self.geometry is None else plot_plan(self, ax, phases)

    def bars(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw magnitude and phase of every displacement."""
        from design.stability.mode_plots import plot_bars

        return plot_bars(self, ax)

    def animate(self, *, frames: int = 30, interval: float = 50.0) -> FuncAnimation:
        """Animate one period of the motion.

        Parameters
        ----------
        frames : int
            Pictures of a period.
        interval : float
            Time between pictures, ms.

        Returns
        -------
        matplotlib.animation.FuncAnimation
            ``animation.save("mode.gif", writer="pillow")`` writes it.
        """
        from design.stability.mode_plots import animate

        return animate(self, frames, interval)


def displacement_rows(model: Model) -> list[int]:
    """Return the places of a model's displacements: states ``y_w1`` with a rate ``dy_w1``.

    All states where there is no such pair. Those of actuators and sensors are left out.
    """
    names = (model.plant if isinstance(model, Equipped) else model).state_names
    paired = [k for k, name in enumerate(names) if f"d{name}" in names]
    return paired or list(range(len(names)))


def normalized(shape: Complex) -> Complex:
    """Return a shape divided by its largest entry."""
    largest = shape[np.argmax(np.abs(shape))]
    return shape / largest if largest else shape


def _geometry(model: Model, names: Sequence[str]) -> Geometry | None:
    needed = {"half_gauge", "half_wheelbase"}
    seen = {"y_w1", "psi_w1", "y_w2", "psi_w2"}
    if not (needed <= set(model.parameters) and seen <= set(names)):
        return None
    return Geometry(model.parameters["half_gauge"], model.parameters["half_wheelbase"])
