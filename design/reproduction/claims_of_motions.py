"""Claims about critical speeds and single motions: those of the report's first page."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from design.reproduction import paper, pieces
from design.reproduction.adhesion import adhesion_limit
from design.reproduction.cases import CASES, MODEL_TITLES, PRINTED, VEHICLES, Case, ModelName
from design.reproduction.claims import (
    CHANGE_TOLERANCE,
    EQUAL,
    ERROR_TOLERANCE,
    FREQUENCY_TOLERANCE,
    NEAR,
    Claim,
    Evidence,
    Finding,
    Rule,
    Verdict,
    cases_of,
)
from design.reproduction.store import Piece

_FAST = 200.0  # m/s: no train hunts there
_AT_FLANGE = 0.99  # of the clearance


def steady(kind: ModelName) -> Rule:
    """Claim that a model runs steadily at the lower of the paper's two speeds."""
    printed = PRINTED[kind]

    def rule(evidence: Evidence) -> Claim:
        return _motion_claim(evidence, kind, printed.steady, printed.steady_figure, hunting=False)

    return rule


def hunting(kind: ModelName) -> Rule:
    """Claim that a model hunts at the higher of the paper's two speeds."""
    printed = PRINTED[kind]

    def rule(evidence: Evidence) -> Claim:
        return _motion_claim(evidence, kind, printed.hunting, printed.hunting_figure, hunting=True)

    return rule


def _motion_claim(
    evidence: Evidence, kind: ModelName, speed: float, figure: str, *, hunting: bool
) -> Claim:
    findings = {}
    for case in cases_of(kind):
        found = evidence.motion(case, speed)
        findings[case.vehicle.name] = Finding(describe(found, case), _same(found["hunts"], hunting))
    what = "hunts" if hunting else "runs steadily"
    return Claim(
        f"{'hunting' if hunting else 'steady'}-{kind}",
        figure,
        f"{MODEL_TITLES[kind]} {what}, {speed:g} m/s",
        f"The {MODEL_TITLES[kind]} {what} at {speed:g} m/s, R = {paper.RADIUS:g} m.",
        "hunting" if hunting else "steady",
        findings,
        _why_motion(evidence, kind, speed),
    )


def describe(found: dict[str, Any], case: Case) -> str:
    """Describe the end of a motion in a few words."""
    if found["hunts"]:
        frequency = found["spectrum"].main_frequency
        return f"hunts, {1e3 * found['amplitude']:.1f} mm at {frequency:.2f} Hz"
    place = "flange" if _on_flange(found, case) else "tread"
    return f"steady on the {place}, at {1e3 * found['mean']:.1f} mm"


def _on_flange(found: dict[str, Any], case: Case) -> bool:
    return not found["hunts"] and abs(found["mean"]) > _AT_FLANGE * case.vehicle.flange_clearance


def _why_motion(evidence: Evidence, kind: ModelName, speed: float) -> str:
    starts = [f"{c.vehicle.name} {_hunts_from(evidence.on_curve(c))}" for c in cases_of(kind)]
    resting = [
        f"{c.vehicle.name} above {limit:.1f} m/s"
        for c in cases_of(kind)
        if speed > (limit := adhesion_limit(c, paper.RADIUS, paper.CANT))
        and _on_flange(evidence.motion(c, speed), c)
    ]
    text = f"On this curve {_listed(starts)}."
    if resting:
        text += (
            f" The curve uses up all adhesion of {_listed(resting)}, so the wheelset moves to the "
            "flange "
            "and rests there."
        )
    return text


def _hunts_from(critical: Any) -> str:
    if critical.loss == "hunting":
        return f"hunts from {critical.speed:.2f} m/s"
    return f"does not start to hunt ({critical})"


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1]


def _same(found: bool, claimed: bool) -> Verdict:
    return "agrees" if found == claimed else "differs"


def onset(kind: ModelName) -> Rule:
    """Claim that hunting starts between the paper's two speeds."""
    printed = PRINTED[kind]

    def rule(evidence: Evidence) -> Claim:
        findings, tangent = {}, []
        for case in cases_of(kind):
            critical = evidence.on_curve(case)
            inside = critical.speed is not None and printed.steady <= critical.speed <= printed.hunting
            text = "no hunting" if critical.speed is None else f"{critical.speed:.2f} m/s"
            findings[case.vehicle.name] = Finding(text, _same(inside, True))
            straight = evidence.speeds(case)["tangent"]
            if straight.speed is not None and printed.steady <= straight.speed <= printed.hunting:
                tangent.append(f"{case.vehicle.name} hunts from {straight.speed:.2f} m/s")
        return Claim(
            f"onset-{kind}",
            f"{printed.steady_figure}, {printed.hunting_figure}",
            f"{MODEL_TITLES[kind]} starts to hunt at {printed.steady:g} to {printed.hunting:g} m/s",
            f"The {MODEL_TITLES[kind]} starts to hunt between {printed.steady:g} and "
            f"{printed.hunting:g} m/s, R = {paper.RADIUS:g} m.",
            f"{printed.steady:g} to {printed.hunting:g} m/s",
            findings,
            _why_onset(kind, tangent),
        )

    return rule


def _why_onset(kind: ModelName, tangent: list[str]) -> str:
    printed = PRINTED[kind]
    limits = {c.vehicle.name: adhesion_limit(c, paper.RADIUS, paper.CANT) for c in cases_of(kind)}
    inside = [
        f"{n} at {v:.1f} m/s" for n, v in limits.items() if printed.steady <= v <= printed.hunting
    ]
    first, last = VEHICLES[0], VEHICLES[-1]
    ratio = last.primary_longitudinal_stiffness / first.primary_longitudinal_stiffness
    text = (
        f"Table 1's primary springs are soft: {last.name}, which has its masses, has "
        f"{ratio:.0f} times the longitudinal stiffness."
    )
    if tangent:
        text += f" On tangent track {_listed(tangent)}, inside the paper's bracket."
    if inside:
        text += f" The adhesion limit of the curve lies inside the bracket for {_listed(inside)}."
    return text


def falls_with_radius(kind: ModelName) -> Rule:
    """Claim that the critical speed falls with the radius."""

    def rule(evidence: Evidence) -> Claim:
        findings = {}
        for case in cases_of(kind):
            sweep = evidence.speeds(case)["sweep"]
            order = np.argsort(-sweep.radius)
            hunts = [i for i in order if sweep.results[i].loss == "hunting"]
            findings[case.vehicle.name] = _falls(sweep.radius[hunts], sweep.speed[hunts])
        return Claim(
            f"falls-{kind}",
            f"Fig 5 ({'a' if kind == 'bogie' else 'b'}), conclusion",
            f"{MODEL_TITLES[kind]}: critical speed falls with radius",
            f"The critical speed of the {MODEL_TITLES[kind]} falls as the radius falls.",
            "falls",
            findings,
            _why_falls(evidence, kind),
        )

    return rule


def _falls(radius: Any, speed: Any) -> Finding:
    if len(speed) < 2:
        return Finding("no hunting on curves", "open")
    steps = np.diff(speed) / speed[:-1]
    text = f"{speed[0]:.1f} m/s at {radius[0]:g} m, {speed[-1]:.1f} at {radius[-1]:.0f} m"
    falls = bool((steps < CHANGE_TOLERANCE).all() and speed[-1] < (1.0 - CHANGE_TOLERANCE) * speed[0])
    rise = float((speed / np.minimum.accumulate(speed)).max()) - 1.0
    if rise > CHANGE_TOLERANCE:
        text += f"; rises by {rise:.1%} on the way"
    return Finding(text, _same(falls, True))


def _why_falls(evidence: Evidence, kind: ModelName) -> str:
    ends = []
    for case in cases_of(kind):
        sweep = evidence.speeds(case)["sweep"]
        other = [
            r for r, found in zip(sweep.radius, sweep.results, strict=True) if found.loss != "hunting"
        ]
        if other:
            ends.append(
                f"{case.vehicle.name} below {min(r for r in sweep.radius if r > max(other)):.0f} m"
            )
    text = "Only radii on which hunting ends steady running count."
    if ends:
        text += f" On tighter curves ({_listed(ends)}) the equilibrium ends first, or stays stable."
    return text


def dual_is_faster(evidence: Evidence) -> Claim:
    """Claim that the dual wheelset's critical speed is higher than the bogie's."""
    findings = {}
    for bogie, dual in zip(cases_of("bogie"), cases_of("dual_wheelset"), strict=True):
        a, b = evidence.on_curve(bogie), evidence.on_curve(dual)
        if a.loss != "hunting" or b.loss != "hunting":
            findings[bogie.vehicle.name] = Finding("one of them does not hunt", "open")
            continue
        text = f"{b.speed:.1f} against {a.speed:.1f} m/s"
        findings[bogie.vehicle.name] = Finding(text, _same(b.speed > a.speed, True))
    fast = [
        f"{c.vehicle.name} (from {evidence.on_curve(c).speed:.0f} m/s at "
        f"{evidence.on_curve(c).frequency:.1f} Hz)"
        for c in cases_of("dual_wheelset")
        if (evidence.on_curve(c).speed or 0.0) > _FAST
    ]
    text = "The frame couples the wheelsets and lets them move together."
    if fast:
        text += f" No train runs as fast as the dual wheelset of {_listed(fast)} would hunt."
    return Claim(
        "dual-faster",
        "Fig 5, conclusion",
        "critical speed: dual wheelset above bogie",
        f"The dual wheelset's critical speed is higher than the bogie's, R = {paper.RADIUS:g} m.",
        "higher",
        findings,
        text,
    )


def simulated_differs(evidence: Evidence) -> Claim:
    """Claim that linear and simulated critical speed differ by 8.75 %."""
    findings = {}
    for case in cases_of("bogie"):
        linear = evidence.on_curve(case).speed
        simulated = evidence.data[pieces.simulated_critical_speed(case).name]
        if simulated is None:
            findings[case.vehicle.name] = Finding("no change within 20 %", "open")
            continue
        error = abs(simulated / linear - 1.0)
        same = abs(error - paper.LINEAR_TO_SIMULATED) < ERROR_TOLERANCE
        text = f"{error:.1%}: {simulated:.2f} simulated, {linear:.2f} m/s linear"
        findings[case.vehicle.name] = Finding(text, _same(same, True))
    return Claim(
        "linear-simulated",
        "section 4.1",
        f"linear and simulated differ by {paper.LINEAR_TO_SIMULATED:.2%}",
        "Linear and simulated critical speed differ by "
        f"{paper.LINEAR_TO_SIMULATED:.2%} (bogie, R = {paper.RADIUS:g} m).",
        f"{paper.LINEAR_TO_SIMULATED:.2%}",
        findings,
        "Simulated from zero initial conditions, as in the paper: small disturbances, to which the "
        "linear "
        "critical speed applies. A large disturbance finds hunting further below, down to the fold of "
        "the limit cycles.",
    )


def main_frequency(kind: ModelName) -> Rule:
    """Claim of the main frequency of hunting."""
    printed = PRINTED[kind]

    def rule(evidence: Evidence) -> Claim:
        findings, above = {}, []
        for case in cases_of(kind):
            found = evidence.motion(case, printed.hunting)
            findings[case.vehicle.name] = _frequency(found, printed.frequency)
            near = evidence.data[pieces.motion_above(case).name]
            if near is not None:
                f = near["spectrum"].main_frequency
                above.append(f"{f:.2f} Hz at {near['speed']:.1f} m/s for {case.vehicle.name}")
        why = "The frequency depends on the speed, which the paper does not give with this figure."
        if above:
            why += f" {pieces.ABOVE - 1.0:.0%} above our own critical speed it is {_listed(above)}."
        return Claim(
            f"frequency-{kind}",
            "Fig 13",
            f"{MODEL_TITLES[kind]} hunts at {printed.frequency:g} Hz, {printed.hunting:g} m/s",
            f"The {MODEL_TITLES[kind]} hunts at {printed.frequency:g} Hz "
            f"(taken at {printed.hunting:g} m/s, {printed.hunting_figure}).",
            f"{printed.frequency:g} Hz",
            findings,
            why,
        )

    return rule


def _frequency(found: dict[str, Any] | None, printed: float) -> Finding:
    if found is None or not found["hunts"]:
        return Finding("does not hunt", "differs")
    value = found["spectrum"].main_frequency
    return Finding(f"{value:.3f} Hz", _same(abs(value - printed) < FREQUENCY_TOLERANCE, True))


def frequency_below(kind: ModelName) -> Rule:
    """Claim of the main frequency between the nonlinear and the linear critical speed."""
    printed = PRINTED[kind]

    def rule(evidence: Evidence) -> Claim:
        findings = {}
        for case in cases_of(kind):
            found = evidence.data[pieces.motion_below(case).name]
            if found is None:
                findings[case.vehicle.name] = Finding(f"no critical speed below {_FAST:g} m/s", "open")
                continue
            value = found["spectrum"].main_frequency
            same = abs(value - printed.frequency_below) < FREQUENCY_TOLERANCE
            text = f"{value:.3f} Hz at {found['speed']:.1f} m/s"
            findings[case.vehicle.name] = Finding(text, _same(same, True))
        return Claim(
            f"frequency-below-{kind}",
            "Fig 12",
            f"{MODEL_TITLES[kind]} below critical: {printed.frequency_below:g} Hz",
            f"Just below its critical speed the {MODEL_TITLES[kind]} moves at "
            f"{printed.frequency_below:g} Hz.",
            f"{printed.frequency_below:g} Hz",
            findings,
            f"Taken {1.0 - pieces.BELOW:.0%} below our own linear critical speed on this curve, from "
            "zero "
            "initial conditions. There the motion has the frequency of hunting, so it goes with the "
            "critical speed.",
        )

    return rule


def dual_is_quicker(evidence: Evidence) -> Claim:
    """Claim that the dual wheelset's hunting frequency is higher than the bogie's."""
    findings = {}
    for bogie, dual in zip(cases_of("bogie"), cases_of("dual_wheelset"), strict=True):
        a = evidence.data[pieces.motion_above(bogie).name]
        b = evidence.data[pieces.motion_above(dual).name]
        if a is None or b is None:
            findings[bogie.vehicle.name] = Finding("one of them does not hunt", "open")
            continue
        slow, quick = (m["spectrum"].main_frequency for m in (a, b))
        text = f"{quick:.2f} against {slow:.2f} Hz"
        findings[bogie.vehicle.name] = Finding(text, _same(quick > slow, True))
    return Claim(
        "dual-quicker",
        "Fig 13, conclusion",
        "frequency: dual wheelset above bogie",
        "The dual wheelset's hunting frequency is higher than the bogie's.",
        f"{paper.DUAL_WHEELSET.frequency:g} against {paper.BOGIE.frequency:g} Hz",
        findings,
        f"Each {pieces.ABOVE - 1.0:.0%} above its own critical speed on this curve. The wavelength "
        "of hunting "
        "changes less than the critical speed, so the faster model hunts at the higher frequency.",
    )


def rms_order(evidence: Evidence) -> Claim:
    """Claim of the ratio of the root mean squares of both models above the critical speed."""
    printed = paper.DUAL_WHEELSET.rms / paper.BOGIE.rms
    findings = {}
    for bogie, dual in zip(cases_of("bogie"), cases_of("dual_wheelset"), strict=True):
        a = evidence.data[pieces.motion_above(bogie).name]
        b = evidence.data[pieces.motion_above(dual).name]
        if a is None or b is None:
            findings[bogie.vehicle.name] = Finding("one of them does not hunt", "open")
            continue
        ratio = b["spectrum"].rms / a["spectrum"].rms
        text = f"{ratio:.2f} ({1e3 * b['spectrum'].rms:.2f} and {1e3 * a['spectrum'].rms:.2f} mm)"
        verdict = "open" if abs(ratio - 1.0) < EQUAL else _same((ratio < 1.0) == (printed < 1.0), True)
        findings[bogie.vehicle.name] = Finding(text, verdict)
    return Claim(
        "rms",
        "Fig 13",
        "rms: dual wheelset below bogie",
        "Above the critical speed the dual wheelset's rms displacement is the smaller one.",
        f"{paper.DUAL_WHEELSET.rms:g} to {paper.BOGIE.rms:g}, ratio {printed:.2f}",
        findings,
        "The paper gives its rms values no unit, so only which is the smaller can be compared, and "
        "values within "
        f"{EQUAL:.0%} count as equal. Ours are taken "
        f"{pieces.ABOVE - 1.0:.0%} above each model's own critical speed.",
    )


def resonance(evidence: Evidence) -> Claim:
    """Claim that the bogie hunts where the kinematic frequency meets a natural one of the frame."""
    findings = {}
    for case in cases_of("bogie"):
        found = evidence.data[pieces.natural_frequencies(case).name]
        if found is None:
            findings[case.vehicle.name] = Finding("does not hunt", "open")
            continue
        kinematic, frame = found["kinematic"], found["frame"]
        nearest = float(frame[np.argmin(np.abs(np.log(frame / kinematic)))])
        near = abs(math.log(nearest / kinematic)) < math.log(1.0 + NEAR)
        text = f"kinematic {kinematic:.2f}, nearest natural {nearest:.2f} Hz"
        findings[case.vehicle.name] = Finding(text, _same(near, True))
    slip = [
        f"{case.vehicle.name} hunts at {found['hunting']:.2f} Hz, "
        f"{found['hunting'] / found['kinematic']:.0%} "
        "of the kinematic frequency"
        for case in cases_of("bogie")
        if (found := evidence.data[pieces.natural_frequencies(case).name]) is not None
    ]
    return Claim(
        "resonance",
        "section 4.4",
        "hunts where kinematic meets natural frequency",
        "The bogie loses stability when the kinematic frequency of a wheelset approaches a natural "
        "frequency "
        "of the frame on its suspension.",
        "approaches",
        findings,
        "Tangent track, at the linear critical speed; natural frequencies of the frame with the "
        "wheelsets "
        f"held, without damping; close is within {NEAR:.0%}. {_listed(slip)}.",
    )


FIRST_RULES: tuple[Rule, ...] = (
    steady("bogie"),
    hunting("bogie"),
    onset("bogie"),
    steady("dual_wheelset"),
    hunting("dual_wheelset"),
    onset("dual_wheelset"),
    falls_with_radius("bogie"),
    falls_with_radius("dual_wheelset"),
    dual_is_faster,
    simulated_differs,
    main_frequency("bogie"),
    main_frequency("dual_wheelset"),
    dual_is_quicker,
    frequency_below("bogie"),
    frequency_below("dual_wheelset"),
    rms_order,
    resonance,
)
"""Claims that need critical speeds and single motions only."""


def first_pieces() -> tuple[Piece, ...]:
    """Return the computations for these claims."""
    found = []
    for case in CASES:
        found += [
            pieces.critical_speeds(case),
            *(pieces.motion(case, v) for v in (case.printed.steady, case.printed.hunting)),
            pieces.motion_below(case),
            pieces.motion_above(case),
        ]
        if case.kind == "bogie":
            found += [pieces.simulated_critical_speed(case), pieces.natural_frequencies(case)]
    return tuple(found)
