"""Running equilibrium as a python-control operating point."""

from __future__ import annotations

import math

import control
from numpy.typing import ArrayLike

from railenv.equilibrium import find_equilibrium
from railenv.models import Model


def equilibrium(
    model: Model,
    *,
    speed: float,
    radius: float = math.inf,
    cant: float = 0.0,
    inputs: ArrayLike | None = None,
    through_folds: bool = False,
) -> control.OperatingPoint:
    """Find the running equilibrium at a speed on a curve.

    It is followed from tangent track at low speed; see :func:`railenv.find_equilibrium`, which takes
    the same parameters and raises the same errors.

    Returns
    -------
    control.OperatingPoint
        Point with ``states``, ``inputs``, ``outputs`` (the states) and, as ``result``, the
        :class:`railenv.equilibrium.Equilibrium` with conditions, residual and access by name.
    """
    found = find_equilibrium(
        model, speed=speed, radius=radius, cant=cant, inputs=inputs, through_folds=through_folds
    )
    return control.OperatingPoint(found.state, found.inputs, outputs=found.state, result=found)
