"""Random values: what a person might pass, and what nobody should."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

import railenv
from railenv.vehicles import QUANTITIES, Vehicle

_FIELDS = {f.name: f.metadata for f in Vehicle.__dataclass_fields__.values()}
LENGTHS = {
    "wheel_radius",
    "half_gauge",
    "half_wheelbase",
    "frame_height",
    "primary_arm",
    "secondary_arm",
}

ODD = st.sampled_from(
    [
        None,
        True,
        "",
        "3",
        "nan",
        "inf",
        b"x",
        1j,
        10**400,
        -(10**400),
        np.float32(2.0),
        np.bool_(True),
        np.array(1.0),
        np.array([1.0, 2.0]),
        np.array([[1.0]]),
        np.array(["a"]),
        np.array([None]),
        [],
        [1.0],
        [[1.0, 2.0], [3.0]],
        {},
        {"a": 1.0},
        set(),
        object,
        math.nan,
        math.inf,
        -math.inf,
    ]
)
"""Values of kinds that a number is not."""

EXTREME = st.sampled_from([0.0, -0.0, 5e-324, 1e-300, 1e-12, -1.0, 1.0, 1e12, 1e300, -1e300, 1.7e308])

ANYTHING = st.one_of(st.floats(), EXTREME, st.integers(), ODD, st.text(max_size=8))


COUNTS = st.one_of(ODD, EXTREME, st.integers(max_value=4), st.integers(min_value=10**9 + 1))
"""Wrong numbers of things, and small right ones; not those that only take long."""


def number(low: float, high: float) -> st.SearchStrategy[Any]:
    """Mostly a number between low and high; now and then anything."""
    return rarely(st.floats(low, high), st.one_of(EXTREME, ANYTHING))


@st.composite
def rarely(draw: Any, usual: st.SearchStrategy[Any], other: st.SearchStrategy[Any]) -> Any:
    """Mostly the usual; now and then something else."""
    return draw(other if draw(st.integers(0, 9)) == 9 else usual)


@st.composite
def vehicles(draw: Any) -> Vehicle:
    """Draw a vehicle that is allowed: quantities up to two decades about a shipped one's, some zero."""
    base = draw(st.sampled_from(railenv.PRESETS))
    changes: dict[str, Any] = {}
    for name in draw(st.sets(st.sampled_from(QUANTITIES), max_size=8)):
        decades = 0.3 if name in LENGTHS else 2.0
        value = getattr(base, name) * 10.0 ** draw(st.floats(-decades, decades))
        changes[name] = min(value, _FIELDS[name]["bounds"].get("high", math.inf))
    optional = [n for n in QUANTITIES if n.startswith(("primary_", "secondary_")) and "arm" not in n]
    changes |= dict.fromkeys(draw(st.sets(st.sampled_from(optional), max_size=3)), 0.0)
    return base.replace(
        wheelbase_curving=draw(st.booleans()),
        load_bookkeeping=draw(st.sampled_from(["once", "printed"])),
        **changes,
    )


MODELS = st.one_of(
    st.builds(railenv.Bogie, vehicles()),
    st.builds(railenv.DualWheelset, vehicles()),
    st.builds(lambda v: railenv.Equipped(railenv.Bogie(v), "secondary"), vehicles()),
    st.just(railenv.CooperriderBogie()),
)

RADII = st.one_of(st.just(math.inf), st.floats(150.0, 2e4), st.floats(-2e4, -150.0))
SPEEDS = st.floats(1.0, 150.0)
CANTS = st.floats(-0.16, 0.16)


def conditions(odd: bool = True) -> st.SearchStrategy[dict[str, Any]]:
    """Speed, radius and cant, some left out; anything now and then."""
    other = ANYTHING if odd else EXTREME
    return st.fixed_dictionaries(
        {"speed": rarely(SPEEDS, other)},
        optional={"radius": rarely(RADII, other), "cant": rarely(CANTS, other)},
    )


@st.composite
def changed_text(draw: Any, text: str) -> bytes:
    """Draw a text with some bytes replaced, inserted, repeated or cut away."""
    content = bytearray(text.encode())
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, max(len(content) - 1, 0)))
        kind = draw(st.integers(0, 3))
        if kind == 0:
            content[place : place + 1] = draw(st.binary(min_size=1, max_size=3))
        elif kind == 1:
            content[place:place] = draw(st.text(max_size=6)).encode("utf-8", "surrogatepass")
        elif kind == 2:
            del content[place : place + draw(st.integers(1, 200))]
        else:
            content[place:place] = content[place : place + draw(st.integers(1, 200))]
    return bytes(content)
