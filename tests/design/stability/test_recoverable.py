"""What actuators can bring back of an unstable mode, against simulated bang-bang commands."""

import math

import numpy as np
import pytest

import design
import railenv
from design.stability.recoverable import _half_width
from railenv.errors import ParameterError

WORN = {"conicity": 0.4, "creep_factor": 1.4}


def bogie(place):
    return railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), place).replace(**WORN)


def test_slow_and_turnless_modes_have_closed_forms():
    pushes = np.array([0.3 + 0.4j, -0.2j])
    assert _half_width(1e-3 + 9.0j, pushes) == pytest.approx(2.0 / math.pi * 0.7 / 1e-3, rel=0.02)
    assert _half_width(0.5 + 0.0j, np.array([0.3, -0.2])) == pytest.approx(1.0)


@pytest.mark.parametrize(("share", "recovers"), [(0.9, True), (1.1, False)])
def test_commands_bring_back_what_lies_within_and_nothing_beyond(share, recovers):
    """The command that pushes the mode against its motion at every moment, in continuous time."""
    model = bogie("secondary").replace(delay=0.0)
    mode, *_ = design.recoverable_amplitudes(model, speed=135.0)
    assert mode.frequency == pytest.approx(20.4, abs=0.2)
    system = design.linearize(model, speed=135.0, inputs=list(model.command_names))
    A, B = np.asarray(system.A), np.asarray(system.B)
    values, right = np.linalg.eig(A)
    k = int(np.argmin(np.abs(values - (mode.growth + 2j * math.pi * mode.frequency))))
    left = np.linalg.inv(right)[k]
    row = model.state_names.index(f"y_{mode.body}")
    z = share * mode.amplitude / (2.0 * abs(right[row, k]))
    step, push = 2e-4, left @ B[:, 0] * model.limits[0]
    lead = np.exp(values[k] * step)
    gain = push * (lead - 1.0) / values[k]
    first, z = abs(z), complex(z)
    for _ in range(round(6.0 / step)):
        z = lead * z - gain * np.sign((push.conjugate() * z).real)
        if abs(z) < 0.05 * first or abs(z) > 5.0 * first:
            break
    assert (abs(z) < first) == recovers


def test_a_moment_on_the_frame_hardly_holds_the_mode_of_worn_wheels_and_those_on_wheelsets_do():
    reach = {}
    for place in ("secondary", "primary"):
        modes = design.recoverable_amplitudes(bogie(place), speed=162.0)
        fast = next(mode for mode in modes if mode.frequency > 15.0)
        reach[place] = fast.amplitude / bogie(place).limits[0]
    assert reach["primary"] > 10.0 * reach["secondary"]


def test_a_stable_vehicle_has_nothing_to_bring_back_and_delay_costs():
    model = bogie("secondary")
    assert design.recoverable_amplitudes(model, speed=40.0) == ()
    (soon, *_), (late, *_) = (
        design.recoverable_amplitudes(model.replace(delay=delay), speed=150.0) for delay in (0.0, 0.02)
    )
    assert late.amplitude == pytest.approx(soon.amplitude * math.exp(-0.02 * soon.growth))
    bare = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH), "none")
    with pytest.raises(ParameterError, match="no actuators"):
        design.recoverable_amplitudes(bare, speed=140.0)
