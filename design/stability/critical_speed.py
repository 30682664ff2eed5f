"""Critical speed: the first speed at which steady running stops being stable.

Stability is lost by hunting (a pair of complex eigenvalues crosses the imaginary axis, a Hopf point),
by divergence (a real eigenvalue crosses it), or because the equilibrium itself ends in a fold, as that
on the tread does on tight curves. The branch of equilibria is followed from low speed, so that the
three are told apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from design.loop.dynamics import Dynamics, dynamics
from design.stability.loss import CriticalSpeed, Loss
from design.stability.mode_shape import displacement_rows
from railenv import checks
from railenv.equilibrium import Branch, Equilibrium, Point, SpeedPath, Stuck, find_equilibrium
from railenv.models import Model
from railenv.threads import one_blas_thread

SPEED_RANGE = (3.0, 400.0)
"""m/s, the range searched unless another is given."""

_ZERO = 1e-9  # real parts below this fraction of the largest eigenvalue are rounding error
_ROOT = 1e-8  # of a step: better than 2e-9 of the speed
_REAL = 1e-3  # imaginary parts below this fraction of the largest count as none at a fold
_CLOSED_LOOP_STEP = 0.06  # of the logarithm of the speed: controllers can have narrow unstable ranges
_CLOSE = 1e-6  # eigenvalues that differ by less than this fraction count as one


def critical_speed(
    model: Model,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    speed_range: tuple[float, float] = SPEED_RANGE,
    inputs: ArrayLike | None = None,
    controller: Any | None = None,
    period: float | None = None,
) -> CriticalSpeed:
    """Find the first speed of a range at which steady running loses stability.

    The equilibrium is followed from tangent track at low speed into the curve and then up in speed,
    through the range at steps of at most 16 %; a loss of stability is located to better than 1e-6
    relative. Where the largest real part peaks below zero between steps, the peak is looked at too.

    Parameters
    ----------
    model : Model
    radius : float
        Curve radius, m; ``math.inf`` is tangent track, negative the other hand.
    cant : float
        Cant angle, rad.
    speed_range : (float, float)
        Lowest and highest speed, m/s.
    inputs : array_like, shape (n_inputs,), optional
        Constant inputs; zero when left out.
    controller : array_like, control.StateSpace or Feedback, optional
        Closes the loop once per control period (:func:`design.closed_loop`); the steps are then at most
        6 %. That the equilibrium ends is still looked for on the vehicle's own branch, without moments.
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.

    Returns
    -------
    CriticalSpeed

    Raises
    ------
    EquilibriumError
        If there is no equilibrium on the curve at the lowest speed, or it has ended below that.

    Examples
    --------
    >>> import design, railenv
    >>> hopf = design.critical_speed(railenv.Bogie(railenv.HIGH_SPEED_COACH))
    >>> round(hopf.speed, 2), round(hopf.frequency, 3)
    (116.47, 3.113)
    """
    low, high = checks.speeds(speed_range)
    u = checks.vector("inputs", inputs, model.input_names)
    judged_by = dynamics(model, controller, period)
    unit = SpeedPath.unit if controller is None else _CLOSED_LOOP_STEP
    with one_blas_thread():
        start = find_equilibrium(model, speed=low, radius=radius, cant=cant, inputs=u)
        branch = Branch(model, SpeedPath(checks.curvature(radius), start.cant, unit), u)
        return _Search(model, branch, start, (low, high), judged_by).run()


@dataclass(frozen=True)
class _Search:
    """One search for the loss of stability along a branch of equilibria."""

    model: Model
    branch: Branch
    start: Equilibrium
    speed_range: tuple[float, float]
    dynamics: Dynamics

    def run(self) -> CriticalSpeed:
        low, high = self.speed_range
        points: list[Point] = []
        sigmas: list[float] = []
        first = self.branch.start(self.start.state, math.log(low))
        try:
            for p in self.branch.points(first, math.log(high)):
                points, sigmas = [*points[-2:], p], [*sigmas[-2:], self._sigma(p)]
                if len(points) == 1:
                    if self._unstable(p, sigmas[0]):
                        return self._result("unstable at start", p)
                    continue
                crossing = self._crossing(points, sigmas)
                if crossing is not None:
                    return self._classified(crossing)
        except Stuck:
            return self._result("end", points[-1])
        return self._result("none", None)

    def _sigma(self, p: Point) -> float:
        return float(self._eigenvalues(p).real.max())

    def _eigenvalues(self, p: Point) -> NDArray[np.complex128]:
        return self.dynamics.eigenvalues(p, self.branch.path.at(p.s))

    def _unstable(self, p: Point, sigma: float) -> bool:
        magnitude = float(np.abs(p.jacobian[:, : self.model.n_states]).max())
        return sigma > _ZERO * max(magnitude, 1.0) ** 0.5

    def _crossing(self, points: list[Point], sigmas: list[float]) -> tuple[Point, bool] | None:
        """Return the point where stability is lost in the newest step, and whether it is a fold."""
        p, q = points[-2:]
        if self._unstable(q, sigmas[-1]) or not q.forward:
            return self._locate(p, q)
        if len(points) == 3:
            left, middle, right = sigmas
            peak = middle > max(left, right)
            if peak and middle + 3.0 * (middle - min(left, right)) > 0.0:
                return self._peak(*points)
        return None

    def _peak(self, *points: Point) -> tuple[Point, bool] | None:
        """Look for an unstable stretch around a local maximum of the growth rate."""
        for p, q in pairwise(points):

            def decay(t: float, p: Point = p, q: Point = q) -> float:
                return -self._sigma(self.branch.between(p, q, t))

            found = optimize.minimize_scalar(
                decay, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-3}
            )
            highest = self.branch.between(p, q, found.x)
            if self._unstable(highest, -found.fun):
                return self._locate(p, highest)
        return None

    def _locate(self, p: Point, q: Point) -> tuple[Point, bool]:
        """Locate the first loss of stability between a stable and an unstable point.

        Returns it, and whether it is a fold: there too a real eigenvalue crosses zero, but the branch
        itself turns back.
        """
        fold = None if q.forward else self._root(p, q, lambda x: float(x.tangent[-1]))
        # a growth rate that is within rounding of zero at p is no bracket: stability is lost at p
        crossing = self._root(p, q, self._sigma) if self._sigma(p) < 0.0 < self._sigma(q) else 0.0
        if fold is not None:
            where = self.branch.between(p, q, crossing)
            real = abs(self._critical(where).imag) < _REAL * self._fastest(where)
            if fold <= crossing or real:
                return self.branch.between(p, q, fold), True
        return self.branch.between(p, q, crossing), False

    def _root(self, p: Point, q: Point, function: Callable[[Point], float]) -> float:
        """Return the fraction of the way from p to q at which a function of the branch crosses 0."""

        def along(t: float) -> float:
            return function(self.branch.between(p, q, t) if 0.0 < t < 1.0 else (q if t else p))

        return float(optimize.brentq(along, 0.0, 1.0, xtol=_ROOT, rtol=_ROOT))

    def _fastest(self, p: Point) -> float:
        return float(np.abs(self._eigenvalues(p)).max())

    def _critical(self, p: Point) -> complex:
        eigenvalues = self._eigenvalues(p)
        return complex(eigenvalues[np.argmax(eigenvalues.real)])

    def _classified(self, crossing: tuple[Point, bool]) -> CriticalSpeed:
        point, fold = crossing
        if fold:
            return self._result("fold", point)
        critical = self._critical(point)
        hunting = abs(critical.imag) > _CLOSE * self._fastest(point)
        return self._result("hunting" if hunting else "divergence", point)

    def _result(self, loss: Loss, point: Point | None) -> CriticalSpeed:
        lost = loss in ("hunting", "divergence", "fold", "end")
        eigenvalue: complex | None = None
        mode: NDArray[np.complex128] | None = None
        multiplicity = 0
        if point is not None:
            n = self.model.n_states
            eigenvalues, vectors = self.dynamics.modes(point, self.branch.path.at(point.s))
            # of a complex pair, the eigenvalue in the upper half plane
            k = int(np.argmax(np.where(eigenvalues.imag >= 0.0, eigenvalues.real, -np.inf)))
            eigenvalue = complex(eigenvalues[k])
            near = np.abs(eigenvalues - eigenvalues[k]) < _CLOSE * np.abs(eigenvalues).max()
            multiplicity = int(near.sum())
            mode = vectors[:n, k]
            shape = mode[displacement_rows(self.model)]
            mode = mode / shape[np.argmax(np.abs(shape))]
        oscillates = eigenvalue is not None and loss in ("hunting", "unstable at start")
        frequency = abs(eigenvalue.imag) / (2.0 * math.pi) if oscillates and eigenvalue else None
        return CriticalSpeed(
            loss=loss,
            speed=math.exp(point.s) if lost and point is not None else None,
            frequency=frequency or None,
            state=None if point is None else point.state,
            eigenvalue=eigenvalue,
            mode=mode,
            multiplicity=multiplicity,
            speed_range=self.speed_range,
            radius=self.start.radius,
            cant=self.start.cant,
            model_name=self.model.name,
            state_names=self.model.state_names,
            inputs=self.start.inputs,
            period=self.dynamics.period,
            _model=self.model,
        )
