"""Ramps of speed: what disturbs the vehicle on its way, and where they lead as they get slower."""

import math

import numpy as np
import pytest

import design
import railenv
from railenv.errors import ParameterError

COOPERRIDER = railenv.CooperriderBogie()
HOPF = 68.644  # m/s


def _gentle(x, u, speed, curvature, cant, p):
    """Supercritical: above the critical speed the amplitude is the root of (V - critical) / 100."""
    q, r = x
    growth = p.quick * ((speed - p.critical) / 100.0 - (q * q + r * r))
    return [growth * q - 20.0 * r, 20.0 * q + growth * r]


GENTLE = railenv.Model("gentle", ["q", "r"], [], _gentle, {"critical": 50.0, "quick": 20.0}, scale=0.01)


def test_slower_ramps_up_begin_to_hunt_ever_nearer_to_the_hopf_point():
    ends = ((60.0, 80.0, 0.2), (66.0, 72.0, 0.05), (67.0, 70.0, 0.0125))
    found = [
        design.speed_ramp(COOPERRIDER, start=start, stop=stop, rate=rate).critical_speed
        for start, stop, rate in ends
    ]
    assert HOPF < found[2] < found[1] < found[0] < 74.0
    assert found[2] == pytest.approx(HOPF, rel=0.01)
    # a motion grows by its growth rate, integrated over time: from a kick to hunting by a factor of 100
    slope = design.critical_speed(COOPERRIDER).growth_slope
    for speed, (_, _, rate) in zip(found, ends, strict=True):
        assert slope * (speed - HOPF) ** 2 / 2.0 / rate < math.log(100.0)


def test_ramp_from_the_equilibrium_itself_finds_that_it_is_unstable():
    ramp = design.speed_ramp(COOPERRIDER, start=66.0, stop=71.0)
    assert HOPF < ramp.critical_speed < 70.3
    assert str(ramp).startswith("ramp from 66 to 71 m/s: hunting begins at 69.")
    assert ramp.disturbance == design.cycles.polach.DISTURBANCE
    assert ramp.amplitude[ramp.speed < 67.0].max() < 0.1 * ramp.threshold
    undisturbed = design.speed_ramp(COOPERRIDER, start=66.0, stop=71.0, disturbance=0.0)
    assert undisturbed.critical_speed is None
    assert undisturbed.amplitude.max() < 1e-9


def test_kicks_are_those_of_the_seed():
    def ramp(**more):
        return design.speed_ramp(COOPERRIDER, start=67.0, stop=67.2, **more).amplitude

    assert np.array_equal(ramp(), ramp(seed=0))
    assert not np.array_equal(ramp(), ramp(seed=1))
    one, ten = (np.median(ramp(disturbance=size)) for size in (0.001, 0.01))
    assert ten == pytest.approx(10.0 * one, rel=0.05)


def test_equations_of_ones_own_are_disturbed_too():
    ramp = design.speed_ramp(GENTLE, start=45.0, stop=60.0, rate=0.1, threshold=0.2)
    # the amplitude is 0.2 where (V - 50) / 100 is 0.04
    assert ramp.critical_speed == pytest.approx(54.0, abs=0.4)
    late = ramp.speed > 58.0
    expected = np.sqrt((ramp.speed[late] - 50.0) / 100.0)
    assert ramp.amplitude[late] == pytest.approx(expected, rel=0.02)
    down = design.speed_ramp(
        GENTLE, start=60.0, stop=45.0, rate=0.1, threshold=0.2, perturbation={"q": 0.3}
    )
    assert down.critical_speed == pytest.approx(54.0, abs=0.4)
    assert "ceases" in str(down)


def test_last_part_of_a_ramp_may_be_short_and_the_speed_goes_on_steadily():
    ramp = design.speed_ramp(GENTLE, start=40.0, stop=42.0, rate=0.81)
    assert ramp.time[-1] == pytest.approx(2.0 / 0.81)
    assert (np.diff(ramp.time) > 0.0).all()
    assert ramp.speed == pytest.approx(40.0 + 0.81 * ramp.time, rel=1e-12)


@pytest.mark.parametrize("disturbance", [-0.1, math.inf, math.nan])
def test_bad_disturbances_are_refused(disturbance):
    with pytest.raises(ParameterError, match="disturbance"):
        design.speed_ramp(COOPERRIDER, start=60.0, stop=61.0, disturbance=disturbance)
