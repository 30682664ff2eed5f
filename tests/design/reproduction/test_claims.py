"""Verdicts and numbers of the claims follow the results that they are given."""

import dataclasses
import math

import numpy as np
import pytest

import design
import railenv
from design.cycles.spectrum import Spectrum
from design.reproduction import FULL, QUICK, first_page, paper, pieces, whole_report
from design.reproduction.adhesion import adhesion_limit
from design.reproduction.body import (
    LOW_CONICITY,
    beside_body_at_rest,
    body_damping,
    body_moves,
    over_damping,
)
from design.reproduction.cases import CASES, VEHICLES
from design.reproduction.claims import Evidence, counts
from design.reproduction.claims_of_body import BODY_RULES
from design.reproduction.claims_of_diagrams import FURTHER_RULES
from design.reproduction.claims_of_frequencies import FREQUENCY_RULES
from design.reproduction.claims_of_motions import FIRST_RULES, describe
from design.reproduction.sections.critical_speeds import brief

COACH = "HIGH_SPEED_COACH"
BOGIES = CASES[:3]


def motion(hunts=True, amplitude=5e-3, mean=1e-3, frequency=2.0, rms=3e-3, speed=100.0):
    spectrum = Spectrum("y_w1", np.arange(3.0), np.ones(3), frequency, rms)
    return {
        "hunts": hunts,
        "amplitude": amplitude,
        "mean": mean,
        "spectrum": spectrum,
        "speed": speed,
    }


@pytest.fixture(scope="module")
def speeds():
    """Real critical speeds on few curves, the only part that takes time."""
    found = {}
    for case in CASES:
        piece = pieces.critical_speeds(case)
        inputs = {**piece.inputs, "radii": [1500.0, 3000.0, 6250.0]}
        found[piece.name] = piece.function(**inputs)
    return found


@pytest.fixture
def data(speeds):
    """Results in which everything hunts at 2 Hz, and simulation agrees with the linear speeds."""
    found = dict(speeds)
    for case in CASES:
        for speed in (case.printed.steady, case.printed.hunting):
            found[pieces.motion(case, speed).name] = motion(speed=speed)
        found[pieces.motion_below(case).name] = motion()
        found[pieces.motion_above(case).name] = motion()
        linear = speeds[pieces.critical_speeds(case).name]["listed"][1].speed
        found[pieces.simulated_critical_speed(case).name] = linear
        found[pieces.natural_frequencies(case).name] = {
            "hunting": 1.0,
            "kinematic": 1.0,
            "frame": np.array([0.9, 7.0]),
        }
    return found


def judged(data, key):
    claims = {c.key: c for c in (rule(Evidence(data, QUICK)) for rule in FIRST_RULES)}
    return claims[key]


def verdicts(claim):
    return [claim.findings[v.name].verdict for v in VEHICLES]


def test_steady_and_hunting_follow_the_motions(data):
    assert verdicts(judged(data, "steady-bogie")) == ["differs"] * 3
    assert verdicts(judged(data, "hunting-bogie")) == ["agrees"] * 3
    case = BOGIES[0]
    data[pieces.motion(case, paper.BOGIE.steady).name] = motion(hunts=False, mean=9.3e-3)
    claim = judged(data, "steady-bogie")
    assert verdicts(claim) == ["agrees", "differs", "differs"]
    assert claim.findings["TABLE_1"].text == "steady on the flange, at 9.3 mm"


def test_motion_in_words():
    assert describe(motion(amplitude=0.0123, frequency=2.35), BOGIES[0]) == "hunts, 12.3 mm at 2.35 Hz"
    assert describe(motion(hunts=False, mean=-2e-3), BOGIES[0]) == "steady on the tread, at -2.0 mm"


def test_bracket_holds_the_coach_on_tangent_track_but_no_vehicle_on_the_curve(data):
    claim = judged(data, "onset-bogie")
    assert verdicts(claim) == ["differs"] * 3
    assert claim.findings[COACH].text == "95.66 m/s"
    assert "HIGH_SPEED_COACH hunts from 116.47 m/s, inside the paper's bracket" in claim.why
    assert "TABLE_1_PRINTED_LOADS at 119.7 m/s" in claim.why


def test_bracket_agrees_where_the_critical_speed_lies_in_it(data):
    name = pieces.critical_speeds(BOGIES[2]).name
    moved = dataclasses.replace(data[name]["listed"][1], speed=117.0)
    data[name] = {**data[name], "listed": [None, moved]}
    assert verdicts(judged(data, "onset-bogie")) == ["differs", "differs", "agrees"]


def test_only_the_coachs_critical_speed_falls_with_the_radius(data):
    assert verdicts(judged(data, "falls-bogie")) == ["differs", "differs", "agrees"]


def test_difference_of_linear_and_simulated_speed(data):
    name = pieces.simulated_critical_speed(BOGIES[0]).name
    data[name] *= 1.0 - paper.LINEAR_TO_SIMULATED
    data[pieces.simulated_critical_speed(BOGIES[1]).name] = None
    claim = judged(data, "linear-simulated")
    assert verdicts(claim) == ["agrees", "open", "differs"]
    assert claim.findings["TABLE_1"].text.split(":")[0] in ("8.7%", "8.8%")


def test_main_frequency_agrees_within_the_papers_resolution(data):
    case = BOGIES[1]
    for frequency, verdict in ((2.73, "agrees"), (2.80, "differs")):
        data[pieces.motion(case, 120.0).name] = motion(frequency=frequency)
        assert judged(data, "frequency-bogie").findings[case.vehicle.name].verdict == verdict


def test_nothing_to_compare_with_stays_open(data):
    data[pieces.motion_above(CASES[-1]).name] = None
    for key in ("dual-quicker", "rms"):
        assert judged(data, key).findings[COACH].verdict == "open"


def test_kinematic_frequency_near_a_natural_one(data):
    assert verdicts(judged(data, "resonance")) == ["agrees"] * 3
    far = {"hunting": 1.0, "kinematic": 2.0, "frame": np.array([0.9, 7.0])}
    data[pieces.natural_frequencies(BOGIES[0]).name] = far
    assert verdicts(judged(data, "resonance")) == ["differs", "agrees", "agrees"]


def test_counts_add_up(data):
    claims = [rule(Evidence(data, QUICK)) for rule in FIRST_RULES]
    assert len({c.key for c in claims}) == len(FIRST_RULES)
    for vehicle in VEHICLES:
        assert sum(counts(claims, vehicle)) == len(claims)


def test_claims_of_diagrams_and_limit_cycles_follow_the_results():
    found = {}
    speed, radius = np.array([20.0, 40.0, 60.0, 80.0]), np.array([500.0, 6000.0])
    for case in CASES:
        low = np.zeros((2, 4, 2, case.model.n_states))
        high = low.copy()
        high[0, :, :, 0] = 9e-3
        high[1, 1:, :, 0] = np.array([4e-3, 6e-3, 8e-3])[:, None]
        found[pieces.diagram(case, QUICK).name] = design.SimulatedDiagram(
            case.kind,
            case.model.state_names,
            radius,
            0.0873,
            speed,
            ({"y_w1": 1e-4}, {"y_w1": 8e-3}),
            low,
            high,
            np.ones((2, 4), bool),
            9.23e-3,
            None,
        )
        found[pieces.branch(case, paper.RADIUS, QUICK).name] = None
    case = BOGIES[2]
    branch = design.cycle_branch(case.model, parameter_range=(85.0, 117.0))
    found[pieces.branch(case, paper.RADIUS, QUICK).name] = {
        "branch": branch,
        "criticality": "subcritical",
    }
    claims = {c.key: c for c in (rule(Evidence(found, QUICK)) for rule in FURTHER_RULES)}
    assert verdicts(claims["larger-bogie"]) == ["agrees"] * 3
    assert verdicts(claims["grows-dual_wheelset"]) == ["agrees"] * 3
    assert claims["grows-bogie"].findings["TABLE_1"].text.startswith("2.0 mm at 40, most 4.0 at 80")
    assert verdicts(claims["subcritical-bogie"]) == ["open", "open", "agrees"]
    assert "91.42" in claims["subcritical-bogie"].findings[COACH].text


@pytest.mark.parametrize(
    ("kind", "vehicle", "speed"),
    [
        ("bogie", railenv.TABLE_1_PRINTED_LOADS, 119.7),
        ("dual_wheelset", railenv.TABLE_1_PRINTED_LOADS, 132.7),
        ("bogie", railenv.TABLE_1, 132.7),
    ],
)
def test_adhesion_limit(kind, vehicle, speed):
    case = next(c for c in CASES if c.kind == kind and c.vehicle is vehicle)
    assert adhesion_limit(case, 6250.0, 0.0873) == pytest.approx(speed, abs=0.05)


def test_pieces_of_the_first_page_are_pieces_of_the_whole_report():
    def keys(sections):
        return {p.name: p.key for s in sections for p in s.pieces()}

    first, quick, full = keys(first_page(FULL)), keys(whole_report(QUICK)), keys(whole_report(FULL))
    assert first.items() <= quick.items()
    assert first.items() <= full.items()
    assert quick.keys() == full.keys()
    assert quick != full


def test_speeds_in_few_characters(speeds):
    found = speeds[pieces.critical_speeds(BOGIES[2]).name]
    assert [brief(r) for r in (found["tangent"], *found["listed"])] == [
        "116.5",
        "107.0",
        "95.7",
        "48.6 f",
        "83.8 w",
    ]


# ------------------------------------------------------------- below the critical speed, frequencies


def judged_below(data, key):
    return {c.key: c for c in (rule(Evidence(data, QUICK)) for rule in FREQUENCY_RULES)}[key]


def test_rms_below_the_critical_speed_follows_the_motions(data):
    for bogie, dual, factor in zip(CASES[:3], CASES[3:], (1.2, 0.8, 1.01), strict=True):
        data[pieces.motion_below(bogie).name] = motion(rms=3e-3)
        data[pieces.motion_below(dual).name] = motion(rms=factor * 3e-3)
    claim = judged_below(data, "rms-below")
    assert verdicts(claim) == ["agrees", "differs", "open"]
    assert claim.findings["TABLE_1"].text == "1.20 (3.60 and 3.00 mm)"
    assert claim.printed == "118.438 to 100.371, ratio 1.18"
    data[pieces.motion_below(CASES[-1]).name] = None
    assert verdicts(judged_below(data, "rms-below"))[-1] == "open"


def test_which_model_is_quicker_below_the_critical_speed(data):
    for bogie, dual, frequency in zip(CASES[:3], CASES[3:], (0.8, 1.2, 0.9), strict=True):
        data[pieces.motion_below(bogie).name] = motion(frequency=1.0)
        data[pieces.motion_below(dual).name] = motion(frequency=frequency)
    claim = judged_below(data, "bogie-quicker-below")
    assert verdicts(claim) == ["agrees", "differs", "agrees"]
    assert claim.findings[COACH].text == "1.00 Hz at 100.0, 0.90 Hz at 100.0 m/s"


def test_natural_frequencies_around_1_hz(data):
    assert verdicts(judged_below(data, "natural-frequencies")) == ["differs"] * 3
    near = {"hunting": 1.0, "kinematic": 1.0, "frame": np.array([0.7, 1.4])}
    data[pieces.natural_frequencies(BOGIES[0]).name] = near
    claim = judged_below(data, "natural-frequencies")
    assert verdicts(claim) == ["agrees", "differs", "differs"]
    assert claim.findings["TABLE_1"].text == "0.70, 1.40 Hz"


@pytest.mark.parametrize("case", BOGIES, ids=lambda c: c.vehicle.name)
def test_natural_frequencies_of_the_frame_have_closed_forms(case):
    """Bounce and yaw of the frame on its springs, the wheelsets held."""
    piece = pieces.natural_frequencies(case)
    found, v = piece.function(**piece.inputs)["frame"], case.vehicle
    bs2 = v.secondary_arm**2
    bounce = 4.0 * v.primary_vertical_stiffness / v.frame_mass
    yaw = (
        4.0 * v.primary_longitudinal_stiffness * v.primary_arm**2
        + 4.0 * v.primary_lateral_stiffness * v.half_wheelbase**2
        + 2.0 * v.secondary_longitudinal_stiffness * bs2
    ) / v.frame_yaw_inertia
    for square in (bounce, yaw):
        assert np.abs(found / (math.sqrt(square) / (2.0 * math.pi)) - 1.0).min() < 1e-6


# ------------------------------------------------------------------------------- the body


@pytest.fixture
def bodies():
    def onset(speed, mode):
        return {"speed": speed, "frequency": 2.0, "mode": mode}

    modes = ["body hunting (yaw)"] * 2 + ["bogie hunting, in phase"] * 3
    modes += ["body hunting (upper sway)"] * 3
    speeds = [30.0, 40.0, 100.0, 104.0, 101.0, 81.0, 65.0, 60.0]
    return {
        body_moves().name: {
            "at rest": {**onset(100.0, None), "low_frequency": 0.6, "low_damping": 0.3},
            "moving": {**onset(80.0, None), "low_frequency": 0.7, "low_damping": 0.2},
        },
        body_damping().name: [onset(v, m) for v, m in zip(speeds, modes, strict=True)],
    }


def judged_body(data, key):
    return {c.key: c for c in (rule(Evidence(data, QUICK)) for rule in BODY_RULES)}[key]


def test_body_matters_if_it_moves_the_critical_speed(bodies):
    claim = judged_body(bodies, "body-moves")
    assert verdicts(claim) == ["open", "open", "differs"]
    assert claim.findings[COACH].text.endswith("under a body at rest from 100.0 (-20%)")
    bodies[body_moves().name]["moving"]["speed"] = 97.0
    assert verdicts(judged_body(bodies, "body-moves"))[-1] == "agrees"


def test_damping_cures_body_hunting_if_more_of_it_always_helps(bodies):
    claim = judged_body(bodies, "body-damping")
    assert verdicts(claim) == ["open", "open", "differs"]
    assert "helps in 2 of 4 steps; multiples of its own damping: 0: body from 30 m/s" in (
        claim.findings[COACH].text
    )
    assert "0.25 times the coach's own damping is best" in claim.why
    found = bodies[body_damping().name]
    for one in found[5:]:
        one["mode"] = "bogie hunting, in phase"
    assert verdicts(judged_body(bodies, "body-damping"))[-1] == "agrees"
    for one in found[:2]:
        one["mode"] = "bogie hunting, in phase"
    assert verdicts(judged_body(bodies, "body-damping"))[-1] == "open"


def test_body_and_damping_are_computed_as_eigenvalues_tell():
    """The body's cost by critical speeds; body hunting by the growth rate at one speed."""
    coach = railenv.HIGH_SPEED_COACH
    found = beside_body_at_rest(coach, 20.0)
    assert found["at rest"]["speed"] == pytest.approx(116.474, abs=1e-3)
    assert found["moving"]["speed"] == pytest.approx(95.705, abs=1e-3)
    assert found["moving"]["mode"] == "bogie hunting, in phase"
    flat = coach.replace(conicity=LOW_CONICITY)
    for factor, one in zip((0.5, 2.0), over_damping(flat, (0.5, 2.0)), strict=True):
        damping = factor * flat.secondary_lateral_damping
        model = railenv.Coach(flat.replace(secondary_lateral_damping=damping))
        for share, unstable in ((0.99, False), (1.01, True)):
            poles = design.linearize(model, speed=share * one["speed"]).poles()
            assert (poles.real.max() > 0.0) == unstable
    assert one["mode"].startswith("body hunting")
