"""What trains and evaluates controllers of hunting bogies.

``agents.sb3`` gives the vector environments to Stable-Baselines3 (extra ``rl``). Controllers and their
evaluation are not in this version yet.

The name ``agents`` is used by other distributions too; ``__distribution__`` tells this one.
"""

__distribution__ = "railenv"

__all__: list[str] = []
