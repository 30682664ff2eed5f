"""Motions that actuators of limited moment can bring back: a bound for every controller.

In an unstable mode z' = lambda z + sum b_i u_i with |u_i| <= U_i only motions within a bounded region
can be brought back to rest (T. Hu, Z. Lin, L. Qiu: An explicit description of null controllable regions
of linear systems with saturating actuators, Systems & Control Letters 47, 2002). Its half width in the
direction phi is the integral of exp(-alpha t) sum U_i |b_i| |cos(omega t + phi - arg b_i)|, with
lambda = alpha + i omega; for a slowly growing mode, it is nearly 2 / pi sum U_i |b_i| / alpha. A larger
motion grows under any command, so a linear critical speed has no practical meaning beyond the speed at
which the track itself moves the vehicle that far.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from design.linear.linearization import linearize
from railenv.equipment import Equipped
from railenv.errors import ParameterError

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_DIRECTIONS = 180
_POINTS = 720  # of the integral over half a period
_OSCILLATES = 1e-6  # of a mode's eigenvalue, as imaginary part


@dataclass(frozen=True)
class Recoverable:
    """An unstable mode, and the amplitude that the actuators can bring back.

    Attributes
    ----------
    growth : float
        Growth rate with commands at rest, 1/s.
    frequency : float
        Hz.
    body : str
        Wheelset (or body, if there is none) whose lateral motion is largest in the mode.
    amplitude : float
        Largest amplitude of that motion from which commands within the limits can lead back to rest, m.
    """

    growth: float
    frequency: float
    body: str
    amplitude: float

    def __str__(self) -> str:
        return (
            f"{self.frequency:.2f} Hz, growing at {self.growth:.2f} 1/s: up to "
            f"{1e3 * self.amplitude:.3g} mm of {self.body} can be brought back"
        )


def recoverable_amplitudes(
    model: Equipped, *, speed: float, radius: float = math.inf, cant: float = 0.0
) -> tuple[Recoverable, ...]:
    """Return the amplitude of each unstable mode that actuators can bring back, the least first.

    Each mode is considered as if the others were at rest, so each number is a separate bound. The
    transport delay counts: the motion grows until a first command acts.

    Parameters
    ----------
    model : Equipped
    speed : float
        m/s.
    radius, cant : float
        m (``math.inf`` is tangent track), rad.

    Returns
    -------
    tuple of Recoverable
        The unstable modes; empty if the vehicle is stable.

    Raises
    ------
    ParameterError
        If the model has no actuators.
    EquilibriumError
        If there is no running equilibrium.

    Examples
    --------
    >>> import design, railenv
    >>> bogie = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))
    >>> print(*design.recoverable_amplitudes(bogie, speed=140.0))
    5.01 Hz, growing at 2.35 1/s: up to 39.8 mm of w1 can be brought back
    """
    if not model.command_names:
        raise ParameterError(f"{model.name} has no actuators that could bring a motion back")
    system = linearize(model, speed=speed, radius=radius, cant=cant, inputs=list(model.command_names))
    values, right = np.linalg.eig(np.asarray(system.A))
    left = np.linalg.inv(right)
    wheelsets = [g.name for g in model.guided] or list(model.body_names)
    rows = [model.state_names.index(model.body_states[name]["y"]) for name in wheelsets]
    found = []
    for k in np.flatnonzero((values.real > 0.0) & (values.imag >= 0.0)):
        pushes = left[k] @ np.asarray(system.B) * model.limits
        pair = 1.0 if values[k].imag <= _OSCILLATES * abs(values[k]) else 2.0
        shape = pair * np.abs(right[rows, k])
        reach = _half_width(complex(values[k]), pushes) * math.exp(-values[k].real * model.delay)
        found.append(
            Recoverable(
                growth=float(values[k].real),
                frequency=float(values[k].imag / (2.0 * math.pi)),
                body=wheelsets[int(shape.argmax())],
                amplitude=float(shape.max() * reach),
            )
        )
    return tuple(sorted(found, key=lambda mode: mode.amplitude))


def _half_width(eigenvalue: complex, pushes: Complex) -> float:
    """Return the largest half width of a mode's region from which commands lead back."""
    growth, turn = eigenvalue.real, eigenvalue.imag
    if turn <= _OSCILLATES * abs(eigenvalue):
        return float(np.abs(pushes).sum() / growth)
    half = math.pi / turn  # after half a period the integrand repeats, smaller by exp(-growth half)
    time = (np.arange(_POINTS) + 0.5) * half / _POINTS
    weight = np.exp(-growth * time) * half / _POINTS / -math.expm1(-growth * half)
    direction = np.linspace(0.0, math.pi, _DIRECTIONS, endpoint=False)
    angle = turn * time + direction[:, None] - np.angle(pushes)[:, None, None]
    widths = np.einsum("i,ipt,t->p", np.abs(pushes), np.abs(np.cos(angle)), weight)
    return float(widths.max())
