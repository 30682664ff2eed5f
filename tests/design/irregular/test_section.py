"""Poincare sections and their diagrams where the answer is known."""

import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

import design
from railenv.errors import ParameterError, SimulationError, UnknownNameError
from tests.design.cycles import exact
from tests.design.irregular.known import LORENZ, LORENZ_START, ROSSLER, ROSSLER_START


def test_a_cycle_is_one_point_of_its_amplitude():
    model = exact.hopf_normal_form(l1=-1.0)
    found = design.poincare_section(model, speed=exact.MU + 0.49, duration=30.0, settle=40.0)
    np.testing.assert_allclose(found.values(), 0.7, rtol=1e-6)
    np.testing.assert_allclose(found.values("y"), 0.0, atol=0.7 * 0.49)
    np.testing.assert_allclose(np.diff(found.time), np.pi, rtol=1e-6)  # omega is 2
    assert found.period == 1
    assert found.kind == "period 1"


@pytest.mark.parametrize(("direction", "sign"), [("up", -1.0), ("down", 1.0)])
def test_a_value_is_passed_in_the_direction_asked_for(direction, sign):
    model = exact.hopf_normal_form(l1=-1.0)  # x' = -2 y on the cycle: upwards where y is negative
    found = design.poincare_section(
        model, speed=exact.MU + 1.0, at=0.6, direction=direction, duration=30.0
    )
    np.testing.assert_allclose(found.values(), 0.6, atol=1e-12)
    np.testing.assert_allclose(found.values("y"), sign * 0.8, rtol=1e-5)
    assert len(found) == pytest.approx(30.0 / np.pi, abs=1.0)


def test_no_point_is_missed_or_counted_twice_where_chunks_meet(monkeypatch):
    model = exact.hopf_normal_form(l1=-1.0)
    kinds = [{"at": "maximum"}, {"at": "minimum"}, {"at": 0.1}]
    common = {"speed": exact.MU + 1.0, "duration": 40.0, "step": 0.02}
    whole = [design.poincare_section(model, **common, **kind) for kind in kinds]
    monkeypatch.setattr(sys.modules["design.irregular.section"], "_CHUNK", 7)
    for kind, expected in zip(kinds, whole, strict=True):
        found = design.poincare_section(model, **common, **kind)
        np.testing.assert_allclose(found.time, expected.time, atol=1e-12)
        np.testing.assert_allclose(found.states, expected.states, atol=1e-12)
        assert len(found) in (12, 13)


def test_successive_maxima_of_the_lorenz_system_make_a_tent():
    found = design.poincare_section(
        LORENZ, speed=1.0, state="z", duration=600.0, perturbation=LORENZ_START, step=0.004
    )
    before, after = found.return_map()
    order = np.argsort(before)
    before, after = before[order], after[order]
    top = int(np.argmax(after))
    assert 38.0 < before[top] < 39.0  # E. N. Lorenz, J. Atmos. Sci. 20 (1963), Fig. 4: 38.5
    assert np.mean(np.diff(after[:top]) > 0.0) > 0.98
    assert np.mean(np.diff(after[top:]) < 0.0) > 0.98
    far = np.abs(before - before[top]) > 0.5
    slope = np.gradient(np.interp(grid := np.linspace(30.0, 45.0, 60), before[far], after[far]), grid)
    inside = (grid > before[0] + 0.5) & (grid < before[-1] - 0.5) & (np.abs(grid - before[top]) > 1.0)
    assert (np.abs(slope[inside]) > 1.0).all()  # no periodic motion of it is stable
    np.testing.assert_allclose(
        found.values("x") * found.values("y"), 8.0 / 3.0 * found.values(), rtol=1e-9
    )
    assert found.period is None


@pytest.mark.parametrize(("c", "period"), [(2.5, 1), (3.5, 2), (4.0, 4), (5.7, None)])
def test_periods_of_the_rossler_system_double(c, period):
    found = design.poincare_section(
        ROSSLER.replace(c=c), speed=1.0, duration=400.0, settle=800.0, perturbation=ROSSLER_START
    )
    assert found.period == period
    if period is not None:
        assert found.miss(period) < 1e-3
        assert found.miss(2 * period) < 1e-3
        assert period == 1 or found.miss(period // 2) > 0.01


@pytest.fixture(scope="module")
def cascade():
    return design.section_diagram(
        ROSSLER,
        [2.5, 3.5, 4.0, 5.0, 5.7],
        parameter="c",
        speed=1.0,
        perturbation=ROSSLER_START,
        duration=300.0,
        settle=600.0,
        step=0.03,
        exponents=2,
        exponents_over=1000.0,
    )


def test_diagram_of_the_rossler_system(cascade):
    kinds = ["period 1", "period 2", "period 4", "chaotic", "chaotic"]
    for sweep in ("up", "down"):
        assert [p.kind for p in cascade.of(sweep)] == kinds
        assert [p.value for p in cascade.of(sweep)] == [2.5, 3.5, 4.0, 5.0, 5.7]
    assert cascade.ranges("up")[-1] == ("chaotic", 5.0, 5.7)
    assert cascade.ended == ()
    largest = [p.lyapunov.largest for p in cascade.of("up")]
    assert largest[-1] == pytest.approx(0.0714, abs=0.02)
    np.testing.assert_allclose(largest[:3], 0.0, atol=5e-3)
    assert "chaotic 5 to 5.7" in str(cascade)
    assert len(cascade.summary()["points"]) == 10


def test_sweeps_show_two_motions_between_a_fold_and_a_hopf_point():
    # r' = r (mu + r^2 - r^4): a large motion from mu = -1/4 on, rest up to 0
    model = exact.hopf_normal_form(l1=1.0, l2=-1.0)
    found = design.section_diagram(
        model, exact.MU + np.array([-0.3, -0.2, -0.1, 0.1]), perturbation={"x": 0.01}, settle=120.0
    )
    assert [p.section.moves for p in found.of("up")] == [False, False, False, True]
    assert [p.section.moves for p in found.of("down")] == [False, True, True, True]
    large = found.of("down")[1].section
    assert large.values()[-1] ** 2 == pytest.approx((1.0 + np.sqrt(0.2)) / 2.0, rel=1e-5)
    apart = design.section_diagram(
        model, [exact.MU - 0.1], perturbation={"x": 2.0}, settle=60.0, sweeps=("apart",)
    )
    assert apart.points[0].kind == "period 1"


def test_a_sweep_ends_where_the_motion_diverges_and_the_next_starts_below():
    model = exact.hopf_normal_form(l1=-1.0, l2=0.2)  # nothing holds it from mu = 1.25 on
    values = exact.MU + np.array([0.5, 1.0, 1.5, 2.0])
    found = design.section_diagram(model, values, perturbation={"x": 0.5})
    assert [p.value for p in found.of("up")] == [10.5, 11.0]
    assert [p.value for p in found.of("down")] == [10.5, 11.0]
    assert len(found.ended) == 1
    assert found.ended[0].startswith("up: nothing at 11.5; ")
    with pytest.raises(SimulationError):
        design.section_diagram(model, [12.0], perturbation={"x": 0.5})


def test_an_interrupted_diagram_keeps_its_motions(monkeypatch):
    module = sys.modules["design.irregular.section_diagram"]
    point = module._Plan.point

    def interrupted(self, sweep, value, start):
        if value == 12.0:
            raise KeyboardInterrupt
        return point(self, sweep, value, start)

    monkeypatch.setattr(module._Plan, "point", interrupted)
    model = exact.hopf_normal_form(l1=-1.0)
    found = design.section_diagram(model, [11.0, 12.0], duration=5.0, settle=5.0)
    assert [p.value for p in found.points] == [11.0]
    assert found.ended == ("interrupted after 1 of 4 motions",)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"state": "w"}, "unknown state"),
        ({"at": "top"}, "at is 'top'"),
        ({"direction": "left"}, "direction is 'left'"),
        ({"duration": -1.0}, "duration is -1"),
    ],
)
def test_bad_arguments_of_a_section_are_told(arguments, message):
    with pytest.raises((ParameterError, UnknownNameError), match=message):
        design.poincare_section(LORENZ, speed=1.0, **arguments)


@pytest.mark.parametrize(
    ("values", "arguments", "message"),
    [
        ([2.0, 1.0], {}, "increase"),
        ([1.0], {"sweeps": ()}, "sweeps is empty"),
        ([1.0], {"sweeps": ("left",)}, "sweep is 'left'"),
        ([1.0], {"parameter": "rho"}, "speed is None"),
        ([1.0], {"parameter": "tau"}, "unknown parameter"),
    ],
)
def test_bad_arguments_of_a_diagram_are_told(values, arguments, message):
    with pytest.raises((ParameterError, UnknownNameError), match=message):
        design.section_diagram(LORENZ, values, **arguments)


def test_a_coach_at_rest_has_no_section_and_a_hunting_one_shows_its_amplitude(coach):
    rest = design.poincare_section(coach, speed=80.0, settle=60.0, duration=5.0)
    assert rest.kind == "at rest"
    away = {"y_w1": 8e-3, "y_w2": 8e-3}
    found = design.poincare_section(coach, speed=105.0, perturbation=away, duration=20.0)
    cycle = design.simulated_cycle(coach, speed=105.0, perturbation=away)
    assert found.kind == "period 1"
    np.testing.assert_allclose(found.values(), cycle.amplitude["y_w1"], rtol=2e-4)
    assert np.diff(found.time).mean() == pytest.approx(cycle.period, rel=1e-4)


def test_everything_can_be_drawn(cascade):
    section = design.poincare_section(
        LORENZ, speed=1.0, state="z", duration=60.0, perturbation=LORENZ_START
    )
    for plot in (section.plot(), section.plot(("x", "y")), section.plot_return_map()):
        assert np.ravel(plot.axes)[0].lines
    assert str(section).endswith("points at maximum of z; does not come back")
    assert section.summary()["points"] == len(section)
    figure = cascade.plot().figure
    assert len(figure.axes) == 2
    fresh = plt.subplots()[1]
    cascade.plot("y", ax=fresh)
    assert len(fresh.figure.axes) == 1
    plt.close("all")
