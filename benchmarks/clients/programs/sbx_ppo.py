"""SBX's PPO, in JAX."""

from judged import ID, KEYWORDS, Clock, mean_return, report
from sbx import PPO
from stable_baselines3.common.env_util import make_vec_env

STEPS = 40960

env = make_vec_env(ID, n_envs=4, seed=1, env_kwargs=KEYWORDS)
model = PPO("MlpPolicy", env, seed=1, gamma=0.98, n_steps=512, batch_size=128)


def act(observation):
    return model.predict(observation, deterministic=True)[0]


before = mean_return(act)
clock = Clock()
model.learn(STEPS)
report(
    "`PPO` on `make_vec_env`",
    steps=STEPS,
    seconds=clock.seconds,
    before=before,
    after=mean_return(act),
)
