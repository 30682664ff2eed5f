"""Tuning of yaw-rate feedback, LQG and H-infinity control by search, on their robust stability.

All maximise the speed up to which every plant of a family (several conicities and creep factors, from
20 m/s) decays: the robust critical speed of the evaluation. The search is SciPy's differential
evolution.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from agents.controllers.h_infinity import ACCELEROMETER, DISTURBANCES, GYRO, WEIGHTS, HInfinity
from agents.controllers.lqg import LQG
from agents.controllers.scheduled import CONTROL_PERIOD, ScheduledController, readings_of
from agents.controllers.service import CONICITY, ranges_of_service, vehicles_of_service
from agents.controllers.yaw_rate import YawRateFeedback
from agents.tuning.family import Family
from design.linear.h_infinity import MOTION, ROLL_OFF, SLACK, uncertain_model
from design.linear.regulator import Disturbances, Weights
from railenv import Equipped, checks
from railenv.threads import one_blas_thread

Array = NDArray[np.float64]

SPEEDS = tuple(float(v) for v in range(20, 261, 10))
"""m/s."""

DECAY = 0.3
"""Rate (1/s) at which every motion of every plant has to decay."""

T = TypeVar("T", bound=ScheduledController)

_CANDIDATES = 24  # of a generation of H-infinity controllers
_SPREAD = 0.3  # of them around the usual one, as logarithms
_FAILED = 1e3  # cost of a design that cannot be computed


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
    """Tune the design parameters of an LQG on its robust critical speed.

    They are the assumed conicity (if the contact has that number), the weight of the moment, and the
    intensities of the disturbances and of the noise.

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


def tune_h_infinity(
    model: Equipped,
    *,
    speeds: Sequence[float],
    tolerance: float = 0.1,
    generations: int = 1,
    seed: int = 0,
    period: float = CONTROL_PERIOD,
) -> HInfinity:
    """Tune the design parameters of an H-infinity controller on its robust critical speed.

    They are the weights of moment and yaw angle, the intensities of moments and of noise, the size of
    the motion to which unforeseen forces belong, roll-off and slack; the search starts around the
    defaults. The design assumes the geometric middle of the range of conicity (if the contact has that
    number).

    Parameters
    ----------
    model : Equipped
    speeds : sequence of float
        Between which it is scheduled, m/s; a single one for a fixed one.
    tolerance : float
        Share by which the gain of all actuators may be off, either way. A controller tuned for exact
        actuators reaches higher speeds but has hardly any margin.
    generations : int
        Of the search, with 24 candidates each.
    seed : int
    period : float
        Control period, s.
    """
    checks.number("tolerance", tolerance, low=0.0, high=0.9)
    middle = math.sqrt(CONICITY[0] * CONICITY[1])
    believed = model.replace(conicity=middle) if "conicity" in model.variable_names else model
    ranges = ranges_of_service(model)
    models = [uncertain_model(believed, speed=v, ranges=ranges, period=period) for v in speeds]
    d, w = DISTURBANCES, WEIGHTS

    def make(x: Array) -> HInfinity:
        moment, yaw, disturbance, accelerometer, gyro, motion, roll_off, excess = np.exp(x).tolist()
        made = HInfinity.of(
            models,
            weights=dataclasses.replace(w, moment=moment, yaw=yaw),
            disturbances=dataclasses.replace(
                d, moment=disturbance, accelerometer=accelerometer, gyro=gyro
            ),
            motion=motion,
            roll_off=roll_off,
            slack=1.0 + excess,
        )
        made.about["tolerance"] = tolerance
        if believed is not model:
            made.about["design conicity"] = middle
        return made

    usual = (w.moment, w.yaw, d.moment, ACCELEROMETER, GYRO, MOTION, ROLL_OFF, SLACK - 1.0)
    start = np.log(usual)
    spread = _SPREAD * np.random.default_rng(seed).standard_normal((_CANDIDATES, len(start)))
    spread[0] = 0.0
    widest = 3.0 * _SPREAD
    return _searched(
        model,
        make,
        [(value - widest, value + widest) for value in start.tolist()],
        generations,
        seed,
        period,
        around=start + np.clip(spread, -widest, widest),
        gains=(1.0 - tolerance, 1.0 + tolerance),
    )


def _searched(
    model: Equipped,
    make: Callable[[Array], T],
    bounds: Sequence[tuple[float, float]],
    generations: int,
    seed: int,
    period: float,
    around: Array | None = None,
    gains: Sequence[float] = (1.0,),
) -> T:
    """Return the best design that a search finds.

    The search starts from the candidates ``around``, or anywhere within the bounds. Every plant has to
    decay with each of several gains of its actuators.
    """
    signals = [reading.signal for reading in readings_of(model, "sensors", period)]
    with one_blas_thread():
        vehicles = vehicles_of_service(model)
        exact = Family.of(model, signals, vehicles, SPEEDS, period)
        family, *others = (dataclasses.replace(exact, B=gain * exact.B) for gain in gains)
        for other in others:
            family = family.joined(other)

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
            init=around if around is not None else "sobol" if len(bounds) > 2 else "latinhypercube",
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
