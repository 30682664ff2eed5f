"""What an episode runs on: speed, curve, vehicle, irregularity, drawn at random or pinned."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.envs.settings import CANT_BASE, LOWEST_SPEED, RANDOMIZABLE, Settings
from railenv.errors import ParameterError
from railenv.irregularity import SAMPLES, SPACING
from railenv.vehicles import Vehicle

PINNABLE = ("speed", "radius", "cant", "irregularity_factor", "offset", *RANDOMIZABLE)
"""What ``reset(options=...)`` may pin."""

_DRAWS = 16  # uniform numbers of an episode, always all drawn, so that pins change nothing else
_CREEP = ("lateral_creep", "lateral_spin_creep", "spin_creep", "longitudinal_creep")


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
        Start and end of the clothoid into the curve and of that out of it, m.
    vehicle : Vehicle
    creep_factor : float
    irregularity_factor : float
    line_offset : float
        m along the line of irregularities.
    offset : float
        m, lateral, of all bodies at the start.
    biases : ndarray, shape (4,)
        Standard normal numbers that scale the sensors' biases.
    noise_seed : int
    """

    speed: float
    curvature: float
    cant: float
    plan: tuple[float, float, float, float]
    vehicle: Vehicle
    creep_factor: float
    irregularity_factor: float
    line_offset: float
    offset: float
    biases: NDArray[np.float64]
    noise_seed: int

    @property
    def radius(self) -> float:
        """Radius of the circular curve, m; ``math.inf`` is tangent track."""
        return 1.0 / self.curvature if self.curvature else math.inf

    def conditions(self) -> dict[str, float]:
        """Return what was drawn, under the names by which it can be pinned."""
        return {
            "speed": self.speed,
            "radius": self.radius,
            "cant": self.cant,
            "conicity": self.vehicle.conicity,
            "friction": self.vehicle.friction,
            "creep_factor": self.creep_factor,
            "body_mass": self.vehicle.body_mass,
            "irregularity_factor": self.irregularity_factor,
            "offset": self.offset,
        }


def draw(settings: Settings, rng: np.random.Generator, pinned: Mapping[str, Any]) -> Episode:
    """Draw an episode, with some of its quantities pinned.

    Raises
    ------
    UnknownNameError
        If a pinned name is not one of ``PINNABLE``.
    ParameterError
        If pinned quantities are impossible, alone or together.
    """
    checks.known("option", pinned, PINNABLE)
    u = rng.random(_DRAWS)
    biases = rng.standard_normal(4)
    noise_seed = int(rng.integers(2**63))
    speed, curvature, cant = _running(settings, u, pinned)
    vehicle, creep_factor = _vehicle(settings, u[8:12], pinned)
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
        vehicle=vehicle,
        creep_factor=creep_factor,
        irregularity_factor=factor if settings.irregularity else 0.0,
        line_offset=float(u[6]) * SAMPLES * SPACING,
        offset=float(offset),
        biases=biases,
        noise_seed=noise_seed,
    )


def _between(limits: tuple[float, float], u: float) -> float:
    return limits[0] + float(u) * (limits[1] - limits[0])


def _running(
    settings: Settings, u: NDArray[np.float64], pinned: Mapping[str, Any]
) -> tuple[float, float, float]:
    """Return speed, curvature and cant with cant deficiency within its limit."""
    gravity = settings.vehicle.gravity
    slack = settings.max_cant_deficiency / CANT_BASE
    hand = 1.0 if u[0] < 0.5 else -1.0
    tangent = bool(u[1] < settings.tangent_share)
    cant = hand * _between(settings.cant_range, u[2]) * (not tangent)
    if "radius" in pinned:
        curvature = checks.curvature(pinned["radius"])
        hand = math.copysign(1.0, curvature)
        cant = hand * _between(settings.cant_range, u[2]) * (curvature != 0.0)
    if "cant" in pinned:
        cant = checks.cant(pinned["cant"])
        hand, tangent = (math.copysign(1.0, cant), False) if cant else (hand, tangent)
    speed = _between(settings.speed_range, u[3])
    if "speed" in pinned:
        speed = checks.number("speed", pinned["speed"], low=LOWEST_SPEED, unit="m/s")
    elif "radius" in pinned and curvature:
        speed = _speed_on(settings, curvature, cant, slack, u[3])
    if "radius" not in pinned:
        lowest = max(0.0, (abs(cant) - slack) * gravity / speed**2)
        highest = min((abs(cant) + slack) * gravity / speed**2, 1.0 / settings.min_radius)
        if tangent and "cant" not in pinned:
            curvature = 0.0
        elif lowest > highest:
            raise ParameterError(
                f"no curve of at least {settings.min_radius:g} m keeps cant deficiency within "
                f"{1e3 * settings.max_cant_deficiency:g} mm at {speed:g} m/s with cant {cant:g} rad"
            )
        else:
            curvature = hand * _between((lowest, highest), u[4])
    deficiency = speed**2 * curvature / gravity - cant
    if abs(deficiency) > slack * (1.0 + 1e-9):
        raise ParameterError(
            f"cant deficiency is {1e3 * CANT_BASE * deficiency:.0f} mm at {speed:g} m/s on a curve of "
            f"{1.0 / curvature if curvature else math.inf:g} m with cant {cant:g} rad; it must be "
            f"within "
            f"{1e3 * settings.max_cant_deficiency:g} mm either way (max_cant_deficiency)"
        )
    return speed, curvature, cant


def _speed_on(settings: Settings, curvature: float, cant: float, slack: float, u: float) -> float:
    """Return a speed of the range that suits a pinned curve."""
    hand = math.copysign(1.0, curvature)
    gravity = settings.vehicle.gravity
    steepest = (hand * cant + slack) * gravity / abs(curvature)
    gentlest = max(0.0, (hand * cant - slack) * gravity / abs(curvature))
    low = max(settings.speed_range[0], math.sqrt(gentlest))
    high = min(settings.speed_range[1], math.sqrt(max(steepest, 0.0)))
    if low > high:
        raise ParameterError(
            f"radius is pinned at {1.0 / curvature:g} m, cant is {cant:g} rad: no speed of "
            f"speed_range {settings.speed_range} keeps cant deficiency within "
            f"{1e3 * settings.max_cant_deficiency:g} mm there"
        )
    return _between((low, high), u)


def _vehicle(
    settings: Settings, u: NDArray[np.float64], pinned: Mapping[str, Any]
) -> tuple[Vehicle, float]:
    values = {
        name: _between(settings.randomize[name], u[i])
        for i, name in enumerate(RANDOMIZABLE)
        if name in settings.randomize
    }
    values |= {name: pinned[name] for name in RANDOMIZABLE if name in pinned}
    factor = checks.number("creep_factor", values.pop("creep_factor", 1.0), low=0.0, open_low=True)
    if factor != 1.0:
        values |= {name: factor * getattr(settings.vehicle, name) for name in _CREEP}
    return (settings.vehicle.replace(**values) if values else settings.vehicle), factor


def _plan(
    settings: Settings, speed: float, u: NDArray[np.float64]
) -> tuple[float, float, float, float]:
    """Return where clothoids start and end; a constant curve began before and never ends."""
    if settings.track == "constant":
        return (-2.0, -1.0, 1e12, 2e12)
    run = speed * settings.duration
    straight, ramp = (0.05 + 0.15 * u[0]) * run, (0.1 + 0.15 * u[1]) * run
    curve = (0.15 + 0.25 * u[2]) * run
    return (straight, straight + ramp, straight + ramp + curve, straight + 2.0 * ramp + curve)
