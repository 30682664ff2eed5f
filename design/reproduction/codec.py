"""Results as plain data, and back: JSON for the structure, NumPy arrays beside it, nothing executed.

The result of a computation (numbers, texts, arrays, and the package's own result objects) becomes a
tree that JSON can hold and a list of arrays. Reading makes only objects of the classes named here.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from design.cycles.cycle import Cycle, CycleBranch, SpecialPoint
from design.cycles.diagram import SimulatedDiagram
from design.cycles.hunting_map import HuntingMap
from design.cycles.onset import HuntingOnset
from design.cycles.shooting import Setting
from design.cycles.spectrum import Spectrum
from design.stability.loss import CriticalSpeed
from design.stability.sweep import CurveSweep
from railenv.contact.creep_comparison import CreepComparison
from railenv.contact.given import LAWS
from railenv.contact.hertz import Material
from railenv.contact.patch import ContactPatch
from railenv.contact.profiles import Profile
from railenv.errors import ParameterError
from railenv.models import Bogie, DualWheelset
from railenv.vehicles import Vehicle

_RECORDS: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (
        ContactPatch,
        CreepComparison,
        CriticalSpeed,
        CurveSweep,
        Cycle,
        CycleBranch,
        HuntingMap,
        HuntingOnset,
        Material,
        Profile,
        Setting,
        SimulatedDiagram,
        SpecialPoint,
        Spectrum,
        Vehicle,
        *LAWS,
    )
}
_MODELS: dict[str, type[Any]] = {kind.__name__: kind for kind in (Bogie, DualWheelset)}


def encode(value: Any) -> tuple[Any, list[NDArray[Any]]]:
    """Return a tree that JSON can hold, and the arrays that it refers to.

    Raises
    ------
    ParameterError
        If something in ``value`` is of a kind that cannot be stored.
    """
    arrays: list[NDArray[Any]] = []
    return _encoded(value, arrays), arrays


def _encoded(value: Any, arrays: list[NDArray[Any]]) -> Any:
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, np.generic):
        return _encoded(value.item(), arrays)
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else {"$float": repr(value)}
    if isinstance(value, complex):
        return {"$complex": [_encoded(part, arrays) for part in (value.real, value.imag)]}
    if isinstance(value, np.ndarray) and value.dtype.kind in "bifcU":
        arrays.append(value)
        return {"$array": len(arrays) - 1}
    if isinstance(value, (list, tuple)):
        items = [_encoded(item, arrays) for item in value]
        return items if isinstance(value, list) else {"$tuple": items}
    if isinstance(value, dict):
        return {_name(key): _encoded(item, arrays) for key, item in value.items()}
    return _encoded_object(value, arrays)


def _encoded_object(value: Any, arrays: list[NDArray[Any]]) -> Any:
    kind = type(value).__name__
    if type(value) in _MODELS.values():
        return {"$model": kind, "vehicle": _encoded(value.vehicle, arrays)}
    if isinstance(value, control.TimeResponseData):
        parts = {
            "time": value.time,
            "outputs": value.outputs,
            "labels": list(value.output_labels),
            "sysname": value.sysname,
        }
        return {"$response": {key: _encoded(part, arrays) for key, part in parts.items()}}
    if type(value) in _RECORDS.values():
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        return {"$record": kind, "fields": {k: _encoded(v, arrays) for k, v in fields.items()}}
    raise ParameterError(f"a value of type {type(value).__name__} cannot be stored: {value!r:.80}")


def _name(key: Any) -> str:
    if not isinstance(key, str) or key.startswith("$"):
        raise ParameterError(f"key is {key!r}; it must be a string that does not start with '$'")
    return key


def decode(tree: Any, arrays: Sequence[NDArray[Any]]) -> Any:
    """Return the value that was passed to :func:`encode`.

    Raises
    ------
    KeyError, IndexError, TypeError, ValueError
        If the tree is not from :func:`encode`.
    """
    if isinstance(tree, list):
        return [decode(item, arrays) for item in tree]
    if not isinstance(tree, dict):
        return tree
    if "$float" in tree:
        return float(tree["$float"])
    if "$complex" in tree:
        return complex(*(decode(part, arrays) for part in tree["$complex"]))
    if "$array" in tree:
        return arrays[tree["$array"]]
    if "$tuple" in tree:
        return tuple(decode(item, arrays) for item in tree["$tuple"])
    if "$model" in tree:
        return _MODELS[tree["$model"]](decode(tree["vehicle"], arrays))
    if "$record" in tree:
        fields = {key: decode(item, arrays) for key, item in tree["fields"].items()}
        return _RECORDS[tree["$record"]](**fields)
    if "$response" in tree:
        return response(**{key: decode(part, arrays) for key, part in tree["$response"].items()})
    return {key: decode(item, arrays) for key, item in tree.items()}


def response(
    time: NDArray[np.float64], outputs: NDArray[np.float64], labels: list[str], sysname: str
) -> control.TimeResponseData:
    """Return a time response without inputs; ``outputs`` has the shape (len(labels), len(time))."""
    return control.TimeResponseData(
        time, outputs, outputs, issiso=False, output_labels=labels, state_labels=labels, sysname=sysname
    )


def plain(value: Any) -> Any:
    """Return results as lists, numbers and strings for any reader of JSON.

    Arrays become lists, records become objects, a number that is not finite becomes null.
    """
    tree, arrays = encode(value)
    return _plain(tree, arrays)


def _plain(tree: Any, arrays: Sequence[NDArray[Any]]) -> Any:
    if isinstance(tree, list):
        return [_plain(item, arrays) for item in tree]
    if not isinstance(tree, dict):
        return tree
    for kind in ("$tuple", "$complex", "$response"):
        if kind in tree:
            return _plain(tree[kind], arrays)
    if "$float" in tree:
        return None
    if "$array" in tree:
        return _plain(encode(arrays[tree["$array"]].tolist())[0], ())
    if "$model" in tree:
        return {"model": tree["$model"], "vehicle": tree["vehicle"]["fields"]["name"]}
    if "$record" in tree:
        return {k: _plain(v, arrays) for k, v in tree["fields"].items() if not k.startswith("_")}
    return {key: _plain(item, arrays) for key, item in tree.items()}
