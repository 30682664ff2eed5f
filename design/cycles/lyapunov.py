"""The first Lyapunov coefficient of a Hopf point, from differences of exact Jacobians."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_LARGEST_DIFFERENCE, _HALVINGS = 1.0, 16  # of the mode given
_CONVERGED = 1e-3  # relative difference of successive extrapolated coefficients ...
_CANCELLED = 0.1  # ... or of this part of the (complex) terms whose real parts cancel
_NOTHING = 1e-200  # a direction that is a rounding error of zero
_HOLDS = 0.1  # relative error that the range of validity allows


@dataclass(frozen=True)
class _Forms:
    """Second and third derivatives of a vector field along directions.

    They are central differences of its Jacobian over a displacement whose largest entry is ``length``.
    """

    jacobian: Callable[[Array], Array]
    length: float

    def _around(self, direction: Array) -> tuple[Array, Array, float]:
        h = self.length / float(np.abs(direction).max())
        return self.jacobian(h * direction), self.jacobian(-h * direction), h

    def second(self, a: Array, b: Complex) -> Complex:
        """Return the second derivative along a real and a complex direction."""
        if not np.abs(a).max() > _NOTHING:
            return np.zeros_like(b)
        ahead, behind, h = self._around(a)
        return np.asarray((ahead - behind) @ b / (2.0 * h))

    def both(self, a: Complex, b: Complex) -> Complex:
        """Return the second derivative along two complex directions."""
        return np.asarray(self.second(a.real, b) + 1j * self.second(a.imag, b))

    def third(self, a: Array, b: Complex) -> Complex:
        """Return the third derivative, twice along a real direction and once along a complex one."""
        if not np.abs(a).max() > _NOTHING:
            return np.zeros_like(b)
        ahead, behind, h = self._around(a)
        middle = self.jacobian(np.zeros_like(a))
        return np.asarray((ahead - 2.0 * middle + behind) @ b / h**2)


def lyapunov_coefficient(
    jacobian: Callable[[Array], Array], mode: Complex, omega: float
) -> tuple[float | None, float | None]:
    """Return the first Lyapunov coefficient, and the multiple of the mode up to which it holds.

    The differences are taken over ever smaller amplitudes and extrapolated (Richardson). If they do not
    converge, because the equations are not smooth enough, there is no coefficient.

    Parameters
    ----------
    jacobian : callable
        Derivatives of the equations at a displacement from the equilibrium, shape (n, n).
    mode : ndarray of complex, shape (n,)
        Critical eigenvector, as large as the largest displacement used.
    omega : float
        Imaginary part of its eigenvalue, rad/s.

    Returns
    -------
    float or None
        As Kuznetsov defines it (*Elements of Applied Bifurcation Theory*, third edition, eq 5.39), for
        an eigenvector of length 1 and divided by omega.
    float or None
        Largest multiple of the mode up to which it holds within 10 %.
    """
    q = mode / np.linalg.norm(mode)
    largest = float(np.abs(mode).max())
    sizes = _LARGEST_DIFFERENCE * 0.5 ** np.arange(_HALVINGS)
    terms = np.array([_terms(_Forms(jacobian, h * largest), q, omega) for h in sizes])
    raw = terms.sum(axis=1).real
    extrapolated = (4.0 * raw[1:] - raw[:-1]) / 3.0
    size = np.maximum(np.abs(extrapolated), _CANCELLED * np.abs(terms[1:]).max(axis=1))
    change = np.abs(np.diff(extrapolated)) / np.maximum(size[1:], 1e-300)
    best = int(np.argmin(change))
    if not change[best] < _CONVERGED:
        return None, None
    limit = float(extrapolated[best + 1])
    good = np.abs(raw - limit) < _HOLDS * abs(limit)
    usable = [float(h) for i, h in enumerate(sizes) if good[i : best + 2].all() and i <= best + 1]
    return limit, (max(usable) if usable else None)


def _terms(forms: _Forms, q: Complex, omega: float) -> Complex:
    """Return the three terms of whose sum the coefficient is the real part."""
    A = forms.jacobian(np.zeros(len(q)))
    values, vectors = np.linalg.eig(A.T)
    p = vectors[:, np.argmin(np.abs(values + 1j * omega))]
    p = p / np.vdot(q, p)
    p = p / np.vdot(p, q)
    re, im, conjugate = q.real.copy(), q.imag.copy(), q.conj()
    mixed = forms.both(q, conjugate).real
    twice = forms.both(q, q)
    cubic = forms.third(re, q) + forms.third(im, q)
    constant = np.asarray(np.linalg.solve(A, mixed), dtype=float)
    double = np.asarray(np.linalg.solve(2j * omega * np.eye(len(A)) - A, twice), dtype=complex)
    first = forms.second(constant, q)
    second = forms.both(double, conjugate)
    parts = np.array([np.vdot(p, cubic), -2.0 * np.vdot(p, first), np.vdot(p, second)])
    return np.asarray(parts / (2.0 * omega), dtype=complex)
