"""Conditions of an episode: speed, curve, vehicle and irregularity, drawn at random or pinned."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.envs.observation import CANT_BASE
from railenv.envs.settings import LOWEST_SPEED, RANDOMIZABLE, Settings
from railenv.errors import ParameterError
from railenv.model import Model

FAILURE = ("failed_actuator", "failure_time")
"""Number of the failing actuator, from 1, and time of its failure (s since the start); 0 for none."""

RUNNING = ("speed", "radius", "curvature", "cant", "irregularity_factor", "offset", *FAILURE)
"""Options that ``reset`` may pin for any vehicle, beside its own numbers; one of a curve's two."""


def condition_names(numbers: Sequence[str]) -> tuple[str, ...]:
    """Return the names of an episode's conditions, including those of the vehicle's numbers."""
    return ("speed", "curvature", "cant", *numbers, "irregularity_factor", "offset", *FAILURE)


_LAST_FAILURE = 0.75  # of the duration, so that there is time to see the effect
_DRAWS = 16  # uniform numbers of an episode; all are always drawn, so that pins change nothing else


@dataclass(frozen=True)
class Episode:
    """One episode's conditions.

    Attributes
    ----------
    speed : float
        m/s.
    curvature, cant : float
        Of the circular curve, 1/m and rad; both signed.
    plan : tuple of float
        Start and end of the clothoid into the curve and of the one out of it, m.
    plant : Model
        The vehicle.
    numbers : mapping of str to float
        Numbers of the vehicle that may vary from episode to episode.
    irregularity_factor : float
    line_offset : float
        Place along the line of irregularities, m.
    offset : float
        Lateral displacement of all bodies at the start, m.
    biases : ndarray, shape (4,)
        Standard normal numbers that scale the sensors' biases.
    noise_seed : int
    failed_actuator : int
        Number of the actuator that fails, from 1; 0 for none.
    failure_time : float
        Time (s since the start) from which it gets no commands.
    """

    speed: float
    curvature: float
    cant: float
    plan: tuple[float, float, float, float]
    plant: Model
    numbers: Mapping[str, float]
    irregularity_factor: float
    line_offset: float
    offset: float
    biases: NDArray[np.float64]
    noise_seed: int
    failed_actuator: int = 0
    failure_time: float = 0.0

    @property
    def radius(self) -> float:
        """Radius of the circular curve, m; ``math.inf`` is tangent track."""
        return 1.0 / self.curvature if self.curvature else math.inf

    def conditions(self) -> dict[str, float]:
        """Return the drawn conditions as finite numbers, under the names that pin them."""
        return {
            "speed": self.speed,
            "curvature": self.curvature,
            "cant": self.cant,
            **self.numbers,
            "irregularity_factor": self.irregularity_factor,
            "offset": self.offset,
            "failed_actuator": self.failed_actuator,
            "failure_time": self.failure_time,
        }


def draw(settings: Settings, rng: np.random.Generator, pinned: Mapping[str, Any]) -> Episode:
    """Draw an episode, with some of its quantities pinned.

    Raises
    ------
    UnknownNameError
        If a pinned name is neither one of ``RUNNING`` nor a number of the vehicle that may vary.
    ParameterError
        If pinned quantities are impossible, alone or together.
    """
    checks.known(settings.told("option"), pinned, [*RUNNING, *settings.variable])
    u = rng.random(_DRAWS)
    biases = rng.standard_normal(max(4, 2 * len(settings.equipped.sensed)))
    noise_seed = int(rng.integers(2**63))
    others = [name for name in settings.variable if name not in RANDOMIZABLE]
    uniform = dict(zip((*RANDOMIZABLE, *others), (*u[8:12], *rng.random(len(others))), strict=True))
    speed, curvature, cant = _running(settings, u, pinned)
    plant, numbers = _plant(settings, uniform, pinned)
    factor = _between(settings.irregularity_factor, u[5])
    if "irregularity_factor" in pinned:
        factor = checks.number("irregularity_factor", pinned["irregularity_factor"], low=0.0)
    offset = (2.0 * u[7] - 1.0) * settings.initial_offset
    if "offset" in pinned:
        offset = checks.number("offset", pinned["offset"], low=-0.02, high=0.02, unit="m")
    return Episode(
        speed=speed,
        curvature=curvature,
        cant=cant,
        plan=_plan(settings, speed, u[12:16]),
        plant=plant,
        numbers=numbers,
        irregularity_factor=0.0 if settings.irregularity is None else factor,
        line_offset=float(u[6]) * settings.line.length,
        offset=float(offset),
        biases=biases,
        noise_seed=noise_seed,
        **_failure(settings, rng.random(3), pinned),
    )


def _failure(settings: Settings, u: NDArray[np.float64], pinned: Mapping[str, Any]) -> dict[str, Any]:
    """Return the failing actuator and the time of its failure."""
    n = len(settings.equipped.command_names)
    failed = 1 + int(u[1] * n) if u[0] < settings.actuator_failure else 0
    if "failed_actuator" in pinned:
        number = checks.number("failed_actuator", pinned["failed_actuator"], low=0.0, high=n)
        failed = checks.whole("failed_actuator", int(number) if number.is_integer() else number, low=0)
    time = _LAST_FAILURE * settings.duration * float(u[2])
    if "failure_time" in pinned:
        time = checks.number("failure_time", pinned["failure_time"], low=0.0, unit="s")
    return {"failed_actuator": failed, "failure_time": time if failed else 0.0}


def _between(limits: tuple[float, float], u: float) -> float:
    return limits[0] + float(u) * (limits[1] - limits[0])


def _running(
    settings: Settings, u: NDArray[np.float64], pinned: Mapping[str, Any]
) -> tuple[float, float, float]:
    """Return speed, curvature and cant with cant deficiency V^2 k / g - cant within its limit.

    Free quantities are drawn from the part of their range that the pinned ones leave possible.
    """
    gravity = settings.equipped.gravity
    slack = settings.max_cant_deficiency / CANT_BASE
    hand = 1.0 if u[0] < 0.5 else -1.0
    tangent = bool(u[1] < settings.tangent_share)
    curvature = _pinned_curvature(pinned)
    cant = checks.cant(pinned["cant"]) if "cant" in pinned else None
    speeds = settings.speed_range
    if "speed" in pinned:
        speed = checks.number(
            "speed", pinned["speed"], low=LOWEST_SPEED, high=checks.HIGHEST_SPEED, unit="m/s"
        )
        speeds = (speed, speed)
    if curvature is not None:
        tangent, hand = curvature == 0.0, math.copysign(1.0, curvature)
    elif cant:
        tangent, hand = False, math.copysign(1.0, cant)
    if tangent:
        if abs(cant or 0.0) > slack:
            raise _impossible(settings, pinned)
        return _between(speeds, u[3]), 0.0, cant or 0.0
    # along the curve's own hand: curvature k in [gentle, tight], cant c, by rule of the same sign
    gentle, tight = (0.0, 1.0 / settings.min_radius) if curvature is None else (abs(curvature),) * 2
    cants = settings.cant_range if cant is None else (hand * cant,) * 2
    low = max(cants[0], speeds[0] ** 2 * gentle / gravity - slack)
    high = min(cants[1], speeds[1] ** 2 * tight / gravity + slack)
    if low > high:
        raise _impossible(settings, pinned)
    c = _between((low, high), u[2])
    slow = max(speeds[0], math.sqrt(max(0.0, c - slack) * gravity / tight))
    fast = speeds[1]
    if gentle > 0.0:
        fast = min(fast, math.sqrt(max(0.0, c + slack) * gravity / gentle))
    if slow > fast * (1.0 + 1e-12):
        raise _impossible(settings, pinned)
    speed = _between((slow, max(slow, fast)), u[3])
    sharpest = min(tight, (c + slack) * gravity / speed**2)
    widest = min(max(gentle, (c - slack) * gravity / speed**2), sharpest)
    k = _between((widest, sharpest), u[4]) if curvature is None else gentle
    return speed, hand * k, hand * c if cant is None else cant


def _pinned_curvature(pinned: Mapping[str, Any]) -> float | None:
    """Return the curvature, pinned itself or by its radius; None if it is free."""
    if "curvature" not in pinned:
        return checks.curvature(pinned["radius"]) if "radius" in pinned else None
    if "radius" in pinned:
        raise ParameterError("options pin radius and curvature; they may pin one of them")
    return checks.number("curvature", pinned["curvature"], low=-1.0, high=1.0, unit="1/m")


def _impossible(settings: Settings, pinned: Mapping[str, Any]) -> ParameterError:
    """Return the error that no running condition fits the pinned values and the other ranges."""
    held = {n: pinned[n] for n in ("speed", "radius", "curvature", "cant") if n in pinned}
    return ParameterError(
        f"cant deficiency cannot be kept within {1e3 * settings.max_cant_deficiency:g} mm either way "
        f"(max_cant_deficiency) with {held or 'any drawn condition'}, speed_range "
        f"{settings.speed_range} m/s, cant_range {settings.cant_range} rad and curves of at least "
        f"{settings.min_radius:g} m"
    )


def _plant(
    settings: Settings, u: Mapping[str, float], pinned: Mapping[str, Any]
) -> tuple[Model, dict[str, float]]:
    """Return the vehicle of an episode, and its numbers that may vary."""
    values = {
        name: _between(settings.randomize[name], u[name])
        for name in settings.variable
        if name in settings.randomize
    }
    values |= {name: pinned[name] for name in settings.variable if name in pinned}
    plant = settings.equipped.plant
    if values:
        plant = plant.replace(**values)
    return plant, numbers_of(plant, settings.variable, values)


def numbers_of(plant: Model, names: Sequence[str], changes: Mapping[str, float]) -> dict[str, float]:
    """Return numbers of a vehicle; ``creep_factor`` is the factor on its creep coefficients."""
    given = {"creep_factor": float(changes.get("creep_factor", 1.0)), **plant.parameters}
    return {name: given[name] for name in names}


def _plan(
    settings: Settings, speed: float, u: NDArray[np.float64]
) -> tuple[float, float, float, float]:
    """Return the starts and ends of clothoids; a constant curve began before and never ends."""
    if settings.track == "constant":
        return (-2.0, -1.0, 1e12, 2e12)
    run = speed * settings.duration
    straight, ramp = (0.05 + 0.15 * u[0]) * run, (0.1 + 0.15 * u[1]) * run
    curve = (0.15 + 0.25 * u[2]) * run
    return (straight, straight + ramp, straight + ramp + curve, straight + 2.0 * ramp + curve)
