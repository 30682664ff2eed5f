"""The time limit of Gymnasium's wrapper, seen from inside the environment."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

import gymnasium as gym
from gymnasium.wrappers import TimeLimit

_RESETS = TimeLimit.reset.__code__


def time_limit(env: gym.Env[Any, Any]) -> int | None:
    """Return the control steps that a wrapper allows an episode whose reset is under way.

    ``gymnasium.make`` passes ``max_episode_steps`` only to the wrapper ``TimeLimit``; an environment
    that does not know the limit cannot put the episode's metrics into its last info. Every wrapper
    resets the environment that it wraps, so its call is among those that lead here.

    Returns
    -------
    int or None
        The least limit; None if there is no such wrapper.
    """
    limits = []
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if frame.f_code is _RESETS:
            wrapper = frame.f_locals["self"]
            if wrapper.unwrapped is env:
                limits.append(wrapper._max_episode_steps)
        frame = frame.f_back
    return min(limits, default=None)
