"""Claims about the creep law: the paper's heuristic one beside Kalker's simplified theory."""

from __future__ import annotations

from design.reproduction.cases import Case
from design.reproduction.claims import (
    CREEP_TOLERANCE,
    Claim,
    Evidence,
    Finding,
    Rule,
    cases_of,
)
from design.reproduction.creep import (
    CROWN_RADIUS,
    FLANGE,
    FLANGE_ANGLE,
    TREAD,
    creep_laws,
)
from design.reproduction.store import Piece
from railenv.contact.creep_comparison import CreepComparison


def agrees_with_simplified_theory(evidence: Evidence) -> Claim:
    """Claim that the heuristic law is close to FASTSIM: without spin and with that of a tread."""
    findings = {}
    for case in cases_of("bogie"):
        found = _compared(evidence, case)
        still = max(found.deviation("heuristic", d, 0.0) for d in ("longitudinal", "lateral"))
        tread = found.deviation("heuristic", "lateral", found.spin[TREAD])
        close = max(still, tread) <= CREEP_TOLERANCE
        text = (
            f"{still:.1%} of μN off without spin, {tread:.1%} with the tread's spin of "
            f"{found.spin[TREAD]:.2f} 1/m"
        )
        findings[case.vehicle.name] = Finding(text, "agrees" if close else "differs")
    return Claim(
        "creep-simplified-theory",
        "section 1",
        "heuristic creep law near the simplified theory",
        "The results of the heuristic creep model agree well with Kalker's simplified theory.",
        "good agreement",
        findings,
        "Largest difference of the creep force from FASTSIM up to full sliding, on the Hertzian patch "
        f"of a wheel on a rail with a crown of {CROWN_RADIUS:g} m; up to {CREEP_TOLERANCE:.0%} is "
        "good. Without spin the two curves nearly coincide; most of the difference is from the spin.",
    )


def fails_at_high_spin(evidence: Evidence) -> Claim:
    """Claim that the heuristic law fails at high spin; taken at the spin of a flange contact."""
    findings = {}
    shares = []
    for case in cases_of("bogie"):
        found = _compared(evidence, case)
        flange = found.deviation("heuristic", "lateral", found.spin[FLANGE])
        text = f"{flange:.0%} of μN off at a spin of {found.spin[FLANGE]:.2f} 1/m"
        findings[case.vehicle.name] = Finding(text, "agrees" if flange > CREEP_TOLERANCE else "differs")
        kalker = found.patch.creep_coefficients.lateral_spin_creep
        shares.append(f"{case.vehicle.lateral_spin_creep / kalker:.0%} ({case.vehicle.name})")
    return Claim(
        "creep-high-spin",
        "section 1",
        "heuristic creep law fails at high spin",
        "In the case of high values of spin, the heuristic theory leads to unsatisfactory results.",
        "unsatisfactory",
        findings,
        f"Lateral force at the spin of a flange contact of {FLANGE_ANGLE:g} degrees. The law takes the "
        "spin as a lateral force that grows without end and drives the contact into full sliding. In "
        "FASTSIM a large spin turns the patch about its middle, and the stresses of its leading "
        f"half and of its trailing half cancel. The vehicle's f12 is {_listed(shares)} of what "
        "Kalker's theory gives for this patch, so that its own equations feel little of the spin.",
    )


def _compared(evidence: Evidence, case: Case) -> CreepComparison:
    found: CreepComparison = evidence.data[creep_laws(case).name]
    return found


def _listed(parts: list[str]) -> str:
    return ", ".join(parts[:-1]) + " and " + parts[-1]


CREEP_RULES: tuple[Rule, ...] = (agrees_with_simplified_theory, fails_at_high_spin)
"""Claims that need the creep laws of a wheel only."""


def creep_pieces() -> tuple[Piece, ...]:
    """Return the computations for these claims."""
    return tuple(creep_laws(case) for case in cases_of("bogie"))
