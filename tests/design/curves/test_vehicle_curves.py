"""Curves of bifurcations of the vehicles against critical speeds and branches at single values."""

import numpy as np
import pytest

import design
import railenv

PLANE = {"conicity": (0.045, 0.06), "speed": (50.0, 90.0)}


@pytest.fixture(scope="module")
def bogie():
    return railenv.CooperriderBogie()


@pytest.fixture(scope="module")
def coach():
    return railenv.Bogie(railenv.HIGH_SPEED_COACH)


def test_hopf_curve_agrees_with_critical_speeds(bogie):
    curve = design.bifurcation_curve(bogie, design.critical_speed(bogie), PLANE)
    for point in curve.points[::6]:
        critical = design.critical_speed(bogie.replace(conicity=point.values[0]))
        assert point.speed == pytest.approx(critical.speed, rel=1e-7)
        assert point.frequency == pytest.approx(critical.frequency, rel=1e-6)
        np.testing.assert_allclose(point.state, critical.state, atol=1e-9)
    assert curve.complete


def test_folds_agree_with_branches_and_with_the_map(bogie):
    steps = 1200  # the flange is a corner, which few steps blur
    branch = design.cycle_branch(bogie, parameter_range=(60.0, 68.8), steps_per_period=steps)
    plane = {"conicity": (0.047, 0.053), "speed": (50.0, 90.0)}
    curve = design.bifurcation_curve(bogie, branch.folds[0], plane, longest_step=0.5)
    assert curve.complete
    point = curve.points[-4]
    along = design.cycle_branch(
        bogie.replace(conicity=point.values[0]),
        parameter_range=(0.95 * point.speed, 1.1 * point.speed),
        steps_per_period=steps,
    )
    assert point.speed == pytest.approx(along.folds[0].value, rel=1e-6)
    chart = design.hunting_map(bogie, "conicity", [0.05])
    assert curve.at("conicity", 0.05) == pytest.approx(chart.onset_speed, rel=2e-6)


def test_coach_hunts_gently_from_a_bautin_point_on(coach):
    hopf = design.critical_speed(coach.replace(conicity=0.15))
    plane = {"conicity": (0.14, 0.2), "speed": (80.0, 130.0)}
    curve = design.bifurcation_curve(coach.replace(conicity=0.15), hopf, plane, longest_step=1.0)
    (bautin,) = (s for s in curve.special if s.kind == "Bautin")
    assert bautin.values == pytest.approx((0.16446, 106.405), rel=1e-4)
    before = curve.value["conicity"] < bautin.values[0]
    assert (curve.coefficient[before] > 0.0).all()
    assert (curve.coefficient[~before] < 0.0).all()
    point = design.hopf_point(coach.replace(conicity=0.15), critical=hopf)
    nearest = min(curve.points, key=lambda p: abs(p.values[0] - 0.15))
    assert nearest.coefficient == pytest.approx(point.lyapunov_coefficient, rel=1e-3)


@pytest.mark.slow
def test_small_hunting_folds_end_where_the_lyapunov_coefficient_vanishes(coach):
    model = coach.replace(conicity=0.2)
    branch = design.cycle_branch(model, points=40)
    plane = {"conicity": (0.14, 0.21), "speed": (80.0, 130.0)}
    curve = design.bifurcation_curve(model, branch.folds[0], plane)
    (bautin,) = (s for s in curve.special if s.kind == "Bautin")
    assert bautin.values == pytest.approx((0.16446, 106.405), rel=1e-4)
    # the last motion that was computed has an amplitude of hundredths of a millimetre
    last = curve.points[1] if curve.points[0].values == bautin.values else curve.points[-2]
    assert 0.0 < last.amplitudes[0] < 6e-5
    assert last.values == pytest.approx(bautin.values, rel=0.02)


@pytest.mark.slow
def test_steps_are_halved_where_corners_stop_a_curve(bogie):
    branch = design.cycle_branch(bogie, parameter_range=(60.0, 68.8))
    plane = {"conicity": (0.02, 0.2), "speed": (30.0, 150.0)}
    curve = design.bifurcation_curve(bogie, branch.folds[0], plane)
    assert curve.complete
    assert curve.value["conicity"].min() == 0.02
    assert curve.value["conicity"].max() == 0.2
    assert curve.points[0].steps > len(branch.folds[0].cycle.states)
    for point in (curve.points[3], curve.points[-4]):
        along = design.cycle_branch(
            bogie.replace(conicity=point.values[0]),
            parameter_range=(0.95 * point.speed, 1.1 * point.speed),
            steps_per_period=3200,
        )
        assert point.speed == pytest.approx(along.folds[0].value, rel=1e-5)


@pytest.mark.slow
def test_curves_of_the_coach_on_curved_track(coach):
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(wheelbase_curving=False))
    branch = design.cycle_branch(model, radius=6250.0, cant=0.0873)
    plane = {"curvature": (1e-5, 3e-4), "speed": (60.0, 130.0)}
    upper = design.bifurcation_curve(model, branch.folds[0], plane)
    ends = [s for s in upper.special if s.kind == "Bautin"]
    assert len(ends) == 2  # two curves of folds, which meet in a cusp
    assert "cusp" in [s.kind for s in upper.special]
    hopf = design.bifurcation_curve(model, branch.hopf, plane)
    on_hopf = [s.values for s in hopf.special if s.kind == "Bautin"]
    for end in ends:
        nearest = min(on_hopf, key=lambda v: abs(v[0] - end.values[0]))
        assert end.values == pytest.approx(nearest, rel=1e-5)
    doubling = next(s for s in branch.special if s.kind == "period doubling")
    curve = design.bifurcation_curve(model, doubling, plane)
    assert curve.ended[0] == "the curve is closed"
    other = [s.value for s in branch.special if s.kind == "period doubling"]
    passages = sorted(curve.at("curvature", 1.0 / 6250.0))
    assert passages == pytest.approx(sorted(other), rel=1e-4)
    radii = 1.0 / curve.value["curvature"]
    assert radii.min() == pytest.approx(5204.0, abs=5.0)
    assert radii.max() == pytest.approx(7089.0, abs=5.0)
