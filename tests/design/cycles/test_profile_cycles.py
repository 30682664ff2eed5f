"""The coach on measured profiles: every fold of its limit cycles, by continuation and by simulation."""

import numpy as np
import pytest

import design
import railenv


@pytest.fixture(scope="module")
def model():
    return railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002)


@pytest.fixture(scope="module")
def branch(model):
    return design.cycle_branch(model)


def test_hunting_begins_gently_with_small_cycles(model):
    hopf = design.hopf_point(model)
    assert hopf.critical.speed == pytest.approx(94.699, abs=0.01)
    assert hopf.critical.frequency == pytest.approx(6.4396, abs=1e-3)
    assert hopf.criticality == "supercritical"


def test_three_folds_lead_from_the_tread_to_the_flange(model, branch):
    values = [fold.value for fold in branch.folds]
    assert values == pytest.approx([94.501, 101.858, 91.937], abs=0.02)
    assert branch.nonlinear_critical_speed == pytest.approx(91.937, abs=0.02)
    clearance = model.flange_clearance
    assert clearance == pytest.approx(6.39e-3, abs=5e-5)
    sizes = [fold.cycle.amplitudes[0] for fold in branch.folds]
    assert sizes[0] < sizes[1] < clearance < sizes[2]


def test_slow_ramps_leave_the_branch_at_its_folds(model, branch):
    on_flange = next(c for c in branch.cycles if c.stable and c.amplitudes[0] > 7e-3 and c.value > 95.0)
    down = design.speed_ramp(model, start=on_flange.value, stop=88.0, cycle=on_flange, rate=0.02)
    assert down.critical_speed == pytest.approx(91.937, rel=5e-3)
    on_tread = [c for c in branch.cycles if c.stable and c.amplitudes[0] < 3e-3][-1]
    up = design.speed_ramp(
        model, start=on_tread.value, stop=104.0, cycle=on_tread, rate=0.02, threshold=6e-3
    )
    assert up.critical_speed == pytest.approx(101.858, rel=5e-3)


def test_a_finer_table_moves_no_fold(branch):
    finer = railenv.ProfilePair(grid=0.5 * railenv.ProfilePair().grid)
    found = design.cycle_branch(railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002.replace(contact=finer)))
    before = [fold.value for fold in branch.folds]
    assert [fold.value for fold in found.folds] == pytest.approx(before, rel=1e-4)


def test_the_patch_matters_at_the_centre_only(branch):
    """The contact jumps near the centre: how softly is told by the patch, which goes with the load."""
    pair = railenv.ProfilePair(width=7.5e-6, step=5e-6)
    narrow = railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002.replace(contact=pair))
    found = design.cycle_branch(narrow)
    assert found.hopf.speed == pytest.approx(88.24, abs=0.1)
    larger = [f.value for f in found.folds if f.cycle.amplitudes[0] > 3e-3]
    before = [f.value for f in branch.folds if f.cycle.amplitudes[0] > 3e-3]
    assert larger == pytest.approx(before, rel=1e-2)
    assert np.all(np.isfinite(larger))
