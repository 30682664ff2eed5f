"""SBX's SAC, in JAX."""

import gymnasium
from judged import ID, KEYWORDS, Clock, mean_return, report
from sbx import SAC

STEPS = 40_000

env = gymnasium.make(ID, **KEYWORDS)
model = SAC(
    "MlpPolicy",
    env,
    seed=1,
    gamma=0.98,
    learning_starts=1000,
    learning_rate=7e-4,
    batch_size=128,
    ent_coef="auto_0.1",
    train_freq=4,  # two updates for four steps
    gradient_steps=2,
    policy_kwargs={"net_arch": [64, 64]},
)


def act(observation):
    return model.predict(observation, deterministic=True)[0]


before = mean_return(act)
clock = Clock()
model.learn(STEPS)
report(
    "`SAC` on `gymnasium.make`",
    steps=STEPS,
    seconds=clock.seconds,
    before=before,
    after=mean_return(act),
)
