"""Mode shapes: what they say, and their pictures."""

import math

import numpy as np
import pytest
from matplotlib.animation import FuncAnimation
from PIL import Image

import design
import railenv
from railenv.errors import ParameterError, UnknownNameError

COACH = railenv.Bogie(railenv.HIGH_SPEED_COACH)


@pytest.fixture(scope="module")
def locus():
    return design.speed_locus(COACH, np.linspace(60.0, 140.0, 9))


def test_shape_is_the_eigenvector_of_the_linearised_vehicle(locus):
    shape = locus.mode(100.0)
    A = design.linearize(COACH, speed=100.0).A
    vector = np.array([shape[n] for n in shape.names])
    full = np.concatenate([vector, shape.eigenvalue * vector])  # rates follow from displacements
    assert np.abs(A @ full - shape.eigenvalue * full).max() < 1e-6 * np.abs(A @ full).max()
    assert np.abs(vector).max() == pytest.approx(1.0)
    assert shape.frequency == pytest.approx(shape.eigenvalue.imag / (2.0 * math.pi))
    assert shape.damping > 0.0


def test_shape_at_the_critical_speed_is_that_of_critical_speed(locus):
    critical = design.critical_speed(COACH)
    own = critical.mode_shape
    other = locus.mode(critical.speed)
    np.testing.assert_allclose(own.displacements, other.displacements, atol=1e-5)
    assert own.damping == pytest.approx(0.0, abs=1e-6)
    # hunting: the trailing wheelset lags behind the leading one
    assert -90.0 < math.degrees(np.angle(own["y_w2"] / own["y_w1"])) < 0.0


def test_actuators_and_sensors_are_no_displacements():
    model = railenv.Equipped(COACH)
    critical = design.critical_speed(model)
    assert critical.mode_shape.names == COACH.state_names[:12]
    plain = design.critical_speed(COACH)
    np.testing.assert_allclose(critical.mode[:12], plain.mode[:12], atol=1e-4)


def test_a_phase_of_half_a_period_turns_the_shape_round(locus):
    shape = locus.mode(100.0)
    np.testing.assert_allclose(shape.at(0.3 + math.pi), -shape.at(0.3), atol=1e-12)
    with pytest.raises(UnknownNameError, match="y_w3"):
        shape["y_w3"]


@pytest.mark.parametrize(("value", "mode"), [(59.0, None), (141.0, None), (100.0, 24), (100.0, -1)])
def test_only_within_the_locus(locus, value, mode):
    with pytest.raises(ParameterError, match=r"speed|mode"):
        locus.mode(value, mode)


@pytest.mark.parametrize(
    ("model", "speed"),
    [
        (COACH, 116.0),
        (railenv.DualWheelset(railenv.TABLE_1), 35.0),
        (railenv.CooperriderBogie(), 66.0),
    ],
    ids=["bogie", "dual wheelset", "cooperrider"],
)
def test_plan_view(model, speed, tmp_path):
    shape = design.speed_locus(model, [speed, speed + 1.0]).mode(speed)
    drawn = shape.plot(phases=(0.0, 45.0, 90.0))
    assert [ax.get_visible() for ax in drawn.axes.flat] == [True, True, True, False]
    drawn.figure.savefig(tmp_path / "plan.png")
    single = shape.plot(ax=drawn.axes[0, 0])
    assert "Hz" in single.axes[0, 0].get_title(loc="left")
    wheelset = {"y": shape.at(0.0)[shape.names.index("y_w1")]}
    centre = next(line for line in drawn.axes[0, 0].lines if line.get_marker() == "o")
    assert np.sign(centre.get_ydata()[0]) == np.sign(wheelset["y"])
    with pytest.raises(ParameterError, match="phases"):
        shape.plot(phases=())


def test_other_models_get_bars(tmp_path):
    def equations(x, u, speed, curvature, cant, p):
        return [x[1], -p.k * x[0] + 0.1 * x[1]]

    model = railenv.Model("oscillator", ["s", "rate"], [], equations, {"k": 4.0})
    shape = design.speed_locus(model, [10.0, 20.0]).mode(10.0)
    assert shape.names == ("s", "rate")
    shape.plot().figure.savefig(tmp_path / "bars.png")
    assert len(shape.plot().axes[0, 0].patches) == 2
    shape.animate(frames=3).save(tmp_path / "bars.gif", writer="pillow")


def test_animation_is_saved_with_all_its_frames(locus, tmp_path):
    animation = locus.mode(100.0).animate(frames=6)
    assert isinstance(animation, FuncAnimation)
    file = tmp_path / "mode.gif"
    animation.save(file, writer="pillow")
    with Image.open(file) as picture:
        assert picture.n_frames == 6
    with pytest.raises(ParameterError, match="frames"):
        locus.mode(100.0).animate(frames=1)
