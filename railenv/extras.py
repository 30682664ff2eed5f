"""Optional packages, and the error if one is missing."""

from __future__ import annotations

import importlib.util

from railenv.errors import MissingPackageError


def require(package: str, distribution: str, what: str, extra: str = "rl") -> None:
    """Raise if a package is not installed.

    Parameters
    ----------
    package, distribution : str
        The name to import, and the name to install.
    what : str
        What needs it.
    extra : str
        The extra that contains it.

    Raises
    ------
    MissingPackageError
    """
    if importlib.util.find_spec(package) is None:
        raise MissingPackageError(
            f"{what} needs {distribution}, which is not installed; install it with "
            f"pip install 'railenv[{extra}]'",
            name=package,
        )


def require_rl(what: str) -> None:
    """Raise if torch, Stable-Baselines3 or its contributions are not installed."""
    require("torch", "torch", what)
    require("stable_baselines3", "stable-baselines3", what)
    require("sb3_contrib", "sb3-contrib", what)
