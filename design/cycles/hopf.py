"""The kind of a Hopf point: hunting that grows gently from zero, or that jumps.

There are two answers because the equations are barely twice differentiable near zero creep. The first
Lyapunov coefficient, of the normal form, holds for amplitudes too small to matter; the direction in
which the branch of limit cycles leaves holds for visible amplitudes.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.continuation import CycleContinuation
from design.cycles.cycle import CycleError
from design.cycles.lyapunov import lyapunov_coefficient
from design.cycles.shooting import Setting, Shooting
from design.cycles.starts import hopf_mode
from design.stability.critical_speed import SPEED_RANGE, critical_speed
from design.stability.loss import CriticalSpeed, HopfPoint, analyse_hopf_points_by
from design.stability.mode_shape import displacement_rows
from railenv import checks
from railenv.models import Model

Array = NDArray[np.float64]

AMPLITUDES = (0.1, 1.0)
"""Amplitudes between which the branch's direction is measured, in units of the model's scale (mm)."""

_POINTS = 25


def hopf_point(
    model: Model,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    speed_range: tuple[float, float] = SPEED_RANGE,
    inputs: ArrayLike | None = None,
    critical: CriticalSpeed | None = None,
) -> HopfPoint:
    """Find the Hopf point of a model and say whether hunting grows gently from it or jumps.

    Parameters
    ----------
    model : Model
    radius, cant, speed_range, inputs
        As in :func:`design.critical_speed`.
    critical : CriticalSpeed, optional
        The Hopf point, if it is already known.

    Raises
    ------
    CycleError
        If stability is not lost by hunting.
    """
    u = checks.vector("inputs", inputs, model.input_names)
    found = critical or critical_speed(
        model, radius=radius, cant=cant, speed_range=speed_range, inputs=u
    )
    if found.loss != "hunting" or found.speed is None or found.state is None:
        raise CycleError(f"{model.name} has no Hopf point: {found}")
    setting = Setting(model, "speed", found.speed, checks.curvature(found.radius), found.cant, u)
    coefficient, valid = _normal_form(setting, found)
    amplitudes, speeds = _direction(setting, found)
    return HopfPoint(found, coefficient, valid, amplitudes, speeds)


@analyse_hopf_points_by
def _found_before(model: Model, critical: CriticalSpeed) -> HopfPoint:
    return hopf_point(model, inputs=critical.inputs, critical=critical)


def _direction(
    setting: Setting, hopf: CriticalSpeed
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return two amplitudes (m) and the speeds (m/s) of the limit cycles with them."""
    assert hopf.speed is not None
    limits = (0.2 * hopf.speed, 5.0 * hopf.speed)
    run = CycleContinuation.from_hopf(setting, hopf, limits, 0.3, None)
    scale, rows = setting.model.scale, displacement_rows(setting.model)
    k = rows[int(np.argmax((run.cycles[0].amplitudes / scale)[rows]))]
    wanted = tuple(a * float(scale[k]) for a in AMPLITUDES)
    while run.cycles[-1].amplitudes[k] < wanted[1] and len(run.cycles) < _POINTS:
        run.run(len(run.cycles) + 1, progress=False)
        if run.ending is not None:
            break
    amplitudes = np.array([c.amplitudes[k] for c in run.cycles])
    speeds = np.array([c.value for c in run.cycles])
    ends = max(wanted[0], float(amplitudes[0])), min(wanted[1], float(amplitudes.max()))
    low, high = (float(np.interp(a, amplitudes, speeds)) for a in ends)
    return ends, (low, high)


def _normal_form(setting: Setting, hopf: CriticalSpeed) -> tuple[float | None, float | None]:
    """Return the first Lyapunov coefficient and the amplitude (m) up to which it holds.

    None if the differences do not converge.
    """
    assert hopf.state is not None
    assert hopf.eigenvalue is not None
    assert hopf.speed is not None
    state, speed = hopf.state, hopf.speed
    shooting = Shooting(setting, 1)
    part = _one_part(setting, hopf_mode(shooting, hopf))

    def jacobian(displacement: Array) -> Array:
        return shooting.jacobian(state + displacement, speed)

    coefficient, multiple = lyapunov_coefficient(jacobian, part, abs(hopf.eigenvalue.imag))
    largest = float(np.abs(part[displacement_rows(setting.model)]).max())
    return coefficient, None if multiple is None else multiple * largest


def _one_part(setting: Setting, mode: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the mode of one uncoupled part if several move: each has the same normal form."""
    shooting = Shooting(setting, 1)
    everything = np.tile(np.arange(len(mode), dtype=float), (2, 1))
    everything[1] += setting.model.scale
    for part in shooting.parts(everything):
        if np.abs(mode[part]).max() > 0.0:
            alone = np.zeros_like(mode)
            alone[part] = mode[part]
            return alone
    return mode
