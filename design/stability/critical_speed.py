"""Critical speed: the first speed at which steady running stops being stable.

Stability is lost by hunting (a pair of complex eigenvalues crosses the imaginary axis, a Hopf point),
by divergence (a real eigenvalue crosses it), or because the equilibrium itself ends in a fold, as that
on the tread does on tight curves. The branch of equilibria is followed from low speed to distinguish
the three.
"""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import ArrayLike

from design.loop.dynamics import dynamics
from design.stability.loss import CriticalSpeed
from design.stability.search import Search
from railenv.models import Model
from railenv.threads import one_blas_thread

SPEED_RANGE = (3.0, 400.0)
"""Default range of the search, m/s."""


def critical_speed(
    model: Model,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    speed_range: tuple[float, float] = SPEED_RANGE,
    inputs: ArrayLike | None = None,
    controller: Any | None = None,
    period: float | None = None,
    longest_step: float | None = None,
) -> CriticalSpeed:
    """Find the first speed of a range at which steady running loses stability.

    The equilibrium is followed from tangent track at low speed into the curve and then up in speed. All
    its eigenvalues are followed from one sampled speed to the next, with their rates of change; if they
    do not change as the previous speeds predict, or a mode may have become unstable and stable again in
    between, the step is halved. A loss of stability is located to better than 1e-6 relative.
    ``sampled`` of the result contains the speeds at which eigenvalues were computed.

    Sampling cannot find everything: a range of instability that leaves no trace at the neighbouring
    speeds, such as a bump of the growth rate that falls off like a Gaussian, is found only if a sample
    lies in it. A shorter ``longest_step`` makes the samples denser.

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
        Controller that closes the loop once per control period (:func:`design.closed_loop`). An end of
        the equilibrium is still found on the vehicle's own branch, without moments.
    period : float, optional
        Control period, s; the controller's own, or 0.005 s.
    longest_step : float, optional
        Longest step from one sampled speed to the next, as a change of the logarithm of the speed;
        0.15 (16 % of the speed) when left out, with a controller 0.06.

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
    >>> round(hopf.speed, 2), round(hopf.frequency, 2)
    (116.47, 3.11)
    """
    with one_blas_thread():
        judged_by = dynamics(model, controller, period)
        where = Search.of(model, radius, cant, speed_range, inputs, longest_step, judged_by)
        return where.first_loss()


def hopf_points(
    model: Model,
    *,
    radius: float = math.inf,
    cant: float = 0.0,
    speed_range: tuple[float, float] = SPEED_RANGE,
    inputs: ArrayLike | None = None,
    longest_step: float | None = None,
) -> tuple[CriticalSpeed, ...]:
    """Find all speeds of a range at which a pair of eigenvalues crosses the imaginary axis.

    These are the losses and gains of stability, and crossings of a further pair while another is
    unstable. The equilibrium is followed as by :func:`design.critical_speed` up to its end, not beyond
    a fold.

    Parameters
    ----------
    model, radius, cant, speed_range, inputs, longest_step
        As in :func:`design.critical_speed`.

    Returns
    -------
    tuple of CriticalSpeed
        Crossings in the order of speed; ``loss`` is "hunting". Each has the state, eigenvalue and mode
        of the pair that crosses; ``growth_slope`` gives the direction (negative: its oscillation dies
        out above that speed), ``unstable`` the number of other eigenvalues that are unstable there.

    Raises
    ------
    EquilibriumError
        If there is no equilibrium on the curve at the lowest speed, or it has ended below that.

    Examples
    --------
    >>> import design, railenv
    >>> first, *further = design.hopf_points(railenv.Bogie(railenv.HIGH_SPEED_COACH))
    >>> round(first.speed, 2), first.unstable
    (116.47, 0)
    """
    with one_blas_thread():
        judged_by = dynamics(model, None, None)
        where = Search.of(model, radius, cant, speed_range, inputs, longest_step, judged_by)
        return where.pairs()
