"""TorchRL's PPO on ``GymEnv`` by its id."""

import torch
from judged import ID, KEYWORDS, Clock, mean_return, report
from tensordict.nn import NormalParamExtractor, TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import GymEnv, RewardSum, StepCounter, TransformedEnv
from torchrl.envs.utils import check_env_specs
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

FRAMES, BATCH = 20480, 2048

torch.manual_seed(0)
torch.set_num_threads(1)
env = GymEnv(ID, **KEYWORDS)
check_env_specs(env)
env = TransformedEnv(env)
env.append_transform(StepCounter())
env.append_transform(RewardSum())
env.set_seed(0)
n, m = env.observation_spec["observation"].shape[-1], env.action_spec.shape[-1]


def layers(outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(n, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)
    )


net = nn.Sequential(layers(2 * m), NormalParamExtractor())
actor = ProbabilisticActor(
    TensorDictModule(net, in_keys=["observation"], out_keys=["loc", "scale"]),
    in_keys=["loc", "scale"],
    spec=env.action_spec,
    distribution_class=TanhNormal,
    distribution_kwargs={"low": -1.0, "high": 1.0},
    return_log_prob=True,
)
critic = ValueOperator(layers(1), in_keys=["observation"])
advantage = GAE(gamma=0.98, lmbda=0.95, value_network=critic, average_gae=True)
loss = ClipPPOLoss(actor, critic, clip_epsilon=0.2, entropy_coeff=0.0)
optimizer = torch.optim.Adam(loss.parameters(), lr=1e-3)


def act(observation):
    with torch.no_grad():
        return torch.tanh(net(torch.as_tensor(observation))[0]).numpy()


before = mean_return(act)
clock = Clock()
collector = Collector(env, actor, frames_per_batch=BATCH, total_frames=FRAMES)
for data in collector:
    for _ in range(10):
        with torch.no_grad():
            advantage(data)
        rows = data.reshape(-1)
        for index in torch.randperm(len(rows)).split(128):
            losses = loss(rows[index])
            total = losses["loss_objective"] + losses["loss_critic"]
            optimizer.zero_grad()
            total.backward()
            nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
            optimizer.step()
collector.shutdown()
report(
    "`ClipPPOLoss`, `Collector`, `GymEnv`; `check_env_specs`",
    steps=FRAMES,
    seconds=clock.seconds,
    before=before,
    after=mean_return(act),
)
