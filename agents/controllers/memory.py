"""Features of a learned policy beside the observation: filters, past commands, a base's demand.

Accelerometers and gyros show little at one instant. Readings and commands, each passed through some
first-order low-pass filters, carry as much information as an observer: any linear controller whose
poles are those corners is a static law of them. Training and the finished policy use the same class.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.controllers.scheduled import ScheduledController
from railenv import checks
from railenv.envs.fleet import BOUND
from railenv.envs.observation import Reading
from railenv.errors import ParameterError

Array = NDArray[np.float64]

BY_SPEED = " by speed"
"""End of the names of features that are multiplied by the speed."""

_FILTERED = ("accelerometer_", "gyro_")
_EVEN = ("z_", "dz_", "speed")  # unchanged in the mirror image of a motion


@dataclass(frozen=True)
class MemorySettings:
    """The memory of a policy.

    Attributes
    ----------
    history : int
        Number of past observations stacked below the present one, as in the environments' keyword.
    corners : tuple of float
        Corner frequencies of the low-pass filters of every accelerometer, gyro and command, Hz.
    past_commands : int
        Number of latest commands.
    schedule : (float, float), optional
        Two speeds, m/s. Every filtered reading, filter and command times the speed, scaled to -1 to 1
        between these two, is one more feature, so that a linear law of all has gains linear in speed.
    """

    history: int = 0
    corners: tuple[float, ...] = ()
    past_commands: int = 0
    schedule: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name in ("history", "past_commands"):
            checks.whole(name, getattr(self, name), low=0)
        if not isinstance(self.corners, (list, tuple)):
            raise ParameterError(f"corners is {self.corners!r}; it must be frequencies in Hz")
        corners = [
            checks.number("corner of a filter", f, low=0.0, open_low=True, unit="Hz")
            for f in self.corners
        ]
        object.__setattr__(self, "corners", tuple(corners))
        if self.schedule is not None:
            object.__setattr__(self, "schedule", _schedule(self.schedule))


def _schedule(given: Sequence[float]) -> tuple[float, float]:
    try:
        low, high = given
    except (TypeError, ValueError):
        raise ParameterError(f"schedule is {given!r}; it must be two speeds in m/s") from None
    low, high = checks.speed(low, "lowest speed of the schedule"), checks.speed(high)
    if not low < high:
        raise ParameterError(f"schedule is ({low:g}, {high:g}); the lowest speed must come first")
    return low, high


@dataclass(frozen=True)
class LinearMemory:
    """A linear memory about any motion: features = Fs s + Fy y, next state = Gs s + Gy y + Gu u.

    y is the observation in the units of the environment, u the command as a share of the limit.
    """

    Fs: Array
    Fy: Array
    Gs: Array
    Gy: Array
    Gu: Array


class Memory:
    """Filters, past commands and base controllers of vehicles side by side.

    Parameters
    ----------
    settings : MemorySettings
        Settings; ``history`` is left to the environment or the policy.
    readings : sequence of Reading
        Entries of an observation without history.
    commands : sequence of str
        Inputs of the model that are commanded.
    period : float
        Control period, s.
    base : ScheduledController, optional
        Controller to whose command the policy's is added; its demand is a feature.

    Raises
    ------
    ParameterError
        If the base reads or commands something else.
    """

    def __init__(
        self,
        settings: MemorySettings,
        readings: Sequence[Reading],
        commands: Sequence[str],
        period: float,
        base: ScheduledController | None = None,
    ) -> None:
        self.settings = settings
        self.readings = tuple(readings)
        self.commands = tuple(commands)
        self.base = copy.deepcopy(base)
        if base is not None and (
            [r.name for r in base.readings] != [r.name for r in readings]
            or tuple(base.commands) != self.commands
            or abs(base.period - period) > 1e-9 * period
        ):
            raise ParameterError(
                f"the base controller reads {[r.name for r in base.readings]} and commands "
                f"{list(base.commands)} every {base.period:g} s; it must read "
                f"{[r.name for r in readings]} and command {list(commands)} every {period:g} s"
            )
        self.filtered = [i for i, r in enumerate(readings) if r.name.startswith(_FILTERED)]
        self._speed_at = next(i for i, r in enumerate(readings) if r.name == "speed")
        self._keep = np.exp(-2.0 * math.pi * period * np.array(settings.corners, dtype=float))
        self.reset(1)

    @property
    def names(self) -> list[str]:
        """Names of the features, in their order."""
        corners, past = self.settings.corners, range(1, self.settings.past_commands + 1)
        signals = [self.readings[i].name for i in self.filtered]
        named = [f"{name} below {f:g} Hz" for f in corners for name in signals]
        named += [f"{name} below {f:g} Hz" for f in corners for name in self.commands]
        named += [f"{name}[-{age}]" for age in past for name in self.commands]
        if self.settings.schedule is not None:
            named += [f"{name}{BY_SPEED}" for name in (*signals, *named)]
        return named + [f"base {name}" for name in self.commands if self.base is not None]

    @property
    def signs(self) -> Array:
        """Signs by which observation (with its history) and features change in the mirror image."""
        one = [1.0 if r.drawn or r.name.startswith(_EVEN) else -1.0 for r in self.readings]
        return np.array(one * (self.settings.history + 1) + [-1.0] * len(self.names))

    def reset(self, count: int) -> None:
        """Start anew for some vehicles side by side."""
        n, m = len(self._keep), len(self.commands)
        self._readings = np.zeros((count, n, len(self.filtered)))
        self._commands = np.zeros((count, n, m))
        self._past = np.zeros((count, self.settings.past_commands, m))
        self._fresh = np.ones(count, dtype=bool)
        self._seen = np.zeros((count, len(self.filtered)))
        self.demand = np.zeros((count, m))
        if self.base is not None:
            self.base.reset(count)

    def reset_rows(self, rows: NDArray[np.bool_]) -> None:
        """Start anew for some of them; ``rows`` is a mask of shape (count,)."""
        self._commands[rows] = 0.0
        self._past[rows] = 0.0
        self._fresh[rows] = True
        if self.base is not None:
            self.base.reset_rows(rows)

    def features(self, observation: NDArray[np.floating]) -> Array:
        """Return the features for an observation, shape (count, n_features).

        Filters start settled at the first observation. ``demand`` is then the demand of the base, as
        shares of the limit. No state changes before :meth:`advance`.
        """
        y = np.asarray(observation, dtype=float)
        self._seen = y[:, self.filtered]
        if self._fresh.any():
            self._readings[self._fresh] = self._seen[self._fresh][:, None, :]
            self._fresh[:] = False
        parts = [self._smoothed(), self._commands, self._past]
        if self.settings.schedule is not None:
            share = self._share(y[:, self._speed_at] * self.readings[self._speed_at].scale)
            parts += [share.reshape(-1, *[1] * (part.ndim - 1)) * part for part in (self._seen, *parts)]
        if self.base is not None:
            self.demand = np.asarray(self.base.propose(y), dtype=float)
            parts.append(np.clip(self.demand, -BOUND, BOUND))
        return np.concatenate([part.reshape(len(y), -1) for part in parts], axis=1)

    def _share(self, speeds: Array) -> Array:
        """Return speeds (m/s) scaled to -1 to 1 between those of the schedule."""
        assert self.settings.schedule is not None
        low, high = self.settings.schedule
        return np.asarray(np.clip((2.0 * speeds - low - high) / (high - low), -1.0, 1.0))

    def _smoothed(self) -> Array:
        keep = self._keep[:, None]
        return keep * self._readings + (1.0 - keep) * self._seen[:, None, :]

    def advance(self, shares: Array) -> None:
        """Advance by a control period with commands (shares of the limit), shape (count, m)."""
        keep = self._keep[:, None]
        self._readings = self._smoothed()
        self._commands = keep * self._commands + (1.0 - keep) * shares[:, None, :]
        if self._past.shape[1]:
            self._past = np.concatenate([shares[:, None, :], self._past[:, :-1]], axis=1)
        if self.base is not None:
            self.base.advance(shares)

    # ------------------------------------------------------------------ linear form

    def linear(self, signals: Array) -> LinearMemory:
        """Return the memory as a linear system about constant signals (SI units)."""
        width, m, c = len(self.readings), len(self.commands), len(self._keep)
        f, p = len(self.filtered), self.settings.past_commands
        speed = np.asarray(signals)[[self._speed_at]]
        base = None if self.base is None else [M[0] for M in self.base.law.at(speed)]
        b = 0 if base is None else len(base[0])
        sizes = (c * f, c * m, p * m, b)
        ends = np.cumsum(sizes)
        zr, zu, past, zb = (slice(e - s, e) for e, s in zip(ends, sizes, strict=True))
        n = int(ends[-1])
        Fs, Fy = np.zeros((past.stop, n)), np.zeros((past.stop, width))
        Gs, Gy, Gu = np.zeros((n, n)), np.zeros((n, width)), np.zeros((n, m))
        pick = np.eye(width)[self.filtered]
        Fs[: past.stop, : past.stop] = np.eye(past.stop)
        Fs[zr, zr] = Gs[zr, zr] = np.kron(np.diag(self._keep), np.eye(f))
        Fy[zr] = Gy[zr] = np.kron((1.0 - self._keep)[:, None], pick)
        Gs[zu, zu] = np.kron(np.diag(self._keep), np.eye(m))
        Gu[zu] = np.kron((1.0 - self._keep)[:, None], np.eye(m))
        if p:
            Gu[past] = np.eye(p * m, m)
            Gs[past, past] = np.eye(p * m, k=-m)
        if self.settings.schedule is not None:
            share = self._share(speed)[0]
            Fs = np.vstack([Fs, np.zeros((f, n)), share * Fs])
            Fy = np.vstack([Fy, share * pick, share * Fy])
        if base is not None and self.base is not None:
            A, B, C, D, E = base
            scales = np.array([reading.scale for reading in self.readings])
            demand = np.zeros((m, n))
            limits = self.base.limits
            demand[:, zb] = C / limits[:, None]
            Fs, Fy = np.vstack([Fs, demand]), np.vstack([Fy, D * scales / limits[:, None]])
            Gs[zb, zb], Gy[zb], Gu[zb] = A, B * scales, E * limits
        return LinearMemory(Fs, Fy, Gs, Gy, Gu)
