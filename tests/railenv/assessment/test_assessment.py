"""Assessments of runs whose forces and accelerations are known from elsewhere."""

import dataclasses
import math

import control
import numpy as np
import pytest

import design
import railenv
from railenv.assessment import Limits
from railenv.assessment.readings import Readings
from railenv.errors import ParameterError, SimulationError, UnknownNameError

VEHICLE = railenv.HIGH_SPEED_COACH
COACH, BOGIE = railenv.Coach(VEHICLE), railenv.Bogie(VEHICLE)
MASS = 4 * VEHICLE.wheelset_mass + 2 * VEHICLE.frame_mass + VEHICLE.body_mass
Q0 = MASS * VEHICLE.gravity / 8
CURVE = {"speed": 40.0, "radius": 1000.0, "cant": 0.08}


@pytest.fixture(scope="module")
def curve():
    """The coach in a steady curve, from its equilibrium."""
    return railenv.assess(COACH, railenv.simulate(COACH, duration=6.0, **CURVE))


@pytest.fixture(scope="module")
def rough():
    """The coach through a transition into a curve, on irregular track."""
    track = railenv.Track.into_curve(radius=1500.0, cant=0.07, straight=50.0, transition=100.0)
    return railenv.simulate(COACH, speed=45.0, track=track, duration=10.0, irregularity="low")


@pytest.fixture(scope="module")
def bogie_run():
    return railenv.simulate(BOGIE, speed=60.0, duration=6.0, irregularity="low")


def histories(assessment, name):
    return {h.where: h.value for h in assessment.histories if h.name == name}


# ------------------------------------------------------------------------ forces


def test_guiding_forces_of_a_curve_carry_what_the_cant_does_not(curve):
    uncompensated = CURVE["speed"] ** 2 / CURVE["radius"] - VEHICLE.gravity * CURVE["cant"]
    total = sum(np.median(v) for v in histories(curve, "sum of guiding forces").values())
    assert total == pytest.approx(MASS * uncompensated, rel=0.01)
    steady = curve.of("quasi-static body lateral acceleration")
    assert all(q.value > abs(uncompensated) for q in steady)  # the body rolls outwards
    assert curve.worst("sum of guiding forces").value < MASS * uncompensated


def test_wheel_loads_of_a_curve_carry_the_weight(curve):
    weight = MASS * (VEHICLE.gravity + CURVE["speed"] ** 2 / CURVE["radius"] * CURVE["cant"])
    loads = histories(curve, "wheel load")
    assert len(loads) == 8
    assert sum(np.median(v) for v in loads.values()) == pytest.approx(weight, rel=0.01)
    outer = curve.of("quasi-static wheel load")
    assert [q.where for q in outer] == ["w1 left", "w2 left", "w3 left", "w4 left"]
    for q in outer:
        assert q.value == pytest.approx(np.median(loads[q.where]), rel=1e-9)
        assert q.value > Q0
    inner = loads["w1 right"]
    unloading = {q.where: q.value for q in curve.of("wheel unloading")}
    assert unloading["w1 right"] == pytest.approx(1.0 - inner.min() / Q0, abs=0.01)


def test_the_other_hand_reads_the_same_on_the_other_wheels(curve):
    mirrored = {"speed": 40.0, "radius": -1000.0, "cant": -0.08}
    other = railenv.assess(COACH, railenv.simulate(COACH, duration=6.0, **mirrored))
    for name in ("sum of guiding forces", "quasi-static guiding force", "quasi-static wheel load"):
        for a, b in zip(curve.of(name), other.of(name), strict=True):
            assert a.value == pytest.approx(b.value, rel=1e-6)
            assert b.where == a.where.replace("left", "right")


def test_limits_are_those_of_the_static_wheel_load(curve):
    assert curve.of("sum of guiding forces")[0].limit == pytest.approx(10e3 + 2.0 * Q0 / 3.0, rel=1e-6)
    assert curve.of("wheel load")[0].limit == pytest.approx(90e3 + Q0, rel=1e-6)
    assert curve.of("quasi-static guiding force")[0].limit == 60e3
    bogie = VEHICLE.frame_mass + 2 * VEHICLE.wheelset_mass
    assert curve.of("frame acceleration")[0].limit == pytest.approx(12.0 - bogie / 5e3)
    assert curve.of("frame acceleration, instability")[0].limit == pytest.approx(6.0 - bogie / 1e4)


def test_y_over_q_of_a_steady_curve_is_the_ratio_of_the_forces(curve):
    readings = Readings(COACH, railenv.simulate(COACH, duration=0.1, **CURVE))
    for i, w in enumerate(("w1", "w2", "w3", "w4")):
        for k, side in enumerate(("left", "right")):
            expected = readings.Y[i, k, -1] / readings.Q[i, k, -1]
            np.testing.assert_allclose(histories(curve, "Y/Q")[f"{w} {side}"], expected, rtol=1e-6)


def test_hunting_is_read_at_its_own_frequency():
    speed = 119.0
    poles = design.linearize(BOGIE, speed=speed).poles()
    hunting = poles[np.argmax(poles.real)]
    response = railenv.simulate(BOGIE, speed=speed, perturbation={"y_w1": 1e-5}, duration=6.0)
    found = railenv.assess(BOGIE, response)
    assert found.hunting_frequency == pytest.approx(abs(hunting.imag) / (2.0 * math.pi), rel=0.03)
    total = histories(found, "sum of guiding forces")["w1"]
    half = total[len(total) // 2 :]
    growing = found.of("sum of guiding forces, instability")[0].value
    assert half.std() < growing < np.abs(half).max()  # the largest rms is that of the last 100 m
    other = railenv.assess(BOGIE, response, hunting_frequency=8.0)
    assert other.of("sum of guiding forces, instability")[0].value < 0.2 * growing


# ----------------------------------------------------------------- accelerations


def test_accelerations_are_second_derivatives_of_the_places(rough):
    readings = Readings(COACH, rough)
    x = dict(zip(rough.state_labels, rough.states, strict=True))
    track = [i for i, name in enumerate(rough.input_labels) if name.startswith("curvature")]
    t, tangent = rough.time, (np.asarray(rough.inputs)[track] == 0.0).all(axis=0)
    assert tangent.sum() > 150
    inside = tangent & (t > 0.5)
    inside[np.flatnonzero(inside)[-5:]] = False
    for place in (*readings.on_bodies(0.3), *readings.on_frames()):
        b = place.body
        across = x[f"y_{b}"] + place.x * x[f"psi_{b}"] - place.z * x[f"phi_{b}"]
        up = x[f"z_{b}"] - place.x * x[f"theta_{b}"]
        sideways = np.gradient(np.gradient(across, t), t) + VEHICLE.gravity * x[f"phi_{b}"]
        for reading, expected in (
            (readings.lateral(place), sideways),
            (readings.vertical(place), np.gradient(np.gradient(up, t), t)),
        ):
            error = np.abs(reading - expected)[inside].max()
            assert error < 0.08 * np.abs(reading[inside]).max()


def test_places_are_above_axle_boxes_pivots_and_in_the_middle(rough):
    readings = Readings(COACH, rough)
    half = VEHICLE.half_wheelbase
    assert [(p.where, round(p.x, 9)) for p in readings.on_frames()] == [
        ("b1 above w1", half),
        ("b1 above w2", -half),
        ("b2 above w3", half),
        ("b2 above w4", -half),
    ]
    pivots = VEHICLE.half_pivot_distance
    on_floor = readings.on_bodies(0.8)
    assert [(p.where, p.x) for p in on_floor] == [
        ("body above b1", pivots),
        ("body above b2", -pivots),
        ("body in the middle", 0.0),
    ]
    assert all(p.z == pytest.approx(0.8 - VEHICLE.body_height) for p in on_floor)
    assert [p.z for p in readings.on_bodies(None)] == [0.0] * 3


def test_whole_vehicle_has_ride_and_comfort(rough):
    found = railenv.assess(COACH, rough, comfort=True, section=(150.0, 450.0))
    names = {q.name for q in found.quantities}
    assert {"Wz, lateral", "Wz, vertical", "comfort, lateral", "comfort, vertical"} <= names
    assert "mean comfort N_MV" not in names
    assert any("N_MV: it needs 300 s, the section has 6.67 s" in note for note in found.notes)
    rms, peak = (found.worst(f"body vertical acceleration{what}").value for what in (", rms", ""))
    assert rms < peak < 6.0 * rms
    readings = Readings(COACH, rough)
    own = np.abs(readings.vertical(readings.on_bodies(None)[0]))
    assert 0.3 * own.max() < found.of("body vertical acceleration")[0].value < 1.5 * own.max()


# --------------------------------------------------------------- what is told


def test_statistics_are_those_of_the_section(rough):
    whole, curve = (railenv.assess(COACH, rough, section=s) for s in (None, (200.0, 450.0)))
    assert whole.section == pytest.approx((0.0, 450.0))
    assert curve.radius == pytest.approx(1500.0)
    inside = {h.where: h for h in curve.histories if h.name == "sum of guiding forces"}["w2"]
    assert inside.distance[0] > 200.7  # a mean reaches 1 m to both sides
    assert inside.distance[-1] < 449.3
    all_along = {h.where: h for h in whole.histories if h.name == "sum of guiding forces"}["w2"]
    part = np.interp(inside.distance, all_along.distance, all_along.value)
    np.testing.assert_allclose(inside.value, part, atol=0.02 * np.abs(part).max())


def test_exceeded_limits_are_told_by_quantity_and_place(bogie_run):
    strict = Limits(y_over_q=0.01)
    found = railenv.assess(BOGIE, bogie_run, limits=strict)
    assert found.passed is False
    assert {q.name for q in found.exceeded} == {"Y/Q"}
    worst = found.worst("Y/Q")
    assert worst.share == pytest.approx(worst.value / 0.01)
    assert f"LIMITS EXCEEDED: Y/Q {worst.share:.0%} at {worst.where}" in found.table()
    assert "EXCEEDED" in found.to_markdown()
    usual = railenv.assess(BOGIE, bogie_run)
    assert usual.passed is True
    assert "all values are within their limits" in str(usual)
    assert usual.exceeded == ()


def test_table_has_the_worst_place_of_each_quantity_or_all(bogie_run):
    found = railenv.assess(BOGIE, bogie_run)
    names = list(dict.fromkeys(q.name for q in found.quantities))
    rows = [line for line in found.table().splitlines() if line.startswith(tuple(names))]
    assert len(rows) == len(names)
    every = found.table(every=True).splitlines()
    assert sum(line.startswith(tuple(names)) for line in every) == len(found.quantities)
    q = found.worst("sum of guiding forces")
    row = next(line for line in rows if line.startswith("sum of guiding forces  "))
    assert f"{q.value / 1e3:.1f} kN" in row
    assert f"{q.limit / 1e3:.1f} kN" in row
    cells = [line.split("|") for line in found.to_markdown().splitlines() if line.startswith("|")]
    assert len(cells) == len(names) + 2
    assert {len(c) for c in cells} == {10}


def test_models_without_bodies_say_what_they_lack(bogie_run):
    notes = railenv.assess(BOGIE, bogie_run).notes
    assert any("no body accelerations and no ride: bogie has no body" in n for n in notes)
    assert any("no quasi-static values" in n for n in notes)
    dual = railenv.DualWheelset(railenv.TABLE_1)
    response = railenv.simulate(dual, speed=25.0, duration=5.0, irregularity="low")
    found = railenv.assess(dual, response)
    assert found.passed is not None
    assert len(found.of("wheel load")) == 4
    assert "left out: no frame accelerations: dual_wheelset has no frame that moves" in found.table()


def test_equations_of_ones_own_are_read_as_far_as_they_tell():
    model = railenv.CooperriderBogie()
    response = railenv.simulate(model, speed=40.0, perturbation={"y_w1": 1e-3}, duration=6.0)
    found = railenv.assess(model, response)
    assert {q.name for q in found.quantities} == {
        "frame acceleration",
        "frame acceleration, instability",
    }
    assert found.passed is None
    assert "no value has a limit, so none is judged" in found.table()
    assert any("no forces of wheels" in n for n in found.notes)


def test_equipped_model_is_assessed_like_its_plant(bogie_run):
    equipped = railenv.Equipped(BOGIE)  # its actuators are told to do nothing
    response = railenv.simulate(equipped, speed=60.0, duration=6.0, irregularity="low")
    found, plain = railenv.assess(equipped, response), railenv.assess(BOGIE, bogie_run)
    for a, b in zip(found.quantities, plain.quantities, strict=True):
        assert (a.name, a.where, a.limit) == (b.name, b.where, b.limit)
        assert a.value == pytest.approx(b.value, rel=1e-3)


def test_nadals_limit_stands_beside_y_over_q_where_there_is_a_flange():
    model = railenv.Bogie(railenv.HIGH_SPEED_COACH_S1002)
    response = railenv.simulate(model, speed=20.0, duration=5.0)
    found = railenv.assess(model, response, limits=Limits(y_over_q=10.0))
    angle, mu = model.guided[0].laws[0].flange_angle, model.guided[0].friction
    q = found.of("Y/Q beside Nadal's limit")[0]
    assert q.limit == pytest.approx(math.tan(angle - math.atan(mu)))
    assert q.group == "information"
    over = dataclasses.replace(q, value=2.0 * q.limit)
    assert over.passed is False
    assert dataclasses.replace(found, quantities=(over,)).exceeded == ()


def test_plot_has_a_panel_of_each_history_and_the_limits_that_are_near(bogie_run):
    from matplotlib.figure import Figure

    found = railenv.assess(BOGIE, bogie_run, limits=Limits(y_over_q=0.1))
    figure = found.plot()
    assert isinstance(figure, Figure)
    panels = [ax for ax in figure.axes if ax.get_visible()]
    assert [ax.get_title(loc="left").split(",")[0] for ax in panels] == [
        "sum of guiding forces",
        "Y/Q",
        "wheel load",
        "frame acceleration",
    ]
    flat = [line for line in panels[1].get_lines() if set(line.get_ydata()) == {0.1}]
    assert len(flat) == 1
    assert len(panels[0].get_lines()) == 2  # its limit is far off


# ----------------------------------------------------------------------- refused


def test_motion_that_left_the_track_is_refused():
    common = {"speed": 60.0, "duration": 6.0}
    thrown = railenv.simulate(BOGIE, perturbation={"y_w1": 0.05}, **common)
    with pytest.raises(ParameterError, match=r"w1 is 50 mm off the middle .* nothing to assess"):
        railenv.assess(BOGIE, thrown)
    with pytest.raises(SimulationError) as found:
        railenv.simulate(BOGIE, perturbation={"y_w1": 1e-3}, step=0.05, output_step=0.05, **common)
    with pytest.raises(ParameterError, match="diverged"):
        railenv.assess(BOGIE, found.value.response)


def test_too_little_to_assess_is_refused(bogie_run):
    with pytest.raises(ParameterError, match=r"is 50 m long; at 60 m/s it must be at least 300 m"):
        railenv.assess(BOGIE, bogie_run, section=(100.0, 150.0))
    short = railenv.simulate(BOGIE, speed=10.0, duration=9.0)
    with pytest.raises(ParameterError, match=r"is 90 m long; at 10 m/s it must be at least 100 m"):
        railenv.assess(BOGIE, short)
    coarse = railenv.simulate(BOGIE, speed=60.0, duration=6.0, output_step=0.02)
    with pytest.raises(ParameterError, match=r"output_step=0.01"):
        railenv.assess(BOGIE, coarse)


def test_what_does_not_belong_together_is_refused(bogie_run):
    with pytest.raises(ParameterError, match="response has not the states of coach"):
        railenv.assess(COACH, bogie_run)
    with pytest.raises(ParameterError, match="model is 'bogie'; it must be a"):
        railenv.assess("bogie", bogie_run)
    with pytest.raises(ParameterError, match=r"limits is 0\.8; it must be"):
        railenv.assess(BOGIE, bogie_run, limits=0.8)
    with pytest.raises(ParameterError, match="section ends at 500 m; the run ends at 360 m"):
        railenv.assess(BOGIE, bogie_run, section=(0.0, 500.0))
    with pytest.raises(ParameterError, match=r"hunting_frequency is 0\.1 Hz"):
        railenv.assess(BOGIE, bogie_run, hunting_frequency=0.1)
    with pytest.raises(UnknownNameError, match="quantity: 'Y over Q'"):
        railenv.assess(BOGIE, bogie_run).of("Y over Q")
    pendulum = railenv.Model("p", ["a", "b"], [], lambda x, u, v, k, c, p: [x[1], -x[0]], {})
    response = railenv.simulate(pendulum, speed=50.0, duration=6.0)
    with pytest.raises(ParameterError, match="p has no forces of wheels and no motion"):
        railenv.assess(pendulum, response)
    uneven = control.TimeResponseData(
        np.r_[bogie_run.time[:-1], bogie_run.time[-1] + 0.01],
        bogie_run.outputs,
        bogie_run.states,
        bogie_run.inputs,
        issiso=False,
        state_labels=list(bogie_run.state_labels),
        input_labels=list(bogie_run.input_labels),
    )
    with pytest.raises(ParameterError, match="not at equal intervals"):
        railenv.assess(BOGIE, uneven)
