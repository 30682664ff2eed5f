"""Nonlinear critical speeds of random vehicles against simulation from large disturbances.

Of each vehicle the whole bifurcation diagram is computed, and it is simulated from disturbances of
several kinds and sizes a little below and above the speed from which it says that hunting can persist.
A motion that persists below is the error that safety cannot bear; none that persists above means that
the speed is too low, or that the disturbances miss it: two of them are the hunting motion itself, as
it is and made larger.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import design
import railenv
from design.cycles.survivors import Survivor, large_disturbances, survivors
from railenv.threads import usable_threads

VEHICLES = 500
"""Random vehicles, a fifth of them of each kind of contact."""

OFF = 0.02
"""Of the speed, below and above which is simulated."""

_RANGE = (5.0, 200.0)  # m/s
_CONICITY = (0.02, 0.5)
_FACTOR = 3.0  # of the suspension of the coach
_LARGER = (1.0, 1.1)  # than the hunting motion next to the speed
_SIZES = (0.25, 0.5, 1.0)  # of the usual large disturbances
_SUSPENSION = (
    "primary_longitudinal_stiffness",
    "primary_lateral_stiffness",
    "primary_vertical_stiffness",
    "primary_vertical_damping",
    "secondary_longitudinal_stiffness",
    "secondary_lateral_stiffness",
    "secondary_vertical_stiffness",
    "secondary_lateral_damping",
    "secondary_vertical_damping",
)
AGREE = ("agrees", "no hunting")
KINDS = ("cone", "linear profile", "hollow tread", "arcs", "profiles, new to worn")


@dataclass(frozen=True)
class Judged:
    """A vehicle, what is computed of it and what simulations say.

    Attributes
    ----------
    number : int
        Of the vehicle, which draws it again.
    kind : str
    linear, nonlinear : float or None
        Critical speeds, m/s.
    rests_on : str or None
    below, above : int
        Disturbances after which it hunts on below and above the nonlinear critical speed.
    """

    number: int
    kind: str
    linear: float | None
    nonlinear: float | None
    rests_on: str | None
    below: int
    above: int

    @property
    def outcome(self) -> str:
        """What is counted."""
        if self.nonlinear is None:
            return "hunts where none was found" if self.above else "no hunting"
        if self.below:
            return "hunts below"
        return "agrees" if self.above else "does not hunt above"


def vehicle(number: int) -> tuple[str, railenv.Vehicle]:
    """Draw a vehicle; the kind of its contact goes round."""
    rng = np.random.default_rng(number)
    kind = KINDS[number % len(KINDS)]
    conicity = float(np.exp(rng.uniform(*np.log(_CONICITY))))
    base = railenv.HIGH_SPEED_COACH
    factors = _FACTOR ** rng.uniform(-1.0, 1.0, len(_SUSPENSION))
    changes: dict[str, Any] = {
        name: float(getattr(base, name) * factor)
        for name, factor in zip(_SUSPENSION, factors, strict=True)
    }
    return kind, base.replace(contact=_contact(kind, conicity, rng), **changes)


def _contact(kind: str, conicity: float, rng: np.random.Generator) -> Any:
    angle = min(conicity, float(rng.uniform(0.02, 0.06)))
    if kind == "cone":
        return railenv.Cone(conicity)
    if kind == "linear profile":
        return railenv.LinearProfile(conicity, angle, float(rng.uniform(0.0, 20.0)))
    if kind == "hollow tread":
        return railenv.HollowTread(conicity, angle, 0.3)
    if kind == "arcs":
        rail, straight = 0.3, angle >= conicity
        wheel = 1e3 if straight else rail * conicity / (conicity - angle)
        return railenv.ArcProfile(angle, wheel, rail)
    new, worn = railenv.HIGH_SPEED_COACH_S1002, railenv.HIGH_SPEED_COACH_S1002_WORN
    return railenv.ProfileFamily(new.contact, worn.contact, float(rng.uniform(0.0, 1.0)))


def judged(number: int) -> Judged:
    """Compute and simulate a vehicle."""
    kind, drawn = vehicle(number)
    model = railenv.Bogie(drawn)
    diagram = design.bifurcation_diagram(model, speed_range=_RANGE, depth=1)
    nonlinear = diagram.nonlinear_critical_speed
    linear = diagram.hopf[0].speed if diagram.hopf else None
    rests_on = None if diagram.onset is None else diagram.onset.rests_on
    if nonlinear is None:
        found = _hunting(model, np.linspace(*_RANGE, 9))
        return Judged(number, kind, linear, None, None, 0, len(found))
    below, above = (
        len(_hunting(model, np.array([speed]), _motions(diagram, speed)))
        for speed in (nonlinear * (1.0 - OFF), nonlinear * (1.0 + OFF))
    )
    return Judged(number, kind, linear, nonlinear, rests_on, below, above)


def _hunting(
    model: railenv.Bogie, speeds: NDArray[np.float64], more: Iterable[dict[str, float]] = ()
) -> tuple[Survivor, ...]:
    starts = [
        {name: size * value for name, value in start.items()}
        for start in large_disturbances(model)
        for size in _SIZES
    ]
    return survivors(model, speeds, starts=[*starts, *more])


def _motions(diagram: design.BifurcationDiagram, speed: float) -> Iterator[dict[str, float]]:
    """Yield the stable motions computed next to a speed, made larger, as disturbances."""
    names = diagram.model.state_names
    for branch in diagram.branches:
        stable = [c for c in branch.cycles if c.stable]
        if stable:
            nearest = min(stable, key=lambda c: abs(c.value - speed))
            away = nearest.states[0] - nearest.states[:-1].mean(axis=0)
            for larger in _LARGER:
                yield dict(zip(names, (larger * away).tolist(), strict=True))


def run(kind: str, count: int) -> dict[str, Any]:
    """Judge so many vehicles of one kind of contact; return how often each outcome came up.

    With it what each vehicle is that disagrees, and how far apart linear and nonlinear critical speeds
    are.
    """
    from joblib import Parallel, delayed

    numbers = range(KINDS.index(kind), count * len(KINDS), len(KINDS))
    found = Parallel(n_jobs=usable_threads())(delayed(judged)(number) for number in numbers)
    outcomes = Counter(j.outcome for j in found)
    below = [j.nonlinear / j.linear for j in found if j.nonlinear and j.linear]
    return {
        "outcomes": dict(sorted(outcomes.items())),
        "rests_on": dict(sorted(Counter(j.rests_on for j in found if j.rests_on).items())),
        "lowest_share": min(below, default=None),
        "middle_share": float(np.median(below)) if below else None,
        "disagreements": [asdict(j) for j in found if j.outcome not in AGREE],
    }
