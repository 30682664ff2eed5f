"""Long memories of controllers: what rounding makes of shift registers does not slow the analysis."""

import control
import numpy as np
import pytest

import design
import railenv
from design.stability.samples import forgotten_within

PERIOD = 0.005


def register(n):
    """A shift register of n periods: each state hands on the one before."""
    return np.eye(n, k=-1)


@pytest.mark.parametrize("n", [20, 40, 80, 160])
def test_what_rounding_makes_of_a_register_is_forgotten(n):
    rng = np.random.default_rng(n)
    size = np.finfo(float).eps
    disturbed = register(n) + size * rng.normal(size=(n, n))
    within = forgotten_within(register(n))
    assert np.abs(np.linalg.eigvals(disturbed)).max() < within
    # and not much more: what is lost has decayed to a part in a thousand within the register's length
    assert within**n < 1e-12 or within == 0.4


def test_matrices_without_registers_are_as_they_were():
    rng = np.random.default_rng(0)
    for matrix in (np.eye(50), rng.normal(size=(50, 50)), np.roll(np.eye(3), 1, axis=0)):
        assert forgotten_within(matrix) == pytest.approx(0.4, abs=0.01)


def test_a_long_memory_that_hardly_counts_moves_no_critical_speed_and_costs_no_samples():
    bogie = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))
    gain, n = -8e4, 79
    short = control.ss([], [], [], [[gain]], PERIOD, inputs=["gyro_b"], outputs=["command_b"])
    rng = np.random.default_rng(1)
    taps = 1e-4 * gain * rng.normal(size=(1, n))
    first = np.eye(n, 1)
    long = control.ss(
        register(n), first, taps, [[gain]], PERIOD, inputs=["gyro_b"], outputs=["command_b"]
    )
    limits = (60.0, 300.0)
    plain = design.critical_speed(bogie, controller=short, speed_range=limits)
    found = design.critical_speed(bogie, controller=long, speed_range=limits)
    assert found.loss == plain.loss == "hunting"
    assert found.speed == pytest.approx(plain.speed, rel=5e-3)
    assert len(found.sampled) < 3 * len(plain.sampled)
