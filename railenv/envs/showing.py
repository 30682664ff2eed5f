"""Scenes for a renderer: the present state and the last seconds of one environment of a fleet."""

from __future__ import annotations

import math
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from railenv.envs.fleet import Fleet
from railenv.model import Model
from railenv.mounting import frames
from railenv.vehicles.guided import Guided

if TYPE_CHECKING:
    from railenv.envs.rendering import History, Outline, Renderer, Scene

_SECONDS = 4.0

WINDOW_RATE = 50.0
"""Largest number of frames per second in a window."""


def film_rate(control_period: float) -> float:
    """Return the frames per second of a film with a frame for each control step, at true speed."""
    rate = 1.0 / control_period
    return round(rate) if math.isclose(rate, round(rate), rel_tol=1e-9) else rate


def steps_a_frame(control_period: float) -> int:
    """Return the control steps from one frame of a window to the next."""
    return max(1, round(1.0 / (WINDOW_RATE * control_period)))


class Past:
    """The last control steps of one environment, for the strip chart.

    Parameters
    ----------
    samples : int
        Number of steps that it holds.
    n_actuators, n_wheelsets : int
        Numbers of actions and of displacements in a step.
    """

    def __init__(self, samples: int, n_actuators: int, n_wheelsets: int) -> None:
        self._samples = samples
        self._n_actuators = n_actuators
        # Twice the room: the steps held are contiguous, and move to the front once in a while.
        self._rows = np.zeros((2 * samples, 1 + n_actuators + n_wheelsets))
        self._end = 0

    def clear(self) -> None:
        """Forget all steps."""
        self._end = 0

    def add(self, time: float, action: NDArray[np.float64], y: NDArray[np.float64]) -> None:
        """Add a step: its time (s), actions, and displacements of the wheelsets (m)."""
        if self._end == len(self._rows):
            self._rows[: self._samples] = self._rows[self._samples :]
            self._end = self._samples
        row = self._rows[self._end]
        row[0], row[1 : 1 + self._n_actuators], row[1 + self._n_actuators :] = time, action, y
        self._end += 1

    def history(self) -> History:
        """Return the steps held, oldest first."""
        from railenv.envs.rendering import History

        rows = self._rows[max(0, self._end - self._samples) : self._end]
        y = 1 + self._n_actuators
        return History(rows[:, 0], rows[:, y:], rows[:, 1:y])


class Recorder:
    """The strip chart and the frames of one environment.

    Without a render mode it does nothing.
    """

    def __init__(self, fleet: Fleet, render_mode: str | None, env: int = 0) -> None:
        self._fleet = fleet
        self._mode = render_mode
        self._env = env
        self._renderer: Renderer | None = None
        self._leading: tuple[Model, Guided] | None = None  # of the vehicle last drawn
        period = fleet.settings.control_period
        self._every = steps_a_frame(period)
        n = fleet.n_actuators, len(fleet.model.guided)
        self._past = None if render_mode is None else Past(max(2, round(_SECONDS / period)), *n)

    def restart(self) -> None:
        """Forget the past, at a reset."""
        if self._past is not None:
            self._past.clear()

    def record(self, action: NDArray[np.floating]) -> None:
        """Add a control step to the strip chart."""
        if self._past is not None:
            y = self._fleet.state(self._env)[self._lateral]
            self._past.add(self._time, np.clip(np.array(action), -1.0, 1.0), y)

    @property
    def due(self) -> bool:
        """Return whether a window that shows the motion at true speed is due for a frame."""
        return int(self._fleet.steps[self._env]) % self._every == 0

    @property
    def _time(self) -> float:
        return float(self._fleet.steps[self._env]) * self._fleet.settings.control_period

    def check(self) -> None:
        """Raise gymnasium.error.ResetNeeded if there is no episode yet."""
        if self._fleet.episodes[self._env] is None:
            raise ResetNeeded("call reset() before render()")

    def scene(self) -> Scene:
        """Return the scene of the next frame; see :meth:`check`."""
        from railenv.envs.rendering import Scene

        self.check()
        fleet, i = self._fleet, self._env
        episode = fleet.episodes[i]
        assert episode is not None
        assert self._past is not None
        speed, curvature, cant = fleet.conditions(i)
        places, outlines = self._places
        reason = fleet.reason(i)
        first = self._first(episode.plant)
        return Scene(
            time=self._time,
            speed=speed,
            curvature=curvature,
            cant=cant,
            critical_speed=fleet.settings.critical_speed,
            bodies=self._poses(fleet.state(i)[: episode.plant.n_states]),
            equilibrium=self._poses(fleet.equilibrium(i)),
            rail=fleet.rails(i)[self._order],
            half_gauge=first.half_gauge,
            half_wheelbase=max(places[0], first.half_gauge),
            wheel_radius=first.wheel_radius,
            flange_clearance=first.clearance,
            history=self._past.history(),
            derailed=reason or None,
            wheelsets=places,
            outlines=outlines,
        )

    @cached_property
    def _order(self) -> list[int]:
        """Numbers of the wheelsets from the leading one to the last."""
        guided = self._fleet.model.guided
        return sorted(range(len(guided)), key=lambda k: -guided[k].x)

    @cached_property
    def _wheelsets(self) -> list[Guided]:
        guided = self._fleet.model.guided
        return [guided[k] for k in self._order]

    @cached_property
    def _lateral(self) -> list[int]:
        """Numbers of the states that are displacements of the wheelsets."""
        return [self._fleet.model.state_names.index(g.y) for g in self._wheelsets]

    def _first(self, plant: Model) -> Guided:
        """Return the leading wheelset with the numbers of an episode's vehicle."""
        if self._leading is None or self._leading[0] is not plant:
            self._leading = plant, plant.guided[self._order[0]]
        return self._leading[1]

    @cached_property
    def _others(self) -> list[str]:
        """Moving bodies that are not wheelsets."""
        names = [g.name for g in self._wheelsets]
        return [name for name in self._fleet.model.body_names if name not in names]

    @cached_property
    def _places(self) -> tuple[tuple[float, ...], tuple[Outline, ...]]:
        """Return places of the wheelsets from their middle (m), and outlines of the other bodies."""
        from railenv.envs.rendering import Outline

        plant = self._fleet.model.plant
        x = np.array([g.x for g in self._wheelsets])
        middle = 0.5 * (x[0] + x[-1])
        numbers = SimpleNamespace(**plant.parameters, **plant.tables)
        at = {name: float(place[0]) for name, place in plant.equations.places(numbers).items()}
        framed = [name for name in frames(plant) if name in self._others]
        outlines = []
        for name in self._others:
            if name in framed:  # over the wheelsets nearest to it
                apart = np.abs(x[:, None] - [at[f] for f in framed])
                own = x[apart.argmin(axis=1) == framed.index(name)]
            else:
                own = x
            reach = float(np.abs(own - at[name]).max(initial=0.0)) or self._wheelsets[0].half_gauge
            kind: Any = "frame" if name in framed else "body"
            outlines.append(Outline(at[name] - middle, reach, kind))
        return tuple((x - middle).tolist()), tuple(outlines)

    @cached_property
    def _bodies(self) -> list[str]:
        return [*(g.name for g in self._wheelsets), *self._others]

    def _poses(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """y, z, phi and psi of the wheelsets, then of the other bodies."""
        motions = self._fleet.model.plant.equations.motions(state.tolist())
        return np.array([motions[name][:4] for name in self._bodies], dtype=float)

    def draw(self) -> NDArray[np.uint8] | None:
        """Draw a frame; return it in the mode rgb_array."""
        if self._renderer is None:
            from railenv.envs.rendering import Renderer

            shown: Any = "human" if self._mode == "human" else "rgb_array"
            period = self._fleet.settings.control_period
            self._renderer = Renderer(shown, film_rate(period * self._every))
        return self._renderer.draw(self.scene())

    def close(self) -> None:
        """Close the renderer, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
