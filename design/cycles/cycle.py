"""Limit cycles: one, a branch of them, and the points where its stability changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from design.cycles.onset import HuntingOnset, onset_of
from design.cycles.shooting import CONDITIONS, Setting
from design.stability.loss import CriticalSpeed
from railenv.errors import RailenvError

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Kind = Literal["fold", "torus", "period doubling", "symmetry breaking", "branch point", "Hopf"]


GOES_ON = "resume goes on"
"""End of ``CycleBranch.ended`` if there is more of the branch."""


class CycleError(RailenvError):
    """No periodic motion was found to start a branch from."""


@dataclass(frozen=True)
class Cycle:
    """A periodic motion.

    Attributes
    ----------
    speed, curvature, cant : float
        m/s, 1/m, rad.
    value : float
        Value of the parameter that the branch varies.
    period : float
        s.
    states : ndarray, shape (steps + 1, n_states)
        The motion at equal intervals over one period; the last row repeats the first.
    amplitudes : ndarray, shape (n_states,)
        Half the distance from peak to peak of every state.
    multipliers : ndarray, shape (n_states - n_trivial,)
        Floquet multipliers, the largest first, without the trivial one.
    trivial_error : float
        Distance of the trivial multiplier from 1, by the motion's own direction over a period: the
        accuracy with which the period and its derivatives were integrated.
    tangent, scale : ndarray
        Direction of the branch and its unit of length, from which it can be continued.
    state_names : tuple of str
    """

    speed: float
    curvature: float
    cant: float
    value: float
    period: float
    states: Array
    amplitudes: Array
    multipliers: NDArray[np.complex128]
    trivial_error: float
    tangent: Array
    scale: Array
    orientation: int
    state_names: tuple[str, ...]

    @property
    def frequency(self) -> float:
        """Frequency, Hz."""
        return 1.0 / self.period

    @property
    def stable(self) -> bool:
        """Whether all multipliers except the trivial one lie inside the unit circle."""
        return bool(self.multipliers.size == 0 or abs(self.multipliers[0]) < 1.0)

    @property
    def time(self) -> Array:
        """Times (s) of the rows of ``states``."""
        return np.linspace(0.0, self.period, len(self.states))

    @property
    def amplitude(self) -> dict[str, float]:
        """Amplitude of every state, by its name."""
        return dict(zip(self.state_names, self.amplitudes.tolist(), strict=True))

    def plot(
        self, states: tuple[str, str] | None = None, ax: Axes | None = None
    ) -> control.ControlPlot:
        """Draw the motion in the plane of two states (by default the first and its rate)."""
        from design.cycles.cycle_plots import plot_cycle

        return plot_cycle(self, states, ax)


@dataclass(frozen=True)
class SpecialPoint:
    """A point of a branch where its stability or its direction changes.

    Attributes
    ----------
    kind : {"fold", "torus", "period doubling", "symmetry breaking", "branch point", "Hopf"}
        Torus is a Neimark-Sacker point; "symmetry breaking" is a branch point of a motion that is
        its own mirror image half a period later; at a "Hopf" point the branch shrinks to an
        equilibrium and ends.
    cycle : Cycle
        The motion at the point.
    multiplier : complex
        The Floquet multiplier on the unit circle.
    precision : float
        Length of the interval of the parameter that contains the point.
    after : int
        Number of points of the branch before it.
    """

    kind: Kind
    cycle: Cycle
    multiplier: complex
    precision: float
    after: int

    @property
    def value(self) -> float:
        """Value of the parameter."""
        return self.cycle.value

    def __str__(self) -> str:
        return f"{self.kind} at {self.value:.6g}, {self.cycle.frequency:.4f} Hz"


@dataclass(frozen=True)
class CycleBranch:
    """A branch of periodic motions.

    Attributes
    ----------
    cycles : tuple of Cycle
        Motions in the order of the branch.
    special : tuple of SpecialPoint
        Special points in the order of the branch.
    ended : str
        Reason why the branch ends.
    complete : bool
        Whether it ends as intended (end of the range or of the number of points, or an equilibrium),
        not by failure or interruption.
    hopf : CriticalSpeed or None
        Hopf point at which it starts, if any.
    setting : Setting
        Model, running conditions and parameter.
    step : float
        Length of the step with which it would continue.
    """

    cycles: tuple[Cycle, ...]
    special: tuple[SpecialPoint, ...]
    ended: str
    complete: bool
    hopf: CriticalSpeed | None
    setting: Setting
    step: float

    def __len__(self) -> int:
        return len(self.cycles)

    @property
    def parameter(self) -> str:
        """Name of the parameter that varies along the branch."""
        return self.setting.parameter

    @property
    def model_name(self) -> str:
        """Name of the model."""
        return self.setting.model.name

    @property
    def value(self) -> Array:
        """The parameter at every point."""
        return np.array([c.value for c in self.cycles])

    @property
    def speed(self) -> Array:
        """Speed (m/s) at every point."""
        return np.array([c.speed for c in self.cycles])

    @property
    def period(self) -> Array:
        """Period (s) at every point."""
        return np.array([c.period for c in self.cycles])

    @property
    def frequency(self) -> Array:
        """Frequency (Hz) at every point."""
        return 1.0 / self.period

    @property
    def amplitude(self) -> Mapping[str, Array]:
        """Amplitude (half peak to peak) at every point, by state."""
        table = np.array([c.amplitudes for c in self.cycles]).T
        return dict(zip(self.setting.model.state_names, table, strict=True))

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Floquet multipliers without the trivial one, shape (points, n_states - n_trivial)."""
        return np.array([c.multipliers for c in self.cycles])

    @property
    def trivial_error(self) -> Array:
        """Distance of the trivial multiplier from 1 at every point."""
        return np.array([c.trivial_error for c in self.cycles])

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the motion is stable, at every point."""
        return np.array([c.stable for c in self.cycles])

    @property
    def folds(self) -> tuple[SpecialPoint, ...]:
        """The folds of the branch."""
        return tuple(s for s in self.special if s.kind == "fold")

    @property
    def onset(self) -> HuntingOnset | None:
        """Lowest value at which hunting of this branch can persist; None without a stable motion.

        It is never above the value of a stable motion that was computed. Motions of other branches may
        persist below; :func:`design.bifurcation_diagram` searches for them.
        """
        return onset_of(self)

    @property
    def nonlinear_critical_speed(self) -> float | None:
        """Lowest speed (m/s) at which hunting of this branch can persist.

        ``onset`` gives the evidence: a fold where stable hunting begins, or the Hopf point where it
        grows from zero. Below this speed no hunting of this branch persists; above it a large enough
        disturbance starts it. None if no stable motion was found, or the parameter is not the speed.
        """
        onset = self.onset if self.parameter == "speed" else None
        return None if onset is None else onset.value

    @property
    def goes_on(self) -> bool:
        """Whether it ended at a number of points or an interruption, so that ``resume`` continues."""
        return self.ended.endswith(GOES_ON)

    def at(self, value: float, *, stable: bool | None = None) -> tuple[Cycle, ...]:
        """Return the computed motions nearest to the branch's passages of a value of the parameter.

        There is one for each passage; ``stable`` keeps only the stable, or the unstable ones.
        """
        side = self.value - value
        found = []
        for i in np.flatnonzero(side[:-1] * side[1:] <= 0.0):
            cycle = self.cycles[i if abs(side[i]) <= abs(side[i + 1]) else i + 1]
            if (stable is None or cycle.stable == stable) and cycle not in found:
                found.append(cycle)
        return tuple(found)

    def summary(self) -> dict[str, Any]:
        """Return the branch as plain numbers and strings, ready for JSON."""
        return {
            "model": self.model_name,
            "parameter": self.parameter,
            "value": self.value.tolist(),
            "speed": self.speed.tolist(),
            "frequency": self.frequency.tolist(),
            "stable": self.stable.tolist(),
            "amplitude": {k: v.tolist() for k, v in self.amplitude.items()},
            "special": [
                {"kind": s.kind, "value": s.value, "frequency": s.cycle.frequency} for s in self.special
            ],
            "nonlinear_critical_speed": self.nonlinear_critical_speed,
            "rests_on": None if self.onset is None else self.onset.rests_on,
            "ended": self.ended,
        }

    def __str__(self) -> str:
        low, high = float(self.value.min()), float(self.value.max())
        text = f"{len(self)} limit cycles, {self.parameter} {low:.4g} to {high:.4g}"
        return text if self.onset is None else f"{text}; {self.onset}"

    def plot(
        self, state: str | None = None, ax: Axes | None = None, clearance: float | None = None
    ) -> control.ControlPlot:
        """Draw the bifurcation diagram: amplitude of a state (by default the first) over the parameter.

        ``clearance`` (m) is drawn as a line; by default the model's own flange clearance.
        """
        from design.cycles.cycle_plots import plot_branch

        return plot_branch(self, state, ax, clearance)


def value_of(setting: Setting, cycle: Cycle) -> float:
    """Return the value of a setting's parameter at a computed motion."""
    if setting.parameter in CONDITIONS:
        return float(getattr(cycle, setting.parameter))
    return setting.model.parameters[setting.parameter]
