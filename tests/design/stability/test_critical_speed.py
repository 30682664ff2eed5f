"""Critical speeds against the literature, an independent implementation, and exact answers."""

import math

import numpy as np
import pytest

import design
import railenv
from railenv.errors import EquilibriumError, ParameterError

CANT = 0.0873  # the paper's, rad


def bogie(vehicle):
    return railenv.Bogie(vehicle)


def on_a_line(vehicle):
    """Return a bogie whose wheelsets a curve does not turn against the frame, as in the paper."""
    return railenv.Bogie(vehicle.replace(wheelbase_curving=False))


@pytest.mark.parametrize(
    ("model", "speed", "frequency"),
    [
        (railenv.DualWheelset(railenv.TABLE_1), 34.175, 1.8681),
        (railenv.Bogie(railenv.TABLE_1), 12.460, 0.7627),
        (railenv.Bogie(railenv.HIGH_SPEED_COACH), 116.471, 3.1134),
    ],
    ids=["table_1_dual_wheelset", "table_1_bogie", "high_speed_coach_bogie"],
)
def test_tangent_critical_speed_equals_that_of_an_independent_implementation(model, speed, frequency):
    found = design.critical_speed(model)
    assert found.loss == "hunting"
    assert found.speed == pytest.approx(speed, rel=1e-3)
    assert found.frequency == pytest.approx(frequency, rel=1e-3)


def test_coach_dual_wheelset_does_not_hunt_up_to_250_m_per_s():
    model = railenv.DualWheelset(railenv.HIGH_SPEED_COACH)
    found = design.critical_speed(model, speed_range=(3.0, 250.0))
    assert found.loss == "none"
    assert found.speed is None
    assert found.frequency is None
    assert str(found).startswith("stable from 3 to 250 m/s (seen at ")


def test_cooperrider_bogie_hunts_from_68_644_m_per_s_at_3_998_hz():
    found = design.critical_speed(railenv.CooperriderBogie())
    assert found.speed == pytest.approx(68.644, rel=1e-3)
    assert found.frequency == pytest.approx(3.998, rel=1e-3)
    # a demo at bifurcation.de prints 68.66 of this bogie, as mph although it is the number in m/s
    assert found.speed == pytest.approx(68.66, rel=1e-3)


@pytest.mark.parametrize(
    ("model", "speed"),
    [
        (railenv.Bogie(railenv.HIGH_SPEED_COACH), 90.13),
        (on_a_line(railenv.HIGH_SPEED_COACH), 95.66),
        (railenv.Bogie(railenv.TABLE_1), 11.75),
        (railenv.DualWheelset(railenv.TABLE_1), 34.48),
    ],
    ids=["coach", "coach_on_a_line", "table_1_bogie", "table_1_dual_wheelset"],
)
def test_critical_speed_at_the_papers_radius_of_6250_m(model, speed):
    found = design.critical_speed(model, radius=6250.0, cant=CANT)
    # no independent figures: what was computed when contact and geometry became consistent
    assert found.speed == pytest.approx(speed, abs=0.01)


def test_critical_speed_of_the_coach_falls_steadily_with_the_radius():
    radii = [10_000, 6250, 4000, 2500, 1500, 1000]
    model = on_a_line(railenv.HIGH_SPEED_COACH)
    sweep = design.curve_sweep(model, radii, cant=CANT)
    assert (np.diff(sweep.speed) < 0).all()
    assert sweep.speed[0] < design.critical_speed(model).speed


def test_coach_turned_by_a_tight_curve_runs_on_its_flange_and_does_not_hunt():
    """Down to 2500 m it hunts earlier than without the turn; below, the flange holds it."""
    radii = [10_000, 6250, 4000, 3000, 2000, 1000]
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    sweep = design.curve_sweep(model, radii, cant=CANT)
    straight = design.curve_sweep(on_a_line(railenv.HIGH_SPEED_COACH), radii[:4], cant=CANT)
    assert (np.diff(sweep.speed[:4]) < 0).all()
    assert (sweep.speed[:4] < straight.speed).all()
    for radius in radii[4:]:
        found = design.critical_speed(model, radius=radius, cant=CANT)
        assert found.loss == "end"
        assert found.speed > 150.0
        slow = railenv.find_equilibrium(model, speed=40.0, radius=radius, cant=CANT)
        assert slow.state[0] > model.vehicle.flange_clearance


def test_critical_speed_of_table_1_hardly_depends_on_the_radius():
    radii = [10_000, 6250, 4000, 2500, 1500, 1000]
    for model in (railenv.Bogie(railenv.TABLE_1), railenv.DualWheelset(railenv.TABLE_1)):
        sweep = design.curve_sweep(model, radii, cant=CANT)
        assert np.ptp(sweep.speed) < 0.03 * sweep.speed.mean()
    bogies = design.curve_sweep(railenv.Bogie(railenv.TABLE_1), radii, cant=CANT)
    assert bogies.speed[-1] > bogies.speed[0]  # it even rises a little


def test_tread_equilibrium_of_the_coach_at_1000_m_ends_in_a_fold_near_49_m_per_s():
    model = on_a_line(railenv.HIGH_SPEED_COACH)
    found = design.critical_speed(model, radius=1000.0, cant=CANT)
    assert found.loss == "fold"
    assert found.speed == pytest.approx(48.6, abs=0.1)
    assert found.frequency is None
    # at a fold a real eigenvalue is zero
    assert abs(found.eigenvalue) < 1e-3
    # on the tread: both wheelsets clear of the flange
    clearance = model.vehicle.flange_clearance
    assert max(abs(found.state[0]), abs(found.state[4])) < clearance
    # no equilibrium near it beyond the fold
    with pytest.raises(EquilibriumError, match="fold"):
        railenv.find_equilibrium(model, speed=found.speed * 1.001, radius=1000.0, cant=CANT)
    railenv.find_equilibrium(model, speed=found.speed * 0.999, radius=1000.0, cant=CANT)


@pytest.mark.parametrize("vehicle", [railenv.TABLE_1, railenv.HIGH_SPEED_COACH], ids=lambda v: v.name)
def test_equilibrium_on_a_tight_curve_ends_where_a_wheel_lifts(vehicle):
    model = railenv.Bogie(vehicle)
    found = design.critical_speed(model, radius=250.0, cant=CANT)
    assert found.loss == "end"
    wheels = model.wheels(found.state, speed=found.speed, curvature=1 / 250.0, cant=CANT)
    loads = [w.normal.magnitude for pair in wheels for w in pair]
    static = 0.5 * 115.8e3 / 2
    assert 0 <= min(loads) < 1e-4 * static
    assert "wheel lifts" in str(found)


def test_curve_of_the_other_hand_has_the_same_critical_speed():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    right = design.critical_speed(model, radius=2500.0, cant=CANT)
    left = design.critical_speed(model, radius=-2500.0, cant=-CANT)
    assert left.speed == pytest.approx(right.speed, rel=1e-8)


def test_critical_speed_is_exact_to_1e_6_where_the_answer_is_known():
    # growth rate (V - 50)/100: hunting from 50 m/s exactly, at 2 rad/s
    model = railenv.Model("oscillator", ["q", "r"], [], _oscillator, {"critical": 50.0, "omega": 2.0})
    found = design.critical_speed(model)
    assert found.loss == "hunting"
    assert found.speed == pytest.approx(50.0, rel=1e-7)
    assert found.frequency == pytest.approx(1.0 / math.pi, rel=1e-6)
    assert found.wavelength == pytest.approx(50.0 * math.pi, rel=1e-6)


def test_growth_rate_of_the_plant_changes_sign_at_the_critical_speed():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    critical = design.critical_speed(model).speed
    for factor, sign in ((1 - 1e-6, -1), (1 + 1e-6, +1)):
        system = design.linearize(model, speed=factor * critical)
        assert np.sign(system.poles().real.max()) == sign


def test_double_eigenvalues_of_the_dual_wheelset_are_counted():
    found = design.critical_speed(railenv.DualWheelset(railenv.TABLE_1))
    assert found.multiplicity == 2
    assert design.critical_speed(railenv.Bogie(railenv.TABLE_1)).multiplicity == 1


def test_critical_eigenvalue_and_mode_belong_to_the_linear_model():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    found = design.critical_speed(model)
    A, _ = model.jacobian(found.state, speed=found.speed)
    np.testing.assert_allclose(A @ found.mode, found.eigenvalue * found.mode, atol=1e-7)
    assert found.eigenvalue.real == pytest.approx(0.0, abs=1e-6)
    assert found.eigenvalue.imag == pytest.approx(2 * math.pi * found.frequency)
    assert np.abs(found.mode[:12]).max() == pytest.approx(1.0)


def test_divergence_is_told_from_hunting():
    # real eigenvalue (V - 50)/100, the equilibrium stays at the origin
    model = railenv.Model("diverging", ["q"], [], _diverging, {"critical": 50.0})
    found = design.critical_speed(model)
    assert found.loss == "divergence"
    assert found.speed == pytest.approx(50.0, rel=1e-7)
    assert found.frequency is None


def test_fold_is_told_from_divergence():
    # q^2 = (50 - V)/50: two equilibria meet at 50 m/s and there is none beyond
    model = railenv.Model("folding", ["q"], [], _folding, {"critical": 50.0}, guess=-1.0)
    found = design.critical_speed(model)
    assert found.loss == "fold"
    assert found.speed == pytest.approx(50.0, rel=1e-6)


def test_instability_between_the_steps_of_the_search_is_found():
    # growth rate 0.001 - ((V - 90)/100)^2: unstable only from 86.84 to 93.16 m/s
    model = railenv.Model("island", ["q", "r"], [], _island, {"centre": 90.0})
    found = design.critical_speed(model)
    assert found.loss == "hunting"
    assert found.speed == pytest.approx(90.0 - 100.0 * math.sqrt(0.001), rel=1e-6)


def test_model_unstable_from_the_start_of_the_range_is_reported_as_such():
    found = design.critical_speed(railenv.Bogie(railenv.HIGH_SPEED_COACH), speed_range=(130.0, 200.0))
    assert found.loss == "unstable at start"
    assert found.speed is None
    assert found.frequency == pytest.approx(3.3, abs=0.2)
    assert "unstable already at 130 m/s" in str(found)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"speed_range": (100.0, 50.0)}, "lowest must not exceed the highest"),
        ({"speed_range": (0.0, 50.0)}, "lowest of speed_range is 0 m/s"),
        ({"speed_range": (math.nan, 50.0)}, "lowest of speed_range is nan"),
        ({"radius": 0.0}, "radius is 0 m"),
        ({"radius": math.nan}, "radius is nan"),
        ({"cant": 3.0}, "cant is 3 rad"),
        ({"inputs": [0.0]}, "inputs has shape"),
    ],
)
def test_bad_arguments_name_quantity_and_value(arguments, message):
    with pytest.raises(ParameterError, match=message):
        design.critical_speed(railenv.Bogie(railenv.HIGH_SPEED_COACH), **arguments)


def test_summary_is_plain_and_complete():
    import json

    found = design.critical_speed(railenv.Bogie(railenv.HIGH_SPEED_COACH), radius=3000.0, cant=CANT)
    data = json.loads(json.dumps(found.summary(), allow_nan=False))
    assert data["loss"] == "hunting"
    assert data["equilibrium"]["y_w1"] == found.state[0]


def test_mode_plot_names_every_displacement():
    drawn = design.critical_speed(railenv.Bogie(railenv.HIGH_SPEED_COACH)).plot()
    labels = [tick.get_text() for tick in drawn.axes[0, 0].get_xticklabels()]
    assert labels == list(railenv.Bogie(railenv.HIGH_SPEED_COACH).state_names[:12])


def _oscillator(x, u, speed, curvature, cant, p):
    q, r = x
    growth = (speed - p.critical) / 100.0
    return [growth * q - p.omega * r, p.omega * q + growth * r]


def _diverging(x, u, speed, curvature, cant, p):
    return [(speed - p.critical) / 100.0 * x[0]]


def _folding(x, u, speed, curvature, cant, p):
    return [x[0] * x[0] - (p.critical - speed) / p.critical]


def _island(x, u, speed, curvature, cant, p):
    q, r = x
    away = (speed - p.centre) / 100.0
    growth = 0.001 - away * away
    return [growth * q - 5.0 * r, 5.0 * q + growth * r]
