"""Bifurcation diagrams of Poincare sections: the kinds of motion over a parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.shooting import CONDITIONS, Setting
from design.irregular.lyapunov import LyapunovExponents, lyapunov_exponents
from design.irregular.motion import Motion, setting_of, start_of
from design.irregular.section import At, PoincareSection, SectionSurface, passages, section_of
from design.progress import tracked
from railenv import checks
from railenv.errors import EquilibriumError, ParameterError, SimulationError
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Sweep = Literal["up", "down", "apart"]

_SWEEPS = ("up", "down", "apart")
_NUDGE = 1e-3  # of the model's scale, in every state, to leave motions that are no longer stable


@dataclass(frozen=True)
class SectionPoint:
    """The motion at one value of the parameter.

    Attributes
    ----------
    sweep : {"up", "down", "apart"}
        Start of the motion: the motion at the value below or above, or the common start.
    value : float
        Value of the parameter.
    section : PoincareSection
    lyapunov : LyapunovExponents or None
        The exponents, if requested.
    """

    sweep: Sweep
    value: float
    section: PoincareSection
    lyapunov: LyapunovExponents | None

    @property
    def kind(self) -> str:
        """Kind of motion by its section and, if known, by its exponents.

        "at rest", or "period k" for a motion that returns after k points of the section; otherwise the
        kind by the exponents, or "does not come back" without them.
        """
        if self.lyapunov is None or not self.section.moves or self.section.period is not None:
            return self.section.kind
        return self.lyapunov.kind

    def __str__(self) -> str:
        text = f"{self.value:g}, {self.sweep}: {self.kind}"
        if self.lyapunov is None:
            return text
        return (
            f"{text}, largest exponent {self.lyapunov.largest:.3g} ± {self.lyapunov.error[0]:.1g} 1/s"
        )


@dataclass(frozen=True)
class SectionDiagram:
    """The sections of a motion over a parameter.

    Attributes
    ----------
    model_name : str
    parameter : str
        The parameter that varies.
    section : SectionSurface
        The surface.
    points : tuple of SectionPoint
        Points in the order in which they were computed.
    ended : tuple of str
        Reasons why there are fewer than requested: for each sweep that ended early, and after an
        interrupt.
    """

    model_name: str
    parameter: str
    section: SectionSurface
    points: tuple[SectionPoint, ...]
    ended: tuple[str, ...]

    def of(self, sweep: Sweep) -> tuple[SectionPoint, ...]:
        """Return the points of one sweep, by increasing value."""
        checks.choice("sweep", sweep, _SWEEPS)
        return tuple(sorted((p for p in self.points if p.sweep == sweep), key=lambda p: p.value))

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        """The sweeps, in the order in which they were computed."""
        return tuple(dict.fromkeys(p.sweep for p in self.points))

    def ranges(self, sweep: Sweep) -> tuple[tuple[str, float, float], ...]:
        """Return the kinds of motion of a sweep, each with its first and last value in turn."""
        found: list[tuple[str, float, float]] = []
        for point in self.of(sweep):
            if found and found[-1][0] == point.kind:
                found[-1] = (point.kind, found[-1][1], point.value)
            else:
                found.append((point.kind, point.value, point.value))
        return tuple(found)

    def summary(self) -> dict[str, Any]:
        """Return the diagram as plain numbers and strings, ready for JSON."""
        return {
            "model": self.model_name,
            "parameter": self.parameter,
            "section": str(self.section),
            "points": [
                {
                    "sweep": p.sweep,
                    "value": p.value,
                    "kind": p.kind,
                    "values": p.section.values().tolist(),
                    "exponents": None if p.lyapunov is None else p.lyapunov.exponents.tolist(),
                    "error": None if p.lyapunov is None else p.lyapunov.error.tolist(),
                }
                for p in self.points
            ],
            "ended": list(self.ended),
        }

    def __str__(self) -> str:
        lines = [f"{self.section} over {self.parameter}, {self.model_name}"]
        for sweep in self.sweeps:
            ranges = (f"{kind} {low:g} to {high:g}" for kind, low, high in self.ranges(sweep))
            lines.append(f"{sweep}: {'; '.join(ranges)}")
        return "\n".join([*lines, *self.ended])

    def plot(self, state: str | None = None, ax: Axes | None = None) -> control.ControlPlot:
        """Draw a state (by default that of the section) at the points over the parameter.

        In a new figure the largest exponent is drawn beneath, if it was computed.
        """
        from design.irregular.irregular_plots import plot_section_diagram

        return plot_section_diagram(self, state, ax)


@dataclass(frozen=True)
class _Plan:
    """The plan of the computations at each value."""

    setting: Setting
    section: SectionSurface
    duration: float
    settle: float
    step: float | None
    count: int
    exponents_over: float

    def at(self, value: float) -> Setting:
        """Return the running conditions at a value of the parameter."""
        whole = self.setting
        model = whole.model_at(value)
        speed, curvature, cant = whole.conditions(value)
        radius = 1.0 / curvature if curvature else math.inf
        return setting_of(model, speed, radius, cant, whole.inputs)

    def point(self, sweep: Sweep, value: float, start: Array) -> SectionPoint:
        """Return the motion at a value, started from a state."""
        here = self.at(value)
        motion = Motion(here, start, self.step)
        motion.settle(self.settle)
        section = passages(motion, self.section, self.duration)
        if not self.count or not section.moves:
            return SectionPoint(sweep, value, section, None)
        found = lyapunov_exponents(
            here.model,
            speed=here.speed,
            radius=1.0 / here.curvature if here.curvature else math.inf,
            cant=here.cant,
            inputs=here.inputs,
            count=self.count,
            duration=self.exponents_over,
            settle=0.1 * self.exponents_over,
            initial_state=section.end,
            step=motion.step,
        )
        return SectionPoint(sweep, value, section, found)


def section_diagram(
    model: Model,
    values: ArrayLike,
    *,
    parameter: str = "speed",
    speed: float | None = None,
    radius: float = math.inf,
    cant: float = 0.0,
    inputs: ArrayLike | None = None,
    state: str | None = None,
    at: At = "maximum",
    direction: Literal["up", "down"] = "up",
    sweeps: Sequence[Sweep] = ("up", "down"),
    duration: float = 30.0,
    settle: float = 30.0,
    initial_state: ArrayLike | None = None,
    perturbation: Mapping[str, float] | None = None,
    step: float | None = None,
    exponents: int = 0,
    exponents_over: float = 100.0,
    progress: bool = False,
) -> SectionDiagram:
    """Compute the bifurcation diagram of a Poincare section over speed or another parameter.

    Parameters
    ----------
    model : Model
    values : array_like
        Increasing values of the parameter; speeds in m/s.
    parameter : str
        "speed", "curvature" (1/m), "cant" (rad) or a parameter of the model.
    speed : float, optional
        Speed, m/s; required if another parameter varies.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track) and cant (rad).
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs; zero when left out.
    state, at, direction
        The surface, as in :func:`design.poincare_section`.
    sweeps : sequence of {"up", "down", "apart"}
        "up" and "down" start each value from the motion at the previous one, which shows where several
        motions are stable; a small disturbance is added at each. "apart" starts each value anew.
    duration, settle : float
        Time recorded at each value, and time before that to settle, s.
    initial_state, perturbation : optional
        As in :func:`design.lyapunov_exponents`, for the first value of a sweep, or for each.
    step : float, optional
        As in that function.
    exponents : int
        Number of Lyapunov exponents to compute at each value as well.
    exponents_over : float
        Time over which these are averaged, s.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns the results so far.

    Raises
    ------
    ParameterError, UnknownNameError
        If an argument is not allowed.
    EquilibriumError
        If there is no running equilibrium to start the first sweep from (then give ``initial_state``).
    """
    given = _values(values)
    plan = _Plan(
        _whole(model, parameter, (speed, radius, cant), inputs, given),
        section_of(model, state, at, direction),
        checks.number("duration", duration, low=0.0, open_low=True, unit="s"),
        checks.number("settle", settle, low=0.0, unit="s"),
        None if step is None else checks.number("step", step, low=0.0, open_low=True, unit="s"),
        checks.whole("exponents", exponents, low=0),
        checks.number("exponents_over", exponents_over, low=0.0, open_low=True, unit="s"),
    )
    _check_sweeps(sweeps)
    run = _Run(plan, [float(v) for v in given], initial_state, perturbation)
    work = [(sweep, v) for sweep in sweeps for v in run.way(sweep)]
    try:
        for sweep, value in tracked(work, f"section diagram, {model.name}", progress):
            run.go(sweep, value)
    except KeyboardInterrupt:
        if not run.points:
            raise
        run.ended.append(f"interrupted after {len(run.points)} of {len(work)} motions")
    return SectionDiagram(model.name, parameter, plan.section, tuple(run.points), tuple(run.ended))


def _check_sweeps(sweeps: Sequence[Sweep]) -> None:
    if not sweeps:
        raise ParameterError("sweeps is empty; give at least one of 'up', 'down' and 'apart'")
    for sweep in sweeps:
        checks.choice("sweep", sweep, _SWEEPS)


class _Run:
    """The computation of a diagram, which carries motions from value to value."""

    def __init__(
        self,
        plan: _Plan,
        values: list[float],
        initial_state: ArrayLike | None,
        perturbation: Mapping[str, float] | None,
    ) -> None:
        self.values = values
        self.points: list[SectionPoint] = []
        self.ended: list[str] = []
        self._plan = plan
        self._start = initial_state, perturbation
        self._carried: Array | None = None
        # values at which a carried motion was lost on the way up, and on the way down
        self._highest, self._lowest = math.inf, -math.inf

    def way(self, sweep: Sweep) -> list[float]:
        """Return the values in the order of a sweep."""
        return self.values[::-1] if sweep == "down" else self.values

    def go(self, sweep: Sweep, value: float) -> None:
        """Compute the motion at the next value of a sweep, unless the sweep has ended."""
        apart = sweep == "apart"
        if not apart and not self._lowest < value < self._highest:
            return
        setting = self._plan.at(value)
        try:
            if apart or self._carried is None:
                start = start_of(setting, *self._start)
            else:
                start = self._carried + _NUDGE * setting.model.scale
            point = self._plan.point(sweep, value, start)
        except (SimulationError, EquilibriumError) as problem:
            if not self.points and not apart:
                raise
            self.ended.append(f"{sweep}: nothing at {value:g}; {problem}")
            if sweep == "up":
                self._highest = value
            elif sweep == "down":
                self._lowest = value
            return
        self.points.append(point)
        if not apart:
            self._carried = point.section.end if point.lyapunov is None else point.lyapunov.end


def _values(values: ArrayLike) -> Array:
    """Return increasing values of a parameter."""
    given = checks.numbers("values", values)
    if not (np.isfinite(given).all() and (np.diff(given) > 0.0).all()):
        raise ParameterError("values must be finite and increase")
    return given


def _whole(
    model: Model,
    parameter: str,
    place: tuple[float | None, float, float],
    inputs: ArrayLike | None,
    values: Array,
) -> Setting:
    """Return the running conditions with the varying parameter."""
    speed, radius, cant = place
    checks.known("parameter", [parameter], [*CONDITIONS, *model.parameters])
    if parameter == "speed":
        speed = float(values[0]) if speed is None else speed
    elif speed is None:
        raise ParameterError(f"speed is None; it must be given where {parameter} varies")
    held = setting_of(model, speed, radius, cant, inputs)
    return Setting(model, parameter, held.speed, held.curvature, held.cant, held.inputs)
