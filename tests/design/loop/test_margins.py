"""Margins against python-control, against the map itself, and against a scan."""

import math

import control
import numpy as np
import pytest

import design
import railenv
from railenv.errors import UnknownNameError

EQUIPPED = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH))
DUAL = railenv.Equipped(railenv.DualWheelset(railenv.TABLE_1), "primary")


def feedback(gain, sensors, commands):
    return control.ss([], [], [], gain, 0.005, inputs=sensors, outputs=commands)


DAMPER = feedback([[-2e5]], ["gyro_b"], ["command_b"])
BOTH = feedback([[-1e5, -2e4], [1e4, -6e4]], ["gyro_w1", "gyro_w2"], ["command_w1", "command_w2"])


@pytest.fixture(scope="module")
def single():
    return design.margins(EQUIPPED, DAMPER, speed=130.0)


@pytest.fixture(scope="module")
def double():
    return design.margins(DUAL, BOTH, speed=36.0, longest_delay=0.05)


def plain_plant(x, u, speed, curvature, cant, p):
    position, rate = x
    return [rate, -4.0 * position - 0.5 * rate + u[0]]


def test_single_loop_agrees_with_python_controls_margins():
    # an oscillator under velocity and position feedback, with a delay of two periods and a half
    model = railenv.Model("oscillator", ["s", "v"], ["F"], plain_plant, {"unused": 1.0})
    controller = control.ss(
        [[0.8]], [[0.05, 0.01]], [[-3.0]], [[-2.0, -0.4]], 0.02, inputs=["s", "v"], outputs=["F"]
    )
    found = design.margins(model, controller, speed=10.0, delay=0.05)["F"]
    plant = control.ss([[0, 1], [-4, -0.5]], [[0], [1]], np.eye(2), 0)
    delay = control.ss(control.tf([1], [1, 0], 0.02))
    held = control.sample_system(plant, 0.02)
    half = control.sample_system(plant, 0.01)
    late = half.A @ half.B, half.B
    split = control.ss(
        np.block([[held.A, late[0]], [np.zeros((1, 3))]]),
        np.vstack([late[1], [[1.0]]]),
        np.hstack([np.eye(2), np.zeros((2, 1))]),
        0,
        0.02,
    )
    K = control.ss([[0.8]], [[0.05, 0.01]], [[-3.0]], [[-2.0, -0.4]], 0.02)
    loop = -K * split * delay * delay
    omega = np.geomspace(0.01, 157.0, 4001)
    values = loop(np.exp(0.02j * omega))
    data = np.abs(values), np.degrees(np.unwrap(np.angle(values))), omega
    gain, phase, _, _, _, _ = control.stability_margins(data)
    assert found.gain_margin == pytest.approx(gain, rel=1e-5)
    assert math.degrees(found.phase_margin) == pytest.approx(abs(phase), rel=1e-5)
    disk, disk_gain, disk_phase = control.disk_margins(loop, omega)
    assert found.disk_margin == pytest.approx(disk, rel=1e-4)
    assert 20.0 * math.log10(found.disk_gain_margin) == pytest.approx(disk_gain, rel=1e-3)
    assert math.degrees(found.disk_phase_margin) == pytest.approx(disk_phase, rel=1e-3)


def spectral_radius(loop, factors):
    """Closed loop with complex factors on its commands."""
    return np.abs(np.linalg.eigvals(loop.A - loop.B @ np.diag(factors) @ loop.C)).max()


def test_margins_are_where_the_multipliers_reach_the_unit_circle(single):
    channel = single["command_b"]
    phase = np.exp(1j * channel.phase_margin)
    for factor in (channel.gain_margin, channel.gain_reduction):
        assert spectral_radius(channel.loop, [factor]) == pytest.approx(1.0, abs=1e-6)
    lag, lead = (spectral_radius(channel.loop, [f]) for f in (phase, 1.0 / phase))
    assert max(lag, lead) == pytest.approx(1.0, abs=1e-6)
    for factor in (0.99 * channel.gain_margin, 1.01 * channel.gain_reduction, phase**0.99):
        assert spectral_radius(channel.loop, [factor]) < 1.0
    assert channel.disk_phase_margin <= channel.phase_margin
    assert channel.disk_gain_margin <= channel.gain_margin


def test_disk_is_the_largest_within_which_the_loop_stays_stable(single):
    channel = single["command_b"]
    angles = np.linspace(0.0, 2.0 * math.pi, 721)
    radii = {}
    for scale in (0.999, 1.001):
        delta = scale * channel.disk_margin * np.exp(1j * angles)
        factors = (1.0 + delta / 2.0) / (1.0 - delta / 2.0)
        radii[scale] = max(spectral_radius(channel.loop, [f]) for f in factors)
    assert radii[0.999] < 1.0 < radii[1.001]


def test_delay_margin_against_a_scan(single):
    delays = np.linspace(0.0, 0.2, 81)
    first = next(
        d
        for d in delays
        if design.closed_loop(EQUIPPED, DAMPER, speed=130.0, delay=0.01 + d).spectral_radius > 1.0
    )
    assert first - (delays[1] - delays[0]) < single.delay_margin <= first
    at = design.closed_loop(EQUIPPED, DAMPER, speed=130.0, delay=0.01 + single.delay_margin)
    assert at.spectral_radius == pytest.approx(1.0, abs=1e-7)
    assert at.frequency[0] == pytest.approx(single.delay_frequency, rel=1e-6)
    assert single.delay == 0.01


def test_delay_margin_that_is_longer_than_looked_for(single):
    found = design.margins(EQUIPPED, DAMPER, speed=130.0, longest_delay=0.02)
    assert found.delay_margin is None
    assert "more than 0.02 s" in str(found)


def test_each_command_is_opened_with_the_other_closed(double):
    assert [c.channel for c in double.channels] == ["command_w1", "command_w2"]
    loop = design.open_loop(DUAL, BOTH, speed=36.0)
    for k, channel in enumerate(double.channels):
        for factor in (channel.gain_margin, channel.gain_reduction):
            if 0.0 < factor < math.inf:
                factors = np.ones(2)
                factors[k] = factor
                assert spectral_radius(loop, factors) == pytest.approx(1.0, abs=1e-6)
        assert channel.gain_margin < math.inf
        # both commands at once bear no more than one alone
        assert double.disk_margin <= channel.disk_margin * (1.0 + 1e-6)


def test_one_channel_alone(double):
    found = design.margins(DUAL, BOTH, speed=36.0, channel="command_w2", longest_delay=0.005)
    assert found.channels == (double["command_w2"],)
    with pytest.raises(UnknownNameError, match="command_b"):
        design.margins(DUAL, BOTH, speed=36.0, channel="command_b")


def test_unstable_loop_has_no_margins(tmp_path):
    found = design.margins(EQUIPPED, DAMPER, speed=240.0)
    assert not found.stable
    assert found.channels == ()
    assert found.delay_margin is None
    assert "no margins: the closed loop is unstable" in str(found)
    assert found.summary()["stable"] is False
    found.plot().figure.savefig(tmp_path / "unstable.png")
    with pytest.raises(UnknownNameError):
        found["command_b"]


def test_least_damped_mode_has_the_smallest_damping_ratio(single):
    mode = single.least_damped
    assert -mode.real / abs(mode) == pytest.approx(single.closed_loop.damping.min())


def test_controller_that_reads_its_past_commands_keeps_its_own_memory():
    # the factor acts behind the controller, which does not know of it
    K = control.ss(
        [],
        [],
        [],
        [[-2e5, -0.3]],
        0.005,
        inputs=["gyro_b", "command_b[-1]"],
        outputs=["command_b"],
    )
    channel = design.margins(EQUIPPED, K, speed=130.0, longest_delay=0.005)["command_b"]
    for factor in (channel.gain_margin, channel.gain_reduction):
        scaled = design.ScaledFeedback(design.LinearFeedback(K), factor)
        loop = design.closed_loop(EQUIPPED, scaled, speed=130.0)
        assert loop.spectral_radius == pytest.approx(1.0, abs=1e-6)


def test_pictures(single, double, tmp_path):
    for name, found in (("single", single), ("double", double)):
        drawn = found.plot()
        said = [t.get_text() for t in drawn.axes[0, 0].get_legend().get_texts()]
        assert sum(t.startswith("command_") for t in said) == len(found.channels)
        drawn.figure.savefig(tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 1000
