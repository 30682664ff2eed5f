"""Tianshou's PPO by its builder of experiments, on an environment by its id."""

import torch
from judged import ID, KEYWORDS, Clock, mean_return, report
from tianshou.highlevel.config import OnPolicyTrainingConfig
from tianshou.highlevel.env import EnvFactoryRegistered, VectorEnvType
from tianshou.highlevel.experiment import ExperimentConfig, PPOExperimentBuilder
from tianshou.highlevel.params.algorithm_params import PPOParams

torch.set_num_threads(1)

experiment = (
    PPOExperimentBuilder(
        EnvFactoryRegistered(task=ID, venv_type=VectorEnvType.DUMMY, **KEYWORDS),
        ExperimentConfig(seed=0, persistence_enabled=False, watch=False),
        OnPolicyTrainingConfig(
            max_epochs=1,
            epoch_num_steps=40960,
            num_training_envs=8,
            num_test_envs=2,
            collection_step_num_env_steps=2048,
            update_step_num_repetitions=10,
            batch_size=128,
        ),
    )
    .with_ppo_params(PPOParams(gamma=0.98, lr=1e-3))
    .with_actor_factory_default((64, 64))
    .with_critic_factory_default((64, 64))
    .build()
)
world = experiment.create_experiment_world()
policy = world.algorithm.policy


def act(observation):
    with torch.no_grad():
        return policy.compute_action(observation)


policy.eval()
before = mean_return(act)
clock = Clock()
world.trainer.run()
seconds = clock.seconds
policy.eval()
report(
    "`PPOExperimentBuilder` with `EnvFactoryRegistered`",
    steps=40960,
    seconds=seconds,
    before=before,
    after=mean_return(act),
)
