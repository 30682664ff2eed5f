"""Maps of where a vehicle never, may, or must hunt: speed against a second parameter.

Above the Hopf point the running equilibrium is unstable, and the vehicle must hunt. Below the nonlinear
critical speed, most often a fold of limit cycles, there is no hunting, however large the disturbance.
Between them it depends on the disturbance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.branch import cycle_branch
from design.cycles.continuation import CycleContinuation
from design.cycles.cycle import Cycle, CycleBranch, CycleError
from design.cycles.onset import HuntingOnset
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

_FOLLOWED = 40  # points from the stable motion of the previous value
_LONGEST_STEP = 0.12
_OFF = (0.01, 0.03, 0.08)  # of the speed, from the onset to the stable motion above it, tried in turn


@dataclass(frozen=True)
class HuntingMap:
    """Hopf points and nonlinear critical speeds over a second parameter.

    Attributes
    ----------
    model_name : str
    parameter : str
        "radius", "cant" or a parameter of the model.
    value : ndarray, shape (n,)
        Its computed values.
    hopf : tuple of CriticalSpeed
        End of steady running, for each value.
    onsets : tuple of (HuntingOnset or None)
        The lowest speed at which hunting can persist, with its evidence, for each value.
    notes : tuple of str
        Reason why there is no onset, for each value; empty if there is one.
    ended : str or None
        Reason why not all values were computed.
    """

    model_name: str
    parameter: str
    value: Array
    hopf: tuple[CriticalSpeed, ...]
    onsets: tuple[HuntingOnset | None, ...]
    notes: tuple[str, ...]
    ended: str | None

    @property
    def hopf_speed(self) -> Array:
        """Speed (m/s) above which the vehicle must hunt; NaN if steady running ends otherwise."""
        return np.array([h.speed if h.loss == "hunting" else math.nan for h in self.hopf], dtype=float)

    @property
    def onset_speed(self) -> Array:
        """Nonlinear critical speed (m/s), below which it never hunts; NaN if none was found."""
        return np.array([math.nan if o is None else o.value for o in self.onsets])

    def summary(self) -> dict[str, Any]:
        """Return the map as plain numbers and strings, ready for JSON."""

        def plain(speeds: Array) -> list[float | None]:
            return [None if math.isnan(v) else v for v in speeds.tolist()]

        return {
            "model": self.model_name,
            "parameter": self.parameter,
            "value": [None if math.isinf(v) else v for v in self.value.tolist()],
            "hopf_speed": plain(self.hopf_speed),
            "onset_speed": plain(self.onset_speed),
            "rests_on": [None if o is None else o.rests_on for o in self.onsets],
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
    """Find the Hopf point and the nonlinear critical speed over a second parameter.

    At each value the whole branch from the Hopf point is followed, and the stable motion of the
    previous value is corrected and followed down, because its branch may no longer be connected to a
    Hopf point. The lower of the two counts.

    Parameters
    ----------
    model : Model
    parameter : str
        "radius", "cant" or a parameter of the model, such as "conicity", or a gain in equations of
        your own.
    values : array_like
        Its values, ordered without jumps.
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
    rows: list[tuple[CriticalSpeed, HuntingOnset | None, str]] = []
    ended: str | None = None
    beside: Cycle | None = None
    try:
        for value in tracked(wanted, f"stability map, {model.name}", progress):
            place = Place(model, radius, cant).replace(**{parameter: value})
            hopf = critical_speed(
                place.model, radius=place.radius, cant=place.cant, speed_range=speed_range
            )
            onset, beside, note = _onset(place, hopf, beside, speed_range)
            rows.append((hopf, onset, note))
    except KeyboardInterrupt:
        ended = f"interrupted after {len(rows)} of {len(wanted)} values"
    return HuntingMap(
        model_name=model.name,
        parameter=parameter,
        value=np.array(wanted[: len(rows)]),
        hopf=tuple(hopf for hopf, _, _ in rows),
        onsets=tuple(onset for _, onset, _ in rows),
        notes=tuple(note for _, _, note in rows),
        ended=ended,
    )


def _onset(
    place: Place, hopf: CriticalSpeed, beside: Cycle | None, speed_range: tuple[float, float]
) -> tuple[HuntingOnset | None, Cycle | None, str]:
    """Return the onset of hunting, a stable motion a little above it, and the reason if none."""
    branches, note = [], f"no Hopf point: {hopf}"
    if hopf.loss == "hunting":
        try:
            branches.append(cycle_branch(place.model, start=hopf))
            note = f"no stable motion; {branches[0].ended}"
        except (CycleError, EquilibriumError) as error:
            note = str(error)
    followed = None if beside is None else _followed(place, beside, speed_range)
    if followed is not None:
        branches.append(followed)
    found = [(b.onset, b) for b in branches]
    hunting = [(onset, b) for onset, b in found if onset is not None]
    if not hunting:
        return None, None, note
    onset, branch = min(hunting, key=lambda pair: pair[0].value)
    return onset, _beside(branch, onset.value), ""


def _followed(place: Place, beside: Cycle, speed_range: tuple[float, float]) -> CycleBranch | None:
    """Return the branch down from the motion found last, up to its first special point."""
    curvature = checks.curvature(place.radius)
    u = np.zeros(place.model.n_inputs)
    setting = Setting(place.model, "speed", beside.speed, curvature, place.cant, u)
    try:
        run = CycleContinuation.from_cycle(setting, beside, -1, speed_range, _LONGEST_STEP, None)
    except (CycleError, ParameterError):
        return None
    branch = run.run(2, progress=False)
    while len(run.cycles) < _FOLLOWED and run.ending is None and not run.special:
        branch = run.run(len(run.cycles) + 1, progress=False)
    return branch


def _beside(branch: CycleBranch, onset: float) -> Cycle | None:
    """Return a stable motion a little above the onset."""
    for off in _OFF:
        near = [
            c
            for c in branch.cycles
            if c.stable and onset * (1.0 + off / 2.0) < c.value < onset * (1.0 + 2.0 * off)
        ]
        if near:
            return near[0]
    return None
