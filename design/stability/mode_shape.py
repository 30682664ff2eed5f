"""Mode shapes: the motion of the bodies of a vehicle relative to each other in one mode."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from design.stability.mode_geometry import Geometry, geometry_of
from design.stability.mode_names import mode_name, roll_axis
from design.stability.participation import Participation, Structure
from railenv import checks
from railenv.equations.coordinates import COORDINATES
from railenv.equipment import Equipped
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class ModeShape:
    """Complex displacements of one mode.

    Attributes
    ----------
    name : str
        Engineering name of the mode, such as "bogie hunting, in phase" or "body lower sway", from its
        shape (``design.stability.mode_names``). For a model that does not name its bodies, the largest
        displacement.
    model_name : str
    names : tuple of str
        The displacements, such as ``y_w1`` (m) or ``psi_w1`` (rad); all states if a model's states are
        not displacements and their rates.
    displacements : ndarray of complex, shape (n_names,)
        Scaled so that the largest is 1. The motion is the real part of
        ``displacements * exp(eigenvalue * t)``.
    eigenvalue : complex
        1/s.
    condition : str
        Condition for which the mode was computed, such as "speed = 116.1 m/s".
    geometry : Geometry or None
        Places of the bodies; None for models without them, which are drawn as a bar chart.
    participation : Participation or None
        Shares of the bodies and of their coordinates; None for models that do not name their bodies.
    """

    name: str
    model_name: str
    names: tuple[str, ...]
    displacements: Complex
    eigenvalue: complex
    condition: str
    geometry: Geometry | None
    participation: Participation | None

    @classmethod
    def of(cls, model: Model, vector: Complex, eigenvalue: complex, condition: str) -> Self:
        """Return the shape of an eigenvector whose first entries are the model's states."""
        return cls.several(model, np.asarray(vector)[:, None], [eigenvalue], condition)[0]

    @classmethod
    def several(
        cls, model: Model, vectors: Complex, eigenvalues: Sequence[complex], condition: str
    ) -> tuple[Self, ...]:
        """Return the shapes of eigenvectors, each a column."""
        chosen, structure, geometry = displacement_rows(model), Structure.of(model), geometry_of(model)
        names = tuple(model.state_names[k] for k in chosen)
        found = []
        for vector, eigenvalue in zip(np.asarray(vectors, complex).T, eigenvalues, strict=True):
            shape = normalized(vector[chosen])
            moved = dict(zip(names, shape.tolist(), strict=True))
            share = structure.shares(moved) if structure else None
            name = mode_name(moved, eigenvalue, share) if share else largest_of(moved)
            found.append(cls(name, model.name, names, shape, eigenvalue, condition, geometry, share))
        return tuple(found)

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
        """Return the displacements at a phase (rad) of the motion, without growth or decay."""
        return np.asarray((self.displacements * np.exp(1j * phase)).real)

    def __str__(self) -> str:
        largest = ", ".join(
            f"{self.names[k]} {abs(self.displacements[k]):.3f} at "
            f"{math.degrees(np.angle(self.displacements[k])) + 0.0:.0f}°"
            for k in np.argsort(-np.abs(self.displacements))[:4]
        )
        return (
            f"{self.model_name}, {self.condition}: {self.name}, {self.frequency:.4f} Hz, damping ratio "
            f"{self.damping:+.5f}; {largest}"
        )

    @property
    def vertical(self) -> bool:
        """Whether bounce and pitch have most of the motion; False if no bodies are named."""
        if self.participation is None:
            return False
        everything = list(self.participation.structure.roles)
        return self.participation.of(everything, ("z", "theta")) > 0.5

    def roll_axis(self, body: str) -> float | None:
        """Return the height (m) above its centre of mass of the axis about which a body rolls.

        It is below the centre (negative) in lower sway and above it in upper sway. None if the body
        does not roll.

        Raises
        ------
        UnknownNameError
            If the model has no such moving body.
        """
        known = self.participation.structure.displacements if self.participation else {}
        checks.known("body", [body], list(known))
        assert self.participation is not None
        moved = dict(zip(self.names, self.displacements.tolist(), strict=True))
        return roll_axis(moved, self.participation.structure, body)

    def plot(
        self, ax: Axes | None = None, *, phases: Sequence[float] = (0.0, 45.0, 90.0, 135.0)
    ) -> control.ControlPlot:
        """Draw the bodies at some phases of a period; models without bodies as bars.

        They are seen from above; the leading end of a whole vehicle also from behind. If most of the
        motion is vertical, they are seen from the side.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes for the view from above or from the side; only the first phase is drawn.
        phases : sequence of float
            Phases, degrees.
        """
        from design.stability.mode_plots import plot_bars, plot_views

        return plot_bars(self, ax) if self.geometry is None else plot_views(self, ax, phases)

    def bars(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw magnitude and phase of every displacement."""
        from design.stability.mode_plots import plot_bars

        return plot_bars(self, ax)

    def animate(self, *, frames: int = 30, interval: float = 50.0) -> FuncAnimation:
        """Animate one period of the motion.

        Parameters
        ----------
        frames : int
            Number of pictures in a period.
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
    """Return the indices of a model's displacements: coordinates of its bodies, and states with a rate.

    If there are none, return all states. Those of actuators and sensors are left out.
    """
    names = (model.plant if isinstance(model, Equipped) else model).state_names
    of_bodies = {own.get(c) for own in model.body_states.values() for c in COORDINATES}
    chosen = [k for k, name in enumerate(names) if name in of_bodies or f"d{name}" in names]
    return chosen or list(range(len(names)))


def largest_of(shape: Mapping[str, complex]) -> str:
    """Return the name of the largest displacement."""
    return max(shape, key=lambda name: abs(shape[name]))


def normalized(shape: Complex) -> Complex:
    """Return a shape divided by its largest entry."""
    largest = shape[np.argmax(np.abs(shape))]
    return shape / largest if largest else shape
