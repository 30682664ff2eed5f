"""Where branches end, and what the nonlinear critical speed rests on, where the answers are exact."""

import math

import numpy as np
import pytest

import design
import railenv
from railenv.equations.functions import sqrt
from tests.design.cycles import exact
from tests.design.cycles.exact import MU


def _window(x, u, speed, curvature, cant, p):
    """r' = r (w^2 - (speed - 10)^2 + c r^2 - r^4), theta' = 2: Hopf points at 10 - w and 10 + w."""
    a, b = x
    mu, r2 = speed - MU, a * a + b * b
    rate = p.width * p.width - mu * mu + p.cubic * r2 - p.fifth * r2 * r2
    return [rate * a - 2.0 * b, 2.0 * a + rate * b]


_WINDOW = railenv.Model("window", ["x", "y"], [], _window, {"width": 0.3, "cubic": -1.0, "fifth": 0.0})


def _lorenz(x, u, speed, curvature, cant, p):
    """Lorenz with r = speed."""
    a, b, c = x
    return [10.0 * (b - a), a * (speed - c) - b, a * b - 8.0 / 3.0 * c]


LORENZ = railenv.Model("lorenz", ["x", "y", "z"], [], _lorenz, {}, guess=[8.0, 8.0, 23.0])


def test_a_branch_between_two_hopf_points_ends_at_the_other():
    branch = design.cycle_branch(_WINDOW, parameter_range=(9.0, 11.0))
    assert branch.complete
    assert "Hopf point" in branch.ended
    np.testing.assert_allclose(branch.amplitude["x"] ** 2, 0.09 - (branch.speed - MU) ** 2, rtol=1e-6)
    (end,) = branch.special
    assert end.kind == "Hopf"
    assert end.value == pytest.approx(10.3, abs=1e-9)
    assert end.cycle.period == pytest.approx(math.pi, rel=1e-9)
    assert not end.cycle.amplitudes.any()
    assert (np.diff(branch.speed) > 0.0).all()  # it does not retrace itself
    assert branch.nonlinear_critical_speed == pytest.approx(9.7, abs=1e-7)
    assert branch.onset.rests_on == "Hopf"


def test_hunting_that_begins_gently_and_ends_at_a_fold_persists_from_its_hopf_point():
    # r^2 = (c + sqrt(c^2 + 4 k (w^2 - mu^2)))/2k: supercritical where c < 0, folds where c > 0
    bent = _WINDOW.replace(cubic=0.4, fifth=1.0)
    branch = design.cycle_branch(bent, parameter_range=(9.0, 11.0), longest_step=0.05)
    fold = math.sqrt(0.09 + 0.04)
    low, high, hopf = branch.special
    assert (low.kind, high.kind, hopf.kind) == ("fold", "fold", "Hopf")
    assert low.value == pytest.approx(MU - fold, rel=1e-8)
    assert high.value == pytest.approx(MU + fold, rel=1e-8)
    assert hopf.value == pytest.approx(10.3, rel=1e-8)
    assert branch.nonlinear_critical_speed == low.value
    assert branch.onset.rests_on == "fold"


@pytest.mark.parametrize("cubic", [0.0, -1.0])
def test_a_vertical_family_is_named_and_left(cubic):
    model = exact.planar(f_mx=1.0, g_my=1.0, f_y=-2.0, g_x=2.0)
    if cubic:  # van der Pol: linear where its damping passes through zero
        model = exact.planar(f_y=1.0, g_x=-1.0, g_my=1.0)
        model = railenv.Model("van der Pol", ["x", "y"], [], _van_der_pol, {})
    branch = design.cycle_branch(model, parameter_range=(9.0, 11.0))
    assert "vertical" in branch.ended
    assert not branch.complete
    assert len(branch) < 40
    assert [s.kind for s in branch.special] in ([], ["branch point"])
    np.testing.assert_allclose(branch.speed, MU, rtol=1e-8)


def test_a_family_that_is_vertical_up_to_the_flange_is_followed_beyond_it():
    model = railenv.Model("play", ["y", "v"], [], _play, {}, scale=1e-3)
    branch = design.cycle_branch(model, parameter_range=(9.0, 10.5))
    amplitude = branch.amplitude["y"]
    upright = np.abs(branch.speed - MU) < 1e-3
    assert 7e-3 < amplitude[upright].max() < 8.5e-3  # the play is 8 mm
    assert branch.complete
    assert branch.speed[-1] == pytest.approx(10.5)
    assert branch.stable[~upright].all()
    assert branch.nonlinear_critical_speed == pytest.approx(MU, rel=1e-5)


def _play(x, u, speed, curvature, cant, p):
    """Linear within a play of 8 mm, beyond which a damper takes hold."""
    y, v = x
    beyond = sqrt((y - 8e-3) * (y - 8e-3) + 1e-10) + sqrt((y + 8e-3) * (y + 8e-3) + 1e-10) - 16e-3
    return [v, -25.0 * y + (speed - MU) * v - 300.0 * beyond * v]


def _van_der_pol(x, u, speed, curvature, cant, p):
    a, b = x
    mu = speed - MU
    return [b, -a + mu * (1.0 - a * a) * b]


def test_the_hopf_point_is_looked_for_in_the_range_given():
    model = railenv.Model("slow", ["x", "y"], [], _slow, {})
    branch = design.cycle_branch(model, parameter_range=(1.0, 5.0))
    assert branch.hopf.speed == pytest.approx(2.0, rel=1e-9)
    assert branch.speed[-1] == pytest.approx(5.0)
    above = design.cycle_branch(model, parameter_range=(3.5, 5.0))
    assert above.hopf.speed == pytest.approx(2.0, rel=1e-9)
    assert above.speed[-1] == pytest.approx(5.0)


def _slow(x, u, speed, curvature, cant, p):
    a, b = x
    rate = (speed - 2.0) - a * a - b * b
    return [rate * a - 2.0 * b, 2.0 * a + rate * b]


def test_the_end_near_a_homoclinic_orbit_names_what_is_known():
    # Sparrow: the branch from r = 24.74 ends at the homoclinic orbit at r = 13.926
    hopf = design.critical_speed(LORENZ, speed_range=(20.0, 30.0))
    assert hopf.speed == pytest.approx(470.0 / 19.0, rel=1e-9)
    branch = design.cycle_branch(LORENZ, start=hopf, parameter_range=(10.0, 30.0))
    assert not branch.complete
    assert "homoclinic" in branch.ended
    assert "period" in branch.ended
    assert "wheel" not in branch.ended
    assert branch.speed[-1] == pytest.approx(13.926, abs=0.03)
    assert branch.nonlinear_critical_speed is None  # no motion of it is stable


def test_a_loop_closes_on_itself():
    # r^2 = 1 +- sqrt(0.09 - mu^2): an island between speeds of 9.7 and 10.3
    island = railenv.Model("island", ["x", "y"], [], _island, {})
    start = design.simulated_cycle(island, speed=10.0, initial_state=[1.1, 0.0])
    branch = design.cycle_branch(island, start=start, parameter_range=(9.0, 11.0))
    assert "loop" in branch.ended
    assert branch.complete
    assert sorted(round(s.value, 7) for s in branch.folds) == [9.7, 10.3]
    assert branch.nonlinear_critical_speed == pytest.approx(9.7, rel=1e-8)
    radius = branch.amplitude["x"] ** 2 - 1.0
    np.testing.assert_allclose(radius**2 + (branch.speed - MU) ** 2, 0.09, rtol=1e-5)


def _island(x, u, speed, curvature, cant, p):
    a, b = x
    mu, r2 = speed - MU, a * a + b * b
    rate = 0.09 - mu * mu - (r2 - 1.0) * (r2 - 1.0)
    return [rate * a - 2.0 * b, 2.0 * a + rate * b]


def test_a_branch_of_doubled_period_leaves_where_the_multiplier_is_minus_one():
    model = exact.company(nu=1.5, twist=0.25)
    parent = design.cycle_branch(model, parameter_range=(9.0, 11.2))
    (doubling,) = (s for s in parent.special if s.kind == "period doubling")
    branch = design.cycle_branch(model, start=doubling, parameter_range=(9.0, 11.2))
    assert branch.period[0] == pytest.approx(2.0 * doubling.cycle.period, rel=1e-6)
    assert branch.speed[0] == pytest.approx(doubling.value, abs=0.05)
    assert branch.amplitude["c"][-1] > 0.1
    np.testing.assert_allclose(parent.amplitude["c"], 0.0, atol=1e-9)
    # what it says is steady stays steady
    last = branch.cycles[-1]
    response = railenv.simulate(
        model, speed=last.speed, initial_state=last.states[0], duration=last.period
    )
    np.testing.assert_allclose(response.states[:, -1], last.states[0], atol=1e-6)


def test_a_branch_of_less_symmetry_leaves_where_the_multiplier_is_one():
    model = exact.company(extra=0.5)
    parent = design.cycle_branch(model, parameter_range=(9.0, 11.2))
    point = next(s for s in parent.special if s.kind == "symmetry breaking")
    sides = [
        design.cycle_branch(model, start=point, direction=side, parameter_range=(9.0, 11.2))
        for side in (1, -1)
    ]
    for branch in sides:
        # c' = (sigma + mu) c - c^3 has c = sqrt(mu - 1)
        c = np.array([cycle.states[:-1, 2].mean() for cycle in branch.cycles])
        size = np.sqrt(branch.speed - MU - 1.0)
        np.testing.assert_allclose(np.abs(c), size, rtol=1e-5)
        assert (np.sign(c) == np.sign(c[0])).all()
        assert branch.stable.all()
    assert np.sign(sides[0].cycles[0].states[0, 2]) == -np.sign(sides[1].cycles[0].states[0, 2])


def test_a_gentle_onset_at_high_conicity_is_the_nonlinear_critical_speed():
    vehicle = railenv.HIGH_SPEED_COACH.replace(conicity=0.4)
    branch = design.cycle_branch(railenv.Bogie(vehicle))
    assert branch.hopf.criticality == "supercritical"
    assert branch.nonlinear_critical_speed == branch.hopf.speed
    assert branch.onset.rests_on == "Hopf"


def test_a_gentle_onset_whose_branch_folds_back_below_it_rests_on_the_fold():
    contact = railenv.LinearProfile(0.4, 0.05, 10.0)
    branch = design.cycle_branch(railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(contact=contact)))
    assert branch.hopf.criticality == "supercritical"
    assert branch.onset.rests_on == "fold"
    lowest = min(c.value for c in branch.cycles if c.stable)
    assert branch.nonlinear_critical_speed <= lowest < branch.hopf.speed


def test_points_that_no_branch_leaves_are_refused():
    branch = design.cycle_branch(exact.hopf_normal_form(l1=1.0, l2=-1.0), parameter_range=(9.0, 10.5))
    with pytest.raises(design.CycleError, match=r"fold.*branches of periodic motions leave"):
        design.cycle_branch(branch.setting.model, start=branch.folds[0], parameter_range=(9.0, 10.5))
