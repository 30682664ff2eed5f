"""One hunting vehicle as a Gymnasium environment."""

from __future__ import annotations

import copy
import math
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from railenv.envs import infos
from railenv.envs.fleet import BOUND, Fleet, broadcast_options
from railenv.envs.infos import DERAILMENT, TERM_NAMES
from railenv.envs.limits import time_limit
from railenv.envs.metrics import episode_metrics
from railenv.envs.settings import Plant, Settings, settings
from railenv.envs.showing import Recorder, film_rate
from railenv.envs.specs import described
from railenv.errors import ParameterError, shown

_FEW = 16


def action_space(fleet: Fleet) -> spaces.Space[Any]:
    """Return the space of actions of one environment."""
    if fleet.n_actuators == 0:
        return spaces.Discrete(1)
    return spaces.Box(-1.0, 1.0, (fleet.n_actuators,), np.float32)


def observation_space(fleet: Fleet) -> spaces.Box:
    """Return the space of observations of one environment, history included."""
    n = len(fleet.observation_names) * (fleet.settings.history + 1)
    return spaces.Box(-BOUND, BOUND, (n,), np.float32)


def numbers_of(actions: Any) -> NDArray[np.float64] | None:
    """Return actions as an array of finite numbers; None if they are not."""
    try:
        values = np.asarray(actions, dtype=float)
    except (OverflowError, TypeError, ValueError):
        return None
    if values.size < _FEW:  # an array operation takes longer for so few
        finite = all(map(math.isfinite, values.ravel().tolist()))
    else:
        finite = bool(np.isfinite(values).all())
    return values if finite else None


class History:
    """Present and past observations of some environments, newest first."""

    def __init__(self, n: int, width: int, length: int) -> None:
        self.width = width
        self.stacked = np.zeros((n, width * (length + 1)), dtype=np.float32)

    def reset(self, rows: Any, observations: NDArray[np.float32]) -> None:
        """Fill the past of some environments with their first observation."""
        self.stacked[rows] = np.tile(observations, self.stacked.shape[1] // self.width)

    def push(self, observations: NDArray[np.float32]) -> None:
        """Move everything one place back and put new observations in front."""
        if self.stacked.shape[1] > self.width:
            self.stacked[:, self.width :] = self.stacked[:, : -self.width].copy()
        self.stacked[:, : self.width] = observations


class HuntingEnv(gym.Env[NDArray[np.float32], Any]):
    """Base of the environments of one vehicle: a bogie, two wheelsets or a whole coach.

    The classes of the ids also list ``gymnasium.Env`` among their own bases, because some libraries
    look there to recognise an environment.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 200}
    plant: ClassVar[Plant]
    _spec: EnvSpec | None = None

    def __init__(self, render_mode: str | None = None, **keywords: Any) -> None:
        self.settings: Settings = settings(self.plant, keywords)
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ParameterError(
                f"render_mode is {render_mode!r}; it must be None, "
                + " or ".join(map(repr, self.metadata["render_modes"]))
            )
        self.render_mode = render_mode
        rate = film_rate(self.settings.control_period)
        self.metadata = {**type(self).metadata, "render_fps": rate}
        infos.check_names(self.settings)
        self._fleet = Fleet(self.settings, 1, lanes=1)
        self._history = History(1, len(self._fleet.observation_names), self.settings.history)
        self.action_space = action_space(self._fleet)
        self.observation_space: spaces.Box = observation_space(self._fleet)  # type: ignore[assignment]
        self._recorder = Recorder(self._fleet, render_mode)
        self._steps = self.settings.steps
        self._idle = np.zeros((1, 0))
        self._running = False
        self._start: dict[str, Any] = {}

    @property
    def spec(self) -> EnvSpec | None:
        """Spec from which Gymnasium remakes this environment, in plain values for JSON."""
        return self._spec

    @spec.setter
    def spec(self, given: EnvSpec | None) -> None:
        self._spec = None if given is None else described(given, self.settings.steps)

    @property
    def fleet(self) -> Fleet:
        """State of the vehicle: model, equilibrium, moments (a fleet of one)."""
        return self._fleet

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start a new episode; ``options`` pin quantities that are otherwise drawn (see the class)."""
        super().reset(seed=seed)
        (pinned,) = broadcast_options(options, 1)
        self._fleet.reset(0, self.np_random, pinned)
        self._history.reset(0, self._fleet.observations[0])
        self._recorder.restart()
        self._running = True
        self._steps = min(self.settings.steps, time_limit(self) or self.settings.steps)
        self._begin()
        if self.render_mode == "human":
            self.render()
        return self._history.stacked[0].copy(), self._start.copy()

    def _begin(self) -> None:
        """Start the infos of a new episode."""
        episode = self._fleet.episodes[0]
        self._start = {} if episode is None else infos.of_start(episode)

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Advance one control period."""
        if not self._running:
            raise gym.error.ResetNeeded("call reset() before step(), and after an episode has ended")
        fleet = self._fleet
        commands = self._commands(action)
        fleet.step(commands)
        self._history.push(fleet.observations)
        values = fleet.terms[0]
        terms = values.tolist()
        terminated = terms[DERAILMENT] > 0.0
        truncated = fleet.steps.item(0) >= self._steps
        info = self._start.copy()
        info.update(zip(TERM_NAMES, values[1:-1], strict=True))
        if terminated or truncated:
            self._running = False
            info.update(infos.of_end(self.episode_metrics(), terms[-1]))
        if self.render_mode is not None:
            self._recorder.record(commands[0])
            if self.render_mode == "human" and (self._recorder.due or not self._running):
                self.render()
        return self._history.stacked[0].copy(), terms[0], terminated, truncated, info

    def _commands(self, action: Any) -> NDArray[np.float64]:
        n = self._fleet.n_actuators
        if n == 0:
            return self._idle
        commands = numbers_of(action)
        if commands is None or commands.size != n:
            raise ParameterError(
                f"action is {shown(action)}; it must be {n} finite number{'s' * (n > 1)} in [-1, 1]"
            )
        return commands.reshape(1, n)

    def episode_metrics(self) -> dict[str, float]:
        """Return the metrics of the episode so far (:func:`railenv.envs.metrics.episode_metrics`)."""
        return episode_metrics(self._fleet, 0)

    def get_state(self) -> dict[str, Any]:
        """Return everything that changes, for an exact resume with :meth:`set_state`."""
        return {
            "fleet": self._fleet.snapshot(),
            "history": self._history.stacked.copy(),
            "np_random": copy.deepcopy(self.np_random),
            "np_random_seed": self.np_random_seed,
            "running": self._running,
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state of an environment with the same settings."""
        self._fleet.restore(state["fleet"])
        self._history.stacked[:] = state["history"]
        self._np_random = copy.deepcopy(state["np_random"])
        self._np_random_seed = state["np_random_seed"]
        self._running = state["running"]
        self._begin()
        self._recorder.restart()

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the vehicle on its track; needs pygame (extra ``render``)."""
        if self.render_mode is None:
            gym.logger.warn(
                "render() needs a render mode; give render_mode='rgb_array' or 'human' to gym.make"
            )
            return None
        return self._recorder.draw()

    def close(self) -> None:
        """Close the window, if there is one."""
        self._recorder.close()


class BogieEnv(HuntingEnv, gym.Env[NDArray[np.float32], Any]):
    """A two-axle bogie of a high-speed coach, with actuated yaw dampers against hunting.

    ## Description

    A bogie of 12 degrees of freedom runs at constant speed on tangent or curved track. Above its
    critical speed (114 m/s on tangent track for the default vehicle, less on curves and on worn wheels)
    it hunts: the wheelsets oscillate from flange to flange. The controller commands the yaw moment
    between bogie frame and vehicle body, through a transport delay and the lag of real actuators.

    x points forward, y to the left, z up; phi is roll, psi is yaw. A positive curvature is the curve
    whose outer rail is the left one. SI units throughout.

    ## Action Space

    ``Box(-1, 1, (n,), float32)``: commanded moment of each actuator as a share of its limit. One for
    ``actuator="secondary"`` (26 kN m), two for ``"primary"`` (5 kN m at each wheelset). One lateral
    force between frame and vehicle body for ``"lateral"`` (20 kN). ``Discrete(1)`` for ``"none"``.

    ## Observation Space

    ``Box(-10, 10, (m,), float32)``; each entry is divided by its scale and clipped. With
    ``observation="state"``: all states of vehicle, actuators and sensors, the latest commands, speed,
    cant deficiency and cant. With ``"sensors"``: accelerometer and gyro of the frame, with noise, bias
    and bandwidth, then speed and cant deficiency. ``history=k`` appends the k previous observations.
    ``env.unwrapped.fleet.observation_table`` lists name, unit and scale of every entry.
    ``context=True`` adds the drawn numbers of the vehicle (``randomize``), from -1 to 1 over their
    ranges; ``info`` always has them.

    ## Reward

    Each step earns ``1 - (w_h h + w_e e + w_r r + w_u u + w_c c + w_d d)``, with

    - hunting ``h = s(8 H)``, H the root of the mean over wheelsets of ``((dy / (V k delta))^2 + ((psi
      - psi_0) / (k delta))^2) / 2``;
    - excursion ``e = s(8 E)``, E the root of the mean over wheelsets of ``((y - y_t - y_0) /
      delta)^2``;
    - ride ``r = s(|a| / 0.1 g)``, a the specific force on the frame about its steady value;
    - effort ``u``, the mean squared moment as a share of the limit; command ``c``, the mean squared
      command; change ``d``, half the mean change of the command since the step before;

    where ``s(x) = x / (1 + x)``, k is the wavenumber of Klingel's kinematic hunting, delta the flange
    clearance, y_t the rails' displacement, and 0 marks the running equilibrium of the track under the
    vehicle: the steady offset in a curve costs nothing. The weights are shares of their sum (0.35,
    0.25, 0.2, 0.05, 0.05, 0.1 unless given), so that a step's reward lies between 0 and 1; at an
    amplitude of an eighth of the clearance the terms of hunting and excursion are 1/2. A derailment
    earns nothing and ends the episode, so that for any discount it is worse than further hunting. Every
    term, before its weight, is in ``info``.

    For learning under constraints ``info["cost"]`` is the largest of three shares of limits, which are
    also in ``info``: ``nadal`` (Y/Q over 2 m, as a share of ``nadal_limit``), ``unloading`` (the part
    of its static load that a wheel has lost, as a mean over 2 m, as a share of 90 %) and
    ``instability`` (the running rms over 100 m of an axle's sum of guiding forces, as a share of the
    limit of EN 14363). At 1 and above, a limit is reached.

    ## Starting State

    The running equilibrium, all bodies moved sideways by up to ``initial_offset``. Speed and cant are
    drawn from their ranges, then the curvature, so that cant deficiency stays within
    ``max_cant_deficiency``; a quarter of the episodes are on tangent track. ``reset(options=...)`` pins
    ``speed``, ``radius`` or ``curvature``, ``cant``, ``offset``, ``irregularity_factor``, ``friction``,
    ``creep_factor``, ``body_mass`` or a number of the vehicle's contact law (``conicity``,
    ``contact_angle``, ``rail_profile_radius`` of the default's hollow tread); impossible values raise
    an error. ``actuator_failure`` is the share of the episodes in which one actuator gets no more
    commands after some time; ``failed_actuator`` (from 1; 0 for none) and ``failure_time`` are in
    ``info``, and can be pinned.

    ## Episode End

    Terminated on derailment only, with the number of the reason in ``info["derailed"]``: Nadal's ratio
    (the mean over 2 m of a wheel's guiding force Y over that of its load Q) above ``nadal_limit``, a
    wheel without load for 2 m, a wheelset more than 30 mm off the track's centre, or, on profiles, a
    wheel that has climbed beyond the steepest part of its flange, where nothing holds it.
    Truncated after ``duration``. The last ``info`` has the metrics of the episode.

    ``nadal_limit`` is 0.8, or ``"contact angle"`` for Nadal's own ``(tan g - mu) / (1 + mu tan g)``, g
    the largest contact angle of the flange and mu the friction of the episode. Only profiles
    (``ProfilePair``, ``ProfileFamily``) have such an angle; other contact laws raise an error.

    ## Arguments

    All fields of :class:`railenv.envs.settings.Settings`, for instance:

    >>> import gymnasium, railenv
    >>> env = gymnasium.make("railenv/Bogie-v1", observation="sensors", speed_range=(100, 140))
    >>> observation, info = env.reset(seed=1, options={"radius": float("inf")})
    >>> observation.shape
    (4,)

    ## Version History

    - v1: one function of height describes the contact of wheel and rail, for every contact law; the
      default vehicle is the coach on hollow treads, whose conicity and contact angle go together. Infos
      have the same names and single numbers throughout.
    - v0: first version, with the contact as printed in the paper; removed.
    """

    plant = "bogie"


class DualWheelsetEnv(HuntingEnv, gym.Env[NDArray[np.float32], Any]):
    """Two wheelsets on a frame at rest, with a yaw actuator at each; Table 1 of the paper.

    Everything is as in :class:`BogieEnv`, except: the vehicle has 8 degrees of freedom and hunts from
    34 m/s on tangent track; actuators are ``"primary"`` (two, 5 kN m each) or ``"none"``; the sensors
    are an accelerometer and a gyro on each axle; the ride term takes the larger of both axles'
    accelerations; the default speeds are 20 to 60 m/s.

    >>> import gymnasium, railenv
    >>> env = gymnasium.make("railenv/DualWheelset-v1", actuator="none")
    >>> env.action_space
    Discrete(1)
    """

    plant = "dual_wheelset"


class CoachEnv(HuntingEnv, gym.Env[NDArray[np.float32], Any]):
    """A whole high-speed coach on two bogies, with actuated yaw dampers or lateral actuators.

    ## Description

    A vehicle of 31 degrees of freedom runs at constant speed on tangent or curved track: a body on two
    bogies, four wheelsets. Above its critical speed (107 m/s on tangent track for the default vehicle,
    less on curves and on worn wheels) both bogies hunt and shake the body. The controller commands
    actuators between the bogies and the body, through a transport delay and a realistic lag.

    x points forward, y to the left, z up; phi is roll, theta is pitch, psi is yaw. A positive curvature
    is the curve whose outer rail is the left one. SI units throughout. Wheelsets ``w1`` to ``w4`` and
    frames ``b1``, ``b2`` are numbered from the front.

    ## Action Space

    ``Box(-1, 1, (n,), float32)``: commanded moment or force of each actuator as a share of its limit.
    ``actuator="secondary"``: two yaw moments (26 kN m), on each frame against the body.
    ``"lateral"``: two lateral forces (20 kN) at the secondary springs, on each frame against the body.
    ``"primary"``: four yaw moments (5 kN m), on each wheelset against its frame. ``"both"``: those
    four, then the two of ``"secondary"``. ``Discrete(1)`` for ``"none"``.

    ## Observation Space

    ``Box(-10, 10, (m,), float32)``; each entry is divided by its scale and clipped. With
    ``observation="state"``: all states of vehicle, actuators and sensors, the latest commands,
    speed, cant deficiency and cant. The body's height is measured from its rest on the springs on
    tangent track, 0.3 m below the unloaded height. With ``"sensors"``: accelerometer and gyro of
    both frames and of the body, with noise, bias and bandwidth, then speed and cant deficiency.
    ``history=k`` appends the k previous observations. ``env.unwrapped.fleet.observation_table`` lists
    name, unit, scale and rest of every entry. ``context=True`` adds the drawn numbers of the vehicle.

    ## Reward

    Each step earns ``1 - (w_h h + w_e e + w_r r + w_u u + w_c c + w_d d)``, with

    - hunting ``h = s(8 H)``, H the root of the mean over the four wheelsets of ``((dy / (V k delta))^2
      + ((psi - psi_0) / (k delta))^2) / 2``;
    - excursion ``e = s(8 E)``, E the root of the mean over the four wheelsets of ``((y - y_t - y_0) /
      delta)^2``;
    - ride ``r = s(3 |a| / a_r)``, a the lateral specific force at the body's centre about its steady
      value, a_r = 0.5 m/s^2, the rms value with which EN 14363 compares the ride of a body;
    - effort ``u``, the mean squared moment or force as a share of the limit; command ``c``, the mean
      squared command; change ``d``, half the mean change of the command since the step before;

    where ``s(x) = x / (1 + x)``, k is the wavenumber of Klingel's kinematic hunting, delta the flange
    clearance, y_t the rails' displacement, and 0 marks the running equilibrium of the track under the
    vehicle: the steady offset in a curve costs nothing. The weights are shares of their sum (0.35,
    0.25, 0.2, 0.05, 0.05, 0.1 unless given), so that a step's reward lies between 0 and 1; at an
    amplitude of an eighth of the clearance the terms of hunting and excursion are 1/2. A derailment
    earns nothing and ends the episode, so that for any discount it is worse than further hunting. Every
    term, before its weight, is in ``info``, and so are ``cost`` and its three parts, as for
    :class:`BogieEnv`, the worst of eight wheels and four axles.

    Accelerations among the metrics are the body's; the readings of the two standards are those of the
    running gear: 49 CFR 213.333 of the frame that shakes more, EN 14363 of the four axles.

    ## Starting State

    The running equilibrium, all bodies moved sideways by up to ``initial_offset``. Speed and cant are
    drawn from their ranges, then the curvature, so that cant deficiency stays within
    ``max_cant_deficiency``; a quarter of the episodes are on tangent track. With ``track="curve"`` each
    body runs on the curvature and cant of its own place, so that the leading bogie enters the
    transition first. ``reset(options=...)`` pins ``speed``, ``radius`` or ``curvature``, ``cant``,
    ``offset``, ``irregularity_factor``, ``friction``, ``creep_factor``, ``body_mass`` or a number of
    the vehicle's contact law (``conicity``, ``contact_angle``, ``rail_profile_radius`` of the default's
    hollow tread); impossible values raise an error. ``actuator_failure`` is the share of the episodes
    in which one actuator gets no more commands after some time; ``failed_actuator`` (from 1; 0 for
    none) and ``failure_time`` are in ``info``, and can be pinned.

    ## Episode End

    Terminated on derailment only, with the number of the reason in ``info["derailed"]``: for any of the
    eight wheels Nadal's ratio (the mean over 2 m of the wheel's guiding force Y over that of its load
    Q) above ``nadal_limit``, no load for 2 m, or, on profiles, a climb beyond the steepest part of the
    flange; or a wheelset more than 30 mm off the track's centre. Truncated after ``duration``. The last
    ``info`` has the metrics of the episode.

    ``nadal_limit`` is 0.8, or ``"contact angle"``, as for :class:`BogieEnv`.

    ## Arguments

    All fields of :class:`railenv.envs.settings.Settings`, for instance:

    >>> import gymnasium, railenv
    >>> env = gymnasium.make("railenv/Coach-v1", observation="sensors", actuator="lateral")
    >>> observation, info = env.reset(seed=1, options={"radius": float("inf")})
    >>> observation.shape
    (8,)

    ## Version History

    - v1: first version, with the contact and the reward of Bogie-v1.
    """

    plant = "coach"
