"""The best passive damper of a problem, by search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

import design
from agents.problems.damper import PrimaryDamper
from agents.problems.problem import Damper, Problem

Array = NDArray[np.float64]

RATES = (2e4, 2.5e6)
"""Rates (N s/m) of existing yaw dampers; the stiffest is that of CRH380A."""

STIFFNESSES = (1e6, 1e7)
"""Stiffnesses of their ends, N/m."""

PRIMARY_RATES = (1e3, 1e5)
"""Rates (N s/m) of dampers at a wheelset; a stiffer one would lock it to the frame at rest."""

_GRID = 5
_EVALUATIONS = 24
_SAMPLES = 2  # for the robust critical speed, beside corners and middle


@dataclass(frozen=True)
class TunedDamper:
    """The result of the search.

    Attributes
    ----------
    damper : YawDamper or PrimaryDamper
    speed : float
        Robust critical speed, m/s.
    searched : tuple of (YawDamper or PrimaryDamper, float)
        All dampers tried, with their robust critical speeds.
    """

    damper: Damper
    speed: float
    searched: tuple[tuple[Damper, float], ...]


def robust_speed(problem: Problem, damper: Damper | None, samples: int = _SAMPLES) -> float:
    """Return the robust critical speed (m/s) with a passive damper; 0 if there is none."""
    found = design.robust_critical_speed(
        problem.passive(damper).plant,
        None,
        problem.ranges,
        samples=samples,
        speed_range=problem.speed_range,
    )
    return found.speed or 0.0


def tuned_damper(problem: Problem) -> TunedDamper:
    """Find the passive damper with the highest robust critical speed: a grid, then the simplex method.

    Parameters
    ----------
    problem : Problem
    """
    bounds = [PRIMARY_RATES] if isinstance(problem.damper, PrimaryDamper) else [RATES, STIFFNESSES]
    kind: type[Damper] = type(problem.damper)
    low, high = np.log(bounds).T
    searched: list[tuple[Damper, float]] = []

    def cost(x: Array) -> float:
        damper = kind(*np.exp(np.clip(x, low, high)).tolist())
        searched.append((damper, robust_speed(problem, damper)))
        return -searched[-1][1]

    grid = np.stack(np.meshgrid(*(np.linspace(a, b, _GRID) for a, b in zip(low, high, strict=True))))
    starts = grid.reshape(len(bounds), -1).T
    best = min(starts, key=cost)
    optimize.minimize(
        cost,
        best,
        method="Nelder-Mead",
        bounds=list(zip(low, high, strict=True)),
        options={"maxfev": _EVALUATIONS, "xatol": 0.02, "fatol": 0.05},
    )
    damper, speed = max(searched, key=lambda row: row[1])
    return TunedDamper(damper, speed, tuple(searched))
