"""The examples about learning run and learn."""

import json
import runpy
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

import agents
import design
import railenv
from examples import ppo_in_torch
from railenv import cli

EXAMPLES = Path(ppo_in_torch.__file__).parent


def test_ppo_in_torch_learns():
    means = ppo_in_torch.train(ppo_in_torch.Options(iterations=12))
    assert len(means) == 12
    assert means[-1] > 0.5 * min(means)  # rewards are negative
    assert means[-1] > -0.05


PASSIVE = 114.2856  # m/s, the bogie without control
SHORT = 81920  # steps, some half of the recipe's


def test_train_in_ten_lines(monkeypatch, tmp_path, capsys):
    """Half of the training is enough for one and a half times the passive critical speed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["train_in_ten_lines.py", str(SHORT)])
    runpy.run_path(str(EXAMPLES / "train_in_ten_lines.py"), run_name="__main__")
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith(f"ppo in railenv/BogieSensors-v1, {SHORT} steps")
    assert printed[1].startswith(f"without control: hunting from {PASSIVE} m/s")
    policy = agents.load("policy.npz")
    assert policy.name == "LearnedPolicy"
    assert policy.about["critical_speed"] > 1.5 * PASSIVE
    assert policy.about["derailed"] == 0.0


def test_the_first_command_of_the_page(tmp_path):
    """As docs/learning.md has it, shorter; the environment is the command's default."""
    run = tmp_path / "first"
    told = ["train", "ppo", "--out", str(run), "--steps", str(SHORT), "--seed", "1", "--json"]
    result = CliRunner().invoke(cli.app, [*told, "--set", "evaluation.every=10240"])
    assert result.exit_code == 0, result.output
    best = json.loads(result.stdout)["best"]
    assert best["environment"] == "railenv/BogieSensors-v1"
    assert best["critical_speed"] > 1.5 * PASSIVE
    policy = agents.load(run / "best.npz")
    vehicle = railenv.Equipped(railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW), "secondary")
    found = design.critical_speed(vehicle, controller=policy, speed_range=(20.0, 400.0))
    assert found.speed == pytest.approx(best["critical_speed"])
