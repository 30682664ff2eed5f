"""Derivatives of a rollout, backwards in time: the gradient of a loss on states by every command.

A rollout runs in the environments' own kernel. The adjoint goes back through the same Runge-Kutta
steps, whose stages it computes again from the recorded states, with the exact Jacobian of the equations
at every stage: derivatives are those of the discrete steps, limits of actuators and contact included.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.rollout import Rollout
from railenv.envs.fleet import Fleet
from railenv.irregularity import FADE
from railenv.kernels import buffers
from railenv.kernels.loader import LANES

Array = NDArray[np.float64]

SMALL = 1e-3
"""Motion about steady running, in units of the model's scale, below which one map fits all periods.

On tangent track the Jacobian's change is even in the motion, so that the map's error is 1e-6.
"""


class Pulled(NamedTuple):
    """Derivatives of a loss by the initial state and the commands of a control period.

    Attributes
    ----------
    state : ndarray, shape (n, n_states)
    commands : dict of int to ndarray, shape (n, n_actuators)
        By the age (control periods) of the command, which is a share of its limit.
    """

    state: Array
    commands: dict[int, Array]


class _Step(NamedTuple):
    """A Runge-Kutta step: length (s), age of its command, commands, rails, states of its stages."""

    length: float
    age: int
    commands: Array
    rails: Array | None
    stages: list[Array]


class Adjoint:
    """The adjoint of a rollout, which goes back through its control periods.

    Parameters
    ----------
    rollout : Rollout
        A new rollout, which gives vehicles, speeds, track and time step. It is not changed.
    """

    def __init__(self, rollout: Rollout) -> None:
        self._fleet = fleet = rollout.fleet
        self._n, self._m = fleet.model.n_states, fleet.n_actuators
        self._limits, self._scale = fleet.model.limits, fleet.model.scale
        self._steps = fleet.integration_steps
        self._rails = _Rails(fleet, self._steps)
        self._kernels = fleet.model.kernels(LANES["float64"])
        self._layout = self._kernels.LAYOUT
        self._lanes = LANES["float64"]
        self._w = self._buffer()
        cells = np.array(self._kernels.CELLS).reshape(-1, 2)
        used = np.flatnonzero(cells[:, 1] < self._n + self._m)  # the commands are the first inputs
        used = used[np.argsort(cells[used, 1], kind="stable")]
        self._entries, self._rows = self._layout.j + used, cells[used, 0]
        self._columns, self._starts = np.unique(cells[used, 1], return_index=True)
        self.still = np.array([self._steady(i) for i in range(fleet.n)])
        self._map: Pulled | None = None

    def _steady(self, i: int) -> Array:
        """Return the state of vehicle i in steady running."""
        speed, curvature, cant = self._fleet.conditions(i)
        found = self._fleet.equilibrium(i)
        model = self._fleet.model
        return model.steady_state(found, speed=speed, curvature=curvature, cant=cant)

    def _buffer(self) -> Array:
        """Return blocks of rows of lanes with the numbers of every vehicle."""
        fleet, layout, lanes = self._fleet, self._layout, self._lanes
        blocks = -(-fleet.n // lanes)
        self._blocks = buffers.zeros((blocks, layout.rows * lanes))
        rows, self._tables = fleet.model.rows()
        held = np.zeros((fleet.n, layout.dx - layout.u))
        for i, episode in enumerate(fleet.episodes):
            assert episode is not None
            own = list(episode.plant.parameters.values())
            held[i, layout.c - layout.u : layout.p - layout.u] = fleet.conditions(i)
            held[i, layout.p - layout.u :] = [*own, *rows[len(own) :]]
        w = self._blocks.reshape(blocks, layout.rows, lanes)
        w[:, layout.u : layout.dx] = _in_lanes(held, lanes)
        return w

    # ------------------------------------------------------------------ one control period

    def back(self, k: int, state: Array, shares: Array, by_end: Array) -> Pulled:
        """Go back through a control period.

        Parameters
        ----------
        k : int
            Control periods since the start of the rollout.
        state : ndarray, shape (n, n_states)
            State at the start of the period.
        shares : ndarray, shape (more than k, n, n_actuators)
            Commands of every period, as shares of their limits, from -1 to 1.
        by_end : ndarray, shape (n, n_states)
            Derivatives of the loss by the state at the end of the period.

        Returns
        -------
        Pulled
            Derivatives; commands older than the rollout are left out.
        """
        still = (np.abs(state - self.still) <= SMALL * self._scale).all(axis=1)
        if self._rails.uneven:
            still[:] = False
        # a block is processed as a whole, and costs as much as a thousand maps
        blocks = np.flatnonzero(~np.logical_and.reduceat(still, range(0, len(still), self._lanes)))
        pulled = self._by_map(by_end) if len(blocks) < len(self._blocks) else None
        if len(blocks):
            rows = (blocks[:, None] * self._lanes + np.arange(self._lanes)).ravel()
            rows = rows[rows < len(still)]
            found = self._by_steps(k, state, shares, by_end, blocks, rows)
            if pulled is None:
                pulled = found
            else:
                pulled.state[rows] = found.state
                for age, by in found.commands.items():
                    pulled.commands[age][rows] = by
        assert pulled is not None
        return Pulled(pulled.state, {age: g for age, g in pulled.commands.items() if age <= k})

    def _by_map(self, by_end: Array) -> Pulled:
        """Go back through a period of a small motion, always by the same map."""
        if self._map is None:
            self._map = self._mapped()
        column = by_end[:, :, None]
        return Pulled(
            (self._map.state @ column)[:, :, 0],
            {age: (by @ column)[:, :, 0] for age, by in self._map.commands.items()},
        )

    def _mapped(self) -> Pulled:
        """Return the transposed derivatives of a period at steady running, column by column."""
        none = np.zeros((1, self._fleet.n, self._m))
        every = np.arange(len(self._blocks)), np.arange(self._fleet.n)
        columns = [
            self._by_steps(0, self.still, none, np.broadcast_to(unit, self.still.shape), *every)
            for unit in np.eye(self._n)
        ]
        ages = columns[0].commands
        return Pulled(
            np.stack([c.state for c in columns], axis=2),
            {age: np.stack([c.commands[age] for c in columns], axis=2) for age in ages},
        )

    def _by_steps(
        self,
        k: int,
        state: Array,
        shares: Array,
        by_end: Array,
        blocks: NDArray[np.intp],
        rows: NDArray[np.intp],
    ) -> Pulled:
        """Go back through every Runge-Kutta step of a period; for some blocks, of vehicles ``rows``."""
        n = self._n
        back = _in_lanes(by_end[rows], self._lanes)
        commands: dict[int, Array] = {}
        for step in reversed(self._staged(k, state, shares, blocks, rows)):
            self._drive(step, blocks)
            h, whole, before = step.length, back, np.zeros_like(back)
            # from the last stage to the first: weight of its slope, step to the next
            for x, weight, ahead in zip(
                reversed(step.stages), (1.0, 2.0, 2.0, 1.0), (0.0, h, 0.5 * h, 0.5 * h), strict=True
            ):
                by = self._pull(x, h / 6.0 * weight * whole + ahead * before, blocks)
                before = by[:, :n]
                back = back + before
                told = commands.setdefault(step.age, np.zeros_like(by[:, n:]))
                told += by[:, n:]
        count = len(rows)
        return Pulled(
            _in_rows(back, count),
            {age: _in_rows(by, count) * self._limits for age, by in commands.items()},
        )

    def _staged(
        self,
        k: int,
        state: Array,
        shares: Array,
        blocks: NDArray[np.intp],
        rows: NDArray[np.intp],
    ) -> list[_Step]:
        """Run a period again; return the states of the stages of every step."""
        x = _in_lanes(state[rows], self._lanes)
        steps = []
        for i, (h, age) in enumerate(self._steps):
            given = shares[k - age] if age <= k else np.zeros_like(shares[0])
            commands = _in_lanes(given[rows] * self._limits, self._lanes)
            rails = self._rails.at(k, i)
            under = None if rails is None else _in_lanes(rails[rows], self._lanes)
            step = _Step(h, age, commands, under, [x])
            self._drive(step, blocks)
            slopes = [self._slope(x, blocks)]
            for ahead in (0.5 * h, 0.5 * h, h):
                step.stages.append(x + ahead * slopes[-1])
                slopes.append(self._slope(step.stages[-1], blocks))
            x = x + h / 6.0 * (slopes[0] + 2.0 * (slopes[1] + slopes[2]) + slopes[3])
            steps.append(step)
        return steps

    def _drive(self, step: _Step, blocks: NDArray[np.intp]) -> None:
        u = self._layout.u
        self._w[blocks, u : u + self._m] = step.commands
        if step.rails is not None:
            self._w[blocks[:, None], u + self._rails.columns] = step.rails

    def _slope(self, x: Array, blocks: NDArray[np.intp]) -> Array:
        """Return the slopes at some states."""
        layout = self._layout
        out = np.empty_like(x)
        for b, own, slope in zip(blocks, x, out, strict=True):
            self._w[b, : self._n] = own
            self._kernels.rhs(self._blocks[b], self._tables)
            slope[:] = self._w[b, layout.dx : layout.work]
        return out

    def _pull(self, x: Array, by_slope: Array, blocks: NDArray[np.intp]) -> Array:
        """Return the transposed Jacobian at some states times derivatives by the slopes there."""
        out = np.zeros((len(x), self._n + self._m, self._lanes))
        for b, own, by, found in zip(blocks, x, by_slope, out, strict=True):
            self._w[b, : self._n] = own
            self._kernels.jacobian(self._blocks[b], self._tables)
            terms = self._w[b, self._entries]
            terms *= by[self._rows]
            found[self._columns] = np.add.reduceat(terms, self._starts, axis=0)
        return out


class _Rails:
    """Displacements of the rails under every wheelset, step by step, as in the environments.

    Attributes
    ----------
    columns : ndarray
        Their indices among the inputs of the model.
    uneven : bool
        Whether any vehicle runs on irregular track.
    """

    def __init__(self, fleet: Fleet, steps: Sequence[tuple[float, int]]) -> None:
        model, line = fleet.model, fleet.settings.line
        under = [(g.x, g.rails) for g in model.guided if g.rails]
        self.columns = np.array([model.input_names.index(n) for _, names in under for n in names], int)
        self._ahead = np.array([x for x, _ in under])
        self._records = np.array([line.align, line.vert, line.cross])
        self._spacing = line.spacing
        episodes = [episode for episode in fleet.episodes if episode is not None]
        self._speeds = np.array([episode.speed for episode in episodes])
        self._levels = np.array([episode.irregularity_factor for episode in episodes])
        self._offsets = np.array([episode.line_offset for episode in episodes])
        lengths = np.array([h for h, _ in steps])
        self._period, self._middles = lengths.sum(), np.cumsum(lengths) - 0.5 * lengths
        self.uneven = bool(self._levels.any() and len(self.columns))

    def at(self, k: int, step: int) -> Array | None:
        """Return them in a step of control period k, shape (n, columns); None if they are zero."""
        if not self.uneven:
            return None
        s = self._speeds * (k * self._period + self._middles[step])
        level = self._levels * np.minimum(s / FADE, 1.0)
        position = (self._offsets[:, None] + s[:, None] + self._ahead) / self._spacing
        cell = np.floor(position).astype(int)
        here, there = (self._records[:, (cell + i) % self._records.shape[1]] for i in (0, 1))
        values = here + (position - cell) * (there - here)  # kind, vehicle, wheelset
        return np.asarray(level[:, None, None] * values.transpose(1, 2, 0)).reshape(len(s), -1)


def _in_lanes(rows: Array, lanes: int) -> Array:
    """Return rows of vehicles, shape (n, width), as rows of lanes, shape (blocks, width, lanes)."""
    spare = -len(rows) % lanes
    full = np.concatenate([rows, np.repeat(rows[:1], spare, axis=0)])
    return full.reshape(-1, lanes, rows.shape[1]).transpose(0, 2, 1)


def _in_rows(values: Array, count: int) -> Array:
    """Return rows of lanes as rows of vehicles."""
    return values.transpose(0, 2, 1).reshape(-1, values.shape[1])[:count]
