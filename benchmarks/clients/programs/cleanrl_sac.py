"""CleanRL's ``sac_continuous_action.py``."""

import torch
from cleanrl_files import trained
from judged import Clock, mean_return, report

STEPS = 10_000

torch.set_num_threads(1)
clock = Clock()
options = [
    "--learning-starts",
    "1000",
    "--gamma",
    "0.98",
    "--buffer-size",
    "20000",
    "--batch-size",
    "128",
]
script = trained("sac_continuous_action.py", "--total-timesteps", f"{STEPS}", *options)
seconds = clock.seconds


def act_of(actor):
    def act(observation):
        with torch.no_grad():
            return actor.get_action(torch.as_tensor(observation[None]))[2].numpy()

    return act


torch.manual_seed(0)
report(
    "`sac_continuous_action.py --env-id`, changed in three lines for Gymnasium 1",
    steps=STEPS,
    seconds=seconds,
    before=mean_return(act_of(script.Actor(script.envs))),
    after=mean_return(act_of(script.actor)),
)
