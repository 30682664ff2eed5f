"""Quantities from the accelerations of frames and of bodies above them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from railenv.assessment.filters import Band, band_pass, extreme, low_pass, sliding_rms
from railenv.assessment.readings import Place
from railenv.assessment.records import Findings, Group, History, Quantity, Stretch
from railenv.assessment.ride import (
    COMFORT_WINDOW,
    COMFORT_WINDOWS,
    Direction,
    continuous_comfort,
    mean_comfort,
    wz,
)
from railenv.assessment.wheel_quantities import RMS_OVER, RMS_STEP, hunting_text

Array = NDArray[np.float64]

FRAME_CUTOFF = 10.0  # Hz
LATERAL_SAFETY_CUTOFF = 6.0
VERTICAL_SAFETY_BAND = (0.4, 4.0)
RIDE_BAND = (0.4, 10.0)
QUASI_STATIC_CUTOFF = 20.0

_PEAK = "0.15/99.85 %"


def from_frames(stretch: Stretch, places: list[Place], hunting: Band | None) -> Findings:
    """Return the quantities from lateral accelerations of frames above the axle boxes.

    Parameters
    ----------
    stretch : Stretch
    places : list of Place
    hunting : (float, float), optional
        Hz, the band of the instability.
    """
    readings, found = stretch.readings, Findings()
    if not places:
        found.notes.append(f"no frame accelerations: {readings.plant.name} has no frame that moves")
    untold = [p.where for p in places if readings.bogie_mass(p.body) is None]
    if untold:
        found.notes.append(
            f"no limit of the frame acceleration of {', '.join(untold)}: the equations of "
            f"{readings.plant.name} do not give the bogie's mass"
        )
    for place in places:
        reading = readings.lateral(place)
        mass = readings.bogie_mass(place.body)
        limit = None if mass is None else stretch.limits.frame_acceleration(mass)
        filtered = low_pass(reading, FRAME_CUTOFF, readings.period)[stretch.inside]
        name, how = "frame acceleration", f"{FRAME_CUTOFF:g} Hz, {_PEAK}"
        found.quantities.append(
            Quantity(name, place.where, extreme(filtered), limit, "m/s^2", how, "running safety")
        )
        found.histories.append(History(name, place.where, stretch.distance, filtered, limit, "m/s^2"))
        if hunting is None:
            continue
        swaying = band_pass(reading, hunting, readings.period)[stretch.inside]
        _, rms = sliding_rms(stretch.distance, swaying, RMS_OVER, RMS_STEP)
        found.quantities.append(
            Quantity(
                f"{name}, instability",
                place.where,
                float(rms.max()),
                None if limit is None else limit / 2.0,
                "m/s^2",
                hunting_text(hunting),
                "running safety",
            )
        )
    return found


class _Kind(NamedTuple):
    """The quantities of the body in one direction."""

    direction: Direction
    read: Callable[[Place], Array]
    safety: float
    peak: float
    rms: float


def from_bodies(stretch: Stretch, places: list[Place], comfort: bool) -> Findings:
    """Return the quantities from accelerations on the floor of bodies.

    Parameters
    ----------
    stretch : Stretch
    places : list of Place
    comfort : bool
        Whether to add the comfort of EN 12299.
    """
    readings, limits, found = stretch.readings, stretch.limits, Findings()
    if not places:
        found.notes.append(
            f"no body accelerations and no ride: {readings.plant.name} has no body above its frames "
            "that moves"
        )
    lateral = _Kind(
        "lateral",
        readings.lateral,
        limits.body_lateral_safety(stretch.radius),
        limits.ride_lateral,
        limits.ride_lateral_rms,
    )
    vertical = _Kind(
        "vertical",
        readings.vertical,
        limits.body_vertical_safety,
        limits.ride_vertical,
        limits.ride_vertical_rms,
    )
    for place in places:
        for kind in (lateral, vertical):
            _of_body(stretch, place, kind, found)
        _quasi_static(stretch, place, found)
        if comfort:
            _comfort(stretch, place, found)
    if comfort and places and _seconds(stretch) < COMFORT_WINDOW * COMFORT_WINDOWS:
        found.notes.append(
            f"no mean comfort N_MV: it needs {COMFORT_WINDOW * COMFORT_WINDOWS:g} s, the section has "
            f"{_seconds(stretch):.3g} s"
        )
    return found


def _of_body(stretch: Stretch, place: Place, kind: _Kind, found: Findings) -> None:
    """Add safety, ride and Wz in one direction at one place."""
    period, inside = stretch.readings.period, stretch.inside
    reading = kind.read(place)
    name = f"body {kind.direction} acceleration"
    if kind.direction == "lateral":
        safe = low_pass(reading, LATERAL_SAFETY_CUTOFF, period)[inside]
        how = f"{LATERAL_SAFETY_CUTOFF:g} Hz, {_PEAK}"
    else:
        safe = band_pass(reading, VERTICAL_SAFETY_BAND, period)[inside]
        how = f"{VERTICAL_SAFETY_BAND[0]:g} to {VERTICAL_SAFETY_BAND[1]:g} Hz, {_PEAK}"
    ride = band_pass(reading, RIDE_BAND, period)[inside]
    band = f"{RIDE_BAND[0]:g} to {RIDE_BAND[1]:g} Hz"
    rms = float(np.sqrt(np.mean(np.square(ride))))
    rows: list[tuple[str, float, float | None, str, Group]] = [
        (f"{name}, safety", extreme(safe), kind.safety, how, "running safety"),
        (name, extreme(ride), kind.peak, f"{band}, {_PEAK}", "ride"),
        (f"{name}, rms", rms, kind.rms, f"{band}, rms", "ride"),
    ]
    for called, value, limit, filtered, group in rows:
        found.quantities.append(Quantity(called, place.where, value, limit, "m/s^2", filtered, group))
    found.histories.append(History(name, place.where, stretch.distance, ride, kind.peak, "m/s^2"))
    index = wz(reading[inside], period, kind.direction)
    found.quantities.append(
        Quantity(
            f"Wz, {kind.direction}", place.where, index, None, "1", "Sperling, 0.5 to 30 Hz", "ride"
        )
    )


def _quasi_static(stretch: Stretch, place: Place, found: Findings) -> None:
    """Add the quasi-static lateral acceleration on the curve."""
    curve = stretch.full_curve
    if curve is None:
        return
    readings = stretch.readings
    filtered = low_pass(readings.lateral(place), QUASI_STATIC_CUTOFF, readings.period)
    found.quantities.append(
        Quantity(
            "quasi-static body lateral acceleration",
            place.where,
            abs(float(np.median(filtered[curve]))),
            stretch.limits.quasi_static_lateral,
            "m/s^2",
            f"{QUASI_STATIC_CUTOFF:g} Hz, median of the full curve",
            "ride",
        )
    )


def _seconds(stretch: Stretch) -> float:
    return float(np.sum(stretch.inside) * stretch.readings.period)


def _comfort(stretch: Stretch, place: Place, found: Findings) -> None:
    """Add continuous comfort, and mean comfort where the section is long enough."""
    readings, inside = stretch.readings, stretch.inside
    levels = [
        continuous_comfort(readings.lateral(place)[inside], readings.period, "lateral"),
        continuous_comfort(readings.vertical(place)[inside], readings.period, "vertical"),
    ]
    for direction, weighting, values in zip(("lateral", "vertical"), ("Wd", "Wb"), levels, strict=True):
        found.quantities.append(
            Quantity(
                f"comfort, {direction}",
                place.where,
                float(np.percentile(values, 95.0)),
                None,
                "m/s^2",
                f"{weighting}, rms over {COMFORT_WINDOW:g} s, 95 %",
                "ride",
            )
        )
    if len(levels[0]) >= COMFORT_WINDOWS:
        found.quantities.append(
            Quantity(
                "mean comfort N_MV",
                place.where,
                mean_comfort(*levels),
                None,
                "1",
                "Wd and Wb, without longitudinal",
                "ride",
            )
        )
