"""Assessment of a run as for an approval: quantities of EN 14363 beside their limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from railenv import checks
from railenv.assessment.body_quantities import from_bodies, from_frames
from railenv.assessment.filters import Band, check_sampling, dominating_frequency
from railenv.assessment.limits import Limits
from railenv.assessment.readings import Place, Readings
from railenv.assessment.records import Findings, History, Quantity, Stretch
from railenv.assessment.wheel_quantities import FORCE_CUTOFF, RMS_OVER, from_wheels
from railenv.errors import ParameterError, shown
from railenv.model import Model

if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure

SHORTEST = RMS_OVER
"""Shortest stretch of track assessed (m): one window of the readings for instability."""

SHORTEST_TIME = 5.0
"""Shortest time assessed (s): two periods of the slowest filter, 0.4 Hz."""

_HUNTING_BAND = (0.5, 10.0)  # Hz, where the hunting frequency is sought
_HALF_BAND = 2.0  # Hz
_LOWEST_EDGE = 0.4  # Hz


@dataclass(frozen=True, eq=False)
class Assessment:
    """Quantities of a run beside their limits.

    Attributes
    ----------
    model : str
        Name of the model.
    section : (float, float)
        Start and end of the stretch assessed, m.
    speed : float
        Highest speed on it, m/s.
    radius : float
        Radius of its sharpest curve, m; infinite on tangent track.
    hunting_frequency : float
        Frequency around which the readings for instability are taken, Hz.
    quantities : tuple of Quantity
    histories : tuple of History
        Courses over distance from which some of the quantities are taken.
    notes : tuple of str
        What was left out, and why.
    """

    model: str
    section: tuple[float, float]
    speed: float
    radius: float
    hunting_frequency: float
    quantities: tuple[Quantity, ...]
    histories: tuple[History, ...]
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool | None:
        """Whether all quantities with a limit are within it; None if no quantity has one.

        Quantities for information do not count.
        """
        judged = [q.passed for q in self.quantities if q.group != "information"]
        return None if all(told is None for told in judged) else not self.exceeded

    @property
    def exceeded(self) -> tuple[Quantity, ...]:
        """Quantities beyond their limits, except those for information."""
        return tuple(q for q in self.quantities if q.passed is False and q.group != "information")

    def of(self, name: str) -> tuple[Quantity, ...]:
        """Return one quantity at all its places.

        Raises
        ------
        UnknownNameError
            If the assessment has no such quantity.
        """
        checks.known("quantity", [name], list(dict.fromkeys(q.name for q in self.quantities)))
        return tuple(q for q in self.quantities if q.name == name)

    def worst(self, name: str) -> Quantity:
        """Return a quantity where it is nearest to its limit, or largest if it has none.

        Raises
        ------
        UnknownNameError
            If the assessment has no such quantity.
        """
        return max(self.of(name), key=lambda q: q.value if q.share is None else q.share)

    def table(self, *, every: bool = False) -> str:
        """Return a table as plain text.

        Parameters
        ----------
        every : bool
            Show all places of each quantity instead of the worst one.
        """
        from railenv.assessment.table import text_table

        return text_table(self, every)

    def to_markdown(self, *, every: bool = False) -> str:
        """Return the table of :meth:`table` in Markdown."""
        from railenv.assessment.table import markdown_table

        return markdown_table(self, every)

    def plot(self) -> Figure:
        """Draw forces and accelerations over distance, with their limits."""
        from railenv.assessment.assessment_plots import plot_assessment

        return plot_assessment(self)

    def __str__(self) -> str:
        return self.table()


def assess(
    model: Model,
    response: control.TimeResponseData,
    *,
    section: tuple[float, float] | None = None,
    limits: Limits | None = None,
    floor_height: float | None = None,
    hunting_frequency: float | None = None,
    comfort: bool = False,
) -> Assessment:
    """Assess a simulated run as the measurements of a running test are assessed (EN 14363, UIC 518).

    One stretch of track is one section of such a test; the statistics over many sections that an
    approval requires are not computed here. Limits are the usual values of these standards
    (:class:`railenv.assessment.Limits`).

    - Guiding forces Y and wheel loads Q pass a low pass of 20 Hz; the sum of guiding forces of a
      wheelset and Y/Q of a wheel are means over 2 m, every 0.5 m. For both, the larger magnitude of the
      0.15 % and the 99.85 % value counts; for Q, the 99.85 % value.
    - Quasi-static Y and Q are medians of the outer wheels where the curve is full.
    - Instability: largest root mean square over 100 m, within 2 Hz of the hunting frequency, of the
      sum of guiding forces and of the frame's acceleration; the limits are half those of both.
    - Accelerations are readings of lateral accelerometers (on a curve they feel the uncompensated
      part, and on a body that rolls its weight) and vertical accelerations without gravity: frames
      above the axle boxes, 10 Hz; bodies on the floor above each frame and in the middle, for safety
      (lateral 6 Hz, vertical 0.4 to 4 Hz) and ride (0.4 to 10 Hz, and Sperling's Wz).

    Quantities of a body that the model lacks are left out, and ``notes`` say so.

    Parameters
    ----------
    model : Model
        What was simulated.
    response : control.TimeResponseData
        What :func:`railenv.simulate` returned.
    section : (float, float), optional
        Start and end of the stretch to assess, m; the whole run when left out. Filters pass over the
        whole run in any case.
    limits : Limits, optional
        Limits; those of a passenger vehicle when left out.
    floor_height : float, optional
        Height (m) above the axles at which accelerations of bodies are read; that of the centre of
        mass when left out.
    hunting_frequency : float, optional
        Hz; when left out, the frequency between 0.5 and 10 Hz at which the sums of guiding forces
        (or else the frames' accelerations) have the most power.
    comfort : bool
        Whether to add the continuous comfort of EN 12299 (root mean squares over 5 s of accelerations
        weighted by Wd and Wb) and, from five minutes on, the mean comfort N_MV.

    Raises
    ------
    ParameterError
        If the response is not one of the model, its motion left the track, the section is too short
        or samples are too far apart for the filters; or if the model has nothing to assess.

    Examples
    --------
    >>> import railenv
    >>> model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    >>> response = railenv.simulate(model, speed=60.0, duration=6.0, irregularity="low")
    >>> assessment = railenv.assess(model, response)
    >>> assessment.passed
    True
    >>> f"{assessment.worst('sum of guiding forces').limit / 1e3:.1f} kN"
    '47.3 kN'
    """
    limits = Limits() if limits is None else limits
    if not isinstance(limits, Limits):
        raise ParameterError(f"limits is {shown(limits)}; it must be a railenv.assessment.Limits")
    if floor_height is not None:
        floor_height = checks.number("floor_height", floor_height, unit="m")
    if hunting_frequency is not None:
        hunting_frequency = checks.number(
            "hunting_frequency", hunting_frequency, low=_LOWEST_EDGE, unit="Hz"
        )
    readings = Readings(model, response)
    check_sampling(readings.period, FORCE_CUTOFF)
    stretch = Stretch(readings, limits, _section(readings, section))
    frames, bodies = readings.on_frames(), readings.on_bodies(floor_height)
    if not (readings.wheelsets or frames or bodies):
        raise ParameterError(
            f"{readings.plant.name} has no forces of wheels and no motion of frames or bodies; there "
            "is nothing to assess"
        )
    f0 = hunting_frequency or _hunting_frequency(stretch, [*frames, *bodies])
    band = (max(f0 - _HALF_BAND, _LOWEST_EDGE), f0 + _HALF_BAND)
    found = _all(stretch, frames, bodies, band, comfort)
    return Assessment(
        model=model.name,
        section=stretch.section,
        speed=stretch.speed,
        radius=stretch.radius,
        hunting_frequency=f0,
        quantities=tuple(found.quantities),
        histories=tuple(found.histories),
        notes=tuple(found.notes),
    )


def _all(
    stretch: Stretch, frames: list[Place], bodies: list[Place], band: Band, comfort: bool
) -> Findings:
    """Return everything found, in the order of the groups."""
    found = Findings()
    for part in (
        from_wheels(stretch, band),
        from_frames(stretch, frames, band),
        from_bodies(stretch, bodies, comfort),
    ):
        found.quantities += part.quantities
        found.histories += part.histories
        found.notes += part.notes
    order = ("running safety", "track loading", "ride", "information")
    found.quantities.sort(key=lambda q: order.index(q.group))
    return found


def _section(readings: Readings, given: tuple[float, float] | None) -> tuple[float, float]:
    """Return start and end (m) of the section assessed, long enough for all readings."""
    end = float(readings.distance[-1])
    first, last = (0.0, end) if given is None else checks.interval("section", given, low=0.0, unit="m")
    if last > end * (1.0 + 1e-9):
        raise ParameterError(f"section ends at {last:g} m; the run ends at {end:g} m")
    fastest = float(readings.speed.max())
    least = max(SHORTEST, SHORTEST_TIME * fastest)
    if last - first < least * (1.0 - 1e-9):
        raise ParameterError(
            f"the section assessed is {last - first:.4g} m long; at {fastest:.4g} m/s it must be at "
            f"least {least:.4g} m ({SHORTEST:g} m and {SHORTEST_TIME:g} s), so simulate for longer"
        )
    return first, last


def _hunting_frequency(stretch: Stretch, places: list[Place]) -> float:
    """Return the frequency (Hz) at which the vehicle sways most."""
    readings = stretch.readings
    if readings.wheelsets:
        signals = readings.Y[:, 0] - readings.Y[:, 1]
    else:
        signals = np.array([readings.lateral(place) for place in places])
    return dominating_frequency(signals[:, stretch.inside], readings.period, _HUNTING_BAND)
