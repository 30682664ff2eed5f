"""Registers the environments with Gymnasium: an entry point that Gymnasium loads when it is imported.

So `import railenv` does not import Gymnasium, and `gymnasium.make("railenv/Bogie-v0")` works without
importing railenv.
"""

from __future__ import annotations


def register() -> None:
    """Register the environments under the namespace that the entry point gives."""
    from gymnasium.envs.registration import register as register_environment

    for name in ("Bogie", "DualWheelset"):
        register_environment(
            f"{name}-v0",
            entry_point=f"railenv.envs.environment:{name}Env",
            vector_entry_point=f"railenv.envs.vector:{name}VectorEnv",
        )
