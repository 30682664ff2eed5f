"""The time limit that Gymnasium puts around an environment, seen from inside."""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

import gymnasium as gym
from gymnasium.wrappers import TimeLimit

_RESETS = TimeLimit.reset.__code__


def time_limit(env: gym.Env[Any, Any]) -> int | None:
    """Return the control steps that a wrapper lets an episode have that is just being reset.

    ``gymnasium.make`` keeps ``max_episode_steps`` to itself and tells it to the wrapper ``TimeLimit``
    only; an environment that does not know the limit cannot say in its last info how the episode was.
    All wrappers reset what they wrap, so theirs are among the calls that lead here.

    Returns
    -------
    int or None
        The least limit; None where there is no such wrapper.
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
