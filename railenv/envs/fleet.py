"""Environments side by side: their states, resets and control steps, behind both environment classes.

One environment is a fleet of one in the scalar kernel, a vector environment one in the lane kernel;
both kernels have the same source, so that the same seed gives the same numbers.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.assessment.limits import Limits
from railenv.envs.derailment import DERAILED, flange_tops, nadal_limits
from railenv.envs.episodes import Episode, draw
from railenv.envs.metrics import CFR_LIMIT, en_limit
from railenv.envs.observation import Reading, context_table, delay_slots, observation_table
from railenv.envs.settings import LOWEST_SPEED, Settings
from railenv.equations.coordinates import Running
from railenv.equations.sensors import specific_force
from railenv.equilibrium import find_equilibrium
from railenv.errors import EquilibriumError, ParameterError, shown
from railenv.kernels import buffers, pool
from railenv.model import Model
from railenv.mounting import carried
from railenv.threads import usable_threads
from railenv.vehicles.guided import Guided

Array = NDArray[np.float64]

BOUND = 10.0
"""Largest magnitude of an observation, in units of its scale."""

RIDE_SCALE = CFR_LIMIT / 3.0
"""Acceleration (m/s^2) at which the ride term is 1/2: a third of the limit of 49 CFR 213.333."""

QUIET = 0.125
"""Amplitude, as a share of the clearance, at which the hunting and excursion terms are 1/2."""

BODY_RIDE_SCALE = Limits().ride_lateral_rms / 3.0
"""The same (m/s^2) for a body above the frames: a third of EN 14363's rms value for its ride."""

THREAD_PAYS_FROM = 128
"""Number of environments that give a thread enough work, some 0.1 ms.

With fewer, waking it costs more than it saves. ``RAILENV_NUM_THREADS=1`` uses a single thread, which is
best where other processes, such as their own environments, use the other processors.
"""

_RING_SECONDS, _RING_METRES = 2.0, 100.0
_REDRAWS = 20


def _readings_of(speed: float, period: float) -> int:
    """Return the number of readings in 2 s and in 100 m of track at a speed (m/s)."""
    return math.ceil(max(_RING_SECONDS, _RING_METRES / speed) / period)


class Fleet:
    """Some environments with the same settings.

    Parameters
    ----------
    settings : Settings
    n : int
        Number of environments.
    lanes : int
        1 for the scalar kernel, 16 for the lane kernel.
    """

    def __init__(self, settings: Settings, n: int, lanes: int) -> None:
        self.settings = settings
        self.n = n
        self.model = settings.equipped
        self._lanes = lanes
        self._kernels = self.model.kernels(lanes, program="environment")
        self._delay = _delay(settings, self.model.delay)
        before, after, slots = self._delay
        T = settings.control_period
        layout = self._kernels.LAYOUT
        self._layout = layout
        self._rows, self._tables = self.model.rows()
        n_blocks = -(-n // lanes)
        longest = math.ceil(2.0 / (LOWEST_SPEED * T))  # control steps in 2 m at the lowest speed
        rows = self._kernels.E_WINDOWS + 2 * self._kernels.N_WHEELS * longest
        rows += slots * max(1, self.n_actuators)
        self._blocks = buffers.zeros((n_blocks, layout.j * lanes))
        self._extras = buffers.zeros((n_blocks, rows * lanes))
        full, varies = settings.observation == "state", settings.track != "constant"
        self._plan = (before, after, slots, full, longest, varies)
        fraction = math.fmod(self.model.delay, T) if before else 0.0
        self._real_plan = (
            fraction / before if before else 0.0,
            (T - fraction) / after,
            settings.line.spacing,
            BOUND,
        )
        line = settings.line
        self._lines = np.array([line.align, line.vert, line.cross])
        self.episodes: list[Episode | None] = [None] * n
        self.steps = np.zeros(n, dtype=np.int64)  # since the reset
        self.observations = np.zeros((n, len(self.observation_names)), dtype=np.float32)
        self.terms = np.zeros((n, self._kernels.TERMS))
        ring = _readings_of(settings.speed_range[0], T)
        self._ring = np.zeros((n, ring, self._kernels.RING_SIGNALS))
        self._nodes = np.zeros((n, self._kernels.NODES, self.model.plant.n_states))
        self._window = np.ones(n)
        self._seeds = np.zeros(n, dtype=np.uint64)
        sensors, shares = self.model.sensors, settings.weights.shares
        above = set(self.model.felt) & set(carried(self.model.plant))
        self._weights = np.array([*shares, T, BODY_RIDE_SCALE if above else RIDE_SCALE, QUIET])
        self._noise = np.array([sensors.accelerometer_noise, sensors.gyro_noise])
        self._tangent_states: dict[Any, Array] = {}
        self._join()

    # ------------------------------------------------------------------ what there is

    @cached_property
    def n_actuators(self) -> int:
        """Number of actuators of one vehicle."""
        return len(self.model.command_names)

    @property
    def integration_steps(self) -> list[tuple[float, int]]:
        """Length (s) of each integration step of a control period, and the age of the command in it.

        The age is counted in control periods: 0 is the command of the period itself.
        """
        before, after, slots = self._delay
        h_before, h_after, *_ = self._real_plan
        return [(h_before, slots - 1)] * before + [(h_after, slots - 2)] * after

    @property
    def rewards(self) -> Array:
        """Rewards of the last step, shape (n,)."""
        return np.asarray(self.terms[:, 0])

    @property
    def costs(self) -> Array:
        """Terms of the reward before their weights, shape (n, 6); see ``RewardWeights``."""
        return np.asarray(self.terms[:, 1 : self._kernels.DERAILED])

    @property
    def derailed(self) -> NDArray[np.bool_]:
        """Whether the last step ended in a derailment, shape (n,)."""
        return np.asarray(self.terms[:, self._kernels.DERAILED] > 0.0)

    def reason(self, i: int) -> str:
        """Return the reason of a derailment; empty if there was none."""
        return DERAILED[int(self.terms[i, self._kernels.REASON])]

    @cached_property
    def observation_table(self) -> list[Reading]:
        """Name, unit, scale, signal and rest of every entry of an observation (without history)."""
        return [*self._measured, *self._context]

    @cached_property
    def _measured(self) -> list[Reading]:
        settings = self.settings
        return observation_table(self.model, settings.observation, settings.control_period)

    @cached_property
    def _context(self) -> list[Reading]:
        """Return the observation's entries for the vehicle, which are constant during an episode."""
        return context_table(self.model, self.settings.randomize) if self.settings.context else []

    def _context_of(self, plant: Model) -> list[float]:
        values = plant.parameters
        return [
            min(max((values[told.signal] - told.rest) / told.scale, -BOUND), BOUND)
            for told in self._context
        ]

    @cached_property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the entries of an observation (without history)."""
        return tuple(reading.name for reading in self.observation_table)

    @cached_property
    def _scales(self) -> Array:
        return np.array([reading.scale for reading in self.observation_table])

    @cached_property
    def _rests(self) -> Array:
        return np.array([reading.rest for reading in self.observation_table])

    def _join(self) -> None:
        """Gather the kernel's arguments beside its buffers."""
        self._arrays = (
            self._lines,
            self._window,
            self._weights,
            self._noise,
            self._scales,
            self._rests,
            self._seeds,
            self.observations,
            self.terms,
            self._ring,
        )

    def _view(self, buffer: Array, i: int) -> Array:
        """Return the rows of one environment in a buffer of blocks."""
        block, lane = divmod(i, self._lanes)
        return buffer[block].reshape(-1, self._lanes)[:, lane]

    def state(self, i: int) -> Array:
        """Return the state of one environment's model."""
        return self._view(self._blocks, i)[: self.model.n_states].copy()

    def set_state(self, i: int, state: Array) -> None:
        """Set the state of one environment's model."""
        self._view(self._blocks, i)[: self.model.n_states] = state

    def all_states(self) -> Array:
        """Return the states of all environments' models, shape (n, n_states)."""
        rows = self._blocks.reshape(len(self._blocks), -1, self._lanes)[:, : self.model.n_states]
        return rows.transpose(0, 2, 1).reshape(-1, self.model.n_states)[: self.n].copy()

    def set_speeds(self, speeds: Array) -> None:
        """Change the speeds (m/s) of all environments within their episodes, shape (n,)."""
        for i, speed in enumerate(speeds):
            self._view(self._blocks, i)[self._layout.c] = speed

    def moments(self, i: int) -> Array:
        """Return applied moments of one environment's actuators, as shares of the limit."""
        n = self.model.plant.n_states
        moments = self._view(self._blocks, i)[n : n + 2 * self.n_actuators : 2]
        return np.clip(moments / self.model.limits, -1.0, 1.0)

    def conditions(self, i: int) -> tuple[float, float, float]:
        """Return speed, curvature and cant at the present place of one environment."""
        speed, curvature, cant = self._view(self._blocks, i)[self._layout.c : self._layout.p]
        return float(speed), float(curvature), float(cant)

    def rails(self, i: int) -> Array:
        """Return the lateral displacement of the rails under each wheelset, m."""
        w, names = self._view(self._blocks, i), self.model.input_names
        under = (g.rails for g in self._guided)
        return np.array([w[self._layout.u + names.index(n[0])] if n else 0.0 for n in under])

    def equilibrium(self, i: int) -> Array:
        """Return the plant's running equilibrium at the place of one environment, shape (n_states,)."""
        episode = self.episodes[i]
        assert episode is not None
        _, curvature, cant = self.conditions(i)
        share = curvature / episode.curvature if episode.curvature else cant / (episode.cant or 1.0)
        nodes = self._nodes[i]
        position = min(max(share, 0.0), 1.0) * (len(nodes) - 1)
        low = min(int(position), len(nodes) - 2)
        return nodes[low] + (position - low) * (nodes[low + 1] - nodes[low])

    # ------------------------------------------------------------------ resets and steps

    def reset(self, i: int, rng: np.random.Generator, pinned: Mapping[str, Any]) -> None:
        """Start a new episode in one environment and write its observation (see :meth:`draw`)."""
        self.place(i, *self.draw(rng, pinned))

    def start(self, i: int, episode: Episode) -> None:
        """Start a given episode in one environment, from the running equilibrium.

        Raises
        ------
        EquilibriumError
            If the episode has no running equilibrium.
        """
        self.place(i, episode, self._equilibria(episode))

    def draw(self, rng: np.random.Generator, pinned: Mapping[str, Any]) -> tuple[Episode, Array]:
        """Draw an episode and find its equilibria; changes nothing but the generator.

        Raises
        ------
        ParameterError
            If pinned quantities are impossible.
        EquilibriumError
            If the pinned running equilibrium does not exist.
        """
        for _ in range(_REDRAWS):
            episode = draw(self.settings, rng, pinned)
            try:
                return episode, self._equilibria(episode)
            except EquilibriumError:
                if "speed" in pinned and ("radius" in pinned or "curvature" in pinned):
                    raise
        raise EquilibriumError(
            f"none of {_REDRAWS} conditions drawn has a running equilibrium; narrow the ranges",
            math.inf,
        )

    def _equilibria(self, episode: Episode) -> Array:
        """Return the plant's equilibria at equal shares of the episode's curve, shape (NODES, n)."""
        plant = episode.plant
        kernels = plant.kernels()
        layout = kernels.LAYOUT
        vehicle = tuple(plant.parameters.values())
        if vehicle not in self._tangent_states:
            if plant is not self.model.plant:
                self._tangent_states.clear()  # of other random vehicles
            # at one speed always, so that the last bit does not depend on earlier episodes
            found = find_equilibrium(plant, speed=LOWEST_SPEED).state
            self._tangent_states[vehicle] = found
        w = np.zeros(layout.rows)
        w[layout.p : layout.dx], tables = plant.rows()
        w[: layout.u] = self._tangent_states[vehicle]
        w[layout.c] = episode.speed
        out = np.empty((self._kernels.NODES, plant.n_states))
        curve = (episode.curvature, episode.cant)
        found = kernels.follow_curve(w, tables, *self._cells, plant.scale, *curve, out)
        if found < len(out):
            raise EquilibriumError(
                f"{plant.name} has no running equilibrium at {episode.speed:g} m/s on a curve of "
                f"{episode.radius:g} m with cant {episode.cant:g} rad that can be followed from "
                "tangent track",
                math.inf,
                episode.speed,
            )
        return out

    @cached_property
    def _guided(self) -> tuple[Guided, ...]:
        """The wheelsets, with the numbers of the settings' vehicle."""
        return self.model.guided

    @cached_property
    def _sites(self) -> dict[str, float]:
        """Places of the bodies of the settings' vehicle."""
        return self.model.sites

    @cached_property
    def _cells(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows and columns of the nonzero entries of the plant's Jacobian."""
        rows, columns = np.array(self.model.plant.kernels().CELLS).T
        return np.ascontiguousarray(rows), np.ascontiguousarray(columns)

    def place(self, i: int, episode: Episode, nodes: Array) -> None:
        """Start an episode in one environment and write its observation."""
        model, k, layout = self.model, self._kernels, self._layout
        w, e = self._view(self._blocks, i), self._view(self._extras, i)
        plant, n = episode.plant, len(model.plant.parameters)
        w[:] = 0.0
        w[layout.p : layout.dx] = self._rows
        w[layout.p : layout.p + n] = list(plant.parameters.values())
        w[layout.c] = episode.speed
        e[:] = 0.0
        e[k.E_CURVATURE], e[k.E_CANT] = episode.curvature, episode.cant
        e[k.E_PLAN : k.E_PLAN + 4] = episode.plan
        e[k.E_OFFSET], e[k.E_LEVEL] = episode.line_offset, episode.irregularity_factor
        e[k.E_GRAVITY] = model.gravity
        e[k.E_FAILED] = episode.failed_actuator
        e[k.E_FAILURE] = round(episode.failure_time / self.settings.control_period)
        if k.N_FORCES:
            e[k.E_STATIC], e[k.E_AXLE_LIMIT] = plant.axle_load / 2.0, en_limit(plant.axle_load)
        for row, g in enumerate(self._guided if plant is model.plant else plant.guided):
            e[k.E_CLEARANCE + row], e[k.E_AHEAD + row] = g.clearance, g.x
            e[k.E_WAVENUMBER + row] = 2.0 * math.pi / g.wavelength
            e[k.E_RADIUS + row], e[k.E_GAUGE + row] = g.wheel_radius, g.half_gauge
            e[k.E_TOP + 4 * row : k.E_TOP + 4 * row + 4] = flange_tops(g)
            if k.N_FORCES:  # of all wheelsets or of none
                limits = nadal_limits(self.settings.nadal_limit, g)
                e[k.E_NADAL + 2 * row : k.E_NADAL + 2 * row + 2] = limits
        sites = self._sites if plant is model.plant else plant.sites
        e[k.E_PLACE : k.E_LIMIT] = list(sites.values())
        e[k.E_LIMIT : k.E_BIAS] = model.limits
        spread = (model.sensors.accelerometer_bias, model.sensors.gyro_bias)
        readings = 2 * len(model.sensed)
        e[k.E_BIAS : k.E_REFERENCE] = episode.biases[:readings] * np.tile(spread, readings // 2)
        e[k.E_REFERENCE : k.E_LIFTED] = self._references(episode, nodes).ravel()
        at_start = 1.0 if episode.plan[0] < 0.0 else 0.0
        state = model.steady_state(
            nodes[-1] if at_start else nodes[0],
            speed=episode.speed,
            curvature=at_start * episode.curvature,
            cant=at_start * episode.cant,
        )
        for name in plant.lateral_states:
            state[model.state_names.index(name)] += episode.offset
        w[: layout.u] = state
        self._window[i] = math.ceil(2.0 / (episode.speed * self.settings.control_period))
        self._seeds[i] = episode.noise_seed
        self._ring[i] = 0.0
        self.terms[i] = 0.0
        self.steps[i] = 0
        self._nodes[i] = nodes
        self.episodes[i] = episode
        self.observations[i, len(self._measured) :] = self._context_of(plant)
        block, lane = divmod(i, self._lanes)
        k.observe_one(
            self._blocks[block],
            self._extras[block],
            lane,
            i,
            self._plan,
            self._real_plan,
            self._arrays,
        )

    def _references(self, episode: Episode, nodes: Array) -> Array:
        """Return the table of reference values for the rewards, shape (NODES, REFERENCES)."""
        names = self.model.plant.state_names
        wanted = (*(g.y for g in self._guided), *(g.psi for g in self._guided))
        columns = [nodes[:, names.index(n)] for n in wanted]
        share = np.linspace(0.0, 1.0, len(nodes))
        run = Running(episode.speed, share * episode.curvature, share * episode.cant)
        motions = episode.plant.equations.motions(list(nodes.T))
        gravity = episode.plant.gravity
        columns += [specific_force(0.0, motions[body], run, gravity) for body in self.model.sensed]
        return np.stack(columns, axis=1)

    def step(self, actions: NDArray[np.floating]) -> None:
        """Advance all environments by one control period.

        Parameters
        ----------
        actions : ndarray, shape (n, n_actuators)
            Commands as shares of the limit, clipped to [-1, 1].
        """
        commands = np.asarray(actions, dtype=float)
        inputs = (
            self._blocks,
            self._extras,
            self._tables,
            commands,
            self._plan,
            self._real_plan,
            self._arrays,
        )
        if self._lanes > 1:
            threads = min(usable_threads(), max(1, self.n // THREAD_PAYS_FROM))
            pool.run(partial(self._kernels.control_steps_shared, *inputs), threads)
        else:
            self._kernels.control_steps(*inputs)
        self.steps += 1

    def totals(self, i: int) -> dict[str, float]:
        """Return running totals of one environment's episode."""
        k, e = self._kernels, self._view(self._extras, i)
        steps = max(1, int(self.steps[i]))
        return {
            "acceleration_rms": math.sqrt(e[k.E_FORCE2] / steps),
            "acceleration_peak": float(e[k.E_PEAK]),
            "effort_rms": math.sqrt(e[k.E_EFFORT2] / steps),
            "distance": float(e[k.E_DISTANCE]),
        }

    def recent(self, i: int) -> Array:
        """Return signals of the last 2 s and 100 m, oldest first, shape (samples, RING_SIGNALS).

        Of one environment: lateral displacement of each wheelset from the equilibrium (m), sum of
        guiding forces of each axle whose forces are known (N), specific force of each body of
        :attr:`railenv.Equipped.watched` from the steady one (m/s^2).
        """
        steps, ring = int(self.steps[i]), self._ring[i]
        in_order = np.roll(ring, -(steps % len(ring)), axis=0)
        kept = _readings_of(self.conditions(i)[0], self.settings.control_period)
        return in_order[len(ring) - min(steps, kept, len(ring)) :]

    # ------------------------------------------------------------------ exact resume

    _KEPT = (
        "_blocks",
        "_extras",
        "episodes",
        "observations",
        "terms",
        "steps",
        "_ring",
        "_window",
        "_seeds",
        "_nodes",
    )

    def snapshot(self) -> dict[str, Any]:
        """Return a copy of everything that changes."""
        return {name: copy.copy(getattr(self, name)) for name in self._KEPT}  # episodes never change

    def restore(self, kept: Mapping[str, Any]) -> None:
        """Go back to a snapshot of a fleet with the same settings."""
        for name in self._KEPT:
            there, given = getattr(self, name), kept[name]
            if len(given) != len(there) or getattr(given, "shape", 0) != getattr(there, "shape", 0):
                raise ParameterError(
                    f"the state given has another {name} than this environment; it must come from one "
                    "with the same settings and number of environments"
                )
            setattr(self, name, copy.copy(given))
        self._join()

    def __getstate__(self) -> dict[str, Any]:
        """Leave out compiled kernels; they are found again on disk."""
        return {key: value for key, value in self.__dict__.items() if key != "_kernels"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._kernels = self.model.kernels(self._lanes, program="environment")
        self._join()


def _delay(settings: Settings, delay: float) -> tuple[int, int, int]:
    """Return the integration steps before and after a command change, and slots of the delay line."""
    T = settings.control_period
    slots = delay_slots(delay, T)
    rest = delay - (slots - 2) * T
    if rest < 1e-9 * T:
        return 0, max(1, math.ceil(T / settings.time_step - 1e-9)), slots
    before = max(1, math.ceil(rest / settings.time_step - 1e-9))
    return before, max(1, math.ceil((T - rest) / settings.time_step - 1e-9)), slots


def broadcast_options(options: Mapping[str, Any] | None, n: int) -> Sequence[dict[str, Any]]:
    """Split options whose values may be arrays of n into one mapping per environment.

    Raises
    ------
    ParameterError
        If an array has another length.
    """
    split: list[dict[str, Any]] = [{} for _ in range(n)]
    for name, value in checks.mapping("options", options).items():
        try:
            shape = np.shape(value)
        except ValueError:
            raise ParameterError(
                f"option {name} is {shown(value)}; it must be one number or {n} of them"
            ) from None
        if shape == ():
            values = [value] * n
        elif shape == (n,):
            values = list(value)
        else:
            raise ParameterError(f"option {name} has shape {shape}; it must be one number or ({n},)")
        for pinned, one in zip(split, values, strict=True):
            pinned[name] = one
    return split
