"""Losses of stability of steady running, and the kinds of Hopf points."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from design.stability.mode_shape import ModeShape
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes


Loss = Literal["hunting", "divergence", "fold", "end", "none", "unstable at start"]
Criticality = Literal["supercritical", "subcritical", "neutral"]

_NEUTRAL = 2e-4  # relative change of speed between them, below which the branch is vertical


@dataclass(frozen=True)
class CriticalSpeed:
    """The loss of stability of steady running: its speed and its kind.

    Attributes
    ----------
    loss : {"hunting", "divergence", "fold", "end", "none", "unstable at start"}
        "fold": the equilibrium turns back in a fold and there is none beyond. "end": it ends where the
        equations jump, as they do when a wheel lifts. "none": stable over the whole range.
    speed : float or None
        Critical speed, m/s; None for "none" and "unstable at start".
    frequency : float or None
        Hunting frequency, Hz; None unless the critical mode oscillates.
    state : ndarray or None, shape (n_states,)
        Equilibrium at the critical speed (for "unstable at start", at the start of the range).
    eigenvalue : complex or None
        The critical eigenvalue (imaginary part not negative), 1/s.
    mode : ndarray or None, shape (n_states,)
        Its eigenvector, scaled so that its largest displacement is 1; for a multiple eigenvalue, one of
        its eigenvectors.
    multiplicity : int
        Number of eigenvalues equal to the critical one; 2 for the dual wheelset, else usually 1.
    growth_slope : float or None
        Change of the growth rate of the critical mode with the speed, 1/s per m/s: positive
        where its stability is lost, negative where it is gained. None unless it crosses the axis.
    unstable : int
        Number of other eigenvalues that are unstable there.
    speed_range : (float, float)
        Range searched, m/s.
    sampled : ndarray
        Increasing speeds at which eigenvalues were computed, m/s.
    radius, cant : float
        m (``math.inf`` on tangent track), rad.
    model_name : str
    state_names : tuple of str
    inputs : ndarray, shape (n_inputs,)
        Constant inputs.
    period : float or None
        Control period (s) of a closed loop; None for the vehicle alone. The eigenvalue of a closed loop
        is that of its map over a period, as one in continuous time.
    """

    loss: Loss
    speed: float | None
    frequency: float | None
    state: NDArray[np.float64] | None
    eigenvalue: complex | None
    mode: NDArray[np.complex128] | None
    multiplicity: int
    growth_slope: float | None
    unstable: int
    speed_range: tuple[float, float]
    sampled: NDArray[np.float64] = field(repr=False, compare=False)
    radius: float
    cant: float
    model_name: str
    state_names: tuple[str, ...]
    inputs: NDArray[np.float64]
    period: float | None
    _model: Model = field(repr=False, compare=False)

    @cached_property
    def hopf(self) -> HopfPoint | None:
        """Normal form and direction of the branch where stability is lost by hunting, else None.

        It is computed on first use, in about a second. None for a closed loop: a map in discrete time
        has no Hopf point of this kind.
        """
        if self.loss != "hunting" or self.period is not None:
            return None
        assert _hopf_analysis is not None, "design.cycles.hopf gives it when design is imported"
        return _hopf_analysis(self._model, self)

    @property
    def criticality(self) -> Criticality | None:
        """Whether hunting grows gently ("supercritical") or jumps ("subcritical").

        "neutral" is neither; None if stability is not lost by hunting. See
        :class:`design.HopfPoint`.
        """
        return None if self.hopf is None else self.hopf.criticality

    @property
    def largest_step(self) -> float:
        """Largest step between neighbouring sampled speeds, as a fraction of the lower one."""
        return float(np.max(self.sampled[1:] / self.sampled[:-1], initial=1.0)) - 1.0

    @property
    def wavelength(self) -> float | None:
        """Length of track (m) covered in one period of hunting."""
        if self.speed is None or self.frequency is None:
            return None
        return self.speed / self.frequency

    def summary(self) -> dict[str, Any]:
        """Return everything but the mode as plain numbers and strings, ready for JSON."""
        named = (
            None
            if self.state is None
            else dict(zip(self.state_names, self.state.tolist(), strict=True))
        )
        return {
            "loss": self.loss,
            "speed": self.speed,
            "frequency": self.frequency,
            "wavelength": self.wavelength,
            "mode": None if self.mode_shape is None else self.mode_shape.name,
            "multiplicity": self.multiplicity,
            "growth_slope": self.growth_slope,
            "unstable": self.unstable,
            "speed_range": list(self.speed_range),
            "sampled_speeds": len(self.sampled),
            "largest_step": self.largest_step,
            "radius": None if math.isinf(self.radius) else self.radius,
            "cant": self.cant,
            "equilibrium": named,
        }

    def __str__(self) -> str:
        return self._told(self._named_loss)

    @property
    def _named_loss(self) -> str:
        """The loss; hunting with its name for a vehicle with a body, which hunts in several ways."""
        shape = self.mode_shape if self.loss == "hunting" else None
        share = shape.participation if shape else None
        if shape is None or share is None or not share.structure.having("body"):
            return self.loss
        return shape.name if "hunting" in shape.name else f"hunting ({shape.name})"

    def _told(self, loss: str) -> str:
        """Describe the result, with a name for the loss."""
        low, high = self.speed_range
        if self.loss == "none":
            looked = f"seen at {len(self.sampled)} speeds, at most {self.largest_step:.1%} apart"
            return f"stable from {low:g} to {high:g} m/s ({looked})"
        if self.speed is None:
            return f"unstable already at {low:g} m/s"
        if self.loss == "fold":
            return f"the running equilibrium ends in a fold at {self.speed:.4f} m/s"
        if self.loss == "end":
            return f"the running equilibrium ends at {self.speed:.4f} m/s, as when a wheel lifts"
        at = f" at {self.frequency:.4f} Hz" if self.frequency is not None else ""
        way = "up to" if self.growth_slope is not None and self.growth_slope < 0.0 else "from"
        beside = ", where others are unstable" if self.unstable else ""
        return f"{loss} {way} {self.speed:.4f} m/s{at}{beside}"

    @cached_property
    def mode_shape(self) -> ModeShape | None:
        """The critical mode as an object that draws and animates itself; None if there is none.

        Its ``name`` gives the kind of hunting, such as "bogie hunting, in phase" or "body hunting
        (upper sway)", its ``participation`` the share of each body.
        """
        if self.mode is None or self.eigenvalue is None:
            return None
        return ModeShape.of(self._model, self.mode, self.eigenvalue, self._told(self.loss))

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the critical mode: magnitude and phase of every displacement."""
        from design.stability.critical_speed_plots import plot_mode

        return plot_mode(self, ax)


@dataclass(frozen=True)
class HopfPoint:
    """A Hopf point with its normal form.

    Attributes
    ----------
    critical : CriticalSpeed
        Speed, frequency, equilibrium and mode.
    lyapunov_coefficient : float or None
        First Lyapunov coefficient by Kuznetsov's definition (eigenvector of length 1 in SI units,
        divided by the angular frequency); negative is supercritical. None if the equations are not
        smooth enough for it to exist.
    amplitude_range : float or None
        Amplitude (m, of the mode's largest displacement) up to which the coefficient holds within 10 %.
    branch_amplitudes : (float, float)
        Amplitudes (m) between which the direction of the branch was measured.
    branch_speeds : (float, float)
        Speeds of the limit cycles (m/s) with these amplitudes.
    criticality : {"supercritical", "subcritical", "neutral"}
        From the branch: its speed rises, falls, or changes by less than 0.02 % with the amplitude.
    """

    critical: CriticalSpeed
    lyapunov_coefficient: float | None
    amplitude_range: float | None
    branch_amplitudes: tuple[float, float]
    branch_speeds: tuple[float, float]

    @property
    def speed(self) -> float:
        """Critical speed, m/s."""
        assert self.critical.speed is not None
        return self.critical.speed

    @property
    def frequency(self) -> float:
        """Hunting frequency, Hz."""
        assert self.critical.frequency is not None
        return self.critical.frequency

    @property
    def state(self) -> NDArray[np.float64]:
        """Running equilibrium at the critical speed, shape (n_states,)."""
        assert self.critical.state is not None
        return self.critical.state

    @property
    def criticality(self) -> Criticality:
        """Direction of the branch of limit cycles at visible amplitudes."""
        low, high = self.branch_speeds
        if abs(high - low) < _NEUTRAL * self.speed:
            return "neutral"
        return "supercritical" if high > low else "subcritical"

    @property
    def normal_form_criticality(self) -> Literal["supercritical", "subcritical"] | None:
        """Kind by the first Lyapunov coefficient, for small amplitudes; None without it."""
        if self.lyapunov_coefficient is None:
            return None
        return "supercritical" if self.lyapunov_coefficient < 0.0 else "subcritical"

    def summary(self) -> dict[str, Any]:
        """Return everything but the mode as plain numbers and strings, ready for JSON."""
        return {
            **self.critical.summary(),
            "criticality": self.criticality,
            "branch_amplitudes": list(self.branch_amplitudes),
            "branch_speeds": list(self.branch_speeds),
            "lyapunov_coefficient": self.lyapunov_coefficient,
            "normal_form_criticality": self.normal_form_criticality,
            "amplitude_range": self.amplitude_range,
        }

    def __str__(self) -> str:
        small, large = (1e3 * a for a in self.branch_amplitudes)
        text = f"{self.critical}; {self.criticality} from {small:.2g} to {large:.2g} mm"
        if self.amplitude_range is None:
            return f"{text}; no first Lyapunov coefficient"
        return (
            f"{text}; first Lyapunov coefficient {self.lyapunov_coefficient:.4g} up to "
            f"{1e3 * self.amplitude_range:.2g} mm"
        )

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the critical mode: magnitude and phase of every displacement."""
        return self.critical.plot(ax)


HopfAnalysis = Callable[[Model, CriticalSpeed], HopfPoint]

_hopf_analysis: HopfAnalysis | None = None


def analyse_hopf_points_by(analysis: HopfAnalysis) -> HopfAnalysis:
    """Set the function that computes :attr:`CriticalSpeed.hopf`.

    It follows limit cycles, which are a layer above this module; so it is passed down, not imported.
    """
    global _hopf_analysis  # noqa: PLW0603 - one for the process
    _hopf_analysis = analysis
    return analysis
