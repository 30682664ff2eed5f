"""The resolution of the report's computations."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """Sizes of the long computations; all others are the same in every report.

    Attributes
    ----------
    diagram_speeds : int
        Number of speeds of each simulated bifurcation diagram.
    diagram_duration : float
        Time simulated at each of them, s.
    branch_points : int
        Largest number of limit cycles of a branch.
    branch_step : float
        Longest step along it, in units of arclength.
    chart_points : int
        Number of values of the parameter in a map of hunting.
    """

    diagram_speeds: int
    diagram_duration: float
    branch_points: int
    branch_step: float
    chart_points: int


FULL = Settings(
    diagram_speeds=86, diagram_duration=20.0, branch_points=300, branch_step=0.12, chart_points=15
)
QUICK = Settings(
    diagram_speeds=18, diagram_duration=12.0, branch_points=60, branch_step=0.4, chart_points=4
)
