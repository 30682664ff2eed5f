"""Runs of a controlled vehicle: many cases side by side, in the environments' own kernel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.controllers.controller import Controller
from agents.controllers.scheduled import CONTROL_PERIOD
from agents.evaluation.returns import check_reads
from railenv import Equipped, checks
from railenv.envs.episodes import Episode, numbers_of
from railenv.envs.fleet import Fleet
from railenv.envs.observation import context_ranges
from railenv.envs.settings import LOWEST_SPEED, Settings
from railenv.envs.settings import settings as settings_of
from railenv.errors import EquilibriumError, ParameterError
from railenv.irregularity import Level

Array = NDArray[np.float64]

_EVER = 1e12  # m, longer than any run
_SCALAR_BELOW = 3  # cases up to which the scalar kernel is faster


@dataclass(frozen=True)
class Case:
    """One run's conditions.

    Attributes
    ----------
    speed : float
        m/s.
    radius, cant : float
        m (``math.inf`` on tangent track), rad.
    offset : float
        Lateral displacement of all bodies at the start, m.
    vehicle : mapping of str to float
        Changes of the vehicle (``replace`` of its model).
    roughness : float
        Factor on the track's irregularity, if it has any.
    """

    speed: float
    radius: float = math.inf
    cant: float = 0.0
    offset: float = 0.0
    vehicle: Mapping[str, float] = field(default_factory=dict)
    roughness: float = 1.0


@dataclass(frozen=True)
class Track:
    """The track and the sensors' noise in a rollout.

    Attributes
    ----------
    irregularity : {"low", "high"}, optional
        Level of ERRI B176; none when left out.
    noise : bool
        Whether sensors have noise and bias.
    seed : int
        Seed of noise, biases and the place on the line, which differ between cases.
    repeats_after : int, optional
        Number of cases after which noise, biases and places repeat, so that comparisons are fair.
    """

    irregularity: Level | None = None
    noise: bool = False
    seed: int = 0
    repeats_after: int | None = None


@dataclass(frozen=True)
class Motion:
    """Recorded motion.

    Attributes
    ----------
    time : ndarray, shape (n_times,)
        s.
    states : ndarray, shape (n_times, n_cases, n_names)
    names : tuple of str
        Recorded states of the equipped model.
    derailed : ndarray of bool, shape (n_cases,)
        Whether a case derailed at any time; it is still followed.
    """

    time: Array
    states: Array
    names: tuple[str, ...]
    derailed: NDArray[np.bool_]

    def __getitem__(self, name: str) -> Array:
        """Return one state, shape (n_times, n_cases)."""
        checks.known("state", [name], self.names)
        return self.states[:, :, self.names.index(name)]


class Rollout:
    """Some cases of a vehicle under one controller.

    Parameters
    ----------
    model : Equipped
    controller : Controller or None
        None commands nothing.
    cases : sequence of Case
    track : Track, optional
        Track; smooth, with ideal readings, when left out.
    like : Controller, optional
        A controller that takes over later; it sets the observation and the control period.
    time_step : float
        Time step of the integration, s.

    Raises
    ------
    EquilibriumError
        If a case has no running equilibrium to start from.
    ParameterError
        If the controller's readings or commands are not those of the model.
    """

    def __init__(
        self,
        model: Equipped,
        controller: Controller | None,
        cases: Sequence[Case],
        track: Track | None = None,
        *,
        like: Controller | None = None,
        time_step: float = 1e-3,
    ) -> None:
        if not cases:
            raise ParameterError("cases is empty; a rollout needs at least one case")
        self.track = Track() if track is None else track
        self.cases = tuple(cases)
        self.controller = controller
        settings = _settings(model, controller or like, self.cases, self.track, time_step)
        n = len(self.cases)
        self.fleet = Fleet(settings, n, 1 if n < _SCALAR_BELOW else 16)
        for given in (controller, like):
            if given is not None:
                check_reads(given, self.fleet)
        self.derailed = np.zeros(n, dtype=bool)
        self._idle = np.zeros((n, self.fleet.n_actuators))
        for i, case in enumerate(self.cases):
            self.fleet.start(i, _episode(settings, case, self.track, i))
        if controller is not None:
            controller.reset(n)

    @property
    def period(self) -> float:
        """Control period, s."""
        return self.fleet.settings.control_period

    def step(self) -> None:
        """Advance all cases by one control period."""
        actions = self._idle
        if self.controller is not None:
            actions = np.asarray(self.controller.act(self.fleet.observations), dtype=float)
        self.fleet.step(actions.reshape(self._idle.shape))
        self.derailed |= self.fleet.derailed

    def run(self, duration: float, names: Sequence[str] | None = None, every: int = 1) -> Motion:
        """Advance by a duration (s) and record states every ``every`` control periods.

        By default the lateral displacement of the leading wheelset is recorded.
        """
        states = self.fleet.model.state_names
        names = [leading(self.fleet.model)] if names is None else names
        checks.known("state", names, states)
        columns = [states.index(name) for name in names]
        steps = round(duration / self.period)
        rows = [self.fleet.all_states()[:, columns]]
        for k in range(1, steps + 1):
            self.step()
            if k % every == 0:
                rows.append(self.fleet.all_states()[:, columns])
        time = np.arange(len(rows), dtype=float) * (every * self.period)
        return Motion(time, np.array(rows), tuple(names), self.derailed.copy())


def leading(model: Equipped) -> str:
    """Return the state that is the lateral displacement of the leading wheelset."""
    return max(model.guided, key=lambda wheelset: wheelset.x).y


def startable(model: Equipped, cases: Sequence[Case]) -> list[bool]:
    """Return for each case whether it has a running equilibrium from which a rollout can start."""
    track = Track()
    settings = _settings(model, None, cases, track, 1e-3)
    fleet = Fleet(settings, 1, 1)
    found = []
    for case in cases:
        try:
            fleet.start(0, _episode(settings, case, track, 0))
        except EquilibriumError:
            found.append(False)
        else:
            found.append(True)
    return found


def _settings(
    model: Equipped,
    controller: Controller | None,
    cases: Sequence[Case],
    track: Track,
    time_step: float,
) -> Settings:
    if not track.noise:
        quiet: dict[str, Any] = dict.fromkeys(
            ("accelerometer_noise", "gyro_noise", "accelerometer_bias", "gyro_bias"), 0.0
        )
        model = model.replace(**quiet)
    speeds = [case.speed for case in cases]
    context = context_ranges(model, getattr(controller, "readings", ()))
    keywords = {
        "model": model,
        "randomize": context,
        "context": bool(context),
        "observation": "sensors" if controller is None else controller.observation,
        "speed_range": (max(LOWEST_SPEED, min(speeds)), max(speeds)),
        "control_period": getattr(controller, "period", CONTROL_PERIOD),
        "irregularity": track.irregularity,
        "time_step": time_step,
    }
    return settings_of("bogie", keywords)


def _episode(settings: Settings, case: Case, track: Track, i: int) -> Episode:
    own = i if track.repeats_after is None else i % track.repeats_after
    rng = np.random.default_rng([track.seed, own])
    speed = checks.number("speed of a case", case.speed, low=LOWEST_SPEED, unit="m/s")
    plant = settings.equipped.plant
    if case.vehicle:
        plant = plant.replace(**case.vehicle)
    return Episode(
        speed=speed,
        curvature=checks.curvature(case.radius),
        cant=checks.cant(case.cant),
        plan=(-2.0, -1.0, _EVER, 2.0 * _EVER),
        plant=plant,
        numbers=numbers_of(plant, settings.variable, case.vehicle),
        irregularity_factor=0.0
        if track.irregularity is None
        else checks.number("roughness", case.roughness, low=0.0),
        line_offset=float(rng.uniform(0.0, 1e4)),
        offset=checks.number("offset of a case", case.offset, low=-0.02, high=0.02, unit="m"),
        biases=rng.standard_normal(max(4, 2 * len(settings.equipped.sensed))),
        noise_seed=int(rng.integers(2**63)),
    )
