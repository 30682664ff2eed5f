"""The order of a model's states says nothing: displacements are told by what has a rate."""

from types import SimpleNamespace

import numpy as np
import pytest

import design
import railenv
from design.curves.ends import size
from design.cycles.shooting import Setting, Shooting
from design.cycles.starts import hopf_mode

OMEGA = 20.0  # rad/s: a rate is so many times its displacement
ORDERS = ("y", "dy", "s"), ("dy", "s", "y"), ("s", "dy", "y")


def _oscillator(order):
    """Return a van der Pol oscillator, and what follows its rate as the force of a sprung damper does.

    Its Hopf point is at a speed of 10 m/s; the square of the amplitude of y is 4 (speed - 10).
    """

    def rhs(x, u, speed, curvature, cant, p):
        at = dict(zip(order, x, strict=True))
        y, dy, s = at["y"], at["dy"], at["s"]
        rates = {
            "y": dy,
            "dy": (speed - 10.0 - y * y) * dy - OMEGA * OMEGA * y,
            "s": 200.0 * (dy - s),
        }
        return [rates[name] for name in order]

    return railenv.Model("sprung", list(order), [], rhs, {}, scale=0.1)


MODELS = [_oscillator(order) for order in ORDERS]


@pytest.mark.parametrize("model", MODELS, ids=lambda m: " ".join(m.state_names))
def test_the_critical_mode_has_a_displacement_of_one(model):
    hopf = design.critical_speed(model, speed_range=(8.0, 12.0))
    assert hopf.speed == pytest.approx(10.0, abs=1e-6)
    shooting = Shooting(Setting(model, "speed", hopf.speed, 0.0, 0.0, np.zeros(0)), 1)
    mode = dict(zip(model.state_names, hopf_mode(shooting, hopf) / model.scale, strict=True))
    assert mode["y"] == pytest.approx(1.0, abs=1e-12)
    assert abs(mode["dy"]) == pytest.approx(OMEGA, rel=1e-6)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: " ".join(m.state_names))
def test_the_kind_of_hopf_point_is_told_at_amplitudes_of_displacements(model):
    point = design.hopf_point(model, speed_range=(8.0, 12.0))
    assert point.branch_amplitudes == pytest.approx((0.01, 0.1), rel=1e-6)
    growth = np.diff(point.branch_speeds) / np.diff(np.square(point.branch_amplitudes))
    assert growth == pytest.approx(0.25, rel=0.2)  # between motions of the branch on straight lines
    assert point.criticality == "supercritical"


@pytest.mark.parametrize("model", MODELS, ids=lambda m: " ".join(m.state_names))
def test_a_curve_of_periodic_motions_knows_how_far_they_swing(model):
    amplitudes = {"y": 0.03, "dy": 0.6, "s": 0.5}
    told = SimpleNamespace(amplitudes=np.array([amplitudes[name] for name in model.state_names]))
    assert size(SimpleNamespace(model=model), told) == pytest.approx(0.3)
