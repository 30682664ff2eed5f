"""The paper's claims, each with the findings of the computations for each vehicle.

A claim is a function of :class:`Evidence`. It derives numbers, verdicts and the reason from results;
the only numbers written here are tolerances. The printed results are in
:mod:`design.reproduction.paper`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

from design.reproduction import paper, pieces
from design.reproduction.cases import CASES, Case, ModelName
from design.reproduction.section import Data
from design.reproduction.settings import Settings
from railenv.vehicles import Vehicle

Verdict = Literal["agrees", "differs", "open"]

FREQUENCY_TOLERANCE = 0.05
"""Hz; the paper's two main frequencies differ by 0.046 Hz, about the resolution of its spectra."""

ERROR_TOLERANCE = 0.01
"""Tolerance within which a relative difference of speeds equals the printed one."""

CHANGE_TOLERANCE = 1e-3
"""Relative change of a critical speed from one radius to the next that counts as zero."""

EQUAL = 0.02
"""Relative difference below which two motions count as equal."""

MOST = 0.9
"""Share of the points of a diagram at which a rule must hold for the claim to agree."""

NEAR = 0.2
"""Relative distance of two frequencies that count as close."""

AROUND = 1.5
"""Factor within which a frequency is around another."""

SIGNIFICANT = 0.05
"""Relative change of a critical speed that is significant."""

CREEP_TOLERANCE = 0.1
"""Difference of two creep laws, over the adhesion limit, that counts as good agreement; FASTSIM itself
differs from the exact theory by half of it."""


@dataclass(frozen=True)
class Finding:
    """The finding of the computations about a claim for one vehicle.

    Attributes
    ----------
    text : str
        Computed numbers.
    verdict : {"agrees", "differs", "open"}
        "open": the vehicle has nothing to compare with the claim.
    """

    text: str
    verdict: Verdict


@dataclass(frozen=True)
class Claim:
    """A claim of the paper beside our findings.

    Attributes
    ----------
    key : str
    source : str
        Place in the paper.
    short : str
        The statement in a few words.
    statement : str
    printed : str
        Printed result.
    findings : dict of str to Finding
        Findings by the name of the vehicle.
    why : str
        Reason, from the same computations.
    """

    key: str
    source: str
    short: str
    statement: str
    printed: str
    findings: dict[str, Finding]
    why: str


@dataclass(frozen=True)
class Evidence:
    """Results of pieces, by their cases."""

    data: Data
    settings: Settings

    def speeds(self, case: Case) -> dict[str, Any]:
        """Return the critical speeds of a case."""
        return self.data[pieces.critical_speeds(case).name]

    def on_curve(self, case: Case) -> Any:
        """Return the critical speed on the curve of Figs 6 to 9."""
        return self.speeds(case)["listed"][pieces.LISTED_RADII.index(paper.RADIUS)]

    def motion(self, case: Case, speed: float) -> dict[str, Any]:
        """Return the motion at one of the paper's speeds."""
        return self.data[pieces.motion(case, speed).name]


Rule = Callable[[Evidence], Claim]


def cases_of(kind: ModelName) -> tuple[Case, ...]:
    """Return the cases of one model, in the order of the vehicles."""
    return tuple(c for c in CASES if c.kind == kind)


def counts(claims: Iterable[Claim], vehicle: Vehicle) -> tuple[int, int, int]:
    """Return the numbers of claims that agree, differ and stay open for a vehicle."""
    verdicts = [c.findings[vehicle.name].verdict for c in claims]
    return verdicts.count("agrees"), verdicts.count("differs"), verdicts.count("open")
