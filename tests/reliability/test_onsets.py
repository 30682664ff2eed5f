"""Nonlinear critical speeds of random vehicles against simulation, in a short form."""

import pytest

from benchmarks.reliability import onsets


@pytest.mark.parametrize("number", [0, 6])
def test_nothing_hunts_below_the_nonlinear_critical_speed_and_something_does_above(number):
    found = onsets.judged(number)
    assert found.nonlinear is not None
    assert found.linear is not None
    assert found.nonlinear <= found.linear
    assert found.outcome == "agrees", found


def test_disagreements_are_told():
    found = onsets.Judged(1, "cone", 90.0, 80.0, "fold", below=1, above=3)
    assert found.outcome == "hunts below"
    assert onsets.Judged(1, "cone", 90.0, 80.0, "fold", 0, 0).outcome == "does not hunt above"
    assert onsets.Judged(1, "cone", None, None, None, 0, 2).outcome == "hunts where none was found"


def test_vehicles_are_drawn_again_by_their_number():
    kinds = {onsets.vehicle(k)[0] for k in range(len(onsets.KINDS))}
    assert kinds == set(onsets.KINDS)
    assert onsets.vehicle(3)[1] == onsets.vehicle(3)[1]
    assert onsets.vehicle(3)[1] != onsets.vehicle(8)[1]
