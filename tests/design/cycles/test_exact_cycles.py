"""Limit cycles, their special points and normal forms, where the exact answers are known."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError, UnknownNameError
from tests.design.cycles import exact
from tests.design.cycles.exact import MU

TIGHT = 1e-6


def test_stuart_landau_amplitude_period_and_multiplier():
    model = exact.hopf_normal_form(l1=-1.0, twist=0.3)
    branch = design.cycle_branch(model, parameter_range=(9.0, 13.0))
    mu = branch.speed - MU
    assert len(branch) > 10
    np.testing.assert_allclose(branch.amplitude["x"], np.sqrt(mu), rtol=TIGHT)
    np.testing.assert_allclose(branch.period, 2.0 * np.pi / (2.0 + 0.3 * mu), rtol=TIGHT)
    np.testing.assert_allclose(
        branch.multipliers[:, 0], np.exp(-2.0 * mu * branch.period), rtol=TIGHT, atol=1e-9
    )
    assert branch.stable.all()
    assert branch.trivial_error.max() < TIGHT
    assert branch.nonlinear_critical_speed == pytest.approx(MU, rel=1e-9)
    assert branch.onset.rests_on == "Hopf"
    assert branch.speed[-1] == pytest.approx(13.0, rel=1e-12)
    assert branch.complete


def test_bautin_fold_lies_where_the_normal_form_says():
    branch = design.cycle_branch(
        exact.hopf_normal_form(l1=1.0, l2=-1.0), parameter_range=(9.0, 10.5), longest_step=0.05
    )
    (fold,) = branch.special
    assert fold.kind == "fold"
    assert fold.value == pytest.approx(MU - 0.25, rel=1e-8)
    assert branch.nonlinear_critical_speed == fold.value
    assert fold.cycle.amplitude["x"] == pytest.approx(math.sqrt(0.5), rel=1e-4)
    assert fold.multiplier == pytest.approx(1.0, abs=1e-4)
    r2 = np.array([c.amplitudes[0] ** 2 for c in branch.cycles])
    np.testing.assert_array_equal(branch.stable, r2 > 0.5)


def test_van_der_pol_period_and_amplitude_from_a_simulated_cycle():
    model = exact.planar(f_y=1.0, g_x=-1.0, g_my=1.0, g_y=0.0, g_xxy=-1.0)
    start = design.simulated_cycle(model, speed=MU + 1.0, perturbation={"x": 1.0}, duration=60.0)
    # mu = 1: period and amplitude known to many digits
    assert start.period == pytest.approx(6.663286859323130, rel=TIGHT)
    assert start.amplitude["x"] == pytest.approx(2.008619860874843, rel=TIGHT)
    assert start.stable


def test_multipliers_of_a_linear_system_on_a_cycle():
    model = exact.company(sigma=-0.4, slope=0.0, nu=0.7)
    branch = design.cycle_branch(model, parameter_range=(9.0, 10.6))
    period = 2.0 * np.pi / 3.0
    expected = np.exp((-0.4 + 0.7j) * period)
    found = branch.multipliers
    distance = np.abs(found - expected).min(axis=1)
    assert distance.max() < TIGHT


@pytest.mark.parametrize(
    ("parameters", "kind", "multiplier", "mu"),
    [
        ({"nu": 1.1}, "torus", np.exp(1.1j * 2.0 * np.pi / 3.0), 1.0),
        ({"nu": 1.5, "twist": 0.25}, "period doubling", -1.0, 0.75),
        ({"extra": 0.5}, "symmetry breaking", 1.0, 1.0),
    ],
)
def test_other_special_points_lie_where_the_multipliers_say(parameters, kind, multiplier, mu):
    branch = design.cycle_branch(exact.company(**parameters), parameter_range=(9.0, 11.2))
    special = branch.special[0]
    assert special.kind == kind
    assert special.value == pytest.approx(MU + mu, rel=TIGHT)
    assert special.precision < 1e-4
    assert min(
        abs(special.multiplier - multiplier), abs(special.multiplier - np.conj(multiplier))
    ) == pytest.approx(0.0, abs=1e-5)
    assert branch.folds == ()
    before = branch.speed < special.value
    assert branch.stable[before].all()
    assert not branch.stable[~before].any()


def test_branch_in_a_parameter_of_the_model_is_exact():
    model = exact.hopf_normal_form(l1=-1.0)
    start = design.cycle_branch(model, parameter_range=(9.0, 11.0)).cycles[-1]
    branch = design.cycle_branch(
        model, start=start, parameter="l1", parameter_range=(-4.0, -0.5), direction=-1
    )
    np.testing.assert_allclose(branch.amplitude["x"], np.sqrt(-1.0 / branch.value), rtol=TIGHT)
    assert branch.value[-1] == pytest.approx(-4.0)
    np.testing.assert_allclose(branch.speed, 11.0)


# ------------------------------------------------------------------------- normal forms


def textbook(f, g, omega):
    """Guckenheimer and Holmes, eq 3.4.11, times 2/omega: Kuznetsov's coefficient of a planar system."""
    cubic = 6.0 * f["xxx"] + 2.0 * f["xyy"] + 2.0 * g["xxy"] + 6.0 * g["yyy"]
    square = f["xy"] * 2.0 * (f["xx"] + f["yy"]) - g["xy"] * 2.0 * (g["xx"] + g["yy"])
    square += -4.0 * f["xx"] * g["xx"] + 4.0 * f["yy"] * g["yy"]
    return 2.0 / omega * (cubic + square / omega) / 16.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_lyapunov_coefficient_of_a_general_cubic_system(seed):
    rng = np.random.default_rng(seed)
    names = ("xx", "xy", "yy", "xxx", "xxy", "xyy", "yyy")
    f, g = (dict(zip(names, rng.uniform(-1.0, 1.0, 7), strict=True)) for _ in "fg")
    model = exact.hopf_normal_form(
        omega=1.7, **{f"f_{k}": v for k, v in f.items()}, **{f"g_{k}": v for k, v in g.items()}
    )
    model.scale = np.full(2, 0.05)  # far from other equilibria
    hopf = design.hopf_point(model, speed_range=(9.5, 11.0))
    assert hopf.lyapunov_coefficient == pytest.approx(textbook(f, g, 1.7), rel=TIGHT)
    assert hopf.amplitude_range is not None


def test_lyapunov_coefficient_of_the_brusselator():
    # x' = 1 - (B + 1) x + x^2 y, y' = B x - x^2 y with B = 2 + mu/10; Kuramoto's amplitude equation
    # has Re g = 3/2 for the eigenvector (1, -1 + i) of squared length 3 and omega = 1
    model = exact.planar(f_1=1.0, f_x=-3.0, f_mx=-0.1, f_xxy=1.0, g_x=2.0, g_mx=0.1, g_xxy=-1.0)
    model.guess = np.array([1.0, 1.5])
    hopf = design.hopf_point(model)
    assert hopf.speed == pytest.approx(MU, rel=1e-8)
    assert hopf.lyapunov_coefficient == pytest.approx(-0.5, rel=TIGHT)


@pytest.mark.parametrize(("l1", "criticality"), [(-1.0, "supercritical"), (0.5, "subcritical")])
def test_direction_of_the_branch_agrees_with_the_normal_form(l1, criticality):
    model = exact.hopf_normal_form(l1=l1, l2=-0.01)
    critical = design.critical_speed(model)
    assert critical.criticality == criticality
    assert critical.hopf.normal_form_criticality == criticality
    assert critical.hopf.lyapunov_coefficient == pytest.approx(2.0 * l1 / 2.0, rel=TIGHT)


# ------------------------------------------------------------- failure, interruption, resumption


def test_no_hopf_point_is_an_error_with_a_hint():
    with pytest.raises(design.CycleError, match=r"no Hopf point.*stable from.*simulated_cycle"):
        design.cycle_branch(exact.planar(f_x=-1.0, g_y=-1.0, f_y=-2.0, g_x=2.0))


def test_a_motion_that_dies_out_is_an_error():
    with pytest.raises(design.CycleError, match="dies out"):
        design.simulated_cycle(exact.hopf_normal_form(l1=-1.0), speed=9.0, perturbation={"x": 0.5})


def test_what_the_branch_cannot_do_is_said():
    model = exact.hopf_normal_form(l1=-1.0)
    with pytest.raises(ParameterError, match="start"):
        design.cycle_branch(model, parameter="l1")
    start = design.cycle_branch(model, parameter_range=(9.0, 11.0), points=5).cycles[-1]
    with pytest.raises(UnknownNameError, match="did you mean 'twist'"):
        design.cycle_branch(model, start=start, parameter="twst", parameter_range=(0.0, 1.0))
    with pytest.raises(ParameterError, match="parameter_range"):
        design.cycle_branch(model, start=start, parameter="l1")
    with pytest.raises(ParameterError, match="lower end"):
        design.cycle_branch(model, parameter_range=(12.0, 9.0))


def test_running_away_of_the_period_ends_the_branch_with_what_was_computed():
    # the twist slows the rotation down, so that the period is infinite at r^2 = 2
    model = exact.hopf_normal_form(l1=-1e-6, twist=-1.0)
    branch = design.cycle_branch(model, parameter_range=(9.0, 11.0))
    assert not branch.complete
    assert "runs away" in branch.ended
    assert 1.0 < branch.amplitude["x"][-1] < math.sqrt(2.0)
    assert branch.period[-1] > 2.0 * branch.period[0]


def test_an_interrupted_branch_keeps_its_points_and_can_be_resumed(monkeypatch):
    from design.cycles.continuation import CycleContinuation

    model = exact.hopf_normal_form(l1=1.0, l2=-1.0)
    whole = design.cycle_branch(model, parameter_range=(9.0, 10.5))
    advance = CycleContinuation._advance

    def interrupted(self):
        if len(self.cycles) == 8:
            raise KeyboardInterrupt
        return advance(self)

    monkeypatch.setattr(CycleContinuation, "_advance", interrupted)
    part = design.cycle_branch(model, parameter_range=(9.0, 10.5))
    monkeypatch.undo()
    assert len(part) == 8
    assert not part.complete
    assert "interrupted" in part.ended
    rest = design.cycle_branch(resume=part, parameter_range=(9.0, 10.5))
    np.testing.assert_allclose(rest.speed, whole.speed, rtol=1e-9)
    assert rest.nonlinear_critical_speed == pytest.approx(whole.nonlinear_critical_speed, rel=1e-9)


def test_a_progress_bar_is_shown_on_request(capsys):
    model = exact.hopf_normal_form(l1=-1.0)
    branch = design.cycle_branch(model, parameter_range=(9.0, 11.0), points=4, progress=True)
    assert len(branch) == 4
    assert "4 points" in branch.ended


def test_hunting_map_of_the_bautin_normal_form():
    chart = design.hunting_map(
        exact.hopf_normal_form(l1=1.0, l2=-1.0), "l1", [1.0, 0.8, 0.6], speed_range=(8.0, 12.0)
    )
    np.testing.assert_allclose(chart.hopf_speed, MU, rtol=1e-8)
    np.testing.assert_allclose(chart.onset_speed, MU - chart.value**2 / 4.0, rtol=1e-7)
    assert chart.notes == ("", "", "")


def test_hunting_map_of_a_gentle_onset_is_the_hopf_point():
    chart = design.hunting_map(exact.hopf_normal_form(l1=-1.0), "twist", [0.0])
    np.testing.assert_allclose(chart.onset_speed, MU, rtol=1e-8)
    assert chart.onsets[0].rests_on == "Hopf"


def test_hunting_map_says_why_there_is_no_onset():
    chart = design.hunting_map(exact.planar(f_x=-1.0, g_y=-1.0, f_y=-2.0, g_x=2.0), "twist", [0.0])
    assert np.isnan(chart.onset_speed).all()
    assert "no Hopf point" in chart.notes[0]


def test_kernels_differentiate_by_parameters_exactly():
    model = railenv.Bogie(railenv.TABLE_1)
    kernels = model.kernels()
    layout = kernels.LAYOUT
    rng = np.random.default_rng(4)
    x = 1e-3 * rng.uniform(-1.0, 1.0, model.n_states)
    w = np.zeros(layout.all_rows)
    w[: layout.u], w[layout.c], w[layout.c + 1] = x, 40.0, 1e-3
    w[layout.p : layout.dx], t = model.rows()
    rows, columns = (np.ascontiguousarray(c) for c in np.array(kernels.PARAMETER_CELLS).T)
    found = np.zeros((model.n_states, len(model.parameters)))
    kernels.dense_parameter_jacobian(w, t, rows, columns, found)
    for k, (name, value) in enumerate(model.parameters.items()):
        changed = dict(model.parameters)
        changed[name] = value + 1e-30j
        oracle = SimpleNamespace(**changed)
        slopes = model.equations(x.tolist(), [0.0] * 9, 40.0, 1e-3, 0.0, oracle)
        exactly = [complex(v).imag / 1e-30 for v in slopes]
        np.testing.assert_allclose(found[:, k], exactly, rtol=1e-9, atol=1e-9 * np.abs(exactly).max())
