"""The coach on measured profiles: every fold of its limit cycles, by continuation and by simulation."""

import pytest

import design
import railenv


@pytest.fixture(scope="module")
def model():
    return railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002)


def branch_of(model):
    return design.cycle_branch(model, parameter_range=(60.0, 112.0))


@pytest.fixture(scope="module")
def branch(model):
    return branch_of(model)


def test_hunting_begins_gently(model):
    hopf = design.hopf_point(model)
    assert hopf.critical.speed == pytest.approx(88.182, abs=0.01)
    assert hopf.critical.frequency == pytest.approx(6.8376, abs=1e-3)
    assert hopf.criticality == "supercritical"


def test_two_folds_lead_from_the_tread_to_the_flange(model, branch):
    assert [fold.value for fold in branch.folds] == pytest.approx([100.025, 92.469], abs=0.02)
    tread, flange = (fold.cycle.amplitudes[0] for fold in branch.folds)
    assert tread < flange < model.flange_clearance == pytest.approx(6.39e-3, abs=5e-5)


def test_hunting_persists_from_its_gentle_beginning(branch):
    """Not from the fold: below it there are small cycles already."""
    lowest = min(cycle.value for cycle in branch.cycles if cycle.stable)
    assert branch.nonlinear_critical_speed == branch.hopf.speed < lowest < 92.0
    assert branch.onset.rests_on == "Hopf"


def test_slow_ramps_leave_the_branch_at_its_folds(model, branch):
    on_flange = next(c for c in branch.cycles if c.stable and c.amplitudes[0] > 7e-3 and c.value > 95.0)
    down = design.speed_ramp(
        model, start=on_flange.value, stop=88.5, cycle=on_flange, rate=0.02, threshold=4.7e-3
    )
    assert down.critical_speed == pytest.approx(92.469, rel=5e-3)
    on_tread = [c for c in branch.cycles if c.stable and c.amplitudes[0] < 3e-3][-1]
    up = design.speed_ramp(
        model, start=on_tread.value, stop=103.0, cycle=on_tread, rate=0.02, threshold=6e-3
    )
    assert up.critical_speed == pytest.approx(100.025, rel=5e-3)


def test_a_finer_table_moves_no_fold(branch):
    finer = railenv.ProfilePair(grid=0.5 * railenv.ProfilePair().grid)
    found = branch_of(railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002.replace(contact=finer)))
    before = [fold.value for fold in branch.folds]
    assert [fold.value for fold in found.folds] == pytest.approx(before, rel=1e-4)


def test_the_patch_matters_at_the_centre_only(branch):
    """The contact jumps near the centre: how softly is told by the patch, which goes with the load."""
    pair = railenv.ProfilePair(width=7.5e-6, step=5e-6)
    narrow = branch_of(railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002.replace(contact=pair)))
    assert narrow.hopf.speed == pytest.approx(77.33, abs=0.1)
    large = [f.value for f in narrow.folds if f.cycle.amplitudes[0] > 3e-3]
    assert [max(large), min(large)] == pytest.approx([f.value for f in branch.folds], rel=1e-2)
