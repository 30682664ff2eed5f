"""The whole bifurcation diagram: branches of every origin, and what the onset of hunting rests on."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError
from tests.design.cycles import exact
from tests.design.cycles.exact import MU


def _island(x, u, speed, curvature, cant, p):
    """Hunting at speeds of 9.7 to 10.3 that hangs together with nothing, and a Hopf point at 11."""
    a, b = x
    mu, r2 = speed - MU, a * a + b * b
    island = (r2 - 1.0) * (r2 - 1.0) + mu * mu - 0.09
    rate = -island * (r2 - 4.0 * (mu - 1.0)) / (1.0 + r2) ** 3
    return [rate * a - 2.0 * b, 2.0 * a + rate * b]


ISLAND = railenv.Model("island", ["x", "y"], [], _island, {})


@pytest.fixture(scope="module")
def island():
    return design.bifurcation_diagram(ISLAND, speed_range=(8.0, 13.0))


def test_branches_that_hang_together_with_no_hopf_point_are_found_by_simulation(island):
    assert [h.speed for h in island.hopf] == pytest.approx([11.0])
    assert [o.kind for o in island.origins] == ["Hopf", "simulation"]
    assert "loop" in island.branches[1].ended
    assert island.nonlinear_critical_speed == pytest.approx(9.7, rel=1e-8)
    assert island.onset.rests_on == "fold"
    assert island.branches[0].nonlinear_critical_speed == pytest.approx(11.0, rel=1e-8)
    assert island.irregular == ()
    assert island.notes == ()


def test_without_simulations_they_are_not_seen():
    alone = design.bifurcation_diagram(ISLAND, speed_range=(8.0, 13.0), speeds=[])
    assert [o.kind for o in alone.origins] == ["Hopf"]
    assert alone.onset.rests_on == "Hopf"
    assert alone.nonlinear_critical_speed == pytest.approx(11.0, rel=1e-8)


def test_branches_leave_branches_where_the_symmetry_breaks():
    found = design.bifurcation_diagram(exact.company(extra=0.5), speed_range=(9.0, 11.2), speeds=[])
    assert [o.kind for o in found.origins][:2] == ["Hopf", "symmetry breaking"]
    assert found.origins[1].parent == 0
    assert found.origins[1].speed == pytest.approx(11.0, rel=1e-6)
    flat = design.bifurcation_diagram(
        exact.company(extra=0.5), speed_range=(9.0, 11.2), speeds=[], depth=0
    )
    assert len(flat.branches) == 1


def test_motion_of_two_frequencies_is_told_as_irregular():
    # beyond the torus point at 11 the second oscillator has its own frequency
    found = design.bifurcation_diagram(exact.company(nu=1.1), speed_range=(9.0, 11.5), speeds=[11.3])
    assert [s.kind for s in found.special] == ["torus"]
    motion = found.irregular[0]
    assert motion.speed == 11.3
    beyond = found.irregular[-1]  # the motion that has become unstable next to the torus point
    assert 11.0 < beyond.speed < 11.3
    assert motion.amplitudes[2] == pytest.approx(math.sqrt(0.3 / 0.75), rel=0.1)
    assert found.nonlinear_critical_speed == pytest.approx(MU, rel=1e-8)


def test_the_diagram_tells_and_draws_itself(island):
    text = str(island)
    assert "from speed 9.7 m/s (fold" in text
    assert "branch 1, from simulation" in text
    summary = island.summary()
    assert summary["rests_on"] == "fold"
    assert len(summary["branches"]) == 2
    axes = np.ravel(island.plot().axes)[0]
    assert any("fold at" in label.get_text() for label in axes.get_legend().get_texts())
    plt.close("all")


def test_an_interrupted_diagram_keeps_its_branches(monkeypatch):
    from design.cycles import bifurcation_search

    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(bifurcation_search, "survivors", interrupted)
    found = design.bifurcation_diagram(ISLAND, speed_range=(8.0, 13.0))
    assert len(found.branches) == 1
    assert "interrupted" in found.ended


def test_bad_options_are_refused():
    with pytest.raises(ParameterError, match="depth"):
        design.bifurcation_diagram(ISLAND, speed_range=(8.0, 13.0), depth=-1)
    with pytest.raises(ParameterError, match="speed"):
        design.bifurcation_diagram(ISLAND, speed_range=(13.0, 8.0))


def test_a_vehicle_with_two_hopf_points_hunts_from_the_first_and_on_from_an_isolated_branch():
    """Gentle hunting between 65 and 82 m/s that folds back, and other hunting from 98 m/s on."""
    vehicle = railenv.HIGH_SPEED_COACH.replace(
        conicity=0.0744,
        primary_longitudinal_stiffness=1.2e6,
        primary_lateral_stiffness=0.6e6,
        secondary_longitudinal_damping=86.8e3,
        secondary_longitudinal_stiffness=418e3,
        secondary_lateral_stiffness=163e3,
        secondary_lateral_damping=13.8e3,
    )
    found = design.bifurcation_diagram(railenv.Bogie(vehicle), speed_range=(30.0, 120.0))
    first = found.branches[0]
    assert found.nonlinear_critical_speed == found.hopf[0].speed == pytest.approx(65.009, abs=0.01)
    assert first.special[-1].kind == "Hopf"
    assert first.special[-1].value == pytest.approx(82.092, abs=0.01)
    assert [f.value for f in first.folds] == pytest.approx([102.40], abs=0.05)
    # the motion that hunts with most of the clearance at 75 m/s
    motion = first.at(75.0, stable=True)[0]
    assert motion.amplitude["y_w1"] == pytest.approx(9.0e-3, abs=1e-3)
