"""Judging a policy during training, by episodes and by its linear critical speeds; extra ``rl``."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

import design
from agents.controllers.learned import LearnedPolicy
from agents.learning.recipe import Criterion, Evaluation
from railenv import Equipped
from railenv.envs.settings import Settings
from railenv.errors import EquilibriumError

HIGHEST_SPEED = 400.0
"""Highest speed of the search for critical speeds (m/s); a policy that is always stable gets it.

A policy that is unstable at the lowest speed, or has no equilibrium there, gets zero.
"""

LOWEST_SPEED = 20.0
"""Speed (m/s) above which a policy must be stable, even if it was trained for faster running.

A train reaches its speed through all lower ones.
"""


@dataclass(frozen=True)
class Judged:
    """The result of an evaluation.

    Attributes
    ----------
    timesteps : int
        Environment steps of training before it.
    mean_return : float
        Mean over the episodes, before any normalisation.
    derailed : float
        Share of the episodes that derailed.
    critical_speed : float
        Linear critical speed of the vehicle on tangent track, m/s; with the robust criterion, the
        lowest over the corners of ``randomize``.
    """

    timesteps: int
    mean_return: float
    derailed: float
    critical_speed: float

    def score(self, criterion: Criterion, highest: float) -> tuple[float, float]:
        """Return the criterion that the best policy maximises, and the one that decides ties.

        Parameters
        ----------
        criterion : str
        highest : float
            Highest speed trained, m/s; faster running does not count.
        """
        reached = 0.0 if criterion == "return" else min(self.critical_speed, highest)
        return reached, self.mean_return


def judge(
    model: Any,
    env: Any,
    policy: LearnedPolicy,
    vehicle: Equipped,
    how: Evaluation,
    settings: Settings,
) -> Judged:
    """Evaluate a model without changing it or drawing random numbers outside ``env``.

    Parameters
    ----------
    model : BaseAlgorithm
    env : VecEnv
        Environment with ``how.episodes`` vehicles, and fixed statistics.
    policy : LearnedPolicy
        Policy of the model.
    vehicle : Equipped
    how : Evaluation
    settings : Settings
        Settings of the environment.
    """
    returns, derailed = _episodes(model, env, how.seed)
    ranges = settings.randomize if how.criterion == "robust_critical_speed" else {}
    corners = [dict(zip(ranges, c, strict=True)) for c in itertools.product(*ranges.values())]
    lowest = min(LOWEST_SPEED, settings.speed_range[0])
    speed = min(
        _critical_speed(vehicle.replace(**corner) if corner else vehicle, policy, lowest)
        for corner in corners
    )
    return Judged(int(model.num_timesteps), float(returns.mean()), float(derailed.mean()), speed)


def _episodes(model: Any, env: Any, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Run one episode in every environment; return their returns and whether they derailed."""
    env.seed(seed)
    observations = env.reset()
    returns, derailed = np.full(env.num_envs, np.nan), np.zeros(env.num_envs, dtype=bool)
    while np.isnan(returns).any():
        actions, _ = model.predict(observations, deterministic=True)
        observations, _, dones, infos = env.step(actions)
        for i in np.flatnonzero(dones & np.isnan(returns)):
            returns[i] = infos[i]["episode"]["r"]
            derailed[i] = infos[i]["derailed"] > 0
    return returns, derailed


def _critical_speed(vehicle: Equipped, policy: LearnedPolicy, lowest: float) -> float:
    limits = (lowest, HIGHEST_SPEED)
    try:
        found = design.critical_speed(vehicle, controller=policy, speed_range=limits)
    except EquilibriumError:
        return 0.0
    if found.speed is not None:
        return float(found.speed)
    return HIGHEST_SPEED if found.loss == "none" else 0.0
