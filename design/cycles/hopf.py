"""What kind of Hopf point it is: hunting that grows gently from nothing, or that jumps.

Two answers are given, because the equations are barely twice differentiable near zero creep. The first
Lyapunov coefficient is that of the normal form and tells of amplitudes too small to matter; the
direction in which the branch of limit cycles leaves is that of amplitudes that can be seen.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from design.cycles.continuation import CycleContinuation
from design.cycles.cycle import CycleError
from design.cycles.shooting import Setting, Shooting
from design.cycles.starts import hopf_mode
from design.stability.critical_speed import SPEED_RANGE, critical_speed
from design.stability.loss import CriticalSpeed, HopfPoint, analyse_hopf_points_by
from railenv import checks
from railenv.evaluator import Evaluator
from railenv.models import Model

Array = NDArray[np.float64]

AMPLITUDES = (0.1, 1.0)
"""Amplitudes between which the branch's direction is judged, in units of the model's scale (mm)."""

_POINTS = 25
_LARGEST_DIFFERENCE, _HALVINGS = 1.0, 16  # units of the model's scale
_CONVERGED = 1e-3  # relative difference of successive extrapolated coefficients
_HOLDS = 0.1  # relative error that the range of validity allows


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
        The Hopf point, where it is known already.

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
    """Return two amplitudes (m) and the speeds (m/s) of the limit cycles that have them."""
    assert hopf.speed is not None
    limits = (0.2 * hopf.speed, 5.0 * hopf.speed)
    run = CycleContinuation.from_hopf(setting, hopf, limits, 0.3, None)
    scale = setting.model.scale
    displacements = slice(0, max(len(scale) // 2, 1))
    k = int(np.argmax((run.cycles[0].amplitudes / scale)[displacements]))
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


class _Forms:
    """Second and third derivatives of the right-hand side along directions, from its exact Jacobian.

    They are central differences of the Jacobian over a displacement, a number of times a direction.
    """

    def __init__(self, setting: Setting, state: Array) -> None:
        self._evaluator: Evaluator = setting.model.evaluator()
        self._setting = setting
        self._state = state
        self.A = self._jacobian(np.zeros_like(state))

    def _jacobian(self, displacement: Array) -> Array:
        setting = self._setting
        self._evaluator.set(
            self._state + displacement, setting.speed, setting.curvature, setting.cant, setting.inputs
        )
        return self._evaluator.jacobian()[:, : len(self._state)]

    def second(self, a: Array, b: Array, h: float) -> Array:
        """Second derivative along a and b."""
        return (self._jacobian(h * a) - self._jacobian(-h * a)) @ b / (2.0 * h)

    def third(self, a: Array, b: Array, h: float) -> Array:
        """Third derivative, twice along a and once along b."""
        return (self._jacobian(h * a) - 2.0 * self.A + self._jacobian(-h * a)) @ b / h**2


def _coefficient(forms: _Forms, q: NDArray[np.complex128], omega: float, h: float) -> float:
    """Return the first Lyapunov coefficient with derivatives over h times the eigenvector.

    Kuznetsov, *Elements of Applied Bifurcation Theory*, eq 5.39 (third edition).
    """
    A = forms.A
    values, vectors = np.linalg.eig(A.T)
    p = vectors[:, np.argmin(np.abs(values + 1j * omega))]
    p = p / np.vdot(q, p)
    p = p / np.vdot(p, q)
    re, im = q.real.copy(), q.imag.copy()
    aa, bb = forms.second(re, re, h), forms.second(im, im, h)
    ab = forms.second(re, im, h)
    qq, mixed = aa - bb + 2j * ab, aa + bb
    cubic = forms.third(re, re, h) + forms.third(im, re, h)
    cubic = cubic + 1j * (forms.third(re, im, h) + forms.third(im, im, h))
    constant = np.linalg.solve(A, mixed)
    double = np.linalg.solve(2j * omega * np.eye(len(A)) - A, qq)
    conjugate = q.conj()

    def along(v: Any, w: Any) -> Any:
        """Second derivative along w and v, for a real w and a complex v."""
        size = float(np.abs(w).max()) or 1.0
        unit = h * float(np.abs(q).max()) / size
        return forms.second(w, v.real, unit) + 1j * forms.second(w, v.imag, unit)

    first = along(q, constant)
    second = along(conjugate, double.real) + 1j * along(conjugate, double.imag)
    return float(
        (np.vdot(p, cubic) - 2.0 * np.vdot(p, first) + np.vdot(p, second)).real / (2.0 * omega)
    )


def _normal_form(setting: Setting, hopf: CriticalSpeed) -> tuple[float | None, float | None]:
    """Return the first Lyapunov coefficient and the amplitude (m) up to which it holds.

    The differences are taken over ever smaller amplitudes and extrapolated (Richardson). Where they
    do not converge there is no coefficient.
    """
    assert hopf.state is not None
    assert hopf.eigenvalue is not None
    mode = hopf_mode(Shooting(setting, 1), hopf)
    part = _one_part(setting, mode)
    length = float(np.linalg.norm(part))
    forms = _Forms(setting, hopf.state)
    omega = abs(hopf.eigenvalue.imag)
    sizes = _LARGEST_DIFFERENCE * 0.5 ** np.arange(_HALVINGS)
    raw = np.array([_coefficient(forms, part / length, omega, h * length) for h in sizes])
    extrapolated = (4.0 * raw[1:] - raw[:-1]) / 3.0
    change = np.abs(np.diff(extrapolated)) / np.maximum(np.abs(extrapolated[1:]), 1e-300)
    best = int(np.argmin(change))
    if not change[best] < _CONVERGED:
        return None, None
    limit = float(extrapolated[best + 1])
    good = np.abs(raw - limit) < _HOLDS * abs(limit)
    usable = [float(h) for i, h in enumerate(sizes) if good[i : best + 2].all() and i <= best + 1]
    n = setting.model.n_states
    largest = float(np.abs(part[: max(n // 2, 1)]).max())
    return limit, (max(usable) * largest if usable else None)


def _one_part(setting: Setting, mode: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the mode of one uncoupled part where several move: each has the same normal form."""
    shooting = Shooting(setting, 1)
    everything = np.tile(np.arange(len(mode), dtype=float), (2, 1))
    everything[1] += setting.model.scale
    for part in shooting.parts(everything):
        if np.abs(mode[part]).max() > 0.0:
            alone = np.zeros_like(mode)
            alone[part] = mode[part]
            return alone
    return mode
