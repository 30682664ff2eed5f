import math

import numpy as np
import pytest
from matplotlib.figure import Figure

from railenv.contact.creep_comparison import compare_creep_laws
from railenv.contact.creep_laws import LAWS, creep_forces
from railenv.equations.creep import heuristic, polach
from railenv.errors import ParameterError
from tests.railenv.contact.reference import COACH_WHEEL, SPIN_CASE, rows

STEP = 1e-6

# ----------------------------------------------------------------------- functions of beta


@pytest.mark.parametrize("law", [heuristic, lambda beta: polach(beta, 1.0, 1.0)])
def test_all_of_a_small_force_is_transmitted(law):
    assert law(1e-7) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("law", [heuristic, lambda beta: polach(beta, 1.0, 1.0)])
def test_force_grows_up_to_the_adhesion_limit(law):
    betas = np.geomspace(1e-3, 1e4, 200)
    forces = np.array([law(b) * b for b in betas])
    assert (np.diff(forces) > -1e-12).all()
    assert forces.max() <= 1.0 + 1e-12
    assert forces[-1] == pytest.approx(1.0, abs=1e-3)


def test_heuristic_joins_smoothly():
    low, high = 3.0 - STEP, 3.0 + STEP
    assert heuristic(3.0) == pytest.approx(1.0 / 3.0)
    assert heuristic(low) == pytest.approx(heuristic(high), abs=1e-6)
    slopes = [(heuristic(b + STEP / 2) - heuristic(b - STEP / 2)) / STEP for b in (low, high)]
    assert slopes[0] == pytest.approx(-1.0 / 9.0, rel=1e-4)
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)


def test_heuristic_starts_with_a_slope_of_a_third():
    assert (heuristic(STEP) - heuristic(0.0)) / STEP == pytest.approx(-1.0 / 3.0, rel=1e-5)


@pytest.mark.parametrize(("k_adhesion", "k_slip"), [(1.0, 1.0), (0.6, 0.2), (0.3, 0.1)])
def test_polach_starts_at_the_mean_reduction_and_ends_at_the_limit(k_adhesion, k_slip):
    assert polach(1e-7, k_adhesion, k_slip) == pytest.approx((k_adhesion + k_slip) / 2.0)
    assert 1e5 * polach(1e5, k_adhesion, k_slip) == pytest.approx(1.0, abs=1e-3)


def test_polach_in_the_form_of_his_paper():
    beta, k_a, k_s = 1.7, 0.6, 0.3
    e = math.pi * beta / 4.0
    force = 2.0 / math.pi * (k_a * e / (1.0 + (k_a * e) ** 2) + math.atan(k_s * e))
    assert polach(beta, k_a, k_s) * beta == pytest.approx(force)


@pytest.mark.parametrize("beta", [0.5, 2.0, 5.0])
def test_complex_step_is_the_slope(beta):
    for law in (heuristic, lambda b: polach(b, 0.8, 0.5)):
        slope = (law(beta + STEP) - law(beta - STEP)) / (2 * STEP)
        assert law(beta + 1e-30j).imag / 1e-30 == pytest.approx(slope, rel=1e-6)


# ------------------------------------------------------------------------ forces of a patch


@pytest.mark.parametrize("law", LAWS)
def test_forces_oppose_the_creepage_and_start_linearly(law):
    small = 1e-8
    f = SPIN_CASE.creep_coefficients
    found = creep_forces(law, small, 0.0, 0.0, SPIN_CASE)
    assert found.longitudinal == pytest.approx(-f.longitudinal_creep * small, rel=0.02)
    assert found.lateral == pytest.approx(0.0, abs=1e-9)
    found = creep_forces(law, 0.0, small, 0.0, SPIN_CASE)
    assert found.lateral == pytest.approx(-f.lateral_creep * small, rel=0.02)


@pytest.mark.parametrize("law", ["heuristic", "polach", "fastsim"])
def test_no_law_exceeds_the_adhesion_limit(law):
    creepage = np.linspace(-0.02, 0.02, 41)
    found = creep_forces(law, creepage, creepage[:, None], 1.0, SPIN_CASE)
    assert np.hypot(*found).max() <= SPIN_CASE.adhesion * 1.002


def test_heuristic_law_is_too_low_where_spin_helps_and_creepage_hinders():
    """An ellipse of 8 x 4 mm with a spin of 0.625 1/m, beside the exact theory of CONTACT."""
    exact = rows("fastsim_cases.csv")[0]["fy_over_mu_n"]
    found = {
        law: creep_forces(law, 0.0, -6.25e-4, 0.625, SPIN_CASE).lateral / SPIN_CASE.adhesion
        for law in LAWS
    }
    assert exact == pytest.approx(-0.607, abs=1e-3)
    assert found["heuristic"] == pytest.approx(-0.532, abs=1e-3)
    assert found["fastsim"] == pytest.approx(exact, rel=0.06)
    assert found["heuristic"] == pytest.approx(0.876 * exact, rel=1e-2)


def test_unknown_law_is_refused():
    with pytest.raises(ParameterError, match="law is 'shen'; it must be 'kalker', 'heuristic'"):
        creep_forces("shen", 0.0, 0.0, 0.0, SPIN_CASE)


# ------------------------------------------------------------------------------- comparison


@pytest.fixture(scope="module")
def comparison():
    return compare_creep_laws(COACH_WHEEL, (0.0, 0.109, 2.05), points=31)


def test_without_spin_the_heuristic_law_is_near_fastsim(comparison):
    for direction in ("longitudinal", "lateral"):
        assert comparison.deviation("heuristic", direction, 0.0) == pytest.approx(0.01, abs=2e-3)
        assert comparison.deviation("polach", direction, 0.0) == pytest.approx(0.042, abs=2e-3)
        assert comparison.deviation("kalker", direction, 0.0) > 1.0
        assert comparison.deviation("fastsim", direction, 0.0) == 0.0


def test_with_spin_it_is_not(comparison):
    assert comparison.deviation("heuristic", "lateral", 0.109) == pytest.approx(0.07, abs=0.01)
    assert comparison.deviation("heuristic", "lateral", 2.05) == pytest.approx(0.74, abs=0.02)


def test_curves_are_those_of_the_laws(comparison):
    assert comparison.longitudinal["polach"].shape == comparison.lateral["fastsim"].shape == (3, 31)
    one = creep_forces("fastsim", 0.0, comparison.creepage[7], comparison.spin[2], COACH_WHEEL)
    assert comparison.lateral["fastsim"][2, 7] == pytest.approx(one.lateral)
    f = COACH_WHEEL.creep_coefficients
    assert comparison.creepage[-1] * f.lateral_creep == pytest.approx(3 * COACH_WHEEL.adhesion)


def test_picture_has_a_panel_for_each_curve(comparison):
    figure = comparison.plot()
    assert isinstance(figure, Figure)
    drawn = [ax for ax in figure.axes if ax.get_visible()]
    assert [ax.get_title(loc="left") for ax in drawn] == [
        "longitudinal, no spin",
        "lateral, no spin",
        "lateral, spin 0.109 1/m",
        "lateral, spin 2.05 1/m",
    ]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "FASTSIM",
        "heuristic",
        "Polach",
        "Kalker, linear",
    ]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda c: c.deviation("heuristic", "lateral", 0.3), "spin is 0.3 1/m; .*: 0, 0.109, 2.05"),
        (lambda c: c.deviation("heuristic", "vertical", 0.0), "direction is 'vertical'"),
        (lambda c: c.deviation("shen", "lateral", 0.0), "law is 'shen'"),
        (lambda c: compare_creep_laws(c.patch, points=1), "points is 1"),
        (lambda c: compare_creep_laws(c.patch, largest=-1.0), "largest is -1"),
        (lambda c: compare_creep_laws(c.patch, (math.nan,)), "no entry may be NaN"),
    ],
)
def test_bad_arguments_are_refused(comparison, call, message):
    with pytest.raises(ParameterError, match=message):
        call(comparison)
