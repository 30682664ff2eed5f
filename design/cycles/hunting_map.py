"""Where a vehicle never hunts, may hunt, and must hunt: speed against a second parameter.

Above the Hopf point the running equilibrium is unstable, and the vehicle must hunt. Below the fold
of limit
cycles there is no hunting, however large the disturbance. Between them it depends on the disturbance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.branch import cycle_branch
from design.cycles.continuation import CycleContinuation
from design.cycles.cycle import Cycle, CycleBranch, CycleError, SpecialPoint
from design.cycles.places import Place
from design.cycles.shooting import Setting
from design.progress import tracked
from design.stability.critical_speed import SPEED_RANGE, critical_speed
from design.stability.loss import CriticalSpeed
from railenv import checks
from railenv.errors import EquilibriumError, ParameterError
from railenv.models import Model

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_FOLLOWED = 40  # points to a neighbouring fold
_LONGEST_STEP = 0.12
_OFF = (0.01, 0.03, 0.08)  # of the speed, from a fold to the stable motion beside it, tried in turn


@dataclass(frozen=True)
class HuntingMap:
    """Hopf points and folds of limit cycles over a second parameter.

    Attributes
    ----------
    model_name : str
    parameter : str
        "radius", "cant" or a parameter of the model.
    value : ndarray, shape (n,)
        Values of it that were computed.
    hopf : tuple of CriticalSpeed
        Where steady running ends, for each value.
    folds : tuple of (SpecialPoint or None)
        The lowest fold of limit cycles, for each value.
    notes : tuple of str
        Why there is no fold, for each value; empty where there is one.
    ended : str or None
        Why not all values were computed.
    """

    model_name: str
    parameter: str
    value: Array
    hopf: tuple[CriticalSpeed, ...]
    folds: tuple[SpecialPoint | None, ...]
    notes: tuple[str, ...]
    ended: str | None

    @property
    def hopf_speed(self) -> Array:
        """Speed (m/s) above which the vehicle must hunt; NaN where steady running ends otherwise."""
        return np.array([h.speed if h.loss == "hunting" else math.nan for h in self.hopf], dtype=float)

    @property
    def fold_speed(self) -> Array:
        """Speed (m/s) below which it never hunts; NaN where there is no fold."""
        return np.array([math.nan if f is None else f.value for f in self.folds])

    def summary(self) -> dict[str, Any]:
        """Return the map as plain numbers and strings, ready for JSON."""

        def plain(speeds: Array) -> list[float | None]:
            return [None if math.isnan(v) else v for v in speeds.tolist()]

        return {
            "model": self.model_name,
            "parameter": self.parameter,
            "value": [None if math.isinf(v) else v for v in self.value.tolist()],
            "hopf_speed": plain(self.hopf_speed),
            "fold_speed": plain(self.fold_speed),
            "notes": list(self.notes),
            "ended": self.ended,
        }

    def plot(self, ax: Axes | None = None) -> control.ControlPlot:
        """Draw the three regions in the plane of parameter and speed."""
        from design.cycles.hunting_map_plots import plot_map

        return plot_map(self, ax)


def hunting_map(
    model: Model,
    parameter: str,
    values: ArrayLike,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    speed_range: tuple[float, float] = SPEED_RANGE,
    progress: bool = False,
) -> HuntingMap:
    """Follow the Hopf point and the fold of limit cycles over a second parameter.

    The first fold is found along the whole branch. From one value to the next the stable motion
    beside it is
    corrected and followed down to its fold again; where that fails the branch is computed anew.

    Parameters
    ----------
    model : Model
    parameter : str
        "radius", "cant" or a parameter of the model, such as "conicity", or a gain in equations of
        your own.
    values : array_like
        Its values, in an order without jumps.
    radius, cant : float
        Curve radius (m; ``math.inf`` is tangent track) and cant (rad), held unless they are the
        parameter.
    speed_range : (float, float)
        Lowest and highest speed, m/s.
    progress : bool
        Show a progress bar. An interrupt (Ctrl-C) returns the values that were completed.

    Returns
    -------
    HuntingMap

    Raises
    ------
    EquilibriumError
        If there is no running equilibrium at the lowest speed.
    """
    checks.known("parameter", [parameter], ["radius", "cant", *model.parameters])
    wanted = np.atleast_1d(np.asarray(values, dtype=float)).tolist()
    rows: list[tuple[CriticalSpeed, SpecialPoint | None, str]] = []
    ended: str | None = None
    beside: Cycle | None = None
    try:
        for value in tracked(wanted, f"stability map, {model.name}", progress):
            place = Place(model, radius, cant).replace(**{parameter: value})
            hopf = critical_speed(
                place.model, radius=place.radius, cant=place.cant, speed_range=speed_range
            )
            fold, beside, note = _fold(place, hopf, beside, speed_range)
            rows.append((hopf, fold, note))
    except KeyboardInterrupt:
        ended = f"interrupted after {len(rows)} of {len(wanted)} values"
    return HuntingMap(
        model_name=model.name,
        parameter=parameter,
        value=np.array(wanted[: len(rows)]),
        hopf=tuple(hopf for hopf, _, _ in rows),
        folds=tuple(fold for _, fold, _ in rows),
        notes=tuple(note for _, _, note in rows),
        ended=ended,
    )


def _fold(
    place: Place, hopf: CriticalSpeed, beside: Cycle | None, speed_range: tuple[float, float]
) -> tuple[SpecialPoint | None, Cycle | None, str]:
    """Return the fold, a stable motion beside it, and why there is none."""
    if beside is not None:
        followed = _followed(place, beside, speed_range)
        if followed is not None:
            return followed[0], followed[1], ""
    if hopf.loss != "hunting":
        return None, None, f"no Hopf point: {hopf}"
    try:
        branch = cycle_branch(place.model, start=hopf)
    except (CycleError, EquilibriumError) as error:
        return None, None, str(error)
    lowest = branch.nonlinear_critical_speed
    if lowest is None:
        return None, None, f"the branch has no fold; {branch.ended}"
    fold = next((f for f in branch.folds if f.value == lowest), None)
    if fold is None:
        return None, None, "hunting begins gently, at a lower speed than that of any fold"
    return fold, _beside(branch, fold), ""


def _followed(
    place: Place, beside: Cycle, speed_range: tuple[float, float]
) -> tuple[SpecialPoint, Cycle] | None:
    curvature = checks.curvature(place.radius)
    u = np.zeros(place.model.n_inputs)
    setting = Setting(place.model, "speed", beside.speed, curvature, place.cant, u)
    try:
        run = CycleContinuation.from_cycle(setting, beside, -1, speed_range, _LONGEST_STEP, None)
    except (CycleError, ParameterError):
        return None
    while len(run.cycles) < _FOLLOWED and not run.special:
        before = len(run.cycles)
        branch = run.run(before + 1, progress=False)
        if len(run.cycles) == before:
            return None
    folds = [s for s in run.special if s.kind == "fold"]
    if not folds or not run.cycles[0].stable:
        return None
    return folds[0], _beside(branch, folds[0]) or run.cycles[0]


def _beside(branch: CycleBranch, fold: SpecialPoint) -> Cycle | None:
    """Return a stable motion a little above a fold."""
    for off in _OFF:
        near = [
            c
            for c in branch.cycles
            if c.stable and fold.value * (1.0 + off / 2.0) < c.value < fold.value * (1.0 + 2.0 * off)
        ]
        if near:
            return near[0]
    return None
