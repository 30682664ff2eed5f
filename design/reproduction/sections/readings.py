"""The search for a reading of the print that gives the paper's speeds."""

from __future__ import annotations

import math
from typing import Any

from markupsafe import Markup

from design.reproduction import paper, pieces
from design.reproduction.adhesion import adhesion_limit
from design.reproduction.cases import CASES, MODEL_TITLES, MODELS, PRINTED
from design.reproduction.claims import Evidence
from design.reproduction.document import fragment
from design.reproduction.readings import UNITS, results
from design.reproduction.section import Data, DataTable, Section
from design.reproduction.settings import Settings
from design.reproduction.store import Piece

_TABLE_1 = tuple(case for case in CASES if case.vehicle.name == "TABLE_1")
HEADER = ("judged by", "speeds in", "readings", *(f"{MODEL_TITLES[m]} alone" for m in MODELS), "both")
"""Headings of the table of counts."""

_JUDGED = {
    "eigenvalues": "eigenvalues at the equilibria",
    "simulation": "simulation from zero, as in the paper",
}


class Readings(Section):
    """The search for a reading that gives the paper's numbers, which found none."""

    key = "readings"
    title = "Is there a reading of the print that gives the paper's speeds?"

    def __init__(self, settings: Settings) -> None:
        self._settings = settings

    def pieces(self) -> tuple[Piece, ...]:
        """Return the critical speeds of Table 1's models; the search itself takes minutes."""
        return tuple(pieces.critical_speeds(case) for case in _TABLE_1)

    def text(self, data: Data) -> Markup:
        """Return the search, its results, and the arguments against any misprint."""
        found = results()
        evidence = Evidence(data, self._settings)
        counts = fragment(
            "table.html",
            paragraphs=[_asked(found), *_answer(found)],
            caption="Readings that are steady at the lower speed and hunt at the upper one.",
            header=HEADER,
            rows=rows(found),
            words=2,
        )
        axes = fragment(
            "table.html",
            paragraphs=[],
            caption=f"The axes of the search: {_product(found)}.",
            header=("place in the print", "read as"),
            rows=[(axis, "; ".join(options)) for axis, options in found["axes"].items()],
            words=2,
        )
        closing = fragment(
            "table.html",
            paragraphs=[_ratio(evidence), _kilometres(evidence), _letter(found), *_conjectures()],
            caption="",
            header=(),
            rows=[],
            words=0,
        )
        return counts + axes + closing

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the counts."""
        header = ("judged_by", "unit", "readings", *MODELS, "both")
        counted = [
            (name, unit, search["readings"], *(search[unit][m] for m in (*MODELS, "both")))
            for name, search in results()["searches"].items()
            for unit in UNITS
        ]
        return (DataTable("readings", header, counted),)


def rows(found: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the numbers of readings that put each model, and both, into the paper's brackets."""
    return [
        (
            _JUDGED[name],
            unit,
            f"{search['readings']}",
            *(f"{search[unit][m]}" for m in (*MODELS, "both")),
        )
        for name, search in found["searches"].items()
        for unit in UNITS
    ]


def _product(found: dict[str, Any]) -> str:
    sizes = [len(options) for options in found["axes"].values()]
    return f"{' × '.join(map(str, sizes))} = {math.prod(sizes)} readings"


def _asked(found: dict[str, Any]) -> str:
    bogie, dual = paper.BOGIE, paper.DUAL_WHEELSET
    return (
        f"The paper's bogie is steady at {bogie.steady:g} and hunts at {bogie.hunting:g} m/s, its dual "
        f"wheelset at {dual.steady:g} and {dual.hunting:g} m/s, R = {paper.RADIUS:g} m. Table 1 gives "
        "neither, with the print corrected. Is there a way to read the printed equations under which "
        "it does, in m/s or in km/h? Every combination of the doubtful places below was tried with "
        "Table 1's numbers: by eigenvalues, where a stable equilibrium on the tread or on a flange "
        "counts as steady, and as hunting that none is stable and one is lost to an oscillation; and "
        f"by the paper's own way, Runge-Kutta steps of {1e3 * found['step']:g} ms from zero "
        f"initial conditions for {found['duration']:g} s."
    )


def _answer(found: dict[str, Any]) -> list[str]:
    both = {
        (name, unit): search[unit]["both"]
        for name, search in found["searches"].items()
        for unit in UNITS
    }
    different = " and ".join(f"{n} of the {MODEL_TITLES[m]}" for m, n in found["different"].items())
    told = f"The readings make {different} that differ."
    if not any(both.values()):
        return [f"None was found: no reading puts both models into their brackets. {told}"]
    hits = "; ".join(f"{n} by {name} in {unit}" for (name, unit), n in both.items() if n)
    return [f"Both models are in their brackets in {hits}. {told}"]


def _ratio(evidence: Evidence) -> str:
    low = PRINTED["dual_wheelset"].steady / PRINTED["bogie"].hunting
    high = PRINTED["dual_wheelset"].hunting / PRINTED["bogie"].steady
    bogie, dual = _speeds(evidence)
    return (
        "An argument without units: the paper's two critical speeds have a ratio of "
        f"{low:.2f} to {high:.2f}, whatever they are measured in. Table 1's is {dual / bogie:.2f} "
        f"({bogie:.1f} and {dual:.1f} m/s), since a frame that no spring holds to the ground hunts far "
        "earlier than a frame at rest."
    )


def _kilometres(evidence: Evidence) -> str:
    bogie, dual = _speeds(evidence)
    wavelength = _TABLE_1[0].vehicle.klingel_wavelength
    kinematic = [
        printed.hunting * UNITS["km/h"] / wavelength for printed in (paper.BOGIE, paper.DUAL_WHEELSET)
    ]
    low, high = paper.BOGIE.steady * UNITS["km/h"], paper.BOGIE.hunting * UNITS["km/h"]
    return (
        f"km/h is rejected: the dual wheelset's {3.6 * dual:.1f} km/h comes near the paper's "
        f"{paper.DUAL_WHEELSET.steady:g} to {paper.DUAL_WHEELSET.hunting:g}, but the bogie would have "
        f"to hunt {low / bogie:.1f} to {high / bogie:.1f} times faster than it does, and the "
        f"frequencies of Fig 13 ({paper.BOGIE.frequency:g} and {paper.DUAL_WHEELSET.frequency:g} Hz) "
        f"would lie above the kinematic ones of a free wheelset ({kinematic[0]:.2f} and "
        f"{kinematic[1]:.2f} Hz), which hunting stays below."
    )


def _letter(found: dict[str, Any]) -> str:
    times = " and ".join(
        f"{'never' if after is None else f'{after:g} s'} at {speed}"
        for speed, after in found["letter"].items()
    )
    return (
        "The print to the letter, with no correction at all, is not what the authors ran: its bogie is "
        f"ten flange clearances off the track after {times}."
    )


def _conjectures() -> list[str]:
    limits = [
        f"{adhesion_limit(case, paper.RADIUS, paper.CANT):.1f} m/s ({MODEL_TITLES[case.kind]})"
        for case in CASES
        if case.vehicle.name == "TABLE_1_PRINTED_LOADS"
    ]
    return [
        "Two conjectures, and no more than that. First, the authors' program may have had a secondary "
        "suspension, which the paper lacks: a frame held to the ground hunts later, nearer to the dual "
        f"wheelset. Second, the curve uses up all adhesion at {' and '.join(limits)} with the printed "
        "loads, inside both brackets; but Table 1's vehicle hunts below these speeds and rests on the "
        "flange above them, the reverse of Figs 6 to 9, so this may be a coincidence.",
    ]


def _speeds(evidence: Evidence) -> tuple[float, float]:
    """Return the linear critical speeds (m/s) of Table 1's bogie and dual wheelset on the curve."""
    speeds = {case.kind: evidence.on_curve(case).speed for case in _TABLE_1}
    assert speeds["bogie"] is not None
    assert speeds["dual_wheelset"] is not None
    return speeds["bogie"], speeds["dual_wheelset"]
