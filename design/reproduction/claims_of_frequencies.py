"""Claims about motions below the critical speed and about natural frequencies: Fig 12, section 4.4."""

from __future__ import annotations

from typing import Any

from design.reproduction import paper, pieces
from design.reproduction.cases import Case
from design.reproduction.claims import (
    AROUND,
    EQUAL,
    Claim,
    Evidence,
    Finding,
    Rule,
    cases_of,
)


def rms_below(evidence: Evidence) -> Claim:
    """Claim that below the critical speed the bogie's rms is the smaller one."""
    bogie, dual = paper.BOGIE, paper.DUAL_WHEELSET
    findings = {}
    for name, slow, quick in _pairs(evidence):
        if slow is None or quick is None:
            findings[name] = _nothing()
            continue
        a, b = (motion["spectrum"].rms for motion in (slow, quick))
        text = f"{b / a:.2f} ({1e3 * b:.2f} and {1e3 * a:.2f} mm)"
        if abs(b / a - 1.0) < EQUAL:
            findings[name] = Finding(text, "open")
        else:
            findings[name] = Finding(text, "agrees" if b > a else "differs")
    clearance = 1e3 * cases_of("bogie")[0].vehicle.flange_clearance
    return Claim(
        "rms-below",
        "Fig 12",
        "rms below critical: dual wheelset above bogie",
        "Below the critical speed the dual wheelset's rms displacement is the larger one.",
        f"{dual.rms_below:g} to {bogie.rms_below:g}, ratio {dual.rms_below / bogie.rms_below:.2f}",
        findings,
        "The paper's values have no unit. They cannot be mm, since the flange clearance is "
        f"{clearance:.2f} mm, and the motion that dies out (Fig 12) has the larger ones, not the "
        "motion that goes on (Fig 13). They look like the root mean square of a spectrum in dB, which "
        "depends on the sampling rate. "
        f"Ours are of the first {pieces.BELOW_RUN:g} m from zero initial conditions, "
        f"{1.0 - pieces.BELOW:.0%} below each model's own critical speed on this curve, so they are "
        "mostly the way to the equilibrium.",
    )


def bogie_is_quicker_below(evidence: Evidence) -> Claim:
    """Claim that below the critical speed the bogie moves at the higher frequency."""
    bogie, dual = paper.BOGIE, paper.DUAL_WHEELSET
    findings = {}
    for name, one, other in _pairs(evidence):
        if one is None or other is None:
            findings[name] = _nothing()
            continue
        a, b = (motion["spectrum"].main_frequency for motion in (one, other))
        text = f"{a:.2f} Hz at {one['speed']:.1f}, {b:.2f} Hz at {other['speed']:.1f} m/s"
        findings[name] = Finding(text, "agrees" if a > b else "differs")
    return Claim(
        "bogie-quicker-below",
        "Fig 12",
        "frequency below critical: bogie above dual wheelset",
        "Below its critical speed the bogie moves at a higher frequency than the dual wheelset.",
        f"{bogie.frequency_below:g} against {dual.frequency_below:g} Hz",
        findings,
        "Above the critical speed the paper has it the other way round "
        f"({bogie.frequency:g} against {dual.frequency:g} Hz), and at nearly three times the "
        "frequency. The wavelength of hunting changes little with the speed, so these equations give "
        "no such rise within the few m/s between the paper's steady running and its hunting.",
    )


def natural_frequencies_near_1_hz(evidence: Evidence) -> Claim:
    """Claim that the natural frequencies of the bogie are around 1 Hz."""
    findings, lows = {}, []
    for case in cases_of("bogie"):
        found = evidence.data[pieces.natural_frequencies(case).name]
        if found is None:
            findings[case.vehicle.name] = Finding("does not hunt", "open")
            continue
        frame = sorted(float(f) for f in found["frame"])
        text = ", ".join(f"{f:.2f}" for f in frame) + " Hz"
        near = all(paper.NATURAL / AROUND <= f <= paper.NATURAL * AROUND for f in frame)
        findings[case.vehicle.name] = Finding(text, "agrees" if near else "differs")
        speed = frame[0] * case.vehicle.klingel_wavelength
        lows.append(f"{case.vehicle.name} at {speed:.0f} m/s")
    return Claim(
        "natural-frequencies",
        "section 4.4",
        f"natural frequencies around {paper.NATURAL:g} Hz",
        "The bogie's natural frequencies, which the kinematic frequency of a wheelset stays below at "
        f"low speeds, are usually around {paper.NATURAL:g} Hz.",
        f"around {paper.NATURAL:g} Hz",
        findings,
        "Frame on its suspension with the wheelsets held, without damping; around means within a "
        f"factor of {AROUND:g}. The kinematic frequency reaches the lowest of them for "
        f"{', '.join(lows)}. Frequencies around 1 Hz are those of a car body on its secondary springs.",
    )


def _pairs(evidence: Evidence) -> list[tuple[str, Any, Any]]:
    """Return the motions below the critical speed of bogie and dual wheelset, by vehicle."""

    def motion(case: Case) -> Any:
        return evidence.data[pieces.motion_below(case).name]

    both = zip(cases_of("bogie"), cases_of("dual_wheelset"), strict=True)
    return [(bogie.vehicle.name, motion(bogie), motion(dual)) for bogie, dual in both]


def _nothing() -> Finding:
    return Finding("one of them has no critical speed", "open")


FREQUENCY_RULES: tuple[Rule, ...] = (
    rms_below,
    bogie_is_quicker_below,
    natural_frequencies_near_1_hz,
)
"""Claims that need motions and natural frequencies of the first page only."""
