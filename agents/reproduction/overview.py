"""An overview of the package on one coach, with which the report begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

import agents
from agents.reproduction import computations
from agents.reproduction.computations import CASE, SPEED_RANGE
from agents.reproduction.words import PASSIVE
from design.cycles.cycle import CycleBranch
from design.reproduction import DataTable, Drawing, Piece, Section, Settings, pieces
from design.reproduction.document import fragment
from design.reproduction.drawing import INK, legend_below, panel, retitle, take_handles
from design.reproduction.section import Data
from design.style import NEUTRAL, SERIES

_CODE = ("agents/controllers/*.py",)
_COLORS = {"sensors": SERIES[0], "state": SERIES[1]}
_READS = {"sensors": "from what a train can measure", "state": "from the full state"}

HEADINGS = ("controller", "reads", "hunts from", "at")
"""Headings of the table of controllers."""

CAPTION = "Linear critical speeds of the sampled closed loops, tangent track."


@dataclass(frozen=True)
class Controlled:
    """A controller and the end of steady running under it.

    Attributes
    ----------
    name : str
    reads : {"sensors", "state"}
    speed, frequency : float or None
        Linear critical speed (m/s) and frequency there (Hz); None if it is stable at all speeds tried.
    """

    name: str
    reads: str
    speed: float | None
    frequency: float | None

    @property
    def reached(self) -> float:
        """Critical speed (m/s), or the highest speed tried."""
        return SPEED_RANGE[1] if self.speed is None else self.speed


class Overview(Section):
    """Critical speed, bifurcation diagram and controllers of the shipped coach.

    Parameters
    ----------
    settings : Settings
        Settings, for the resolution of the limit cycles.
    """

    key = "overview"
    title = "What railenv can do: one coach, from its critical speed to a controller"

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._shipped = {name: agents.shipped(name) for name in agents.shipped_names()}

    def pieces(self) -> tuple[Piece, ...]:
        """Return the limit cycles, and the critical speed with each controller."""
        return (self._branch(), *(self._critical(name) for name in self._shipped))

    def _branch(self) -> Piece:
        return pieces.branch(CASE, math.inf, self._settings)

    def _critical(self, name: str) -> Piece:
        inputs = {
            "model": CASE.model,
            "name": name,
            "controller": computations.plain(self._shipped[name]),
        }
        label = f"critical speed, {name}"
        return Piece(f"overview-critical-{name}", computations.critical, inputs, label, _CODE)

    def branch(self, data: Data) -> CycleBranch:
        """Return the limit cycles of the coach alone."""
        found: CycleBranch = data[self._branch().name]["branch"]
        return found

    def controlled(self, data: Data) -> list[Controlled]:
        """Return the controllers with their results: the coach alone, then the best first."""
        found = [
            Controlled(name, controller.observation, **data[self._critical(name).name])
            for name, controller in self._shipped.items()
        ]
        return sorted(found, key=lambda each: (each.name != PASSIVE, -each.reached))

    def sentences(self, data: Data) -> list[str]:
        """Return the results of the coach alone, and of its controllers."""
        branch, found = self.branch(data), self.controlled(data)
        low, hopf = branch.nonlinear_critical_speed, branch.hopf
        assert low is not None
        assert hopf is not None
        high = hopf.speed
        assert high is not None
        between = (low + high) / 2.0
        size = survived(branch, between)
        best = max((c for c in found if c.reads == "sensors"), key=lambda c: c.reached)
        return [
            f"The coach's bogie hunts from {high:.1f} m/s at {hopf.frequency:.2f} Hz. That is "
            "the linear critical speed: the answer of the eigenvalues.",
            f"Hunting persists down to {low:.1f} m/s, the fold of the limit cycles. In between it "
            f"depends on the disturbance: at {between:.0f} m/s one of {1e3 * size:.1f} mm or more "
            "grows into hunting, a smaller one dies out. That is the unstable limit cycle, on which no "
            "simulation settles.",
            f"With a yaw actuator of {1e-3 * agents.equipped(CASE.model).actuator.limit:g} kN m, a "
            "delay and a sampled controller that reads only what a train can measure, it hunts from "
            f"{_speed(best)} ({best.name}). These are linear answers on nominal wheels; large "
            "disturbances, curves and the wheels and rails of service leave less of them, which is "
            "what controllers are ranked by (railenv evaluate --leaderboard).",
        ]

    def rows(self, data: Data) -> list[tuple[str, ...]]:
        """Return the table of controllers."""
        return [
            (each.name, each.reads, _speed(each), _frequency(each)) for each in self.controlled(data)
        ]

    def text(self, data: Data) -> Markup:
        """Return the sentences and the table."""
        return fragment(
            "table.html",
            paragraphs=self.sentences(data),
            caption=f"{CAPTION} “>”: stable up to the highest speed tried.",
            header=HEADINGS,
            rows=self.rows(data),
            words=2,
        )

    def draw(self, data: Data) -> tuple[Drawing, ...]:
        """Draw the bifurcation diagram, and the Hopf point with each controller."""
        return (
            Drawing("overview_branch", _diagram(self.branch(data)), _BRANCH, _GROUP),
            Drawing("overview_controllers", _bars(self.controlled(data)), _CONTROLLERS, _GROUP),
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the critical speeds."""
        header = ("controller", "reads", "critical_speed_m_per_s", "frequency_hz")
        rows = [(each.name, each.reads, each.speed, each.frequency) for each in self.controlled(data)]
        return (DataTable("overview", header, rows),)


_GROUP = "From the eigenvalues to a controller"
_BRANCH = (
    f"{CASE.title}, tangent track: amplitudes of all limit cycles, the unstable ones dashed. Below the "
    "fold nothing hunts; between fold and Hopf point the dashed line is the disturbance that steady "
    "running survives."
)
_CONTROLLERS = "Speed from which the coach hunts, alone and with each shipped controller."


def survived(branch: CycleBranch, speed: float) -> float:
    """Return the amplitude (m) of the smallest unstable limit cycle at a speed, by interpolation.

    Raises
    ------
    ValueError
        If the branch has none there.
    """
    size, at, unstable = branch.amplitude["y_w1"], branch.speed, ~branch.stable
    found = [
        size[i] + (size[i + 1] - size[i]) * (speed - at[i]) / (at[i + 1] - at[i])
        for i in range(len(at) - 1)
        if unstable[i] and unstable[i + 1] and min(at[i], at[i + 1]) <= speed <= max(at[i], at[i + 1])
    ]
    if not found:
        raise ValueError(f"the branch has no unstable limit cycle at {speed:g} m/s")
    return float(min(found))


def _diagram(branch: CycleBranch) -> Figure:
    figure, ax = panel("", 4.4)
    branch.plot("y_w1", ax=ax)
    retitle(ax, f"{CASE.vehicle.name}, tangent track")
    legend_below(figure, take_handles(ax))
    return figure


def _bars(found: Sequence[Controlled]) -> Figure:
    figure, ax = panel("", 4.4)
    places = np.arange(len(found))[::-1]
    for place, each in zip(places, found, strict=True):
        color = NEUTRAL if each.name == PASSIVE else _COLORS[each.reads]
        ax.barh(place, each.reached, color=color, height=0.66)
        ax.text(each.reached + 5.0, place, _speed(each), va="center", fontsize=9, color=INK)
    ax.axvline(found[0].reached, color=INK, lw=1.0, ls=":")
    ax.set_yticks(places, [each.name for each in found])
    ax.tick_params(axis="y", length=0)
    ax.grid(visible=False, axis="y")
    ax.set_xlim(0.0, 1.25 * SPEED_RANGE[1])
    ax.set_xlabel("linear critical speed (m/s)")
    retitle(ax, "with a yaw actuator of the bogie")
    handles = [ax.barh(0.0, 0.0, color=_COLORS[reads], label=text) for reads, text in _READS.items()]
    legend_below(figure, handles)
    return figure


def _speed(each: Controlled) -> str:
    return f"> {SPEED_RANGE[1]:g} m/s" if each.speed is None else f"{each.speed:.1f} m/s"


def _frequency(each: Controlled) -> str:
    return "" if each.frequency is None else f"{each.frequency:.2f} Hz"
