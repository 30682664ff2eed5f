"""RLlib's PPO on an environment by its id with the module in front, as its workers need it."""

import numpy as np
import ray
import torch
from judged import ID, KEYWORDS, Clock, mean_return, report
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

BATCH, ITERATIONS = 2048, 20
NETWORK = DefaultModelConfig(fcnet_hiddens=[64, 64], fcnet_activation="tanh", vf_share_layers=False)

ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
config = (
    PPOConfig()
    .environment(f"railenv:{ID}", env_config=KEYWORDS)
    .env_runners(num_env_runners=1, num_envs_per_env_runner=4)
    .training(
        gamma=0.98,
        lr=1e-3,
        train_batch_size_per_learner=BATCH,
        minibatch_size=128,
        num_epochs=10,
        lambda_=0.95,
        grad_clip=0.5,
    )
    .rl_module(model_config=NETWORK)
    .debugging(seed=0)
)
algorithm = config.build_algo()


def act(observation):
    module = algorithm.get_module()
    with torch.no_grad():
        outputs = module.forward_inference({Columns.OBS: torch.as_tensor(observation[None])})
    mean, _ = np.split(outputs[Columns.ACTION_DIST_INPUTS].numpy()[0], 2)
    return mean


before = mean_return(act)
clock = Clock()
for _ in range(ITERATIONS):
    algorithm.train()
seconds = clock.seconds
after = mean_return(act)
algorithm.stop()
ray.shutdown()
report(
    f'`PPOConfig().environment("railenv:{ID}", env_config=...)`, one env runner',
    steps=BATCH * ITERATIONS,
    seconds=seconds,
    before=before,
    after=after,
)
