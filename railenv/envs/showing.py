"""What a renderer is shown of a fleet: the present state and the last seconds of one environment."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from railenv.envs.fleet import REASONS, Fleet

if TYPE_CHECKING:
    from railenv.envs.rendering import Renderer, Scene

_SECONDS = 4.0


class Recorder:
    """Keeps the strip chart of one environment and draws its frames.

    Without a render mode it does nothing.
    """

    def __init__(self, fleet: Fleet, render_mode: str | None, fps: int, env: int = 0) -> None:
        self._fleet = fleet
        self._mode = render_mode
        self._fps = fps
        self._env = env
        self._renderer: Renderer | None = None
        samples = max(2, round(_SECONDS / fleet.settings.control_period))
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
        lateral = [self._fleet.model.state_names.index(g.y) for g in self._fleet.model.guided]
        self._past.append((self._time, state[lateral], np.clip(np.array(action), -1.0, 1.0)))

    @property
    def _time(self) -> float:
        return float(self._fleet.steps[self._env]) * self._fleet.settings.control_period

    def scene(self) -> Scene:
        """Return what the next frame shows."""
        from railenv.envs.rendering import History, Scene

        fleet, i = self._fleet, self._env
        episode = fleet.episodes[i]
        assert episode is not None
        speed, curvature, cant = fleet.conditions(i)
        history = History.empty(fleet.n_actuators)
        if self._past:
            times, displacements, actions = zip(*self._past, strict=True)
            history = History(np.array(times), np.array(displacements), np.array(actions))
        reason = REASONS[int(fleet.terms[i, 6])]
        guided = episode.plant.guided
        first = guided[0]
        return Scene(
            time=self._time,
            speed=speed,
            curvature=curvature,
            cant=cant,
            critical_speed=fleet.settings.critical_speed,
            bodies=self._poses(fleet.state(i)[: episode.plant.n_states]),
            equilibrium=self._poses(fleet.equilibrium(i)),
            rail=fleet.rails(i),
            half_gauge=first.half_gauge,
            half_wheelbase=0.5 * (max(g.x for g in guided) - min(g.x for g in guided)),
            wheel_radius=first.wheel_radius,
            flange_clearance=first.clearance,
            history=history,
            derailed=reason or None,
        )

    def _poses(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """y, z, phi and psi of the wheelsets, then of the other bodies."""
        plant = self._fleet.model.plant
        motions = plant.equations.motions(state.tolist())
        wheelsets = [g.name for g in plant.guided]
        order = [*wheelsets, *(name for name in motions if name not in wheelsets)]
        return np.array([motions[name][:4] for name in order if name in plant.body_names], dtype=float)

    def draw(self) -> NDArray[np.uint8] | None:
        """Draw a frame; returns it in the mode rgb_array."""
        if self._renderer is None:
            from railenv.envs.rendering import Renderer

            mode: Any = self._mode
            self._renderer = Renderer(mode, self._fps)
        return self._renderer.draw(self.scene())

    def close(self) -> None:
        """Close the renderer, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
