"""The command line as a user runs it."""

import csv
import json
import re
import subprocess
import sys

import pytest
from typer.main import get_command
from typer.testing import CliRunner

import agents
import railenv
from railenv import cli
from railenv.cli.controllers import controllers

runner = CliRunner()


def invoke(*arguments):
    result = runner.invoke(cli.app, [str(a) for a in arguments])
    assert result.exit_code == 0, result.output
    return result.output


def test_critical_speed_answers_in_one_line():
    assert invoke("critical-speed") == "bogie: hunting from 116.4739 m/s at 3.1135 Hz\n"


def test_critical_speed_as_json():
    data = json.loads(invoke("critical-speed", "-m", "dual-wheelset", "-v", "TABLE_1", "--json"))
    assert data["model"] == "dual_wheelset"
    assert data["speed"] == pytest.approx(34.177, rel=1e-3)
    assert data["multiplicity"] == 2
    assert data["radius"] is None


def test_critical_speed_on_a_curve_with_changed_parameters_and_a_plot(tmp_path):
    plain = json.loads(invoke("critical-speed", "-r", 2500, "-c", 0.0873, "--json"))
    changed = json.loads(
        invoke(
            "critical-speed",
            "-r",
            2500,
            "-c",
            0.0873,
            "--set",
            "conicity=0.1",
            "--set",
            "wheelbase_curving=true",
            "--json",
        )
    )
    assert changed["speed"] != plain["speed"]
    picture = tmp_path / "mode.png"
    assert f"wrote {picture}" in invoke("critical-speed", "--plot", picture).replace("\n", "")
    assert picture.stat().st_size > 1000


def test_critical_speed_under_a_controller_moves(tmp_path):
    said = invoke("critical-speed", "--controller", "output-feedback")
    assert said.startswith("bogie_secondary: hunting from ")
    alone, damped, gain = (
        json.loads(invoke("critical-speed", "--lowest", 20, "--json", *more))["speed"]
        for more in ((), ("--controller", "yaw-rate"), ("--yaw-rate-gain", 2e5))
    )
    assert alone < min(damped, gain)
    assert "unstable already at 3 m/s" in invoke("critical-speed", "--controller", "yaw-rate")
    moving = tmp_path / "mode.gif"
    invoke("critical-speed", "--controller", "lqg", "--set", "conicity=0.4", "--animate", moving)
    assert moving.stat().st_size > 1000


def test_whole_coach_says_what_hunts(tmp_path):
    assert invoke("critical-speed", "--model", "coach").startswith(
        "coach: bogie hunting, in phase from "
    )
    low = json.loads(invoke("critical-speed", "-m", "coach", "--set", "conicity=0.02", "--json"))
    assert (low["loss"], low["mode"]) == ("hunting", "body hunting (upper sway)")
    drawing = tmp_path / "modes.png"
    listed = invoke("modes", "-m", "coach", "--speed", 60, "--highest", 2, "--plot", drawing)
    assert "body lower sway" in listed
    assert drawing.stat().st_size > 1000
    found = json.loads(invoke("modes", "-m", "coach", "--speed", 60, "--highest", 2, "--json"))
    assert {"mode", "frequency", "damping", "wheelsets", "frames", "body"} == set(found["modes"][0])
    assert found["shares_of"] == "kinetic energy"


def test_own_vehicle_from_a_file(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('base = "HIGH_SPEED_COACH"\nname = "mine"\nconicity = 0.2\n')
    data = json.loads(invoke("critical-speed", "-v", file, "--json"))
    expected = json.loads(invoke("critical-speed", "--set", "conicity=0.2", "--json"))
    assert data["speed"] == expected["speed"]


def test_vehicles_lists_every_field_and_round_trips_as_toml(tmp_path):
    listed = invoke("vehicles")
    for name in railenv.vehicles.QUANTITIES:
        assert name in listed
    assert "…" not in listed
    described = invoke("vehicles", "TABLE_1")
    assert "514000" in described
    file = tmp_path / "table_1.toml"
    for model, kind in (("bogie", railenv.Bogie), ("dual-wheelset", railenv.DualWheelset)):
        file.write_text(invoke("vehicles", "TABLE_1", "--toml", "--model", model))
        assert railenv.Assembly.from_toml(file) == kind(railenv.TABLE_1).assembly
    file.write_text(invoke("vehicles", "HIGH_SPEED_COACH", "--toml", "--model", "coach"))
    assert railenv.Assembly.from_toml(file) == railenv.Coach(railenv.HIGH_SPEED_COACH).assembly
    data = json.loads(invoke("vehicles", "--json"))
    assert [v["name"] for v in data] == [v.name for v in railenv.PRESETS]
    assert data[0]["contact"] == {"law": "cone", "conicity": 0.05}


def test_vehicles_tell_their_contact():
    listed = invoke("vehicles")
    assert "contact of HIGH_SPEED_COACH_S1002: S1002 on UIC60, inclination 1:40" in listed
    hollow = invoke("vehicles", "HIGH_SPEED_COACH_HOLLOW")
    assert "contact_angle" in hollow
    assert "0.034" in hollow
    assert "contact of HIGH_SPEED_COACH:" not in invoke("vehicles", "HIGH_SPEED_COACH")


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A file of parts: the coach, which has the kernels of the shipped one."""
    file = tmp_path_factory.mktemp("parts") / "mine.toml"
    railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(name="mine")).assembly.to_toml(file)
    return file


def test_a_file_of_parts_is_a_vehicle_of_every_command(parts, tmp_path):
    assert invoke("critical-speed", "-v", parts) == "mine: hunting from 116.4739 m/s at 3.1135 Hz\n"
    steep = json.loads(invoke("critical-speed", "-v", parts, "--set", "conicity=0.2", "--json"))
    plain = json.loads(invoke("critical-speed", "--set", "conicity=0.2", "--json"))
    assert steep["speed"] == pytest.approx(plain["speed"], rel=1e-9)
    damped = json.loads(
        invoke("critical-speed", "-v", parts, "--controller", "output-feedback", "--json")
    )
    same = json.loads(invoke("critical-speed", "--controller", "output-feedback", "--json"))
    assert damped["speed"] == pytest.approx(same["speed"], rel=1e-9)
    assert len(json.loads(invoke("locus", "-v", parts, "--points", 3, "--json"))["real"]) == 3
    assert "command_b" in invoke("margins", "-v", parts, "-s", 100, "--yaw-rate-gain", 1e5)
    assert "y_w1" in invoke("simulate", "-v", parts, "-s", 100, "--duration", 0.1)
    axes = ("--x", "conicity:0.05,0.3", "--y", "friction:0.2,0.3", "--jobs", 1)
    assert "critical speed" in invoke("map", "-v", parts, *axes)
    assert "hunting from 116.4739" in invoke("bifurcation", "-v", parts, "--points", 3)


def test_a_file_of_parts_is_shown(parts):
    listed = invoke("vehicles", parts)
    assert "read by" in listed
    assert set(railenv.TABLE_1.parameters()) <= set(listed.split())
    assert invoke("vehicles", parts, "--toml").startswith('name = "mine"')
    data = json.loads(invoke("vehicles", parts, "--json"))
    assert data["values"]["conicity"] == 0.05
    assert data["parts"][0]["kind"] == "wheelset"
    assert data["parts"][0]["contact"] == {"law": "cone", "conicity": "conicity"}


def test_warming_is_done_once_and_said(parts):
    command = ("warm", "--no-shipped", "--toml", parts)
    assert "sets of kernels in" in invoke(*command)
    data = json.loads(invoke(*command, "--json"))
    assert [job["kernels"] for job in data["jobs"]] == [
        "mine: analyses and simulation",
        "mine: batches",
        "mine_secondary: analyses and simulation",
        "mine_secondary: environment",
        "mine_secondary: vector environment",
    ]


def test_training_takes_a_vehicle(parts):
    pytest.importorskip("yaml", reason="needs the extra rl")
    shown = json.loads(invoke("train", "ppo", "--vehicle", parts, "--show"))
    assert shown["railenv/BogieSensors-v1"]["env_kwargs"]["vehicle"] == str(parts)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["critical-speed", "-m", "dual-wheelset"], "--model is dual-wheelset; .* is its own model"),
        (["critical-speed", "-m", "coach"], "--model is coach; .* is its own model"),
        (["critical-speed", "-m", "cooperrider"], None),
        (["critical-speed", "--set", "conicty=0.1"], r"did you mean 'conicity'\?\); allowed are"),
    ],
)
def test_errors_with_a_file_of_parts(parts, arguments, message):
    result = runner.invoke(cli.app, [*arguments, "-v", str(parts)])
    if message is None:  # the Cooperrider bogie has its own numbers, whatever the vehicle
        assert result.exit_code == 0
        return
    assert re.search(message, str(result.exception))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--markdown"], "--markdown is for bogies' numbers"),
        (["--toml", "--model", "dual-wheelset"], "describes its own parts"),
        (["--model", "dual-wheelset"], "it is for --toml"),
    ],
)
def test_errors_of_showing_a_file_of_parts(parts, arguments, message):
    result = runner.invoke(cli.app, ["vehicles", str(parts), *arguments])
    assert message in str(result.exception)


def test_warming_a_file_of_numbers_is_refused(tmp_path):
    file = tmp_path / "flat.toml"
    railenv.TABLE_1.to_toml(file)
    result = runner.invoke(cli.app, ["warm", "--no-shipped", "--toml", str(file)])
    assert "has the kernels of the shipped ones" in str(result.exception)


def test_locus_as_table_json_and_plot(tmp_path):
    assert "116.4739" in invoke("locus", "--points", 10)
    picture = tmp_path / "locus.svg"
    data = json.loads(invoke("locus", "--points", 5, "--json"))
    assert len(data["real"]) == len(data["speed"]) == 5
    assert len(data["real"][0]) == 24
    invoke("locus", "--points", 10, "--plot", picture)
    assert "<svg" in picture.read_text()


def test_locus_over_a_parameter_and_over_the_gain_of_a_controller(tmp_path):
    picture, damping = tmp_path / "locus.png", tmp_path / "damping.png"
    span = ("--from", 0.02, "--to", 0.3, "-s", 110, "--points", 8)
    command = ("locus", "--parameter", "conicity", *span)
    data = json.loads(invoke(*command, "--json"))
    (point,) = data["critical_points"]
    assert data["values"][0] == 0.02
    assert point["stability"] == "lost"
    speed = json.loads(invoke("critical-speed", "--set", f"conicity={point['value']}", "--json"))
    assert speed["speed"] == pytest.approx(110.0, rel=1e-6)
    invoke(*command, "--plot", picture, "--damping-plot", damping)
    assert min(picture.stat().st_size, damping.stat().st_size) > 1000
    gain = ("--parameter", "gain", "--from", 0, "--to", 1, "--points", 4, "-s", 130)
    assert "stability gained" in invoke("locus", *gain, "--yaw-rate-gain", 2e5, "--period", 0.01)


def test_locus_over_speed_of_a_damped_bogie():
    data = json.loads(
        invoke("locus", "--lowest", 60, "--points", 5, "--yaw-rate-gain", 1e5, "--delay", 0, "--json")
    )
    (point,) = data["critical_points"]
    assert point["value"] > 120.0


def test_margins_as_text_json_and_plot(tmp_path):
    command = ("margins", "-s", 130, "--yaw-rate-gain", 2e5, "--set", "limit=2e4")
    said = invoke(*command, "--plot", tmp_path / "nyquist.png")
    assert "command_b" in said
    data = json.loads(invoke(*command, "--json"))
    (channel,) = data["channels"]
    assert channel["gain_reduction"] < 1.0 < channel["gain_margin"]
    late = json.loads(invoke(*command, "--delay", 0.01 + 1.01 * data["delay_margin"], "--json"))
    assert late["stable"] is False
    assert "no margins" in invoke("margins", "-s", 240, "--yaw-rate-gain", 2e5)


def test_margins_of_both_actuators_of_a_dual_wheelset_with_a_washout():
    vehicle = ("-m", "dual-wheelset", "-v", "TABLE_1")
    data = json.loads(
        invoke("margins", *vehicle, "-s", 34, "--yaw-rate-gain", 1e5, "--washout", 0.2, "--json")
    )
    assert [c["channel"] for c in data["channels"]] == ["command_w1", "command_w2"]


def test_shipped_controllers_close_the_loop_in_locus_margins_and_map(tmp_path):
    coach = ("-v", "HIGH_SPEED_COACH_HOLLOW")  # that they are for
    span = ("--lowest", 60, "--highest", 300, "--points", 4)
    data = json.loads(invoke("locus", *coach, "--controller", "yaw-rate", *span, "--json"))
    assert data["critical_points"][0]["value"] > 140.0
    shipped = ("--controller", "output-feedback")
    margins = json.loads(invoke("margins", *coach, "-s", 100, *shipped, "--json"))
    assert margins["stable"] is True
    axes = ("--x", "conicity:0.05,0.3", "--y", "gain:0,1")
    what = ("--quantity", "growth", "-s", 120, "--jobs", 1, "--json")
    data = json.loads(invoke("map", *coach, *axes, "--controller", "yaw-rate", *what))
    assert all(with_it < without for without, with_it in data["growth"])


def test_evaluation_on_the_command_line(tmp_path):
    store = tmp_path / "kept.json"
    command = ("evaluate", "passive", "--quick", "--store", store)
    data = json.loads(invoke(*command, "--json"))
    assert data[0]["curves"][0]["linear"] == pytest.approx(114.2856, rel=1e-4)
    assert "| passive | sensors | 114.3 |" in invoke(*command, "--leaderboard")  # from the store
    assert "passive" in invoke(*command, "--plot", tmp_path / "bars.png")


def test_tuning_on_the_command_line(tmp_path):
    import agents

    file = tmp_path / "lqr.npz"
    invoke("tune", "lqr", "--out", file)
    assert isinstance(agents.load(file), agents.LQR)


def test_critical_mode_is_animated(tmp_path):
    file = tmp_path / "mode.gif"
    invoke("critical-speed", "--animate", file)
    assert file.read_bytes()[:3] == b"GIF"


def test_simulate_reports_growth_above_the_critical_speed_and_writes_all_states(tmp_path):
    table = tmp_path / "run.csv"
    data = json.loads(
        invoke(
            "simulate",
            "-s",
            120,
            "--perturb",
            "y_w1=0.0001",
            "--duration",
            4,
            "--show",
            "y_w1",
            "--show",
            "psi_b",
            "--csv",
            table,
            "--json",
        )
    )
    y = data["states"]["y_w1"]
    assert y["amplitude_second_half"] > y["amplitude_first_half"]
    assert "psi_b" in data["states"]
    with table.open() as stream:
        rows = list(csv.DictReader(stream))
    assert set(rows[0]) == {"time", *railenv.Bogie(railenv.TABLE_1).state_names}
    assert float(rows[-1]["time"]) == 4.0
    assert "y_w1" in invoke("simulate", "-s", 100, "--duration", 1, "--plot", tmp_path / "y.png")


ON_A_CURVE = ["simulate", "-s", 60, "-r", 1500, "-c", 0.1, "--straight", 50, "--transition", 100]


def test_simulate_assesses_a_run_through_a_transition(tmp_path):
    drawing = tmp_path / "forces.png"
    level = ["--irregularity", "low", "--irregularity-factor", 0.5]
    output = invoke(*ON_A_CURVE, *level, "--assess", "--section", 200, 550, "--plot", drawing)
    assert "bogie, 200 to 550 m, up to 60 m/s, R = 1500 m" in output
    row = next(line for line in output.splitlines() if line.startswith("quasi-static guiding force"))
    assert re.search(r"w\d left .* kN +60.0 kN +\d+% +ok +20 Hz, median of the full curve", row)
    assert "all values are within their limits" in output
    assert drawing.stat().st_size > 20_000


def test_simulate_says_that_limits_are_exceeded_and_succeeds():
    level = ["--irregularity", "high", "--irregularity-factor", 3]
    assert "LIMITS EXCEEDED: " in invoke(*ON_A_CURVE, *level, "--assess")
    found = json.loads(invoke(*ON_A_CURVE, *level, "--assess", "--json"))["assessment"]
    assert found["passed"] is False
    over = [q for q in found["quantities"] if q["passed"] is False]
    assert over
    assert all(q["share"] == pytest.approx(q["value"] / q["limit"]) and q["share"] > 1.0 for q in over)


def test_simulate_runs_on_a_measured_line(tmp_path):
    file, s = tmp_path / "line.csv", [0.5 * k for k in range(401)]
    file.write_text("distance,align,vert,cross\n" + "".join(f"{x},{x % 4 - 1.5},0,0\n" for x in s))
    options = ["simulate", "-s", 50, "--duration", 3, "--irregularity", file]
    run = json.loads(invoke(*options, "--irregularity-unit", "mm", "--json"))
    moved = run["states"]["y_w1"]["amplitude_second_half"]
    assert 1e-5 < moved < 5e-3
    half = [*options, "--irregularity-unit", "mm", "--irregularity-factor", 0.5, "--json"]
    assert 0.0 < json.loads(invoke(*half))["states"]["y_w1"]["amplitude_second_half"] < moved
    refused = runner.invoke(cli.app, [str(a) for a in options])
    assert "say --irregularity-unit m or mm" in str(refused.exception)


@pytest.mark.parametrize(
    "command", ["vehicles", "critical-speed", "locus", "margins", "simulate", "reproduce", "warm"]
)
def test_every_option_of_every_command_is_explained(command):
    parameters = get_command(cli.app).commands[command].params
    assert parameters
    for parameter in parameters:
        assert getattr(parameter, "help", None), f"{command} {parameter.name}"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["critical-speed", "-v", "TABLE_7"], "unknown vehicle: 'TABLE_7' (did you mean 'TABLE_1'?)"),
        (["critical-speed", "--set", "conicty=0.2"], "did you mean 'conicity'?"),
        (["critical-speed", "--set", "conicity"], "it must be name=value"),
        (
            ["critical-speed", "--set", "conicity=-1"],
            "conicity of Cone is -1; it must be finite and greater",
        ),
        (["critical-speed", "-r", "0"], "radius is 0 m"),
        (["critical-speed", "-v", "nowhere.toml"], "nowhere.toml"),
        (["simulate", "-s", "100", "--show", "y_w7"], "y_w7"),
        (["simulate", "-s", "100", "--irregularity", "medium"], "it must be low, high or a file"),
        (["simulate", "-s", "100", "--irregularity-unit", "mm"], "is that of a file"),
        (["simulate", "-s", "100", "--straight", "50"], "need --transition"),
        (["simulate", "-s", "100", "--assess", "--duration", "2"], "so simulate for longer"),
        (["locus", "--from", "1"], "--from needs --parameter"),
        (["locus", "--parameter", "conicity"], "needs --from, --to and --speed"),
        (["locus", "--delay", "0.01"], "--delay needs a controller"),
        (["margins", "-s", "60"], "margins need a controller"),
        (["margins", "-s", "60", "--controller", "magic"], "neither a file nor shipped"),
        (["margins", "-s", "60", "--controller", "lqg", "--period", "0.01"], "has its own"),
        (["locus", "-r", "400", "-c", "0.09", "--highest", "300"], None),
        (["critical-speed", "--plot", "mode.xyz"], "must end in .png, .svg or .pdf"),
        (["reproduce", "--first-page", "--quick"], "the first page has one form"),
    ],
)
def test_errors_are_one_line_with_exit_status_1(arguments, message):
    run = subprocess.run(
        [sys.executable, "-m", "railenv.cli", *arguments], capture_output=True, text=True, check=False
    )
    if message is None:  # ends early, with a warning: no error
        assert run.returncode == 0
        assert "ends early" in run.stderr
        return
    assert run.returncode == 1
    assert run.stderr.startswith("error: ")
    assert message in run.stderr
    assert "Traceback" not in run.stderr


def test_foreign_package_of_the_same_name_is_detected(tmp_path):
    assert cli.foreign_package("design") is None
    assert cli.foreign_package("agents") is None
    (tmp_path / "agents").mkdir()
    (tmp_path / "agents" / "__init__.py").touch()
    run = subprocess.run(
        [sys.executable, "-m", "railenv.cli", "vehicles", "--json"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert run.returncode == 0
    assert "warning: Python finds 'agents'" in run.stderr
    assert str(tmp_path / "agents") in run.stderr


def test_version():
    assert invoke("--version").strip() == railenv.__version__


def test_bifurcation_reports_fold_and_hopf_point_and_draws_them(tmp_path):
    drawing = tmp_path / "branch.png"
    options = ["--model", "cooperrider", "--highest", "72", "--simulated", "3", "--plot", str(drawing)]
    result = CliRunner().invoke(cli.app, ["bifurcation", *options])
    assert result.exit_code == 0, result.output
    assert "hunting from 68.6440 m/s" in result.output
    assert "fold at 66.655" in result.output
    assert "simulated amplitude" in result.output
    assert drawing.stat().st_size > 1000


def test_bifurcation_maps_a_second_parameter_as_json():
    options = ["--model", "cooperrider", "--map", "conicity=0.05:0.06:2", "--json"]
    result = CliRunner().invoke(cli.app, ["bifurcation", *options])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["value"] == [0.05, 0.06]
    assert found["onset_speed"][0] == pytest.approx(66.655, abs=0.01)
    assert found["onset_speed"][1] < found["onset_speed"][0]


def test_bifurcation_finds_every_branch(tmp_path):
    drawing = tmp_path / "diagram.png"
    options = ["--all", "--model", "cooperrider", "--lowest", "60", "--highest", "72"]
    result = CliRunner().invoke(cli.app, ["bifurcation", *options, "--plot", str(drawing)])
    assert result.exit_code == 0, result.output
    assert "hunting can persist from speed 66.6551 m/s (fold" in result.output
    assert "branch 0, from Hopf at 68.644 m/s" in result.output
    assert drawing.stat().st_size > 1000
    result = CliRunner().invoke(cli.app, ["bifurcation", *options, "--simulated", "3"])
    assert "--all cannot be combined with" in str(result.exception)


def test_bifurcation_follows_curves_over_a_parameter(tmp_path):
    options = ["--model", "cooperrider", "--curve", "conicity=0.048:0.052"]
    file = tmp_path / "curves.png"
    result = CliRunner().invoke(cli.app, ["bifurcation", *options, "--plot", str(file)])
    assert result.exit_code == 0, result.output
    assert file.stat().st_size > 0
    assert "68.644" in result.output
    assert "66.655" in result.output
    result = CliRunner().invoke(cli.app, ["bifurcation", *options, "--json"])
    found = json.loads(result.output)["curves"]
    assert [curve["kind"] for curve in found] == ["Hopf", "fold of cycles"]
    assert found[0]["value"]["conicity"][0] == 0.048
    result = CliRunner().invoke(cli.app, ["bifurcation", "--curve", "conicity=0.1"])
    assert "name=low:high" in str(result.exception)
    result = CliRunner().invoke(cli.app, ["bifurcation", *options, "--map", "conicity=0.1:0.2:2"])
    assert "combined with --map or --simulated" in str(result.exception)


def test_a_malformed_map_is_an_error():
    result = CliRunner().invoke(cli.app, ["bifurcation", "--map", "conicity=1"])
    assert "name=low:high:count" in str(result.exception)


def test_square_brackets_are_text(tmp_path):
    """Rich reads ``[name]`` as markup, unless told not to."""
    file = tmp_path / "mode[b].png"
    assert f"wrote {file}" in invoke("critical-speed", "--plot", file).replace("\n", "")
    run = subprocess.run(
        [sys.executable, "-m", "railenv.cli", "simulate", "-s", "100", "--show", "y[b]"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.stderr.startswith("error: unknown state in --show: 'y[b]'")


def test_controllers_in_files_of_the_same_name_are_told_apart(tmp_path):
    for name, folder in (("passive", "a"), ("yaw-rate", "b"), ("lqg", ".")):
        (tmp_path / folder).mkdir(exist_ok=True)
        agents.shipped(name).save(tmp_path / folder / ("other.npz" if folder == "." else "best.npz"))
    files = [str(tmp_path / file) for file in ("a/best.npz", "b/best.npz", "other.npz")]
    found = controllers([*files, "lqr"])
    assert list(found) == [*files[:2], "other", "lqr"]
    assert [c.name for c in found.values()] == ["Passive", "YawRateFeedback", "LQG", "LQR"]
