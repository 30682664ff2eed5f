"""The examples about learning run and learn."""

import runpy
import sys
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")

import agents
from examples import ppo_in_torch

EXAMPLES = Path(ppo_in_torch.__file__).parent


def test_ppo_in_torch_learns():
    means = ppo_in_torch.train(ppo_in_torch.Options(iterations=12))
    assert len(means) == 12
    assert means[-1] > 0.5 * min(means)  # rewards are negative
    assert means[-1] > -0.05


def test_train_in_ten_lines(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["train_in_ten_lines.py", "16384"])
    runpy.run_path(str(EXAMPLES / "train_in_ten_lines.py"), run_name="__main__")
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("ppo in railenv/Bogie-v1, 16384 steps")
    assert printed[1].startswith("without control: hunting from 114.2856 m/s")
    assert agents.load("policy.npz").name == "LearnedPolicy"
