"""RL Baselines3 Zoo by its command line; keywords of the environment go through ``--env-kwargs``."""

import subprocess
import sys
import tempfile
from pathlib import Path

import gymnasium
import torch
from judged import ID, KEYWORDS, Clock, mean_return, report
from stable_baselines3 import PPO

STEPS = 40960
HYPERPARAMETERS = f"""
{ID}:
  n_timesteps: {STEPS}
  n_envs: 4
  policy: MlpPolicy
  n_steps: 512
  batch_size: 128
  gamma: 0.98
  learning_rate: 0.0003
"""

torch.set_num_threads(1)
Path("ppo.yml").write_text(HYPERPARAMETERS)
keywords = [f"{name}:{value!r}" for name, value in KEYWORDS.items()]  # observation:'sensors' history:3


def train(steps: int, folder: str) -> PPO:
    command = ["-m", "rl_zoo3.train", "--algo", "ppo", "--env", ID, "--gym-packages", "railenv"]
    options = ["-conf", "ppo.yml", "-f", folder, "-n", f"{steps}", "--seed", "0", "--num-threads", "1"]
    options += ["--eval-freq", "-1", "--device", "cpu", "--env-kwargs", *keywords]
    subprocess.run([sys.executable, *command, *options], check=True)
    name = ID.replace("/", "-")
    return PPO.load(Path(folder) / "ppo" / f"{name}_1" / f"{name}.zip", device="cpu")


def judged(model: PPO) -> float:
    return mean_return(lambda observation: model.predict(observation, deterministic=True)[0])


clock = Clock()
with tempfile.TemporaryDirectory() as folder:
    model = train(STEPS, folder)
seconds = clock.seconds
report(
    f"`python -m rl_zoo3.train --algo ppo --env {ID} --gym-packages railenv --env-kwargs ...`",
    steps=STEPS,
    seconds=seconds,
    before=judged(PPO("MlpPolicy", gymnasium.make(ID, **KEYWORDS), seed=0)),
    after=judged(model),
)
