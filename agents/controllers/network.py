"""Small neural networks in plain NumPy, with their exact Jacobian, for learned policies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from railenv import checks
from railenv.errors import ParameterError

Array = NDArray[np.float64]

Activation = Literal["tanh", "relu", "elu"]
Squash = Literal["none", "tanh"]


def _elu(x: Array) -> Array:
    return np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0)))


_VALUES: dict[str, Callable[[Array], Array]] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": _elu,
}
_SLOPES: dict[str, Callable[[Array], Array]] = {
    "tanh": lambda x: 1.0 - np.tanh(x) ** 2,
    "relu": lambda x: (x > 0.0).astype(float),
    "elu": lambda x: np.where(x > 0.0, 1.0, np.exp(np.minimum(x, 0.0))),
}


def _check_real(arrays: Sequence[NDArray[Any]]) -> None:
    for array in arrays:
        if array.dtype.kind not in "fiu":
            raise ParameterError(f"an array of a network has the type {array.dtype}; it must be real")


@dataclass(frozen=True, eq=False)
class Normalization:
    """Shift, scale and bound of a network's inputs: ``clip((x - mean) / scale, -bound, bound)``.

    Attributes
    ----------
    mean, scale : ndarray, shape (n_inputs,)
    bound : float
    """

    mean: Array
    scale: Array
    bound: float

    def __post_init__(self) -> None:
        checks.number("bound of the normalisation", self.bound, low=0.0, open_low=True)
        _check_real((self.mean, self.scale))
        if self.mean.shape != self.scale.shape or self.mean.ndim != 1:
            raise ParameterError(
                f"mean and scale have shapes {self.mean.shape} and {self.scale.shape}; they must be "
                "vectors of one length"
            )
        if not (np.isfinite(self.mean).all() and np.isfinite(self.scale).all() and self.scale.all()):
            raise ParameterError("mean and scale must be finite, and scale not zero")

    def __call__(self, x: Array) -> Array:
        """Return normalised inputs."""
        return np.clip((x - self.mean) / self.scale, -self.bound, self.bound)

    def slopes(self, x: Array) -> Array:
        """Return the derivative of every normalised input by its own."""
        return (np.abs((x - self.mean) / self.scale) < self.bound) / self.scale


@dataclass(frozen=True, eq=False)
class Network:
    """Layers of a feed-forward network, optionally odd under the track's mirror symmetry.

    With f the layers and S the signs by which inputs change in the mirror image, an odd network
    returns ``(f(x) - f(S x)) / 2``: the mirrored motion gets the opposite action, and zero deviation
    gets zero action.

    Attributes
    ----------
    weights : tuple of ndarray
        Weights of the layers in turn, each of shape (n_outputs, n_inputs).
    biases : tuple of ndarray
        Biases of the layers, each of shape (n_outputs,).
    activation : {"tanh", "relu", "elu"}
        Function after every layer except the last.
    squash : {"none", "tanh"}
        Function after the last layer.
    normalization : Normalization
    signs : ndarray or None
        +1 or -1 for every input; None for a network that need not be odd.
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    activation: Activation
    squash: Squash
    normalization: Normalization
    signs: Array | None = None

    def __post_init__(self) -> None:
        checks.known("activation", [self.activation], get_args(Activation))
        checks.known("squash", [self.squash], get_args(Squash))
        width = len(self.normalization.mean)
        arrays = (*self.weights, *self.biases, *(() if self.signs is None else (self.signs,)))
        _check_real(arrays)
        if not self.weights or len(self.weights) != len(self.biases):
            raise ParameterError(
                f"the network has {len(self.weights)} weight matrices and {len(self.biases)} biases; "
                "it needs one of each for every layer"
            )
        for k, (W, b) in enumerate(zip(self.weights, self.biases, strict=True)):
            if W.ndim != 2 or W.shape[1] != width or b.shape != W.shape[:1]:
                raise ParameterError(
                    f"layer {k} has weights of shape {W.shape} and biases of shape {b.shape}; it has "
                    f"{width} inputs"
                )
            if not (np.isfinite(W).all() and np.isfinite(b).all()):
                raise ParameterError(f"layer {k} has weights or biases that are not finite")
            width = len(W)
        if self.signs is not None:
            if self.signs.shape != self.normalization.mean.shape or not (abs(self.signs) == 1).all():
                raise ParameterError("signs must be +1 or -1, one for every input")
            if self.normalization.mean[self.signs < 0].any():
                raise ParameterError(
                    "the network is odd, but inputs that change sign in the mirror have a mean that is "
                    "not zero in the normalisation"
                )

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.normalization.mean)

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.biases[-1])

    def __call__(self, x: Array) -> Array:
        """Return outputs for inputs of shape (count, n_inputs)."""
        value = self._raw(self.normalization(x))
        return np.tanh(value) if self.squash == "tanh" else value

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives of the outputs by the inputs at one point, (n_outputs, n_inputs)."""
        normalized = self.normalization(x)
        slope = self._slope(normalized)
        if self.signs is not None:
            slope = 0.5 * (slope - self._slope(self.signs * normalized) * self.signs)
        if self.squash == "tanh":
            slope = (1.0 - np.tanh(self._raw(normalized[None])[0]) ** 2)[:, None] * slope
        return np.asarray(slope * self.normalization.slopes(x))

    def _raw(self, x: Array) -> Array:
        if self.signs is None:
            return self._layers(x)
        return 0.5 * (self._layers(x) - self._layers(x * self.signs))

    def _layers(self, x: Array) -> Array:
        function = _VALUES[self.activation]
        for W, b in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = function(x @ W.T + b)
        return x @ self.weights[-1].T + self.biases[-1]

    def _slope(self, x: Array) -> Array:
        value, slope = _VALUES[self.activation], _SLOPES[self.activation]
        total: Array = np.eye(len(x))
        for W, b in zip(self.weights[:-1], self.biases[:-1], strict=True):
            before = W @ x + b
            total = slope(before)[:, None] * (W @ total)
            x = value(before)
        return np.asarray(self.weights[-1] @ total)

    # ------------------------------------------------------------------ files

    def header(self) -> dict[str, Any]:
        """Return everything that is not an array, for a file."""
        return {
            "layers": len(self.weights),
            "activation": self.activation,
            "squash": self.squash,
            "bound": self.normalization.bound,
            "odd": self.signs is not None,
        }

    def arrays(self) -> dict[str, Array]:
        """Return all arrays by their names in a file."""
        named = {"mean": self.normalization.mean, "scale": self.normalization.scale}
        if self.signs is not None:
            named["signs"] = self.signs
        for k, (W, b) in enumerate(zip(self.weights, self.biases, strict=True)):
            named |= {f"W{k}": W, f"b{k}": b}
        return named

    @staticmethod
    def names(header: dict[str, Any]) -> list[str]:
        """Return the names of the arrays that a file with this header must have."""
        layers = range(int(checks.number("layers", header["layers"], low=1.0, high=100.0)))
        named = ["mean", "scale", *(f"{kind}{k}" for k in layers for kind in "Wb")]
        return [*named, "signs"] if header["odd"] else named

    @classmethod
    def restore(cls, header: dict[str, Any], arrays: dict[str, Array]) -> Network:
        """Return the network of a file."""
        layers = range(int(header["layers"]))
        return cls(
            tuple(arrays[f"W{k}"] for k in layers),
            tuple(arrays[f"b{k}"] for k in layers),
            header["activation"],
            header["squash"],
            Normalization(arrays["mean"], arrays["scale"], header["bound"]),
            arrays.get("signs"),
        )
