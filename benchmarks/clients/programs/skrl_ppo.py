"""skrl's PPO on the vector environment, which ``wrap_env`` tells by itself."""

import gymnasium
import torch
from judged import ID, KEYWORDS, Clock, mean_return, report
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from torch import nn

set_seed(0)
torch.set_num_threads(1)


def layers(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)
    )


class Policy(GaussianMixin, Model):
    def __init__(self, **spaces):
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self, clip_actions=False)
        self.net = layers(self.num_observations, self.num_actions)
        self.log_std = nn.Parameter(torch.full((self.num_actions,), -0.5))

    def compute(self, inputs, role=""):
        return self.net(inputs["observations"]), {"log_std": self.log_std}


class Value(DeterministicMixin, Model):
    def __init__(self, **spaces):
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.net = layers(self.num_observations, 1)

    def compute(self, inputs, role=""):
        return self.net(inputs["observations"]), {}


env = wrap_env(gymnasium.make_vec(ID, num_envs=32, **KEYWORDS))
spaces = {
    "observation_space": env.observation_space,
    "action_space": env.action_space,
    "device": "cpu",
}
policy, value = Policy(**spaces), Value(**spaces)
config = PPO_CFG(
    rollouts=64, learning_epochs=10, mini_batches=16, discount_factor=0.98, learning_rate=1e-3
)
config.experiment.write_interval = 0
config.experiment.checkpoint_interval = 0
agent = PPO(
    models={"policy": policy, "value": value},
    memory=RandomMemory(memory_size=64, num_envs=32, device="cpu"),
    cfg=config,
    **spaces,
)


def act(observation):
    with torch.no_grad():
        return policy.net(torch.as_tensor(observation)).numpy()


before = mean_return(act)
clock = Clock()
rounds = 64 * 20
trainer = SequentialTrainer(
    env=env, agents=agent, cfg={"timesteps": rounds, "headless": True, "disable_progressbar": True}
)
trainer.train()
report(
    "`PPO` on `wrap_env(gymnasium.make_vec(...))`",
    steps=32 * rounds,
    seconds=clock.seconds,
    before=before,
    after=mean_return(act),
)
