"""The print's equations, written out a second time, and the search over their readings."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import design
import railenv
from benchmarks.readings.axes import AXES, MODELS, Reading, model_of, readings, template
from benchmarks.readings.contact import Place, corrected, printed
from benchmarks.readings.equations import parameters
from benchmarks.readings.judged import by_eigenvalues, by_simulation
from benchmarks.readings.letter import AS_PRINTED, to_the_letter
from benchmarks.readings.run import bracket
from design.reproduction import paper
from design.reproduction.readings import UNITS, results

STEP = 1e-30
NOMINAL = Reading((0,) * len(AXES))
PACKAGE = {"bogie": railenv.Bogie, "dual_wheelset": railenv.DualWheelset}


def rates(model, x, speed, curvature, cant):
    p = SimpleNamespace(**model.parameters)
    return np.array(model.equations(list(x), [0.0], speed, curvature, cant, p))


@pytest.mark.parametrize("kind", MODELS)
def test_corrected_reading_is_the_packages_model(kind):
    model, package = model_of(NOMINAL, kind), PACKAGE[kind](railenv.TABLE_1)
    assert model.state_names == package.state_names
    rng = np.random.default_rng(0)
    z = np.array([name.startswith("z_") for name in model.state_names])
    for _ in range(10):
        x = 2e-3 * rng.normal(size=model.n_states) - 3e-3 * z
        found = rates(model, x, 40.0, 1.6e-4, 0.0873)
        expected = package.rhs(x, speed=40.0, curvature=1.6e-4, cant=0.0873)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-7)


@pytest.mark.parametrize("kind", MODELS)
def test_corrected_reading_has_the_packages_eigenvalues(kind):
    model, package = model_of(NOMINAL, kind), PACKAGE[kind](railenv.TABLE_1)
    state = railenv.find_equilibrium(package, speed=30.0, radius=6250.0, cant=0.0873).state
    columns = [
        rates(model, state + 1j * STEP * row, 30.0, 1.0 / 6250.0, 0.0873).imag / STEP
        for row in np.eye(model.n_states)
    ]
    found = np.sort_complex(np.linalg.eigvals(np.array(columns).T))
    expected = np.linalg.eigvals(package.jacobian(state, speed=30.0, curvature=1.6e-4, cant=0.0873)[0])
    assert found == pytest.approx(np.sort_complex(expected), rel=1e-9, abs=1e-7)


def test_every_option_makes_other_equations():
    x = 1e-3 * np.random.default_rng(1).normal(size=24) - 3e-3 * np.tile([0.0, 1.0, 0.0, 0.0], 6)
    for i, axis in enumerate(AXES):
        found = []
        for j in range(len(axis.options)):
            reading = Reading(tuple(j if k == i else 0 for k in range(len(AXES))))
            model = model_of(reading, "bogie")
            found.append(rates(model, x, 40.0, 1.6e-4, 0.0873 * reading.cant))
        for j in range(len(found)):
            for k in range(j):
                assert np.abs(found[j] - found[k]).max() > 1e-4, (axis.name, j, k)


def test_only_the_printed_levers_break_action_and_reaction():
    """Forces between wheelsets and frame: none is left over unless a misprint is switched on."""
    x = 1e-3 * np.random.default_rng(2).normal(size=24)
    masses = np.repeat([parameters()["wheelset_mass"], parameters()["frame_mass"]], [2, 1])
    names = [axis.name for axis in AXES]

    def left_over(*switched):
        reading = Reading(tuple(int(name in switched) for name in names))
        model = model_of(reading, "bogie")
        free = dict.fromkeys(("vertical_rail_stiffness", "lateral_rail_stiffness", "f11", "f12"), 0.0)
        model = model.replace(**free, f22=0.0, f33=0.0, friction=1.0)
        acceleration = rates(model, x, 40.0, 0.0, 0.0)[12:]
        return float(masses @ acceleration[[0, 4, 8]])

    assert abs(left_over()) < 1e-6
    for misprint in ("lever", "height", "leading damper"):
        assert abs(left_over(misprint)) > 1e-3


def test_printed_contact_by_hand():
    p = SimpleNamespace(**parameters())
    rest = dict.fromkeys(("dy", "dz", "dphi", "dpsi"), 0.0)
    middle = printed(Place(0.0, -1e-3, 0.0, 0.0, **rest), 40.0, 0.0, p)
    spin = p.conicity / p.wheel_radius
    across = p.f12 * spin  # of the left wheel; the right one has the opposite
    assert middle.z == pytest.approx(2e-3 * p.vertical_rail_stiffness + 2.0 * across * p.conicity)
    assert (middle.y, middle.yaw) == pytest.approx((0.0, 0.0), abs=1e-9)
    # eq 5: the flange spring pulls within the clearance, and pushes beyond it
    for beyond, sign in ((-2e-5, 1.0), (1e-3, -1.0)):
        at = Place(p.flange_clearance + beyond, -5e-3, 0.0, 0.0, **rest)
        soft = SimpleNamespace(**{**vars(p), "lateral_rail_stiffness": 0.0})
        push = printed(at, 40.0, 0.0, p).y - printed(at, 40.0, 0.0, soft).y
        assert push * sign > 0.0
        share = math.tanh(1e4 * beyond) / 2.0 + 0.5
        assert push == pytest.approx(-p.lateral_rail_stiffness * beyond * share)


@pytest.mark.parametrize("contact", [corrected, printed])
def test_no_contact_gives_more_than_the_friction(contact):
    p = SimpleNamespace(**{**parameters(), "conicity": 1e-9})
    sliding = Place(0.0, -1e-3, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0)
    found = contact(sliding, 40.0, 0.0, p)
    load = 2e-3 * p.vertical_rail_stiffness
    assert found.y == pytest.approx(-p.friction * load, rel=1e-3)


def test_both_judges_tell_rest_from_hunting():
    """On an oscillator that hunts from 100 m/s on, with an amplitude of 4 sqrt(V - 100) mm."""

    def oscillator(x, u, speed, curvature, cant, p):
        y, dy = x
        energy = y * y + dy * dy / (p.rate * p.rate)
        return [dy, -p.rate * p.rate * y + (speed - 100.0 - energy / 16e-6) * dy + curvature]

    names = {"rate": 20.0, "flange_clearance": 0.01}
    model = railenv.Model("oscillator", ["y_w1", "dy_w1"], ["unused"], oscillator, names, 1e-3)
    faster = model.replace(rate=25.0)
    for judge in (by_eigenvalues, by_simulation):
        for speed, hunting in ((95.0, False), (105.0, True)):
            steady, hunts = judge([model, faster], speed, 1.0, [0.0, 0.0])
            assert steady.tolist() == [not hunting] * 2
            assert hunts.tolist() == [hunting] * 2


def test_lost_motions_neither_rest_nor_hunt():
    def runaway(x, u, speed, curvature, cant, p):
        y, dy = x
        return [dy, 9.0 * y + curvature]

    model = railenv.Model("runaway", ["y_w1", "dy_w1"], ["unused"], runaway, {"flange_clearance": 0.01})
    for judge in (by_eigenvalues, by_simulation):
        assert not np.any(judge([model], 50.0, 1e-3, [0.0]))


def test_brackets_are_judged_once_for_readings_that_a_model_cannot_tell_apart():
    asked = []

    def judge(models, speed, curvature, cant):
        asked.append(len(models))
        return np.ones(len(models), bool), np.array([m.parameters["damper_sign"] > 0 for m in models])

    chosen = [r for r in readings() if r.choices[:6] == (0,) * 6 and r.contact == "corrected"]
    meets = bracket(judge, chosen, "dual_wheelset", 1.0)
    assert len(chosen) == 2 * 2 * 2 * 3 * 3
    assert asked == [len(chosen) // 2, len(chosen) // 2]  # the dual wheelset's frame is at rest
    assert meets.tolist() == [r.parameters("bogie")["damper_sign"] > 0.0 for r in chosen]


def test_stored_counts_belong_to_the_axes():
    found, every = results(), readings()
    assert found["axes"] == {a.words: [o.words for o in a.options] for a in AXES}
    assert math.prod(len(a.options) for a in AXES) == len(every) == len(set(every))
    for model in MODELS:
        assert found["different"][model] == len({r.key(model) for r in every})
    for search in found["searches"].values():
        assert search["readings"] == len(every)
        for unit in UNITS:
            counts = search[unit]
            assert 0 <= counts["both"] <= min(counts[model] for model in MODELS) <= len(every)
    assert set(AS_PRINTED) == {a.name for a in AXES}
    assert to_the_letter().contact == "printed"


@pytest.mark.slow
@pytest.mark.parametrize("kind", MODELS)
def test_print_corrected_hunts_where_the_package_says(kind):
    hopf = design.critical_speed(PACKAGE[kind](railenv.TABLE_1), radius=paper.RADIUS, cant=paper.CANT)
    for judge in (by_eigenvalues, by_simulation):
        for factor, hunting in ((0.9, False), (1.1, True)):
            model = template(kind, "corrected")
            steady, hunts = judge([model], factor * hopf.speed, 1.0 / paper.RADIUS, [paper.CANT])
            assert (steady[0], hunts[0]) == (not hunting, hunting)
