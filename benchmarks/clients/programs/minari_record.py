"""Minari: episodes are recorded, stored, read again, and the environment is made from the data set."""

import os
from pathlib import Path

import gymnasium
import numpy as np

os.environ["MINARI_DATASETS_PATH"] = str(Path("datasets").resolve())

import minari
from judged import ID, KEYWORDS, Clock, report

EPISODES = 10
NAME = "railenv/bogie/random-v0"

clock = Clock()
if NAME in minari.list_local_datasets():
    minari.delete_dataset(NAME)
env = minari.DataCollector(gymnasium.make(ID, **KEYWORDS), record_infos=True)
env.action_space.seed(0)
steps = 0
for seed in range(EPISODES):
    env.reset(seed=seed)
    ended = False
    while not ended:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = terminated or truncated
        steps += 1
env.create_dataset(NAME, algorithm_name="random", eval_env=ID)

dataset = minari.load_dataset(NAME)
assert dataset.total_episodes == EPISODES
assert dataset.total_steps == steps
again = dataset.recover_environment()
for seed, episode in zip(range(EPISODES), dataset.iterate_episodes(), strict=True):
    observation, info = again.reset(seed=seed)
    assert np.array_equal(observation, episode.observations[0])
    for t, action in enumerate(episode.actions):
        observation, reward, *_, info = again.step(action)
        assert np.array_equal(observation, episode.observations[t + 1])
        assert reward == episode.rewards[t]
        assert info["speed"] == episode.infos["speed"][t + 1]
assert again.unwrapped.settings == env.unwrapped.settings
assert dataset.recover_environment(eval_env=True).spec.id == ID
report(
    "`DataCollector`, `create_dataset`, `load_dataset`, `recover_environment`; each episode "
    "again from its actions",
    steps=steps,
    seconds=clock.seconds,
)
