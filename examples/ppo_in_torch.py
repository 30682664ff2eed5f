"""Proximal policy optimisation in one file of torch, on the vector environment without any library.

``python -m examples.ppo_in_torch`` trains for about a minute. After Schulman et al., "Proximal policy
optimization algorithms" (2017), with the implementation details that matter: advantages by
generalised advantage estimation, normalised; bootstrapping where time ends an episode.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import Tensor, nn


@dataclass(frozen=True)
class Options:
    iterations: int = 60
    n_envs: int = 64
    n_steps: int = 64
    epochs: int = 8
    batch: int = 1024
    learning_rate: float = 2e-3
    gamma: float = 0.99
    lam: float = 0.95
    clip: float = 0.2
    seed: int = 0


ENV = {
    "observation": "state",
    "speed_range": (130.0, 130.0),  # above the critical speed, 114 m/s
    "tangent_share": 1.0,
    "duration": 2.0,
}


class ActorCritic(nn.Module):
    def __init__(self, n_observations: int, n_actions: int) -> None:
        super().__init__()

        def layers(n_out: int, gain: float) -> nn.Sequential:
            net = nn.Sequential(
                nn.Linear(n_observations, 64),
                nn.Tanh(),
                nn.Linear(64, 64),
                nn.Tanh(),
                nn.Linear(64, n_out),
            )
            nn.init.orthogonal_(net[-1].weight, gain)
            return net

        self.actor, self.critic = layers(n_actions, 0.01), layers(1, 1.0)
        self.log_std = nn.Parameter(torch.full((n_actions,), -1.0))

    def distribution(self, x: Tensor) -> torch.distributions.Normal:
        return torch.distributions.Normal(self.actor(x), self.log_std.exp())

    def value(self, x: Tensor) -> Tensor:
        return self.critic(x).squeeze(-1)


class Normalizer:
    """Running mean and spread of the observations."""

    def __init__(self, size: int) -> None:
        self.count, self.mean, self.square = 1e-4, np.zeros(size), np.ones(size)

    def __call__(self, x: np.ndarray, update: bool = True) -> Tensor:
        if update:
            self.count += len(x)
            share = len(x) / self.count
            self.mean += share * (x.mean(axis=0) - self.mean)
            self.square += share * ((x**2).mean(axis=0) - self.square)
        std = np.sqrt(np.maximum(self.square - self.mean**2, 0.0) + 1e-8)
        return torch.as_tensor(np.clip((x - self.mean) / std, -10, 10), dtype=torch.float32)


def train(options: Options) -> list[float]:
    """Return the mean reward of a step in each iteration."""
    o = options
    torch.set_num_threads(1)  # more are slower for networks this small
    torch.manual_seed(o.seed)
    env = gymnasium.make_vec(
        "railenv/Bogie-v1",
        o.n_envs,
        vectorization_mode="vector_entry_point",
        autoreset_mode=AutoresetMode.SAME_STEP,
        **ENV,
    )
    n, m = env.single_observation_space.shape[0], env.single_action_space.shape[0]
    net, normalize = ActorCritic(n, m), Normalizer(n)
    optimizer = torch.optim.Adam(net.parameters(), o.learning_rate, eps=1e-5)
    observation, _ = env.reset(seed=o.seed)
    x = normalize(observation)
    means = []
    for iteration in range(o.iterations):
        steps = []
        for _ in range(o.n_steps):
            with torch.no_grad():
                spread = net.distribution(x)
                action = spread.sample()
                old, value = spread.log_prob(action).sum(-1), net.value(x)
            observation, reward, terminated, truncated, info = env.step(action.clamp(-1, 1).numpy())
            reward = torch.as_tensor(reward, dtype=torch.float32)
            done = torch.as_tensor(terminated | truncated)
            following = normalize(observation)
            after = torch.zeros(o.n_envs)
            if done.any():  # where time ended the episode, what would have followed counts
                rows = np.flatnonzero(truncated & ~terminated)
                if len(rows):
                    last = normalize(np.stack(info["final_obs"][rows].tolist()), update=False)
                    after[rows] = net.value(last).detach()
            steps.append((x, action, old, value, reward + o.gamma * after, done))
            means.append(float(reward.mean()))
            x = following
        xs, actions, olds, values, rewards, dones = (
            torch.stack(parts) for parts in zip(*steps, strict=True)
        )
        advantages = generalized_advantages(o, values, rewards, dones, net.value(x).detach())
        data = [part.flatten(0, 1) for part in (xs, actions, olds, advantages, advantages + values)]
        for group in optimizer.param_groups:
            group["lr"] = o.learning_rate * (1.0 - iteration / o.iterations)
        improve(o, net, optimizer, data)
    return np.array(means).reshape(o.iterations, -1).mean(axis=1).tolist()


def generalized_advantages(
    o: Options, values: Tensor, rewards: Tensor, dones: Tensor, last: Tensor
) -> Tensor:
    advantages, running, following = torch.zeros_like(rewards), torch.zeros(o.n_envs), last
    for t in reversed(range(len(rewards))):
        going = 1.0 - dones[t].float()
        delta = rewards[t] + o.gamma * going * following - values[t]
        running = delta + o.gamma * o.lam * going * running
        advantages[t], following = running, values[t]
    return advantages


def improve(o: Options, net: ActorCritic, optimizer: torch.optim.Optimizer, data: list[Tensor]) -> None:
    for _ in range(o.epochs):
        for rows in torch.randperm(len(data[0])).split(o.batch):
            x, action, old, advantage, target = (part[rows] for part in data)
            ratio = (net.distribution(x).log_prob(action).sum(-1) - old).exp()
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            gain = torch.min(ratio * advantage, ratio.clamp(1 - o.clip, 1 + o.clip) * advantage)
            loss = -gain.mean() + 0.5 * (net.value(x) - target).square().mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(net.parameters(), 0.5)
            optimizer.step()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--iterations", type=int, default=Options.iterations)
    means = train(Options(iterations=parser.parse_args().iterations))
    for k in sorted({round(math.exp(v)) for v in np.linspace(0.0, math.log(len(means)), 12)}):
        print(f"iteration {k:4d}: mean reward of a step {means[k - 1]:.4f}")


if __name__ == "__main__":
    main()
