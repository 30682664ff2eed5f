"""Commands that are killed go on where they were, and end with what they would have ended with."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from typer.testing import CliRunner

import agents
from railenv import cli

DEADLINE = 300.0  # s


def command(arguments):
    return [sys.executable, "-m", "railenv.cli", *map(str, arguments)]


def killed(arguments, ready):
    """Run a command and kill it, with all its processes, as soon as something is ready."""
    process = subprocess.Popen(
        command(arguments), start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    deadline = time.monotonic() + DEADLINE
    while not ready():
        assert process.poll() is None, "it ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.002)
    os.killpg(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL


def lines(path):
    return path.read_bytes().count(b"\n") if path.exists() else 0


@pytest.mark.parametrize("jobs", [1, 2])
def test_killed_map_goes_on_without_loss(tmp_path, jobs):
    store = tmp_path / "map.jsonl"
    axes = ["--x", "radius:700:9000:6:log", "--y", "conicity:0.04:0.3:24", "--cant", "0.05"]
    arguments = ["map", *axes, "--jobs", jobs, "--store", store]
    killed(arguments, lambda: lines(store) > 8)
    before = store.read_text().splitlines()
    assert 8 < len(before) < 6 * 24
    result = CliRunner().invoke(cli.app, [*map(str, arguments), "--json"])
    whole = CliRunner().invoke(cli.app, ["map", *axes, "--jobs", "1", "--json"])
    assert result.exit_code == whole.exit_code == 0, result.output
    assert json.loads(result.output) == json.loads(whole.output)
    after = store.read_text().splitlines()
    kept = [line for line in before if re.fullmatch(r"\{.*\}", line)]
    assert after[: len(kept)] == kept
    cells = [json.loads(line)["cell"] for line in after[1:]]
    assert sorted(cells) == list(range(6 * 24))  # each computed once


TRAINING = {
    "n_envs": 8,
    "n_steps": 16,
    "batch_size": 64,
    "env_kwargs.duration": 0.3,
    "evaluation.every": 256,
    "evaluation.episodes": 2,
    "checkpoint_every": 128,
}


@pytest.mark.slow
def test_killed_training_goes_on_without_loss(tmp_path):
    pytest.importorskip("stable_baselines3")
    changes = [part for n, v in TRAINING.items() for part in ("--set", f"{n}={json.dumps(v)}")]
    common = ["train", "ppo", "--steps", 4096, "--seed", 5, *changes]
    run, whole = tmp_path / "killed", tmp_path / "whole"
    checkpoints = run / "checkpoints"
    killed(
        [*common, "--out", run],
        lambda: checkpoints.is_dir() and any(p.name.isdigit() for p in checkpoints.iterdir()),
    )
    assert not (run / "last.npz").exists()
    assert subprocess.run(command(["train", "--resume", "--out", run]), check=False).returncode == 0
    assert subprocess.run(command([*common, "--out", whole]), check=False).returncode == 0
    for name in ("last.npz", "best.npz"):
        first, second = (agents.load(folder / name) for folder in (run, whole))
        for key, array in first.network.arrays().items():
            np.testing.assert_array_equal(array, second.network.arrays()[key])
    assert (run / "evaluations.csv").read_text() == (whole / "evaluations.csv").read_text()


@pytest.mark.slow
def test_killed_report_goes_on_without_loss(tmp_path):
    run, whole = tmp_path / "killed", tmp_path / "whole"
    arguments = ["reproduce", "--first-page", "--jobs", "1", "--out"]
    killed([*arguments, run], lambda: len(list(run.glob("pieces/*.npz"))) >= 2)
    kept = {path.name: path.stat().st_mtime_ns for path in run.glob("pieces/*.npz")}
    assert not (run / "report.html").exists()
    for folder in (run, whole):
        assert subprocess.run(command([*arguments, folder]), check=False).returncode == 0
    for name, written in kept.items():
        assert (run / "pieces" / name).stat().st_mtime_ns == written, "computed again"
    text = re.compile(r"\d+ (of \d+ )?computations[^<]*|in [\d.]+ s")
    reports = [text.sub("", (folder / "report.html").read_text()) for folder in (run, whole)]
    assert reports[0] == reports[1]
