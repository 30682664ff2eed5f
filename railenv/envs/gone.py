"""Entry points of environments of earlier versions, which name their successors."""

from __future__ import annotations

from typing import Any, NoReturn

from railenv.errors import ParameterError


def _gone(name: str) -> NoReturn:
    raise ParameterError(
        f"railenv/{name}-v0 is gone: the wheel-rail contact has changed, and so has what its episodes "
        f"do; make railenv/{name}-v1"
    )


def bogie_v0(**keywords: Any) -> NoReturn:
    """Raise: railenv/Bogie-v0 is gone.

    Raises
    ------
    ParameterError
        Always.
    """
    _gone("Bogie")


def dual_wheelset_v0(**keywords: Any) -> NoReturn:
    """Raise: railenv/DualWheelset-v0 is gone.

    Raises
    ------
    ParameterError
        Always.
    """
    _gone("DualWheelset")
