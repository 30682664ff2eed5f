"""Tuning of yaw-rate feedback and of LQG by search over a few numbers, on their robust stability.

Both maximise the speed up to which every plant of a family (several conicities and creep factors, from
20 m/s on) decays: what the evaluation calls the robust critical speed. The search is SciPy's
differential evolution.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from agents.controllers.lqg import LQG
from agents.controllers.scheduled import CONTROL_PERIOD, ScheduledController, readings_of
from agents.controllers.service import CONICITY, vehicles_of_service
from agents.controllers.yaw_rate import YawRateFeedback
from agents.tuning.family import Family
from design.linear.regulator import Disturbances, Weights
from railenv import Equipped
from railenv.threads import one_blas_thread

Array = NDArray[np.float64]

SPEEDS = tuple(float(v) for v in range(20, 261, 10))
"""m/s."""

DECAY = 0.3
"""1/s, at which every motion of every plant has to decay."""

T = TypeVar("T", bound=ScheduledController)

_FAILED = 1e3  # what a design that cannot be computed costs


def tune_yaw_rate(
    model: Equipped, *, generations: int = 8, seed: int = 0, period: float = CONTROL_PERIOD
) -> YawRateFeedback:
    """Tune gain and washout of a fixed yaw-rate feedback on its robust critical speed.

    Parameters
    ----------
    model : Equipped
    generations : int
        Of the search, with 16 candidates each.
    seed : int
    period : float
        Control period, s.
    """

    def make(x: Array) -> YawRateFeedback:
        gain, washout = np.exp(x)
        return YawRateFeedback.design(model, gain=float(gain), washout=float(washout), period=period)

    bounds = [(np.log(1e4), np.log(1e6)), (np.log(0.05), np.log(2.0))]
    return _searched(model, make, bounds, generations, seed, period)


def tune_lqg(
    model: Equipped,
    *,
    speeds: Sequence[float],
    generations: int = 6,
    seed: int = 0,
    period: float = CONTROL_PERIOD,
) -> LQG:
    """Tune what an LQG is designed with on its robust critical speed.

    That is the conicity that it believes in (where the contact has that number), the weight of the
    moment, and the intensities of the disturbances and of the noise.

    Parameters
    ----------
    model : Equipped
    speeds : sequence of float
        Between which it is scheduled, m/s; a single one for a fixed one.
    generations : int
        Of the search, with 24 candidates each.
    seed : int
    period : float
        Control period, s.
    """
    believes = "conicity" in model.variable_names

    def make(x: Array) -> LQG:
        moment, alignment, disturbance, accelerometer, gyro = np.exp(x[1:])
        made = LQG.design(
            model.replace(conicity=float(x[0])) if believes else model,
            speeds=speeds,
            weights=Weights(moment=float(moment)),
            disturbances=Disturbances(
                alignment=float(alignment),
                moment=float(disturbance),
                accelerometer=float(accelerometer),
                gyro=float(gyro),
            ),
            period=period,
        )
        if believes:
            made.about["design conicity"] = float(x[0])
        return made

    bounds = [
        CONICITY,
        (np.log(0.1), np.log(30.0)),
        (np.log(1e-5), np.log(1e-2)),
        (np.log(1e-4), np.log(1.0)),
        (np.log(0.02), np.log(5.0)),
        (np.log(3e-4), np.log(0.1)),
    ]
    return _searched(model, make, bounds, generations, seed, period)


def _searched(
    model: Equipped,
    make: Callable[[Array], T],
    bounds: Sequence[tuple[float, float]],
    generations: int,
    seed: int,
    period: float,
) -> T:
    """Return the best design that a search finds."""
    signals = [reading.signal for reading in readings_of(model, "sensors", period)]
    with one_blas_thread():
        vehicles = vehicles_of_service(model)
        family = Family.of(model, signals, vehicles, SPEEDS, period)

        def cost(x: Array) -> float:
            try:
                law = make(x).law
            except (np.linalg.LinAlgError, ValueError):  # Riccati's equation has no solution here
                return _FAILED
            return -family.stable_up_to(law, period, DECAY)

        found = optimize.differential_evolution(
            cost,
            bounds,
            maxiter=generations,
            popsize=8 if len(bounds) == 2 else 4,
            rng=seed,
            polish=False,
            init="sobol" if len(bounds) > 2 else "latinhypercube",
        )
    best = make(found.x)
    best.about |= {
        "tuning": "differential evolution on robust stability",
        "vehicles": [dict(vehicle) for vehicle in vehicles],
        "decay": DECAY,
        "evaluations": int(found.nfev),
        "seed": seed,
    }
    return best
