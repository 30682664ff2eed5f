"""CleanRL's single files, run as scripts; three of their lines are of Gymnasium before 1.0.

``TransformObservation`` did not want the space of the observations then, and a vector environment
gave the last observation of an episode as ``final_observation``, with the reset in the same step, and
``final_info`` as a list, from which they log.
"""

import os
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

import gymnasium
from judged import ID, KEYWORDS

SOURCE = Path(os.environ["CLIENT_SOURCE"])
CHANGES = {
    "lambda obs: np.clip(obs, -10, 10))": "lambda obs: np.clip(obs, -10, 10), env.observation_space)",
    'if "final_info" in infos:': "if False:",
    'infos["final_observation"]': 'infos["final_obs"]',
    "for i in range(args.num_envs)]\n    )": "for i in range(args.num_envs)],\n"
    "        autoreset_mode=gym.vector.AutoresetMode.SAME_STEP,\n    )",
}


def trained(script: str, *options: str) -> SimpleNamespace:
    """Run a script, and return its global names."""
    gymnasium.register("Hunting-v0", lambda **more: gymnasium.make(ID, **KEYWORDS, **more).unwrapped)
    text = (SOURCE / "cleanrl" / script).read_text(encoding="utf-8")
    for old, new in CHANGES.items():
        text = text.replace(old, new)
    path = Path(script)
    path.write_text(text, encoding="utf-8")
    sys.path.insert(0, str(SOURCE))  # cleanrl_utils
    sys.argv = [script, "--env-id", "Hunting-v0", "--seed", "0", "--no-cuda", *options]
    return SimpleNamespace(**runpy.run_path(str(path), run_name="__main__"))
