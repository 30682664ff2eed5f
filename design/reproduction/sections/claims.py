"""The table of claims."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from design.reproduction.cases import VEHICLES
from design.reproduction.claims import Claim, Evidence, counts
from design.reproduction.claims_of_body import BODY_RULES, body_pieces
from design.reproduction.claims_of_creep import CREEP_RULES, creep_pieces
from design.reproduction.claims_of_diagrams import FURTHER_RULES, further_pieces
from design.reproduction.claims_of_frequencies import FREQUENCY_RULES
from design.reproduction.claims_of_motions import FIRST_RULES, first_pieces
from design.reproduction.document import fragment
from design.reproduction.section import Data, DataTable, Section
from design.reproduction.settings import Settings
from design.reproduction.store import Piece

WORDS = {"agrees": "agrees", "differs": "differs", "open": "cannot be decided"}

_MEANING = (
    "The first vehicle is the paper's Table 1, with each load carried once; the second carries the "
    "loads as the "
    "paper prints them; the third is the coach whose masses Table 1 has, with its own suspension."
)


class Claims(Section):
    """Every claim of the paper beside our numbers."""

    key = "claims"
    title = "What the paper claims, and what the equations give"

    def __init__(self, settings: Settings, *, whole: bool) -> None:
        self._settings = settings
        self._whole = whole

    def pieces(self) -> tuple[Piece, ...]:
        """Return the pieces for the claims."""
        further = (*further_pieces(self._settings), *body_pieces()) if self._whole else ()
        return (*first_pieces(), *creep_pieces(), *further)

    def claims(self, data: Data) -> list[Claim]:
        """Judge every claim."""
        evidence = Evidence(data, self._settings)
        further = (*FURTHER_RULES, *BODY_RULES) if self._whole else ()
        rules = (*FIRST_RULES, *FREQUENCY_RULES, *CREEP_RULES, *further)
        return [rule(evidence) for rule in rules]

    def text(self, data: Data) -> Markup:
        """Return the table."""
        claims = self.claims(data)
        return fragment(
            "claims.html",
            claims=claims,
            counts=[(v.name, counts(claims, v)) for v in VEHICLES],
            untested=0 if self._whole else len(FURTHER_RULES) + len(BODY_RULES),
            meaning=_MEANING,
            words=WORDS,
        )

    def tables(self, data: Data) -> tuple[DataTable, ...]:
        """Return the table, a row for each claim and vehicle."""
        header = ("claim", "source", "statement", "paper", "vehicle", "ours", "verdict", "why")
        return (DataTable("claims", header, _rows(self.claims(data))),)


def _rows(claims: Sequence[Claim]) -> list[tuple[str, ...]]:
    return [
        (c.key, c.source, c.statement, c.printed, vehicle, found.text, found.verdict, c.why)
        for c in claims
        for vehicle, found in c.findings.items()
    ]
