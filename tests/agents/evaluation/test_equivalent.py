"""Actuators as dampers and springs."""

import cmath
import math

import numpy as np
import pytest

import agents
import design
import railenv
from railenv.errors import ParameterError, UnknownNameError

GAIN = 8e4


@pytest.fixture(scope="module")
def bogie():
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW))


def chain(model, s, period):
    """Transfer from a yaw rate to minus the moment: gyro, sampling and hold, delay, actuator's lag."""
    corner = 2.0 * math.pi * model.sensors.gyro_bandwidth
    omega, zeta = 2.0 * math.pi * model.actuator.bandwidth, model.actuator.damping
    lag = omega**2 / (s * s + 2.0 * zeta * omega * s + omega**2)
    hold = (1.0 - cmath.exp(-s * period)) / (s * period)
    return GAIN * corner / (s + corner) * hold * cmath.exp(-s * model.delay) * lag


@pytest.mark.parametrize("conicity", [0.05, 0.4])
def test_yaw_rate_feedback_is_what_its_chain_of_lags_makes_of_the_gain(bogie, conicity):
    model = bogie.replace(conicity=conicity)
    controller = agents.YawRateFeedback.design(model, gain=GAIN, washout=0.0)
    found = agents.equivalent_damper(model, controller, [50.0, 80.0])
    for sigma, hertz, rate, stiffness in zip(
        found.growth, found.frequency, found.rate, found.stiffness, strict=True
    ):
        s = sigma + 2j * math.pi * hertz
        expected = chain(model, s, controller.period)
        assert abs(rate + stiffness / s - expected) < 0.02 * abs(expected)


def test_delay_turns_a_damper_into_a_spring(bogie):
    model = bogie.replace(conicity=0.4)
    controller = agents.YawRateFeedback.design(model, gain=GAIN, washout=0.0)
    early = agents.equivalent_damper(model.replace(delay=0.0), controller, [80.0])
    late = agents.equivalent_damper(model.replace(delay=0.02), controller, [80.0])
    assert early.rate[0] > 0.0 > late.rate[0]
    # without delay damping is at most the gain, and the magnitude of both together is the chain's
    assert early.rate[0] < GAIN


def test_mode_is_the_least_damped_of_the_loop(bogie):
    controller = agents.shipped("output-feedback")
    found = agents.equivalent_damper(bogie, controller, [90.0, 120.0])
    for k, speed in enumerate((90.0, 120.0)):
        values = design.closed_loop(bogie, controller, speed=speed).eigenvalues
        hertz = values.imag / (2.0 * math.pi)
        swings = values[(hertz > 0.3) & (hertz < 40.0)]
        assert found.growth[k] == pytest.approx(swings.real.max(), rel=1e-9, abs=1e-9)


def test_second_actuator_is_found_by_its_name():
    model = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), "primary")
    controller = agents.YawRateFeedback.design(model, gain=GAIN, washout=0.0)
    found = agents.equivalent_damper(model, controller, [60.0], actuator="w2")
    assert np.isfinite([found.rate[0], found.stiffness[0]]).all()
    with pytest.raises(UnknownNameError, match="actuator"):
        agents.equivalent_damper(model, controller, [60.0], actuator="w3")


def test_lateral_actuator_is_no_yaw_damper():
    model = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), "lateral")
    with pytest.raises(ParameterError, match="yaw actuator"):
        agents.equivalent_damper(model, np.zeros((1, 24)), [60.0])


def test_it_is_drawn(bogie):
    controller = agents.YawRateFeedback.design(bogie, gain=GAIN)
    plot = agents.equivalent_damper(bogie, controller, [60.0, 80.0, 100.0]).plot()
    above, below = plot.axes.ravel()
    assert "kN m s/rad" in above.get_ylabel()
    assert "MN m/rad" in below.get_ylabel()
