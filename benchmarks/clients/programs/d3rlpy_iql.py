"""d3rlpy's IQL, from a data set of Minari: episodes of a shipped controller with noise."""

import os
from pathlib import Path

import gymnasium
import numpy as np

os.environ["MINARI_DATASETS_PATH"] = str(Path("datasets").resolve())

import d3rlpy
import minari
from judged import ID, KEYWORDS, Clock, mean_return, report

import agents

NAME = "railenv/bogie/yaw-rate-v0"
EPISODES, UPDATES = 60, 10_000

if NAME in minari.list_local_datasets():
    minari.delete_dataset(NAME)
controller = agents.shipped("yaw-rate")
width = len(controller.readings)
rng = np.random.default_rng(0)
env = minari.DataCollector(gymnasium.make(ID, **KEYWORDS))
for seed in range(EPISODES):
    observation, _ = env.reset(seed=seed, options={"offset": 0.006})
    controller.reset()
    ended = False
    while not ended:
        command = controller.act(observation[:width]) + 0.05 * rng.standard_normal(1)
        action = np.clip(command, -1.0, 1.0).astype(np.float32)
        observation, _, terminated, truncated, _ = env.step(action)
        ended = terminated or truncated
env.create_dataset(NAME)

d3rlpy.seed(1)
# datasets.get_minari of d3rlpy 2.8.1 joins all T + 1 observations of an episode to its T actions, so
# that from the second episode on they do not belong together; here the last one is left out
episodes = list(minari.load_dataset(NAME))
dataset = d3rlpy.dataset.MDPDataset(
    observations=np.concatenate([e.observations[:-1] for e in episodes]),
    actions=np.concatenate([e.actions for e in episodes]),
    rewards=np.concatenate([e.rewards for e in episodes]),
    terminals=np.concatenate([e.terminations for e in episodes]),
    timeouts=np.concatenate([e.truncations for e in episodes]),
)
network = d3rlpy.models.VectorEncoderFactory([64, 64])
learner = d3rlpy.algos.IQLConfig(
    gamma=0.98,
    actor_learning_rate=1e-3,
    critic_learning_rate=1e-3,
    actor_encoder_factory=network,
    critic_encoder_factory=network,
    value_encoder_factory=network,
    observation_scaler=d3rlpy.preprocessing.StandardObservationScaler(),
).create(device="cpu:0")
learner.build_with_dataset(dataset)
scaler = learner.observation_scaler  # which fit() would make itself; the untrained policy needs it, too
scaler.fit_with_transition_picker(dataset.episodes, dataset.transition_picker)


def act(observation):
    return learner.predict(observation[None])[0]


before = mean_return(act)
clock = Clock()
learner.fit(
    dataset,
    n_steps=UPDATES,
    n_steps_per_epoch=UPDATES,
    show_progress=False,
    logger_adapter=d3rlpy.logging.NoopAdapterFactory(),
)
report(
    f"`MDPDataset` of a data set of Minari, `IQL`; {EPISODES} episodes, steps are updates",
    steps=UPDATES,
    seconds=clock.seconds,
    before=before,
    after=mean_return(act),
)
