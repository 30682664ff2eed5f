"""Curves of bifurcations and their special points, where the exact answers are known."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import design
from design.curves.run import Run
from railenv.errors import ParameterError, UnknownNameError
from tests.design.curves.planes import CUSP, RING, TAKENS, TWO, ZERO
from tests.design.cycles import exact
from tests.design.cycles.exact import MU

TIGHT = 1e-6


def special(curve, kind):
    return [s.values for s in curve.special if s.kind == kind]


# -------------------------------------------------------------------------- equilibria


@pytest.fixture(scope="module")
def bautin_hopf():
    model = exact.hopf_normal_form(l1=1.0, l2=-1.0)
    hopf = design.critical_speed(model)
    return design.bifurcation_curve(model, hopf, {"l1": (-1.0, 2.0), "speed": (9.0, 11.0)})


def test_bautin_point_of_the_normal_form(bautin_hopf):
    curve = bautin_hopf
    assert curve.kind == "Hopf"
    assert curve.complete
    np.testing.assert_allclose(curve.speed, MU, rtol=1e-9)
    np.testing.assert_allclose(curve.coefficient, curve.value["l1"], atol=TIGHT)  # 2 l1 / omega
    np.testing.assert_allclose(curve.frequency, 2.0 / (2.0 * np.pi), rtol=1e-9)
    (point,) = special(curve, "Bautin")
    np.testing.assert_allclose(point, (0.0, MU), atol=TIGHT)
    for value in (-1.0, 0.3, 1.0, 2.0):  # ends, between points, a point
        assert curve.at("l1", value) == pytest.approx([MU])
    assert curve.value["l1"][0] == -1.0
    assert curve.value["l1"][-1] == 2.0


def test_hopf_hopf_point_of_two_oscillators():
    hopf = design.critical_speed(TWO)
    assert hopf.speed == pytest.approx(ZERO - 1.0)
    curve = design.bifurcation_curve(TWO, hopf, {"k": (-1.5, 1.0), "speed": (5.0, 15.0)})
    np.testing.assert_allclose(curve.speed, ZERO + curve.value["k"], rtol=1e-9)
    (point,) = (s for s in curve.special if s.kind == "Hopf-Hopf")
    np.testing.assert_allclose(point.values, (0.0, ZERO), atol=TIGHT)
    assert point.point.frequency == pytest.approx(2.0 / (2.0 * np.pi), rel=TIGHT)
    assert point.numbers["frequency"] == pytest.approx(5.0 / (2.0 * np.pi), rel=TIGHT)
    assert [s.kind for s in curve.special] == ["Hopf-Hopf"]


def test_hopf_curve_passes_a_fold_of_equilibria():
    model = TWO.replace(on=1.0, k=-0.5)
    hopf = design.critical_speed(model)
    curve = design.bifurcation_curve(model, hopf, {"m": (-0.5, 2.0), "speed": (5.0, 15.0)})
    z = np.array([p.state[4] for p in curve.points])
    assert z.min() < -1.0
    assert z.max() > 1.0
    np.testing.assert_allclose(curve.value["m"], z**2, atol=1e-9)
    np.testing.assert_allclose(curve.speed, ZERO - 0.5 - z, rtol=1e-9)
    (point,) = special(curve, "fold-Hopf")
    np.testing.assert_allclose(point, (0.0, ZERO - 0.5), atol=TIGHT)


def test_hopf_curve_ends_at_a_bogdanov_takens_point():
    hopf = design.critical_speed(TAKENS, speed_range=(9.5, 11.0))
    curve = design.bifurcation_curve(TAKENS, hopf, {"b2": (-3.0, 2.0), "speed": (8.0, 12.0)})
    assert curve.ended[0].startswith("the end of the range, b2 -3")
    assert "Bogdanov-Takens" in curve.ended[1]
    (point,) = (s for s in curve.special if s.kind == "Bogdanov-Takens")
    np.testing.assert_allclose(point.values, (0.0, ZERO), atol=TIGHT)
    assert point.numbers["b"] / point.numbers["a"] == pytest.approx(1.0, rel=1e-4)
    np.testing.assert_allclose(curve.frequency[:-1] * 2.0 * np.pi, np.sqrt(-curve.value["b2"][:-1]))


def test_fold_of_equilibria_passes_a_bogdanov_takens_point():
    model = TAKENS.replace(b2=2.0)
    fold = design.critical_speed(model, speed_range=(9.5, 12.0))
    assert fold.loss == "fold"
    curve = design.bifurcation_curve(model, fold, {"b2": (-3.0, 3.0), "speed": (8.0, 14.0)})
    assert curve.kind == "fold of equilibria"
    np.testing.assert_allclose(curve.speed, ZERO + curve.value["b2"] ** 2 / 4.0, rtol=1e-9)
    (point,) = (s for s in curve.special if s.kind == "Bogdanov-Takens")
    np.testing.assert_allclose(point.values, (0.0, ZERO), atol=TIGHT)
    assert point.numbers["b"] / point.numbers["a"] == pytest.approx(1.0, rel=1e-4)


def test_cusp_of_equilibria():
    fold = design.critical_speed(CUSP, speed_range=(9.0, 11.0))
    curve = design.bifurcation_curve(CUSP, fold, {"b2": (-1.0, 2.0), "speed": (8.0, 12.0)})
    b1, b2 = curve.speed - ZERO, curve.value["b2"]
    np.testing.assert_allclose(27.0 * b1**2, 4.0 * b2**3, atol=1e-8)
    assert b1.min() < -0.5
    assert b1.max() > 0.5
    (point,) = (s for s in curve.special if s.kind == "cusp")
    np.testing.assert_allclose(point.values, (0.0, ZERO), atol=TIGHT)
    assert point.numbers["c"] == pytest.approx(-1.0, rel=1e-4)
    passages = sorted(curve.at("b2", 1.5))
    assert passages == pytest.approx([ZERO - np.sqrt(0.5), ZERO + np.sqrt(0.5)], rel=1e-5)


# --------------------------------------------------------------------- periodic motions


def test_folds_of_cycles_end_at_the_bautin_point():
    model = exact.hopf_normal_form(l1=1.0, l2=-1.0)
    branch = design.cycle_branch(model, parameter_range=(9.0, 10.5), longest_step=0.05)
    curve = design.bifurcation_curve(model, branch.folds[0], {"l1": (-1.0, 2.0), "speed": (8.0, 11.0)})
    assert curve.kind == "fold of cycles"
    l1 = curve.value["l1"]
    np.testing.assert_allclose(curve.speed - MU, -(l1**2) / 4.0, atol=1e-8)
    size = np.array([np.hypot(*p.state) for p in curve.points])
    np.testing.assert_allclose(size**2, l1 / 2.0, atol=TIGHT)
    np.testing.assert_allclose(np.array([p.critical for p in curve.points]), 1.0)
    (point,) = special(curve, "Bautin")
    np.testing.assert_allclose(point, (0.0, MU), atol=TIGHT)
    assert "Bautin point" in curve.ended[0]
    assert curve.complete
    assert [s.kind for s in curve.special] == ["Bautin"]
    for value in (0.3, 1.1):
        assert curve.at("l1", value) == pytest.approx([MU - value**2 / 4.0], rel=1e-7)


def ring_folds(**parameters):
    """Return a model and its curve of folds; the fold starts at r > 1."""
    model = RING.replace(**parameters)
    start = design.simulated_cycle(
        model.replace(b1=0.5), speed=ZERO, perturbation={"a": 1.0}, duration=30.0
    )
    branch = design.cycle_branch(
        model, start=start, parameter="b1", parameter_range=(-0.5, 1.0), direction=-1
    )
    placed = model.replace(b1=branch.folds[0].value)
    return model, design.bifurcation_curve(
        placed, branch.folds[0], {"b1": (-0.5, 0.5), "b2": (-0.5, 0.8)}
    )


def test_two_curves_of_folds_meet_in_a_cusp():
    _, curve = ring_folds()
    b1, b2 = curve.value["b1"], curve.value["b2"]
    np.testing.assert_allclose(27.0 * b1**2, 4.0 * b2**3, atol=TIGHT)
    assert b1.min() < -0.25
    assert b1.max() > 0.25
    (point,) = (s for s in curve.special if s.kind == "cusp")
    np.testing.assert_allclose(point.values, (0.0, 0.0), atol=1e-5)
    # u' = -u^3 over a period, for u in units of sqrt(4) (scale + amplitude)
    assert point.numbers["c"] == pytest.approx(-16.0 * point.point.period, rel=1e-3)


@pytest.fixture(scope="module")
def flip():
    model = exact.company(nu=1.5, twist=0.25)
    return model, design.cycle_branch(model, parameter_range=(9.0, 11.2)).special[0]


def test_period_doublings_lie_on_a_circle_with_two_resonances(flip):
    model, start = flip
    curve = design.bifurcation_curve(model, start, {"nu": (0.0, 3.0), "speed": (9.0, 12.0)})
    assert curve.kind == "period doubling"
    assert curve.ended == ("the curve is closed", "the curve is closed")
    nu, mu = curve.value["nu"], curve.speed - MU
    np.testing.assert_allclose(np.hypot(nu - 1.5, mu - 1.0), 0.25, rtol=TIGHT)
    turns = np.unwrap(np.arctan2(mu - 1.0, nu - 1.5))
    assert abs(turns[-1] - turns[0]) == pytest.approx(2.0 * np.pi, abs=1e-3)
    found = np.array(sorted(special(curve, "1:2 resonance")))
    np.testing.assert_allclose(found, [(1.25, MU + 1.0), (1.75, MU + 1.0)], atol=1e-5)


def test_period_doubling_changes_its_criticality_with_the_sign_of_the_cube(flip):
    model, start = flip
    curve = design.bifurcation_curve(model, start, {"cube": (-1.0, 2.0), "speed": (9.0, 12.0)})
    np.testing.assert_allclose(curve.speed, MU + 0.75, rtol=TIGHT)
    assert (np.sign(curve.coefficient) == np.sign(curve.value["cube"])).all()
    (point,) = special(curve, "degenerate period doubling")
    np.testing.assert_allclose(point, (0.0, MU + 0.75), atol=1e-5)


def test_torus_points_and_their_strong_resonances():
    model = exact.company(nu=1.1)
    start = design.cycle_branch(model, parameter_range=(9.0, 11.2)).special[0]
    slopes = design.bifurcation_curve(model, start, {"slope": (0.5, 2.0), "speed": (9.0, 14.0)})
    np.testing.assert_allclose((slopes.speed - MU) * slopes.value["slope"], 1.0, rtol=TIGHT)
    assert slopes.kind == "torus"
    curve = design.bifurcation_curve(model, start, {"nu": (0.6, 1.3), "speed": (9.0, 12.0)})
    angles = [np.angle(p.critical) for p in curve.points]
    np.testing.assert_allclose(angles, curve.value["nu"] * 2.0 * np.pi / 3.0, rtol=TIGHT)
    (quarter,), (third,) = special(curve, "1:4 resonance"), special(curve, "1:3 resonance")
    np.testing.assert_allclose(quarter, (0.75, MU + 1.0), atol=TIGHT)
    np.testing.assert_allclose(third, (1.0, MU + 1.0), atol=TIGHT)
    ending = design.bifurcation_curve(model, start, {"twist": (-1.0, 1.0), "speed": (9.0, 12.0)})
    assert "meet at -1" in ending.ended[0]
    found = sorted(special(ending, "1:2 resonance"))
    np.testing.assert_allclose(found, [(-0.4, MU + 1.0), (0.4, MU + 1.0)], atol=1e-5)


def test_symmetry_breaking_points_follow_from_half_a_period():
    model = exact.company(extra=0.5)
    start = design.cycle_branch(model, parameter_range=(9.0, 11.2)).special[0]
    assert start.kind == "symmetry breaking"
    curve = design.bifurcation_curve(model, start, {"nu": (-1.0, 1.0), "speed": (9.0, 14.0)})
    nu, growth = curve.value["nu"], curve.speed - MU - 1.0
    np.testing.assert_allclose(np.hypot(nu, growth - 0.25), 0.25, rtol=TIGHT)
    assert curve.ended[0] == "the curve is closed"
    found = np.array(sorted(special(curve, "1:1 resonance")))
    np.testing.assert_allclose(found, [(-0.25, MU + 1.25), (0.25, MU + 1.25)], atol=1e-5)
    assert (curve.coefficient > 0.0).all()
    with pytest.raises(ParameterError, match="mirror image"):
        design.bifurcation_curve(model, start, {"twist": (-1.0, 1.0), "speed": (9.0, 12.0)})


# ------------------------------------------------------------- from one curve to another


def test_a_second_hopf_curve_leads_through_a_hopf_hopf_point():
    plane = {"k": (-1.5, 1.0), "speed": (5.0, 15.0)}
    first = design.bifurcation_curve(TWO, design.critical_speed(TWO), plane)
    second = design.bifurcation_curve(TWO, first.special[0], plane, kind="Hopf")
    np.testing.assert_allclose(second.speed, ZERO - 2.0 * second.value["k"], rtol=1e-9)
    np.testing.assert_allclose(second.frequency, 5.0 / (2.0 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(special(second, "Hopf-Hopf"), [(0.0, ZERO)], atol=TIGHT)


def test_hopf_points_and_folds_lead_through_a_bogdanov_takens_point():
    plane = {"b2": (-3.0, 2.0), "speed": (8.0, 12.0)}
    first = design.bifurcation_curve(
        TAKENS, design.critical_speed(TAKENS, speed_range=(9.5, 11.0)), plane
    )
    folds = design.bifurcation_curve(TAKENS, first.special[-1], plane, kind="fold of equilibria")
    np.testing.assert_allclose(folds.speed, ZERO + folds.value["b2"] ** 2 / 4.0, rtol=1e-9)
    (point,) = (s for s in folds.special if s.kind == "Bogdanov-Takens")
    again = design.bifurcation_curve(TAKENS, point, plane, kind="Hopf")
    np.testing.assert_allclose(again.speed, ZERO, rtol=1e-9)
    assert again.value["b2"].min() == -3.0
    assert again.value["b2"].max() == pytest.approx(0.0, abs=TIGHT)
    assert [s.kind for s in again.special] == ["Bogdanov-Takens"]
    assert "Bogdanov-Takens" in again.ended[1]


def test_folds_of_equilibria_lead_through_a_fold_hopf_point():
    model = TWO.replace(on=1.0, k=-0.5)
    plane = {"m": (-0.5, 2.0), "speed": (5.0, 15.0)}
    hopf = design.bifurcation_curve(model, design.critical_speed(model), plane)
    (point,) = (s for s in hopf.special if s.kind == "fold-Hopf")
    folds = design.bifurcation_curve(model, point, plane, kind="fold of equilibria")
    np.testing.assert_allclose(folds.value["m"], 0.0, atol=1e-9)
    assert special(folds, "fold-Hopf")[0] == pytest.approx((0.0, ZERO - 0.5), abs=TIGHT)


def test_folds_of_cycles_start_at_a_bautin_point(bautin_hopf):
    model = exact.hopf_normal_form(l2=-1.0)
    plane = {"l1": (-1.0, 2.0), "speed": (8.0, 11.0)}
    curve = design.bifurcation_curve(model, bautin_hopf.special[0], plane, kind="fold of cycles")
    l1 = curve.value["l1"]
    np.testing.assert_allclose(curve.speed - MU, -(l1**2) / 4.0, atol=1e-8)
    assert l1.max() == 2.0
    assert [s.kind for s in curve.special] == ["Bautin"]
    back = design.bifurcation_curve(model, curve.special[0], plane, kind="Hopf")
    np.testing.assert_allclose(back.speed, MU, rtol=1e-9)


@pytest.mark.parametrize(
    ("parameters", "meeting", "kind", "growing"),
    [
        ({"sigma": 0.2}, "fold-torus", "torus", 0.0),
        ({"sigma": 0.3, "nu": 2.0, "twist": -0.1}, "fold-flip", "period doubling", 0.1),
    ],
)
def test_another_multiplier_becomes_critical_on_a_curve_of_folds(parameters, meeting, kind, growing):
    model, folds = ring_folds(**parameters)
    found = {round(s.values[0], 6): s for s in folds.special if s.kind == meeting}
    wanted = [-parameters["sigma"] - growing]
    if growing:
        wanted.append(-parameters["sigma"] + growing)  # the other of two real multipliers
    assert sorted(found) == pytest.approx(sorted(-2.0 * u**3 for u in wanted), abs=TIGHT)
    u = wanted[-1]
    start = found[round(-2.0 * u**3, 6)]
    assert start.values[1] == pytest.approx(3.0 * u**2, abs=TIGHT)
    plane = {"b1": (-0.3, 0.3), "b2": (-0.5, 0.8)}
    curve = design.bifurcation_curve(model, start, plane, kind=kind)
    assert curve.kind == kind
    assert len(curve) > 10
    np.testing.assert_allclose(curve.value["b1"], u**3 - u * curve.value["b2"], atol=TIGHT)
    assert len(special(curve, meeting)) == 1
    again = design.bifurcation_curve(model, start, plane, kind="fold of cycles")
    np.testing.assert_allclose(27.0 * again.value["b1"] ** 2, 4.0 * again.value["b2"] ** 3, atol=TIGHT)


def test_torus_points_lead_to_the_resonance_on_a_curve_of_period_doublings(flip):
    model, start = flip
    plane = {"nu": (0.0, 2.2), "speed": (9.0, 12.0)}
    circle = design.bifurcation_curve(model, start, plane)
    resonance = max((s for s in circle.special if s.kind == "1:2 resonance"), key=lambda s: s.values)
    curve = design.bifurcation_curve(model, resonance, plane, kind="torus")
    np.testing.assert_allclose(curve.speed, MU + 1.0, rtol=TIGHT)
    assert curve.value["nu"].min() == pytest.approx(1.75, abs=1e-5)
    assert curve.value["nu"].max() == 2.2
    assert special(curve, "1:2 resonance")[0] == pytest.approx((1.75, MU + 1.0), abs=1e-5)
    with pytest.raises(ParameterError, match=r"must be 'period doubling' or 'torus'"):
        design.bifurcation_curve(model, resonance, plane, kind="Hopf")
    with pytest.raises(ParameterError, match="needed at special points of curves only"):
        design.bifurcation_curve(model, start, plane, kind="torus")


# -------------------------------------------------------------- arguments, results, pictures


def test_what_a_curve_cannot_start_from_is_said(flip):
    model, start = flip
    plane = {"nu": (0.0, 3.0), "speed": (9.0, 12.0)}
    with pytest.raises(ParameterError, match="two parameters"):
        design.bifurcation_curve(model, start, {"speed": (9.0, 12.0)})
    with pytest.raises(UnknownNameError, match="did you mean 'nu'"):
        design.bifurcation_curve(model, start, {"nuu": (0.0, 3.0), "speed": (9.0, 12.0)})
    with pytest.raises(ParameterError, match="range of nu"):
        design.bifurcation_curve(model, start, {**plane, "nu": (3.0, 0.0)})
    with pytest.raises(ParameterError, match="speed"):
        design.bifurcation_curve(model, start, {**plane, "speed": (-1.0, 12.0)})
    with pytest.raises(ParameterError, match="CriticalSpeed"):
        design.bifurcation_curve(model, start.cycle, plane)
    stable = design.critical_speed(exact.planar(f_x=-1.0, g_y=-1.0))
    with pytest.raises(ParameterError, match="stable from"):
        design.bifurcation_curve(model, stable, plane)
    with pytest.raises(design.CurveError, match="parameters that the start was found with"):
        design.bifurcation_curve(model.replace(nu=2.9), start, plane)
    with pytest.raises(design.CurveError, match="within the ranges"):
        design.bifurcation_curve(model, start, {**plane, "speed": (11.0, 12.0)})


def test_most_points_and_the_bar(flip, capsys):
    model, start = flip
    plane = {"slope": (0.5, 2.0), "speed": (9.0, 12.0)}
    curve = design.bifurcation_curve(model, start, plane, points=4, progress=True)
    assert len(curve) == 7
    assert curve.ended == ("4 points were computed",) * 2
    assert curve.complete


def test_an_interrupted_curve_keeps_its_points(flip, monkeypatch):
    model, start = flip
    step = Run._step

    def interrupted(self, side, follower, system):
        if len(side.nodes) == 5:
            raise KeyboardInterrupt
        step(self, side, follower, system)

    monkeypatch.setattr(Run, "_step", interrupted)
    curve = design.bifurcation_curve(model, start, {"slope": (0.5, 2.0), "speed": (9.0, 12.0)})
    assert len(curve) == 5
    assert "interrupted" in curve.ended
    assert not curve.complete


def test_summary_text_and_picture(bautin_hopf):
    curve = bautin_hopf
    summary = curve.summary()
    assert summary["kind"] == "Hopf"
    assert summary["parameters"] == ["l1", "speed"]
    assert len(summary["value"]["l1"]) == len(curve)
    (found,) = summary["special"]
    assert found["kind"] == "Bautin"
    assert math.isclose(found["value"]["speed"], MU)
    assert "Bautin at" in str(curve)
    assert "Hopf of planar" in str(curve)
    with pytest.raises(UnknownNameError):
        curve.at("l2", 0.0)
    assert curve.at("l1", 5.0) == ()
    axes = np.ravel(curve.plot().axes)[0]
    lines = len(axes.lines)
    curve.plot(ax=axes)
    assert len(axes.lines) == 2 * lines
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["Hopf", "Hopf, subcritical", "Bautin"]
    gentle, jumping = (np.ma.masked_invalid(line.get_xdata()) for line in axes.lines[:2])
    assert gentle.min() == -1.0
    assert jumping.max() == 2.0
    assert gentle.max() < 0.1
    assert jumping.min() > -0.1
    plt.close("all")
