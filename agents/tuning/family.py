"""Families of linear plants, of several vehicles at several speeds, on which controllers are tuned."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import control
import numpy as np
from numpy.typing import NDArray

from agents.controllers.scheduled import Law
from design.linear.linearization import discretize, linearize
from design.linear.regulator import lateral_model
from railenv import Equipped

Array = NDArray[np.float64]

_FLOOR = 1e-12


@dataclass(frozen=True)
class Family:
    """Sampled lateral plants of several vehicles at several speeds, stacked.

    Attributes
    ----------
    A : ndarray, shape (q, n, n)
    B : ndarray, shape (q, n, m)
    S : ndarray, shape (p, n)
        Selects the readings from the states.
    speed : ndarray, shape (q,)
        m/s.
    """

    A: Array
    B: Array
    S: Array
    speed: Array

    @classmethod
    def of(
        cls,
        model: Equipped,
        signals: Sequence[str],
        vehicles: Sequence[Mapping[str, float]],
        speeds: Sequence[float],
        period: float,
        radius: float = math.inf,
        cant: float = 0.0,
    ) -> Self:
        """Linearise and sample a model with each of some changes at each speed, on one curve.

        On tangent track lateral motion is alone; on a curve vertical motion belongs to it.
        """
        A, B, at = [], [], []
        system = None
        for changes in vehicles:
            vehicle = model.replace(**changes)
            for speed in speeds:
                if math.isinf(radius):
                    system = lateral_model(vehicle, speed=speed, period=period, sensors=True)
                else:
                    system = _curving_model(vehicle, speed, period, radius, cant)
                A.append(system.A)
                B.append(system.B)
                at.append(speed)
        assert system is not None
        S = np.zeros((len(signals), system.nstates))
        for row, name in enumerate(signals):
            if name in system.state_labels:
                S[row, system.state_labels.index(name)] = 1.0
        return cls(np.array(A), np.array(B), S, np.array(at))

    def joined(self, other: Family) -> Family:
        """Return both families together."""
        return Family(
            np.concatenate([self.A, other.A]),
            np.concatenate([self.B, other.B]),
            self.S,
            np.concatenate([self.speed, other.speed]),
        )

    def loops(self, A: Array, B: Array, C: Array, D: Array, rows: Sequence[int] | None = None) -> Array:
        """Return the matrices of the closed loops of some plants (all by default) with one law each."""
        chosen = slice(None) if rows is None else list(rows)
        plant, into = self.A[chosen], self.B[chosen]
        q, n, k = len(plant), plant.shape[1], A.shape[1]
        M = np.zeros((q, n + k, n + k))
        M[:, :n, :n] = plant + into @ D @ self.S
        M[:, :n, n:] = into @ C
        M[:, n:, :n] = B @ self.S
        M[:, n:, n:] = A
        return M

    def growth(self, law: Law, period: float) -> Array:
        """Return the growth rate (1/s) of each plant's slowest mode under a scheduled law."""
        A, B, C, D, E = law.at(self.speed)
        M = self.loops(A + E @ C, B + E @ D, C, D)
        largest = np.abs(np.linalg.eigvals(M)).max(axis=1)
        return np.asarray(np.log(np.maximum(largest, _FLOOR)) / period)

    def stable_up_to(self, law: Law, period: float, decay: float) -> float:
        """Return the speed (m/s) up to which every plant decays at a rate (1/s), by interpolation.

        If that fails at the lowest speed, return the excess of the growth rate, negative.
        """
        speeds = np.unique(self.speed)
        excess = self.growth(law, period) + decay
        worst = np.array([excess[self.speed == v].max() for v in speeds])
        failing = np.flatnonzero(worst > 0.0)
        if not len(failing):
            return float(speeds[-1] - 0.01 * worst.max())
        i = int(failing[0])
        if i == 0:
            return float(-worst[0])
        share = -worst[i - 1] / (worst[i] - worst[i - 1])
        return float(speeds[i - 1] + share * (speeds[i] - speeds[i - 1]))


def _curving_model(
    model: Equipped, speed: float, period: float, radius: float, cant: float
) -> control.StateSpace:
    """Sample the whole motion of an equipped vehicle on a curve, its delay included."""
    commands = list(model.command_names)
    whole = linearize(model, speed=speed, radius=radius, cant=cant, inputs=commands)
    return discretize(whole, period, delay=model.delay, delayed=commands)
