"""Networks for Stable-Baselines3 with the mirror symmetry of track and vehicle.

The mirror image of a motion needs the mirror image of the moment. An odd actor has this by
construction: ``(f(x) - f(S x)) / 2`` with S the signs by which observations change. Zero deviation then
gets zero moment. Critics of PPO and A2C are even: ``(g(x) + g(S x)) / 2``. Needs the extra ``rl``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib.tqc.policies import Actor as TQCActor
from sb3_contrib.tqc.policies import TQCPolicy
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN, SACPolicy
from stable_baselines3.sac.policies import Actor as SACActor
from stable_baselines3.td3.policies import Actor as TD3Actor
from stable_baselines3.td3.policies import TD3Policy
from torch import Tensor, nn


class Mirrored(nn.Module):
    """The odd or the even part of a network.

    Parameters
    ----------
    net : Module
    signs : sequence of float
        +1 or -1 for every input.
    parity : {-1, 1}
        -1 for odd, 1 for even.
    """

    signs: Tensor

    def __init__(self, net: nn.Module, signs: Sequence[float], parity: int) -> None:
        super().__init__()
        self.net = net
        self.parity = parity
        self.register_buffer("signs", torch.tensor(signs, dtype=torch.float32))

    def forward(self, x: Tensor) -> Tensor:
        """Return the part's value."""
        there, mirrored = self.net(torch.cat([x, x * self.signs])).chunk(2)
        return 0.5 * (there + self.parity * mirrored)


def _without_bias(layer: nn.Linear) -> None:
    """Fix a bias at zero: it would not be odd."""
    with torch.no_grad():
        layer.bias.zero_()
    layer.bias.requires_grad_(False)


class MirrorActorCriticPolicy(ActorCriticPolicy):
    """Policy for PPO and A2C with an odd actor and an even critic; takes ``signs``."""

    def __init__(self, *args: Any, signs: Sequence[float], **kwargs: Any) -> None:
        self.signs = list(signs)
        super().__init__(*args, **kwargs)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        _without_bias(self.action_net)  # type: ignore[arg-type]

    def _build_mlp_extractor(self) -> None:
        super()._build_mlp_extractor()
        extractor: Any = self.mlp_extractor
        extractor.policy_net = Mirrored(extractor.policy_net, self.signs, -1)
        extractor.value_net = Mirrored(extractor.value_net, self.signs, 1)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "signs": self.signs}


class _OddGaussianActor:
    """The common part of the actors of SAC and TQC: an odd mean and an even spread."""

    features_extractor: Any
    mu: Any
    log_std: Any

    def _mirror(self, signs: Sequence[float]) -> None:
        latent: Any = self.latent_pi  # type: ignore[attr-defined]
        self.signs = list(signs)
        self.odd = Mirrored(latent, self.signs, -1)
        self.even = Mirrored(latent, self.signs, 1)
        _without_bias(self.mu)

    def get_action_dist_params(self, obs: Any) -> tuple[Tensor, Tensor, dict[str, Tensor]]:
        """Return mean and logarithm of the spread."""
        features = self.extract_features(obs, self.features_extractor)  # type: ignore[attr-defined]
        spread = self.log_std(self.even(features))
        return self.mu(self.odd(features)), torch.clamp(spread, LOG_STD_MIN, LOG_STD_MAX), {}

    def _get_constructor_parameters(self) -> dict[str, Any]:
        own: dict[str, Any] = super()._get_constructor_parameters()  # type: ignore[misc]
        return {**own, "signs": self.signs}


class MirrorSACActor(_OddGaussianActor, SACActor):
    """Actor of SAC whose mean is odd and whose spread is even."""

    def __init__(self, *args: Any, signs: Sequence[float], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._mirror(signs)


class MirrorTQCActor(_OddGaussianActor, TQCActor):
    """Actor of TQC whose mean is odd and whose spread is even."""

    def __init__(self, *args: Any, signs: Sequence[float], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._mirror(signs)


class MirrorSACPolicy(SACPolicy):
    """Policy for SAC with an odd actor; takes ``signs``."""

    def __init__(self, *args: Any, signs: Sequence[float], **kwargs: Any) -> None:
        self.signs = list(signs)
        super().__init__(*args, **kwargs)

    def make_actor(self, features_extractor: Any = None) -> MirrorSACActor:
        """Return a new actor."""
        keywords = self._update_features_extractor(self.actor_kwargs, features_extractor)
        return MirrorSACActor(**keywords, signs=self.signs).to(self.device)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "signs": self.signs}


class MirrorTQCPolicy(TQCPolicy):
    """Policy for TQC with an odd actor; takes ``signs``."""

    def __init__(self, *args: Any, signs: Sequence[float], **kwargs: Any) -> None:
        self.signs = list(signs)
        super().__init__(*args, **kwargs)

    def make_actor(self, features_extractor: Any = None) -> MirrorTQCActor:
        """Return a new actor."""
        keywords = self._update_features_extractor(self.actor_kwargs, features_extractor)
        return MirrorTQCActor(**keywords, signs=self.signs).to(self.device)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "signs": self.signs}


class MirrorTD3Actor(TD3Actor):
    """Actor of TD3 that is odd."""

    def __init__(self, *args: Any, signs: Sequence[float], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.signs = list(signs)
        *layers, squash = self.mu
        self.mu = nn.Sequential(Mirrored(nn.Sequential(*layers), self.signs, -1), squash)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "signs": self.signs}


class MirrorTD3Policy(TD3Policy):
    """Policy for TD3 with an odd actor; takes ``signs``."""

    def __init__(self, *args: Any, signs: Sequence[float], **kwargs: Any) -> None:
        self.signs = list(signs)
        super().__init__(*args, **kwargs)

    def make_actor(self, features_extractor: Any = None) -> MirrorTD3Actor:
        """Return a new actor."""
        keywords = self._update_features_extractor(self.actor_kwargs, features_extractor)
        return MirrorTD3Actor(**keywords, signs=self.signs).to(self.device)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "signs": self.signs}


class MirroredMeanStd(RunningMeanStd):
    """Running statistics of observations together with their mirror images.

    The mean of quantities that change sign is then zero, and their variance the mean square.
    """

    def __init__(self, signs: NDArray[np.float64]) -> None:
        super().__init__(shape=signs.shape)
        self.odd = signs < 0.0

    def update(self, arr: NDArray[Any]) -> None:
        """Add a batch of observations, shape (count, n)."""
        values = np.asarray(arr, dtype=float)
        mean, var = values.mean(axis=0), values.var(axis=0)
        var = np.where(self.odd, var + mean**2, var)
        self.update_from_moments(np.where(self.odd, 0.0, mean), var, len(values))
