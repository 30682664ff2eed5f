"""Learn a controller from a data set alone, by TD3+BC in plain torch (extras ``offline`` and ``rl``).

``python -m examples.offline_datasets`` first; then ``python -m examples.learn_offline`` learns from the
mixed data set in a few minutes, and says what the policy is worth: its return in the environment, and
the critical speed of the vehicle with it. After Fujimoto & Gu, "A minimalist approach to offline
reinforcement learning" (2021). The actor is odd under the mirror symmetry of the track, so that it
commands nothing where nothing deviates.
"""

from __future__ import annotations

import argparse
import copy
import os
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import minari
import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

import agents
import design
from agents.controllers.memory import Memory, MemorySettings
from agents.controllers.network import Network, Normalization
from agents.evaluation.returns import episode_returns


@dataclass(frozen=True)
class Options:
    updates: int = 20_000
    batch: int = 256
    learning_rate: float = 1e-3
    gamma: float = 0.99
    tau: float = 0.005
    alpha: float = 2.5  # weight of the return against the distance from the data
    noise: float = 0.2
    noise_clip: float = 0.5
    policy_delay: int = 2
    hidden: int = 64
    seed: int = 0


def layers(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    first, second = nn.Linear(inputs, hidden), nn.Linear(hidden, hidden)
    return nn.Sequential(first, nn.ReLU(), second, nn.ReLU(), nn.Linear(hidden, outputs))


class Actor(nn.Module):
    """Odd in the inputs that change sign in the mirror; inputs are divided by their spread."""

    def __init__(self, scale: np.ndarray, signs: np.ndarray, hidden: int, outputs: int) -> None:
        super().__init__()
        self.net = layers(len(scale), hidden, outputs)
        self.register_buffer("scale", torch.as_tensor(scale, dtype=torch.float32))
        self.register_buffer("signs", torch.as_tensor(signs, dtype=torch.float32))

    def forward(self, x: Tensor) -> Tensor:
        x = x / self.scale
        return torch.tanh(0.5 * (self.net(x) - self.net(x * self.signs)))


class Critic(nn.Module):
    """Two estimates of the return."""

    def __init__(self, scale: np.ndarray, hidden: int, actions: int) -> None:
        super().__init__()
        self.nets = nn.ModuleList(layers(len(scale) + actions, hidden, 1) for _ in range(2))
        self.register_buffer("scale", torch.as_tensor(scale, dtype=torch.float32))

    def forward(self, x: Tensor, action: Tensor) -> Tensor:
        joined = torch.cat([x / self.scale, action], dim=-1)
        return torch.cat([net(joined) for net in self.nets], dim=-1)


def transitions(dataset: minari.MinariDataset) -> list[Tensor]:
    """Return observations, actions, rewards, next observations and terminations of all steps."""
    parts: list[list[np.ndarray]] = [[] for _ in range(5)]
    for episode in dataset.iterate_episodes():
        found = episode.observations, episode.actions, episode.rewards, episode.terminations
        observations, actions, rewards, terminations = (np.asarray(x, dtype=np.float32) for x in found)
        row = (observations[:-1], actions, rewards, observations[1:], terminations)
        for part, array in zip(parts, row, strict=True):
            part.append(array)
    return [torch.as_tensor(np.concatenate(part)) for part in parts]


def learn(dataset: minari.MinariDataset, signs: np.ndarray, options: Options) -> Actor:
    """Return the actor that TD3+BC finds; it never acts in an environment."""
    o = options
    torch.set_num_threads(1)  # more are slower for networks this small
    torch.manual_seed(o.seed)
    data = transitions(dataset)
    scale = data[0].pow(2).mean(dim=0).sqrt().numpy() + 1e-3
    count = data[1].shape[1]
    actor, critic = Actor(scale, signs, o.hidden, count), Critic(scale, o.hidden, count)
    actor_target, critic_target = copy.deepcopy(actor), copy.deepcopy(critic)
    actor_optimizer = torch.optim.Adam(actor.parameters(), o.learning_rate)
    critic_optimizer = torch.optim.Adam(critic.parameters(), o.learning_rate)
    for update in range(o.updates):
        rows = torch.randint(len(data[0]), (o.batch,))
        x, action, reward, following, terminated = (part[rows] for part in data)
        with torch.no_grad():
            noise = (o.noise * torch.randn_like(action)).clamp(-o.noise_clip, o.noise_clip)
            next_action = (actor_target(following) + noise).clamp(-1.0, 1.0)
            value = critic_target(following, next_action).min(dim=-1).values
            target = reward + o.gamma * (1.0 - terminated) * value
        critic_loss = F.mse_loss(critic(x, action), target[:, None].expand(-1, 2))
        critic_optimizer.zero_grad()
        critic_loss.backward()
        critic_optimizer.step()
        if update % o.policy_delay:
            continue
        chosen = actor(x)
        value = critic(x, chosen)[:, 0]
        weight = o.alpha / value.detach().abs().mean()
        actor_loss = F.mse_loss(chosen, action) - weight * value.mean()
        actor_optimizer.zero_grad()
        actor_loss.backward()
        actor_optimizer.step()
        with torch.no_grad():
            for net, slow in ((actor, actor_target), (critic, critic_target)):
                for new, old in zip(net.parameters(), slow.parameters(), strict=True):
                    old.lerp_(new, o.tau)
    return actor


def mirror_signs(env: gymnasium.Env) -> np.ndarray:
    """Return by which sign each entry of an observation changes in the mirror image of the track."""
    fleet, settings = env.unwrapped.fleet, env.unwrapped.settings
    memory = MemorySettings(history=settings.history)
    readings, commands = tuple(fleet.observation_table), tuple(fleet.model.command_names)
    return Memory(memory, readings, commands, settings.control_period, None).signs


def controller(actor: Actor, env: gymnasium.Env) -> agents.LearnedPolicy:
    """Return an actor as a controller, which can be evaluated, linearised and saved."""
    fleet, settings = env.unwrapped.fleet, env.unwrapped.settings
    linear = [layer for layer in actor.net if isinstance(layer, nn.Linear)]

    def plain(tensor: Tensor) -> np.ndarray:
        return tensor.detach().numpy().astype(float)

    network = Network(
        tuple(plain(layer.weight) for layer in linear),
        tuple(plain(layer.bias) for layer in linear),
        "relu",
        "tanh",
        Normalization(np.zeros(len(actor.scale)), plain(actor.scale), 1e9),
        plain(actor.signs),
    )
    return agents.LearnedPolicy(
        network,
        tuple(fleet.observation_table),
        tuple(fleet.model.command_names),
        fleet.model.limits,
        settings.observation,
        MemorySettings(history=settings.history),
        period=settings.control_period,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dataset", default="railenv/bogie/mixed-v0")
    parser.add_argument("--folder", type=Path, default=Path("datasets"), help="of the data sets")
    parser.add_argument("--updates", type=int, default=Options.updates)
    parser.add_argument("--out", type=Path, help="file to save the controller to")
    given = parser.parse_args()
    os.environ["MINARI_DATASETS_PATH"] = str(given.folder.resolve())  # the only way to tell Minari
    dataset = minari.load_dataset(given.dataset)
    env = dataset.recover_environment()
    policy = controller(learn(dataset, mirror_signs(env), Options(updates=given.updates)), env)
    if given.out:
        policy.save(given.out)
    worst, best = dataset.storage.metadata["ref_min_score"], dataset.storage.metadata["ref_max_score"]
    found = episode_returns(env.spec.id, policy, episodes=20, seed=1000, env_kwargs=env.spec.kwargs)
    print(f"mean return {found.mean:.1f}; of random commands {worst:.1f}, of the expert {best:.1f}")
    vehicle = env.unwrapped.fleet.model
    print("without control:", design.critical_speed(vehicle))
    print("with the policy:", design.critical_speed(vehicle, controller=policy))


if __name__ == "__main__":
    main()
