"""The modes of a vehicle at one speed: their names, frequencies, damping and energy."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from design.loop.dynamics import dynamics
from design.stability.locus import Speeds
from design.stability.mode_shape import ModeShape
from design.stability.participation import Measure
from railenv import checks
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

_STILL = 1e-9  # of the largest eigenvalue: imaginary parts below count as zero
_TOLD = {"wheelset": "wheelsets", "frame": "frames", "body": "body", "other": "others"}


@dataclass(frozen=True)
class ModeTable:
    """The oscillating modes of a vehicle about its steady running, the slowest first.

    Attributes
    ----------
    model_name : str
    condition : str
        Running conditions, such as "96.5 m/s, tangent track".
    shapes : tuple of ModeShape
        Modes with name, frequency, damping ratio and shares of the bodies; each can draw and animate
        itself.
    """

    model_name: str
    condition: str
    shapes: tuple[ModeShape, ...]

    def __len__(self) -> int:
        return len(self.shapes)

    def __iter__(self) -> Iterator[ModeShape]:
        return iter(self.shapes)

    def __getitem__(self, name: str) -> ModeShape:
        """Return the slowest mode with a name.

        Raises
        ------
        UnknownNameError
            If there is no such mode.
        """
        checks.known("mode", [name], [shape.name for shape in self.shapes])
        return next(shape for shape in self.shapes if shape.name == name)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each mode."""
        return tuple(shape.name for shape in self.shapes)

    @property
    def measure(self) -> Measure | None:
        """Measure of the shares, kinetic energy or squared amplitude; None without named bodies."""
        share = next((s.participation for s in self.shapes if s.participation), None)
        return share.measure if share else None

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the vehicle with shares in :meth:`rows`: wheelsets, frames, body, others."""
        shares = [s.participation.roles for s in self.shapes if s.participation]
        present = {role for own in shares for role in own}
        return tuple(told for role, told in _TOLD.items() if role in present)

    def rows(self) -> list[dict[str, Any]]:
        """Return name, frequency (Hz), damping ratio and shares of the parts of each mode.

        They are plain numbers and strings, for JSON and pandas tables.
        """
        found = []
        for shape in self.shapes:
            own: dict[Any, float] = shape.participation.roles if shape.participation else {}
            shares = {told: own[role] for role, told in _TOLD.items() if told in self.parts}
            found.append(
                {"mode": shape.name, "frequency": shape.frequency, "damping": shape.damping, **shares}
            )
        return found

    def __str__(self) -> str:
        parts = self.parts
        head = f"{self.model_name}, {self.condition}: {len(self)} oscillating modes"
        if parts:
            head += f"; shares of {self.measure}"
        titles = "".join(f"{part:>11}" for part in parts)
        lines = [head, f"{'Hz':>8}{'damping':>9}{titles}  mode"]
        for row in self.rows():
            shares = "".join(f"{row[part]:11.2f}" for part in parts)
            lines.append(f"{row['frequency']:8.3f}{row['damping']:+9.3f}{shares}  {row['mode']}")
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the shares of the parts in each mode as bars, with frequency and damping ratio."""
        from design.stability.mode_table_plots import plot_table

        return plot_table(self, ax)


def modes(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    highest: float | None = None,
    controller: Any | None = None,
    period: float | None = None,
) -> ModeTable:
    """Return the oscillating modes of a vehicle about its running equilibrium at one speed, with names.

    Parameters
    ----------
    model : Model
    speed : float
        m/s.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track, negative the other hand) and cant (rad).
    highest : float, optional
        Frequency up to which modes are listed, Hz; all of them when left out.
    controller : array_like, control.StateSpace or Feedback, optional
        Controller that closes the loop once per control period (:func:`design.closed_loop`).
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.

    Returns
    -------
    ModeTable

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium.

    Examples
    --------
    >>> import design, railenv
    >>> found = design.modes(railenv.Bogie(railenv.HIGH_SPEED_COACH), speed=20.0, highest=30.0)
    >>> found.names
    ('bogie hunting', 'frame lateral', 'frame yaw')
    >>> print(f"{found['bogie hunting'].frequency:.3f} Hz")
    0.632 Hz
    """
    speed = checks.speed(speed)
    limit = math.inf
    if highest is not None:
        limit = 2.0 * math.pi * checks.number("highest", highest, low=0.0, open_low=True, unit="Hz")
    checks.curvature(radius)
    family = Speeds(model, dynamics(model, controller, period), float(radius), checks.cant(cant))
    found = family.modes(speed)
    values = found.eigenvalues
    fastest = float(abs(values).max(initial=0.0))
    chosen = [k for k, v in enumerate(values) if _STILL * fastest < v.imag <= limit]
    chosen.sort(key=lambda k: float(values[k].imag))
    where = f"{speed:g} m/s, {family.condition}"
    shapes = ModeShape.several(
        model, found.vectors[:, chosen], [complex(values[k]) for k in chosen], where
    )
    return ModeTable(model.name, where, shapes)
