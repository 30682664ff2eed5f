"""The sections of the report, in order. A new section is a subclass of ``Section`` and a line here."""

from __future__ import annotations

from collections.abc import Sequence

from design.reproduction.section import Section
from design.reproduction.sections.adhesion import Adhesion
from design.reproduction.sections.claims import Claims
from design.reproduction.sections.creep import Creep
from design.reproduction.sections.critical_speeds import CriticalSpeeds
from design.reproduction.sections.diagrams import Diagrams
from design.reproduction.sections.limit_cycles import LimitCycles
from design.reproduction.sections.map import Map
from design.reproduction.sections.motions import Motions
from design.reproduction.sections.readings import Readings
from design.reproduction.sections.simplifications import Simplifications
from design.reproduction.sections.spectra import Spectra
from design.reproduction.sections.vehicles import Vehicles
from design.reproduction.settings import Settings


def first_page(settings: Settings, leading: Sequence[Section] = ()) -> tuple[Section, ...]:
    """Return the sections of the first page: those that take seconds, after the leading ones."""
    return (
        *leading,
        Claims(settings, whole=False),
        CriticalSpeeds(),
        Simplifications(),
        Readings(settings),
        Adhesion(settings, whole=False),
    )


def whole_report(
    settings: Settings, further: Sequence[Section] = (), leading: Sequence[Section] = ()
) -> tuple[Section, ...]:
    """Return all sections after the leading ones, further ones before the vehicles' parameters."""
    return (
        *leading,
        Claims(settings, whole=True),
        CriticalSpeeds(),
        Simplifications(),
        Readings(settings),
        Adhesion(settings, whole=True),
        Creep(),
        Motions(),
        Diagrams(settings),
        Spectra(),
        LimitCycles(settings),
        Map(settings),
        *further,
        Vehicles(),
    )
