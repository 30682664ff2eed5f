"""The spec that Gymnasium keeps of an environment, in a form that JSON can hold."""

from __future__ import annotations

import dataclasses

from gymnasium.envs.registration import EnvSpec

from railenv.envs.given import plain


def described(spec: EnvSpec, steps: int) -> EnvSpec:
    """Return a spec with keywords as plain values, and the control steps of an episode.

    Parameters
    ----------
    spec : EnvSpec
        The spec from Gymnasium, with the keywords as they were given.
    steps : int
        Control steps after which an episode ends by itself.
    """
    keywords = {name: value for name, value in spec.kwargs.items() if name != "max_episode_steps"}
    return dataclasses.replace(spec, kwargs=plain(keywords), max_episode_steps=steps)
