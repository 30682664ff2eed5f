"""Claims about bifurcation diagrams and limit cycles, which need the whole report."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from design.cycles.cycle import CycleBranch
from design.cycles.diagram import SimulatedDiagram
from design.cycles.polach import HUNTING
from design.reproduction import paper, pieces
from design.reproduction.adhesion import adhesion_limit
from design.reproduction.cases import CASES, MODEL_TITLES, PRINTED, Case, ModelName
from design.reproduction.claims import MOST, Claim, Evidence, Finding, Rule, Verdict, cases_of
from design.reproduction.settings import Settings
from design.reproduction.store import Piece

_FIGURES = {"bogie": "Fig 10", "dual_wheelset": "Fig 11"}


START = -1
"""Index of a diagram's large disturbance, which also finds hunting that grows slowly."""


def amplitude(found: SimulatedDiagram) -> Any:
    """Return half the peak to peak (m) of the first state, shape (n_radii, n_speeds)."""
    return found.amplitude[found.state_names[0]][..., START]


def largest(found: SimulatedDiagram) -> Any:
    """Return the largest magnitude (m) of the first state, shape (n_radii, n_speeds)."""
    ends = np.stack([found.lowest[..., START, 0], found.highest[..., START, 0]])
    return np.abs(ends).max(axis=0)


def on_track(found: SimulatedDiagram, case: Case) -> Any:
    """Return where the wheelset stays within two flange clearances, shape (n_radii, n_speeds)."""
    with np.errstate(invalid="ignore"):
        return largest(found) < 2.0 * case.vehicle.flange_clearance


def hunting_range(found: SimulatedDiagram, case: Case, row: int) -> tuple[float, float] | None:
    """Return lowest and highest speed (m/s) of a diagram at which simulations end in hunting."""
    with np.errstate(invalid="ignore"):
        hunts = (amplitude(found)[row] > HUNTING * case.model.scale[0]) & on_track(found, case)[row]
    speeds = found.speed[hunts]
    return (float(speeds.min()), float(speeds.max())) if speeds.size else None


def larger_on_tighter(kind: ModelName) -> Rule:
    """Claim that the largest displacement grows as the radius falls."""

    def rule(evidence: Evidence) -> Claim:
        findings, steady = {}, []
        for case in cases_of(kind):
            found = evidence.data[pieces.diagram(case, evidence.settings).name]
            every, rest, hunts = _shares_growing(found, case)
            text = f"{every:.0%} of comparisons; at rest {rest:.0%}, hunting {hunts:.0%}"
            findings[case.vehicle.name] = Finding(
                text.replace("nan%", "none"), "agrees" if every > MOST else "differs"
            )
            reach = hunting_range(found, case, len(found.radius) - 1)
            if reach is not None:
                steady.append(f"{case.vehicle.name} from {reach[0]:.0f} to {reach[1]:.0f} m/s")
        why = (
            "Compared speed by speed, each curve with the next wider one, where both motions stay on "
            "the "
            "track; then where both are at rest, and where both hunt."
        )
        if steady:
            why += f" At {found.radius[-1]:g} m hunting is found for {'; '.join(steady)}."
        return Claim(
            f"larger-{kind}",
            _FIGURES[kind],
            f"{MODEL_TITLES[kind]}: displacement grows on tighter curves",
            f"The largest displacement of the {MODEL_TITLES[kind]} grows as the radius falls.",
            "grows",
            findings,
            why,
        )

    return rule


def _shares_growing(found: SimulatedDiagram, case: Case) -> tuple[float, float, float]:
    """Return the share of pairs of neighbouring curves, at one speed, with more on the tighter one.

    There are three shares: of all pairs, of those at rest, and of those hunting on both.
    """
    order = np.argsort(found.radius)
    y, size, inside = (v[order] for v in (largest(found), amplitude(found), on_track(found, case)))
    hunts = size > HUNTING * case.model.scale[0]
    tighter, wider = slice(0, -1), slice(1, None)
    both = inside[tighter] & inside[wider]
    more = y[tighter] > y[wider]
    at_rest = both & ~hunts[tighter] & ~hunts[wider]
    hunting = both & hunts[tighter] & hunts[wider]
    every, rest, moving = (
        float(np.mean(more[chosen])) if chosen.any() else math.nan
        for chosen in (both, at_rest, hunting)
    )
    return every, rest, moving


def grows_with_speed(kind: ModelName) -> Rule:
    """Claim that the amplitude grows with the speed above the critical one."""

    def rule(evidence: Evidence) -> Claim:
        findings, ends = {}, []
        for case in cases_of(kind):
            found = evidence.data[pieces.diagram(case, evidence.settings).name]
            row = int(np.argmax(found.radius))
            reach = hunting_range(found, case, row)
            if reach is None:
                findings[case.vehicle.name] = Finding("does not hunt", "open")
                continue
            findings[case.vehicle.name] = _growth(found, row, reach)
            if reach[1] < found.speed[-1]:
                ends.append(f"{case.vehicle.name} beyond {reach[1]:.0f} m/s")
        radius = max(paper.DIAGRAM_RADII)
        why = f"Simulated from a large disturbance, R = {radius:g} m, up to where hunting ends."
        if ends:
            why += (
                f" It does end: {', '.join(ends)}, where the curve uses up the adhesion and the "
                "wheelset "
                "rests on the flange."
            )
        return Claim(
            f"grows-{kind}",
            "section 4.2",
            f"{MODEL_TITLES[kind]}: amplitude grows with speed",
            f"Above the critical speed the {MODEL_TITLES[kind]}'s amplitude grows with the speed.",
            "grows",
            findings,
            why,
        )

    return rule


def _growth(found: SimulatedDiagram, row: int, reach: tuple[float, float]) -> Finding:
    inside = (found.speed >= reach[0]) & (found.speed <= reach[1])
    speed, size = found.speed[inside], 1e3 * amplitude(found)[row, inside]
    share = float(np.mean(np.diff(size) > 0.0)) if len(speed) > 1 else math.nan
    top = int(np.argmax(size))
    text = (
        f"{size[0]:.1f} mm at {speed[0]:.0f}, most {size[top]:.1f} at {speed[top]:.0f}, "
        f"{size[-1]:.1f} at {speed[-1]:.0f} m/s; grows in {share:.0%} of the steps"
    )
    return Finding(text, "agrees" if share > MOST else "differs")


def subcritical(kind: ModelName) -> Rule:
    """Claim that hunting exists below the linear critical speed."""

    def rule(evidence: Evidence) -> Claim:
        findings, kinds = {}, []
        for case in cases_of(kind):
            found = evidence.data[pieces.branch(case, paper.RADIUS, evidence.settings).name]
            if found is None:
                findings[case.vehicle.name] = Finding("no hunting", "open")
                continue
            hopf, fold = found["branch"].hopf.speed, found["branch"].nonlinear_critical_speed
            kinds.append(f"{case.vehicle.name} {found['criticality']}")
            if fold is None or found["branch"].onset.rests_on == "Hopf":
                findings[case.vehicle.name] = Finding(f"no fold below {hopf:.2f} m/s", "differs")
                continue
            text = f"fold at {fold:.2f}, Hopf point at {hopf:.2f} m/s: {1.0 - fold / hopf:.2%} lower"
            findings[case.vehicle.name] = Finding(text, "agrees")
        return Claim(
            f"subcritical-{kind}",
            "Figs 4, 12",
            f"{MODEL_TITLES[kind]}: nonlinear critical speed lower",
            f"The {MODEL_TITLES[kind]}'s nonlinear critical speed lies below the linear one, "
            f"R = {paper.RADIUS:g} m.",
            "V_cr-NL < V_cr-L",
            findings,
            "The fold of the branch of limit cycles is the nonlinear critical speed. Kind of Hopf "
            "point: "
            f"{'; '.join(kinds) or 'none'}.",
        )

    return rule


def frequency_in_bracket(kind: ModelName) -> Rule:
    """Claim that hunting has the printed frequency at a speed of the paper's bracket."""
    printed = PRINTED[kind]

    def rule(evidence: Evidence) -> Claim:
        findings, limits = {}, []
        for case in cases_of(kind):
            limit = adhesion_limit(case, paper.RADIUS, paper.CANT)
            limits.append(f"{case.vehicle.name} {limit:.1f} m/s")
            found = evidence.data[pieces.branch(case, paper.RADIUS, evidence.settings).name]
            if found is None:
                findings[case.vehicle.name] = Finding("no hunting", "open")
                continue
            speeds = speeds_with_frequency(found["branch"], printed.frequency)
            inside = any(printed.steady <= v <= printed.hunting for v in speeds)
            text = "at " + ", ".join(f"{v:.1f}" for v in speeds) + " m/s" if speeds else "at no speed"
            text += f", up to {found['branch'].speed.max():.0f} m/s"
            short = found["branch"].speed.max() < printed.steady  # the branch was not followed that far
            outside: Verdict = "open" if short else "differs"
            findings[case.vehicle.name] = Finding(text, "agrees" if inside else outside)
        return Claim(
            f"frequency-bracket-{kind}",
            "Fig 13",
            f"{MODEL_TITLES[kind]} hunts at {printed.frequency:g} Hz, "
            f"{printed.steady:g} to {printed.hunting:g} m/s",
            f"The {MODEL_TITLES[kind]} hunts at {printed.frequency:g} Hz somewhere between "
            f"{printed.steady:g} and {printed.hunting:g} m/s, R = {paper.RADIUS:g} m.",
            f"{printed.frequency:g} Hz",
            findings,
            "Speeds at which limit cycles of the branch have the printed frequency. Beside them, the "
            "speeds at "
            f"which the curve uses up all adhesion: {', '.join(limits)}.",
        )

    return rule


def speeds_with_frequency(branch: CycleBranch, frequency: float) -> list[float]:
    """Return the speeds (m/s) at which limit cycles of a branch have a frequency (Hz)."""
    speed, off = branch.speed, branch.frequency - frequency
    crossed = np.flatnonzero(off[:-1] * off[1:] < 0.0)
    share = off[crossed] / (off[crossed] - off[crossed + 1])
    return sorted((speed[crossed] + share * (speed[crossed + 1] - speed[crossed])).tolist())


FURTHER_RULES: tuple[Rule, ...] = (
    larger_on_tighter("bogie"),
    larger_on_tighter("dual_wheelset"),
    grows_with_speed("bogie"),
    grows_with_speed("dual_wheelset"),
    subcritical("bogie"),
    subcritical("dual_wheelset"),
    frequency_in_bracket("bogie"),
    frequency_in_bracket("dual_wheelset"),
)
"""Claims that need bifurcation diagrams and limit cycles."""


def further_pieces(settings: Settings) -> tuple[Piece, ...]:
    """Return the computations for these claims."""
    return tuple(
        piece
        for case in CASES
        for piece in (pieces.diagram(case, settings), pieces.branch(case, paper.RADIUS, settings))
    )
