"""Stability maps: each cell is what the analysis of one case says; any backend; stores; pictures."""

import json
import math
import pickle

import joblib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from typer.testing import CliRunner

import design
import railenv
from design.loop.feedback import as_feedback
from design.studies.store import checked
from railenv import cli

RADII = [700.0, 2000.0, 8000.0, math.inf]
CONICITIES = [0.05, 0.12, 0.3]


@pytest.fixture(scope="module")
def coach(coach):
    """Return the coach whose equilibrium folds on tight curves: without the turn of its wheelsets."""
    return coach.replace(wheelbase_curving=False)


@pytest.fixture(scope="module")
def chart(coach):
    return design.stability_map(coach, {"radius": RADII, "conicity": CONICITIES}, cant=0.05, n_jobs=2)


@pytest.fixture(scope="module")
def equipped(coach):
    return railenv.Equipped(coach)


def yaw_rate_feedback(model, gain=1e5):
    """Return a matrix that answers the yaw rate of the frame, against it."""
    matrix = np.zeros((1, model.n_states))
    matrix[0, model.state_names.index("gyro_b")] = gain
    return matrix


def test_critical_speeds_are_those_of_single_searches(chart, coach):
    for i, radius in enumerate(RADII):
        for j, conicity in enumerate(CONICITIES):
            alone = design.critical_speed(coach.replace(conicity=conicity), radius=radius, cant=0.05)
            assert chart.loss[i, j] == alone.loss
            assert chart.critical_speed[i, j] == alone.speed
            assert chart.frequency[i, j] == alone.frequency or alone.frequency is None
    assert {"hunting", "fold"} <= set(chart.loss.ravel())
    assert (chart.notes == "").all()
    assert chart.ended is None


@pytest.mark.parametrize("first", ["speed", "radius"])
def test_damping_is_that_of_the_eigenvalues_at_the_equilibrium(coach, first):
    axes = {"radius": [1000.0, 8000.0, math.inf], "speed": [60.0, 20.0]}
    if first == "speed":
        axes = dict(reversed(axes.items()))
    growth = design.stability_map(coach, axes, quantity="growth", n_jobs=1)
    damping = design.stability_map(coach, axes, quantity="damping", n_jobs=1)
    missing = 0
    for i, u in enumerate(axes[first]):
        for j, v in enumerate(axes[["radius", "speed"][first == "radius"]]):
            speed, radius = (u, v) if first == "speed" else (v, u)
            try:
                values = design.linearize(coach, speed=speed, radius=radius).poles()
            except railenv.EquilibriumError:
                missing += 1
                assert np.isnan(growth.growth[i, j])
                assert "no running equilibrium" in growth.notes[i, j]
                continue
            assert growth.growth[i, j] == pytest.approx(values.real.max(), rel=1e-6, abs=1e-6)
            ratio = (-values.real / np.abs(values)).min()
            assert damping.damping[i, j] == pytest.approx(ratio, rel=1e-6)
    assert missing == 1


def test_closed_loops_over_gain_and_delay_are_those_of_single_analyses(equipped):
    controller = yaw_rate_feedback(equipped)
    gains, delays = [0.0, 0.5, 1.0], [0.0, 0.013]
    chart = design.stability_map(
        equipped,
        {"gain": gains, "delay": delays},
        quantity="growth",
        speed=110.0,
        controller=controller,
        n_jobs=1,
    )
    for i, gain in enumerate(gains):
        for j, delay in enumerate(delays):
            loop = design.closed_loop(equipped, gain * controller, speed=110.0, delay=delay)
            assert chart.growth[i, j] == pytest.approx(loop.growth, rel=1e-6)
    assert chart.period == 0.005


def test_critical_speeds_over_gain_and_a_parameter_of_the_equipment(equipped):
    controller = yaw_rate_feedback(equipped)
    axes = {"parallel_damping": [0.0, 4e4], "gain": [0.0, 0.2]}
    chart = design.stability_map(equipped, axes, controller=controller, n_jobs=1)
    for i, damping in enumerate(axes["parallel_damping"]):
        model = equipped.replace(parallel_damping=damping)
        alone = design.critical_speed(model).speed  # a factor of 0 is no controller
        assert chart.critical_speed[i, 0] == pytest.approx(alone, rel=1e-6)
        loop = design.critical_speed(model, controller=0.2 * controller)
        assert (chart.loss[i, 1], chart.critical_speed[i, 1]) == (
            loop.loss,
            pytest.approx(loop.speed, rel=1e-6, nan_ok=True),
        )


def test_a_cluster_of_dask_gives_the_same_map(chart, coach):
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True
    )
    with cluster, distributed.Client(cluster) as client, joblib.parallel_config(backend="dask"):
        found = design.stability_map(coach, {"radius": RADII, "conicity": CONICITIES}, cant=0.05)
        ran = client.run(lambda: "design.studies.map_cells" in __import__("sys").modules)
    assert any(ran.values())  # in the cluster, not here
    np.testing.assert_array_equal(found.critical_speed, chart.critical_speed)


def _own_model():
    def oscillator(x, u, speed, curvature, cant, p):
        y, dy = x
        return [dy, -p.stiffness * y + p.gain * (speed - p.limit) * dy + u[0]]

    parameters = {"stiffness": 40.0, "limit": 30.0, "gain": 0.1}
    return railenv.Model("oscillator", ["y", "dy"], ["force"], oscillator, parameters)


def test_a_model_of_own_equations_goes_to_other_processes():
    model = _own_model()  # its function is local: only cloudpickle takes it
    axes = {"limit": [20.0, 35.0, 50.0], "gain": [0.1, 0.2]}
    chart = design.stability_map(model, axes, n_jobs=2)
    np.testing.assert_allclose(chart.critical_speed, np.array([[20.0] * 2, [35.0] * 2, [50.0] * 2]))
    np.testing.assert_allclose(chart.frequency, np.sqrt(40.0) / (2.0 * np.pi))
    assert chart.axes[0].unit == ""
    with pytest.raises(railenv.ParameterError, match="rename the parameter"):
        design.stability_map(model, axes, controller=[[1.0]])


@pytest.mark.parametrize(
    "made",
    [
        lambda: railenv.Bogie(railenv.TABLE_1),
        lambda: railenv.DualWheelset(railenv.TABLE_1),
        railenv.CooperriderBogie,
        lambda: railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH)),
    ],
)
def test_the_packages_models_survive_pickling(made):
    model = made()
    x = 1e-3 * np.ones(model.n_states)
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.rhs(x, speed=30.0), model.rhs(x, speed=30.0))
    assert again.equations_hash == model.equations_hash


def test_a_map_continues_from_its_store_and_refuses_another(coach, tmp_path):
    axes = {"conicity": [0.1, 0.2], "radius": [2000.0, math.inf]}
    arguments = {"store": tmp_path / "map.jsonl", "n_jobs": 1}
    whole = design.stability_map(coach, axes, **arguments)
    header, first, *_ = arguments["store"].read_text().splitlines()
    marked = json.loads(first) | {"critical_speed": 1.0}  # tells that it was not computed again
    marked.pop("crc32")
    marked = checked(marked)
    arguments["store"].write_text(f"{header}\n{json.dumps(marked)}\n")
    again = design.stability_map(coach, axes, **arguments).critical_speed
    assert again[0, 0] == 1.0
    np.testing.assert_array_equal(again.ravel()[1:], whole.critical_speed.ravel()[1:])
    with pytest.raises(railenv.ParameterError, match=r"model\.parameters\.friction is 0\.2 there"):
        design.stability_map(coach.replace(friction=0.35), axes, **arguments)
    with pytest.raises(railenv.ParameterError, match=r"cant is 0\.0 there, 0\.02 now"):
        design.stability_map(coach, axes, cant=0.02, **arguments)
    with pytest.raises(railenv.ParameterError, match="quantity is 'critical_speed' there"):
        design.stability_map(coach, axes, quantity="growth", speed=30.0, **arguments)
    with pytest.raises(railenv.ParameterError, match=r"axes\.conicity"):
        design.stability_map(coach, axes | {"conicity": [0.1, 0.3]}, **arguments)


def test_controllers_are_known_by_what_they_do(equipped):
    def settings(controller):
        function = design.studies.map_cells.CellFunction(
            design.cycles.places.Place(equipped, math.inf, 0.0),
            ("radius", "cant"),
            "growth",
            50.0,
            (3.0, 400.0),
            controller,
            None,
        )
        return function.settings({})["controller"]

    K = yaw_rate_feedback(equipped)
    system = as_feedback(K, equipped).system
    names = ["gyro_b"]
    static = design.StaticFeedback(
        lambda s: -1e5 * s, lambda s: [[-1e5]], names, equipped.command_names
    )
    curved = design.StaticFeedback(
        lambda s: -1e5 * s + 1e6 * s**3, lambda s: [[-1e5 + 3e6 * s[0] ** 2]], names, ["command_b"]
    )
    assert settings(K) == settings(system)
    assert settings(K) != settings(1.0001 * K)
    assert settings(static) != settings(curved)
    assert settings(static)["signals"] == names


@pytest.mark.parametrize(
    ("axes", "keywords", "message"),
    [
        ({"radius": RADII}, {}, "it must map two parameters"),
        ({"radius": RADII, "conicty": CONICITIES}, {}, "did you mean 'conicity'"),
        ({"radius": RADII, "gain": [1, 2]}, {}, "unknown axis: 'gain'"),
        ({"radius": RADII, "conicity": [0.1]}, {}, "at least 2 numbers"),
        ({"radius": RADII, "conicity": [0.1, 0.3, 0.2]}, {}, "strict order"),
        ({"radius": [-500.0, 500.0, 1000.0, math.inf], "cant": [0, 0.1]}, {}, "order of the curvature"),
        ({"radius": RADII, "conicity": [0.1, 0.9]}, {}, "conicity of Cone is 0.9; it must be"),
        ({"radius": RADII, "conicity": [0.1, math.inf]}, {}, "conicity"),
        ({"radius": RADII, "cant": [0.0, 0.9]}, {}, "cant is 0.9 rad"),
        ({"radius": RADII, "cant": [0.0, 0.1]}, {"cant": 0.1}, "cant is both an axis and held"),
        ({"radius": RADII, "speed": [10, 20]}, {}, "searches for the speed"),
        ({"radius": RADII, "conicity": CONICITIES}, {"quantity": "growth"}, "needs a speed"),
        ({"radius": RADII, "conicity": CONICITIES}, {"quantity": "gain"}, "quantity is 'gain'"),
        ({"radius": RADII, "speed": [0, 20]}, {"quantity": "growth"}, "speed is 0 m/s"),
    ],
)
def test_arguments_are_checked_before_anything_is_computed(coach, axes, keywords, message):
    with pytest.raises(railenv.ParameterError, match=message):
        design.stability_map(coach, axes, **keywords)


def test_tangent_track_only_models_refuse_curves(cooperrider):
    axes = {"radius": [500.0, 1000.0], "k6": [2e6, 3e6]}
    with pytest.raises(railenv.ParameterError, match="tangent track only"):
        design.stability_map(cooperrider, axes)


def test_as_xarray_with_units(chart):
    xarray = pytest.importorskip("xarray")
    data = chart.to_xarray()
    assert isinstance(data, xarray.Dataset)
    assert data.critical_speed.dims == ("radius", "conicity")
    assert data.critical_speed.attrs["units"] == "m/s"
    assert data.radius.attrs == {"long_name": "curve radius", "units": "m"}
    at = data.sel(radius=math.inf, conicity=0.05)
    assert float(at.critical_speed) == chart.critical_speed[-1, 0]
    assert str(at.loss.values) == "hunting"
    assert data.attrs["cant"] == 0.05


def test_summary_is_json(chart):
    data = json.loads(json.dumps(chart.summary(), allow_nan=False))
    assert data["axes"]["radius"][-1] is None
    assert data["critical_speed"][1][2] == chart.critical_speed[1, 2]
    assert str(chart).startswith("bogie, 4 x 3 cells, radius x conicity: critical speed")


def _labels(drawn):
    figure = np.ravel(drawn.axes)[0].figure
    axes = figure.axes
    legend = axes[0].get_legend()
    texts = [] if legend is None else [t.get_text() for t in legend.get_texts()]
    figure.canvas.draw()
    result = (axes[0].get_xlabel(), axes[0].get_ylabel(), axes[-1].get_ylabel(), texts)
    ticks = [t.get_text() for t in axes[0].get_xticklabels()]
    plt.close(figure)
    return (*result, ticks)


def test_picture_of_critical_speeds(chart):
    x, y, bar, texts, ticks = _labels(chart.plot())
    assert (x, bar) == ("curve radius (m)", "critical speed (m/s)")
    assert y == "conicity: slope of the tread (1)"
    assert "tread equilibrium ends in a fold" in texts
    assert ticks[-1] == "tangent"


def test_picture_of_damping_has_the_boundary_and_both_hands(coach):
    axes = {"radius": [-1000.0, -4000.0, math.inf, 4000.0, 1000.0], "speed": [30.0, 60.0, 90.0]}
    chart = design.stability_map(coach, axes, quantity="damping", n_jobs=1)
    np.testing.assert_allclose(chart.damping, chart.damping[::-1], rtol=1e-6)  # mirror symmetry
    x, y, bar, texts, _ = _labels(chart.plot())
    assert (x, y) == ("curvature of the track (1/km)", "forward speed (m/s)")
    assert bar == "least damping ratio of a mode (1)"
    assert texts == ["boundary of stability", "no running equilibrium"]


def _invoke(*arguments):
    return CliRunner().invoke(cli.app, [str(a) for a in ("map", *arguments)])


def test_command_line(tmp_path):
    coach = railenv.Bogie(railenv.HIGH_SPEED_COACH)
    arguments = ["--x", "radius:1000,4000,inf", "--y", "conicity:0.05:0.2:2", "--jobs", 1]
    arguments += ["--store", tmp_path / "map.jsonl"]
    result = _invoke(*arguments, "--json")
    assert result.exit_code == 0, result.output
    expected = design.critical_speed(coach.replace(conicity=0.2), radius=4000.0).speed
    assert json.loads(result.output)["critical_speed"][1][1] == expected
    picture = tmp_path / "map.png"
    shown = _invoke(*arguments, "--plot", picture)
    assert shown.exit_code == 0, shown.output
    assert "bogie, 3 x 2 cells, radius x conicity: critical speed" in shown.output
    assert picture.stat().st_size > 5000


@pytest.mark.parametrize(
    ("x", "message"),
    [
        ("radius:500:2000", "it must be name:low:high:count"),
        ("radius:500:2000:5:lin", "it must be name:low:high:count"),
        ("radius:-500:2000:5:log", "limits above 0"),
        ("conicity:0.1:0.2:3", "are both conicity"),
    ],
)
def test_command_line_says_what_is_wrong_with_an_axis(x, message):
    result = _invoke("--x", x, "--y", "conicity:0.05:0.2:2")
    assert isinstance(result.exception, railenv.ParameterError)
    assert message in str(result.exception)
