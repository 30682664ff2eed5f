"""CleanRL's ``ppo_continuous_action.py``."""

import gymnasium
import numpy as np
import torch
from cleanrl_files import trained
from judged import Clock, mean_return, report

STEPS = 40960

torch.set_num_threads(1)
clock = Clock()
options = ["--num-envs", "4", "--num-steps", "512", "--gamma", "0.98", "--learning-rate", "1e-3"]
script = trained("ppo_continuous_action.py", "--total-timesteps", f"{STEPS}", *options)
seconds = clock.seconds


def act_of(agent, mean, variance):
    def act(observation):
        seen = np.clip((observation - mean) / np.sqrt(variance + 1e-8), -10, 10)
        with torch.no_grad():
            return agent.actor_mean(torch.as_tensor(seen, dtype=torch.float32)).numpy()

    return act


wrapper = script.envs.envs[0]  # its running mean and variance, with which the agent saw
while not isinstance(wrapper, gymnasium.wrappers.NormalizeObservation):
    wrapper = wrapper.env
seen = wrapper.obs_rms.mean, wrapper.obs_rms.var
torch.manual_seed(0)
report(
    "`ppo_continuous_action.py --env-id`, changed in three lines for Gymnasium 1",
    steps=STEPS,
    seconds=seconds,
    before=mean_return(act_of(script.Agent(script.envs), 0.0, 1.0)),
    after=mean_return(act_of(script.agent, *seen)),
)
