"""Gymnasium's own checks, vectorisation and wrappers on the environments, single and vector."""

import pickle
import warnings

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import vector as wrappers_of_vectors
from judged import KEYWORDS, Clock, mean_return, report

IDS = ("railenv/Bogie-v1", "railenv/DualWheelset-v1", "railenv/Coach-v1")
STEPS = 300
SHORT = {"duration": 0.5, "observation": "sensors"}

clock = Clock()
warnings.simplefilter("error")  # of which check_env makes its advice
for name in IDS:
    check_env(gymnasium.make(name, **SHORT).unwrapped, skip_render_check=True)
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        for single in (gymnasium.make(name, **SHORT), gymnasium.make(f"railenv:{name}", **SHORT)):
            assert pickle.loads(pickle.dumps(single.spec)) == single.spec

env = gymnasium.make("railenv/Bogie-v1", **KEYWORDS)
env = gymnasium.wrappers.RecordEpisodeStatistics(env)
env = gymnasium.wrappers.ClipAction(env)
env = gymnasium.wrappers.NormalizeObservation(env)
env = gymnasium.wrappers.FrameStackObservation(env, 4)
env = gymnasium.wrappers.NormalizeReward(env, gamma=0.98)
env = gymnasium.wrappers.TimeLimit(env, 50)
env.reset(seed=0)
for _ in range(50):
    *_, truncated, info = env.step(5.0 * env.action_space.sample())
assert truncated
assert info["episode"]["l"] == 50
assert info["distance"] > 0.0  # metrics of an episode that the wrapper ends

for mode in AutoresetMode:
    one = gymnasium.make_vec("railenv/Bogie-v1", 3, autoreset_mode=mode, **SHORT)
    other = SyncVectorEnv(
        [lambda: gymnasium.make("railenv/Bogie-v1", **SHORT)] * 3, autoreset_mode=mode
    )
    found = [envs.reset(seed=7) for envs in (one, other)]
    one.action_space.seed(0)
    for _ in range(STEPS):
        assert data_equivalence(*found)
        actions = one.action_space.sample()
        found = [envs.step(actions) for envs in (one, other)]
        ended = found[0][2] | found[0][3]
        if mode is AutoresetMode.DISABLED and ended.any():
            found = [envs.reset(options={"reset_mask": ended.copy()}) for envs in (one, other)]

envs = gymnasium.make_vec("railenv/Bogie-v1", 3, vectorization_mode="async", **SHORT)
envs.reset(seed=0)
envs.step(envs.action_space.sample())
envs.close()

envs = gymnasium.make_vec("railenv/Bogie-v1", 4, **SHORT)
for wrapper in (
    wrappers_of_vectors.RecordEpisodeStatistics,
    wrappers_of_vectors.ClipAction,
    wrappers_of_vectors.NormalizeObservation,
    wrappers_of_vectors.NormalizeReward,
    wrappers_of_vectors.DictInfoToList,
):
    envs = wrapper(envs)
envs.reset(seed=0)
for _ in range(STEPS):
    observations, *_ = envs.step(envs.action_space.sample())
    assert np.isfinite(observations).all()
report(
    "`check_env` of three ids, 10 wrappers, `SyncVectorEnv` against the vector environment in each "
    "autoreset mode, `AsyncVectorEnv`",
    seconds=clock.seconds,
    idle=round(mean_return(lambda observation: np.zeros(1)), 1),
)
