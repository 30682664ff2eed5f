"""What a renderer is shown of a fleet: the present state and the last seconds of one environment."""

from __future__ import annotations

import math
from collections import deque
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from railenv.envs.fleet import Fleet
from railenv.mounting import frames
from railenv.vehicles.guided import Guided

if TYPE_CHECKING:
    from railenv.envs.rendering import Outline, Renderer, Scene

_SECONDS = 4.0

WINDOW_RATE = 50.0
"""Frames a second that a window shows at most."""


def film_rate(control_period: float) -> float:
    """Return the frames a second of a film with a frame of each control step, at true speed."""
    rate = 1.0 / control_period
    return round(rate) if math.isclose(rate, round(rate), rel_tol=1e-9) else rate


def steps_a_frame(control_period: float) -> int:
    """Return the control steps from one frame of a window to the next."""
    return max(1, round(1.0 / (WINDOW_RATE * control_period)))


class Recorder:
    """Keeps the strip chart of one environment and draws its frames.

    Without a render mode it does nothing.
    """

    def __init__(self, fleet: Fleet, render_mode: str | None, env: int = 0) -> None:
        self._fleet = fleet
        self._mode = render_mode
        self._env = env
        self._renderer: Renderer | None = None
        period = fleet.settings.control_period
        self._every = steps_a_frame(period)
        samples = max(2, round(_SECONDS / period))
        self._past: deque[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = deque(
            maxlen=samples
        )

    def restart(self) -> None:
        """Forget the past, at a reset."""
        self._past.clear()

    def record(self, action: NDArray[np.floating]) -> None:
        """Add a control step to the strip chart."""
        if self._mode is None:
            return
        state = self._fleet.state(self._env)
        lateral = [self._fleet.model.state_names.index(g.y) for g in self._wheelsets]
        self._past.append((self._time, state[lateral], np.clip(np.array(action), -1.0, 1.0)))

    @property
    def due(self) -> bool:
        """Whether a window that shows the motion at true speed has its next frame now."""
        return int(self._fleet.steps[self._env]) % self._every == 0

    @property
    def _time(self) -> float:
        return float(self._fleet.steps[self._env]) * self._fleet.settings.control_period

    def check(self) -> None:
        """Raise gymnasium.error.ResetNeeded where there is no episode yet."""
        if self._fleet.episodes[self._env] is None:
            raise ResetNeeded("call reset() before render()")

    def scene(self) -> Scene:
        """Return what the next frame shows; see :meth:`check`."""
        from railenv.envs.rendering import History, Scene

        self.check()
        fleet, i = self._fleet, self._env
        episode = fleet.episodes[i]
        assert episode is not None
        speed, curvature, cant = fleet.conditions(i)
        places, outlines = self._places()
        history = History.empty(fleet.n_actuators, len(places))
        if self._past:
            times, displacements, actions = zip(*self._past, strict=True)
            history = History(np.array(times), np.array(displacements), np.array(actions))
        reason = fleet.reason(i)
        first = episode.plant.guided[self._order[0]]
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
            history=history,
            derailed=reason or None,
            wheelsets=places,
            outlines=outlines,
        )

    @cached_property
    def _order(self) -> list[int]:
        """Numbers of the wheelsets from the leading one to the last."""
        guided = self._fleet.model.guided
        return sorted(range(len(guided)), key=lambda k: -guided[k].x)

    @property
    def _wheelsets(self) -> list[Guided]:
        return [self._fleet.model.guided[k] for k in self._order]

    @property
    def _others(self) -> list[str]:
        """Bodies that move and are no wheelsets."""
        names = [g.name for g in self._wheelsets]
        return [name for name in self._fleet.model.body_names if name not in names]

    def _places(self) -> tuple[tuple[float, ...], tuple[Outline, ...]]:
        """Return where the wheelsets are, from their middle (m), and how the other bodies are drawn."""
        from railenv.envs.rendering import Outline

        plant = self._fleet.model.plant
        x = np.array([g.x for g in self._wheelsets])
        middle = 0.5 * (x[0] + x[-1])
        numbers = SimpleNamespace(**plant.parameters, **plant.tables)
        at = {name: float(place[0]) for name, place in plant.equations.places(numbers).items()}
        framed = [name for name in frames(plant) if name in self._others]
        outlines = []
        for name in self._others:
            if name in framed:  # over the wheelsets that are nearest to it
                apart = np.abs(x[:, None] - [at[f] for f in framed])
                own = x[apart.argmin(axis=1) == framed.index(name)]
            else:
                own = x
            reach = float(np.abs(own - at[name]).max(initial=0.0)) or self._wheelsets[0].half_gauge
            kind: Any = "frame" if name in framed else "body"
            outlines.append(Outline(at[name] - middle, reach, kind))
        return tuple((x - middle).tolist()), tuple(outlines)

    def _poses(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """y, z, phi and psi of the wheelsets, then of the other bodies."""
        motions = self._fleet.model.plant.equations.motions(state.tolist())
        order = [*(g.name for g in self._wheelsets), *self._others]
        return np.array([motions[name][:4] for name in order], dtype=float)

    def draw(self) -> NDArray[np.uint8] | None:
        """Draw a frame; returns it in the mode rgb_array."""
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
