"""The passive equivalent of an actuator: a damper and a spring in parallel.

A controller is a list of numbers; a damper has a rate and a stiffness. In a mode all motions follow
``exp(s t)``, so the moment M of an actuator and the turning rate across it have a fixed complex ratio.
A damper of rate c and a spring of stiffness k in parallel give ``M = -(c + k / s) dpsi``: the c and k
that satisfy this are the actuator's equivalent for this motion, whatever the controller is. A passive
damper on rubber ends (Maxwell's element) has them too, and can be compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import design
from design.loop.sampled import continuous
from railenv import Equipped, checks
from railenv.errors import ParameterError

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_FREQUENCIES = (0.3, 40.0)  # Hz, of hunting; modes outside belong to the controller


@dataclass(frozen=True)
class EquivalentDamper:
    """An actuator as a damper and a spring, in the least damped oscillation at each speed.

    Attributes
    ----------
    speed : ndarray, shape (n_speeds,)
        m/s.
    growth, frequency : ndarray, shape (n_speeds,)
        Growth rate and frequency of that mode of the closed loop, 1/s and Hz.
    rate : ndarray, shape (n_speeds,)
        Damping rate, N m s/rad; negative where the actuator feeds the motion.
    stiffness : ndarray, shape (n_speeds,)
        Stiffness, N m/rad; negative where its moment leads the turning rate.
    """

    speed: Array
    growth: Array
    frequency: Array
    rate: Array
    stiffness: Array

    def plot(self, axes: Sequence[Axes] | None = None, label: str = "") -> control.ControlPlot:
        """Draw rate and stiffness over speed, one below the other."""
        from agents.evaluation.equivalent_plots import plot_equivalent

        return plot_equivalent({label: self}, axes)


def equivalent_damper(
    model: Equipped, controller: Any, speeds: Sequence[float], *, actuator: str | None = None
) -> EquivalentDamper:
    """Return an actuator's equivalent damper and spring in the least damped mode, on tangent track.

    Parameters
    ----------
    model : Equipped
    controller : design.Feedback
    speeds : sequence of float
        m/s.
    actuator : str, optional
        Name of its mount, such as ``"b"``; the first one when left out.

    Returns
    -------
    EquivalentDamper

    Raises
    ------
    UnknownNameError
        If there is no such actuator.
    ParameterError
        If it is not a yaw actuator, or there is no oscillation from 0.3 to 40 Hz at a speed.
    EquilibriumError
        If there is no equilibrium at a speed.
    """
    mounts = {mount.name: mount for mount in model.equipment.mounts}
    name = next(iter(mounts), "") if actuator is None else actuator
    checks.known("actuator", [name], list(mounts))
    mount = mounts[name]
    if mount.acts != "yaw":
        raise ParameterError(
            f"actuator is {name!r}, a {mount.acts} one; only a yaw actuator can be like a yaw damper"
        )
    ends = [
        (sign, model.state_names.index(f"dpsi_{body}"))
        for sign, body in zip((1.0, -1.0), mount.between, strict=True)
        if body in model.body_names
    ]
    moment = model.state_names.index(mount.state_names[0])
    at = checks.numbers("speeds", speeds, least=1)
    found = np.array([_at(model, controller, float(v), moment, ends) for v in at])
    return EquivalentDamper(at, *found.T)


def _at(
    model: Equipped, controller: Any, speed: float, moment: int, ends: list[tuple[float, int]]
) -> tuple[float, float, float, float]:
    """Return growth, frequency, rate and stiffness at a speed."""
    loop = design.closed_loop(model, controller, speed=speed)
    multipliers, vectors = np.linalg.eig(loop.system.A)
    s = continuous(multipliers.astype(complex), loop.period)
    hertz = s.imag / (2.0 * math.pi)
    low, high = _FREQUENCIES
    swings = np.flatnonzero((hertz >= low) & (hertz <= high))
    if not len(swings):
        raise ParameterError(
            f"speed is {speed:g} m/s; the closed loop must oscillate there, from {low:g} to {high:g} Hz"
        )
    k = swings[np.argmax(s[swings].real)]
    turning = sum(sign * vectors[i, k] for sign, i in ends)
    ratio = -vectors[moment, k] / turning
    inverse = 1.0 / s[k]
    stiffness = ratio.imag / inverse.imag
    rate = ratio.real - stiffness * inverse.real
    return float(s[k].real), float(hertz[k]), float(rate), float(stiffness)
