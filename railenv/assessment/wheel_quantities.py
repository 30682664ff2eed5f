"""Quantities from the forces between wheels and rails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railenv.assessment.filters import (
    Band,
    band_pass,
    extreme,
    low_pass,
    percentiles,
    sliding_mean,
    sliding_rms,
)
from railenv.assessment.records import SHORTEST_CURVE, Findings, History, Quantity, Stretch
from railenv.contact.nadal import angle_of_flange, nadal

Array = NDArray[np.float64]

FORCE_CUTOFF = 20.0  # Hz
MEAN_OVER, MEAN_STEP = 2.0, 0.5  # m
RMS_OVER, RMS_STEP = 100.0, 10.0  # m
LIGHTEST = 0.01
"""Least divisor of Y/Q, as a share of the static wheel load: a lifted wheel has no Y/Q."""

SIDES = ("left", "right")

_OVER_2_M = f"{FORCE_CUTOFF:g} Hz, mean over {MEAN_OVER:g} m, 0.15/99.85 %"
_OF_FORCES = f"{FORCE_CUTOFF:g} Hz, 99.85 %"
_MEDIAN = f"{FORCE_CUTOFF:g} Hz, median of the full curve"


def hunting_text(band: Band) -> str:
    """Return a description of how the root mean square for the instability is taken."""
    return f"{band[0]:.1f} to {band[1]:.1f} Hz, rms over {RMS_OVER:g} m, largest"


@dataclass(frozen=True, eq=False)
class _Forces:
    """Filtered forces of the section; arrays have the shape (wheelsets, 2, samples)."""

    stretch: Stretch
    Y: Array
    Q: Array
    static: Array  # N, shape (wheelsets,)

    def wheels(self) -> list[tuple[int, int, str]]:
        """Return the number, the side and the name of each wheel."""
        names = self.stretch.readings.wheelsets
        return [(i, k, f"{w} {side}") for i, w in enumerate(names) for k, side in enumerate(SIDES)]


def from_wheels(stretch: Stretch, hunting: Band | None) -> Findings:
    """Return the quantities from the forces of the wheels.

    Parameters
    ----------
    stretch : Stretch
    hunting : (float, float), optional
        Hz, the band of the instability.
    """
    readings, found = stretch.readings, Findings()
    if not readings.wheelsets:
        found.notes.append(
            f"no forces of wheels: the equations of {readings.plant.name} do not give them"
        )
        return found
    filtered = [low_pass(f, FORCE_CUTOFF, readings.period) for f in (readings.Y, readings.Q)]
    Y, Q = (f[..., stretch.inside] for f in filtered)
    forces = _Forces(stretch, Y, Q, readings.static_loads().mean(axis=1))
    _sums(forces, found)
    if hunting is not None:
        _instability(forces, hunting, found)
    _ratios(forces, found)
    _loads(forces, found)
    _quasi_static(forces, filtered, found)
    return found


def _sums(forces: _Forces, found: Findings) -> None:
    """Add the sums of guiding forces over 2 m."""
    stretch = forces.stretch
    total = forces.Y[:, 0] - forces.Y[:, 1]
    places, means = sliding_mean(stretch.distance, total, MEAN_OVER, MEAN_STEP)
    for w, mean, static in zip(stretch.readings.wheelsets, means, forces.static, strict=True):
        limit = stretch.limits.track_shift(static)
        name = "sum of guiding forces"
        found.quantities.append(
            Quantity(name, w, extreme(mean), limit, "N", _OVER_2_M, "running safety")
        )
        found.histories.append(History(name, w, places, mean, limit, "N"))


def _instability(forces: _Forces, band: Band, found: Findings) -> None:
    """Add root mean squares of the sums of guiding forces in the band of hunting."""
    stretch = forces.stretch
    readings = stretch.readings
    total = band_pass(readings.Y[:, 0] - readings.Y[:, 1], band, readings.period)
    _, rms = sliding_rms(stretch.distance, total[:, stretch.inside], RMS_OVER, RMS_STEP)
    for w, values, static in zip(readings.wheelsets, rms, forces.static, strict=True):
        limit = stretch.limits.track_shift(static) / 2.0
        found.quantities.append(
            Quantity(
                "sum of guiding forces, instability",
                w,
                float(values.max()),
                limit,
                "N",
                hunting_text(band),
                "running safety",
            )
        )


def _ratios(forces: _Forces, found: Findings) -> None:
    """Add Y/Q over 2 m, beside the limit of the standards and beside Nadal's."""
    stretch = forces.stretch
    ratio = forces.Y / np.maximum(forces.Q, LIGHTEST * forces.static[:, None, None])
    places, means = sliding_mean(stretch.distance, ratio, MEAN_OVER, MEAN_STEP)
    limit, without = stretch.limits.y_over_q, []
    guided = {g.name: g for g in stretch.readings.model.guided}
    for i, k, wheel in forces.wheels():
        value = extreme(means[i, k])
        found.quantities.append(Quantity("Y/Q", wheel, value, limit, "1", _OVER_2_M, "running safety"))
        found.histories.append(History("Y/Q", wheel, places, means[i, k], limit, "1"))
        wheelset = guided[stretch.readings.wheelsets[i]]
        angle = angle_of_flange(wheelset.laws[k]) if wheelset.laws else None
        if angle is None or wheelset.friction is None:
            without.append(wheel)
            continue
        climbing = nadal(angle, wheelset.friction)
        found.quantities.append(
            Quantity("Y/Q beside Nadal's limit", wheel, value, climbing, "1", _OVER_2_M, "information")
        )
    if without:
        found.notes.append(
            "no limit of Nadal: the contact law has no flange whose angle could be taken"
        )


def _loads(forces: _Forces, found: Findings) -> None:
    """Add wheel loads, and the unloading of wheels."""
    stretch = forces.stretch
    for i, k, wheel in forces.wheels():
        static, load = float(forces.static[i]), forces.Q[i, k]
        low, high = percentiles(load)
        limit = stretch.limits.wheel_load(static, stretch.speed)
        found.quantities += [
            Quantity("wheel load", wheel, high, limit, "N", _OF_FORCES, "track loading"),
            Quantity(
                "wheel unloading",
                wheel,
                (static - low) / static,
                None,
                "1",
                f"{FORCE_CUTOFF:g} Hz, 0.15 %, over the static load",
                "information",
            ),
        ]
        found.histories.append(History("wheel load", wheel, stretch.distance, load, limit, "N"))


def _quasi_static(forces: _Forces, filtered: list[Array], found: Findings) -> None:
    """Add quasi-static forces of the outer wheels."""
    stretch = forces.stretch
    curve = stretch.full_curve
    if curve is None:
        found.notes.append(
            f"no quasi-static values: the section has no {SHORTEST_CURVE:g} m of constant curve"
        )
        return
    outer = 0 if stretch.curvature > 0.0 else 1
    limits = stretch.limits
    for i, w in enumerate(stretch.readings.wheelsets):
        Y, Q = (float(np.median(force[i, outer][curve])) for force in filtered)
        for name, value, limit in (
            ("quasi-static guiding force", Y, limits.quasi_static_guiding_force(stretch.radius)),
            ("quasi-static wheel load", Q, limits.quasi_static_wheel_load),
        ):
            where = f"{w} {SIDES[outer]}"
            found.quantities.append(Quantity(name, where, value, limit, "N", _MEDIAN, "track loading"))
