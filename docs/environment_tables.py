"""Tables of the environments' pages, from the records and spaces that the code uses."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from environment_cases import Case

import railenv
from railenv.envs.environment import HuntingEnv
from railenv.envs.episodes import RUNNING
from railenv.envs.fleet import BOUND
from railenv.envs.observation import Reading
from railenv.envs.settings import RewardWeights, Settings
from railenv.vehicles import describe

_KINDS = {
    "y": "lateral displacement from the track's centre, {}",
    "z": "vertical displacement, {}",
    "phi": "roll angle, {}",
    "theta": "pitch angle, {}",
    "psi": "yaw angle, {}",
    "dy": "lateral velocity, {}",
    "dz": "vertical velocity, {}",
    "dphi": "roll rate, {}",
    "dtheta": "pitch rate, {}",
    "dpsi": "yaw rate, {}",
    "T": "moment before the limit, actuator at the {}",
    "dT": "its rate, actuator at the {}",
    "F": "force before the limit, actuator at the {}",
    "dF": "its rate, actuator at the {}",
    "accel": "lateral specific force behind the accelerometer's filter, {}",
    "gyro": "yaw rate behind the gyro's filter, {}",
    "accelerometer": "reading of the lateral accelerometer, {}",
    "command": "command {age} control steps ago, actuator at the {}",
}
_APPLIED = {"yaw": ("moment about z", "N m"), "lateral": ("lateral force", "N")}
_OF_THE_RUN = {
    "speed": "speed",
    "cant_deficiency": "cant deficiency, speed^2 curvature / g - cant",
    "cant": "cant",
}
_PINS = {
    "speed": ("m/s", "`speed_range`: {0.speed_range}; on a pinned curve, the part that suits it"),
    "radius": (
        "m",
        "cant deficiency within `max_cant_deficiency`: {0.max_cant_deficiency:g} m; either hand, not "
        "below `min_radius`: {0.min_radius:g} m; tangent track (`inf`) in a share `tangent_share`: "
        "{0.tangent_share:g}",
    ),
    "curvature": ("1/m", "as `radius`, of which it is the inverse; one of them may be pinned"),
    "cant": ("rad", "`cant_range`: {0.cant_range}, with the curve's sign; 0 on tangent track"),
    "irregularity_factor": ("1", "`irregularity_factor`: {0.irregularity_factor}"),
    "offset": ("m", "within `initial_offset`: {0.initial_offset:g} m, either way"),
    "conicity": ("1", "`randomize`, otherwise the vehicle's: {0.vehicle.conicity:g}"),
    "contact_angle": ("1", "`randomize`, otherwise the vehicle's: {0.vehicle.contact.contact_angle:g}"),
    "rail_profile_radius": (
        "m",
        "`randomize`, otherwise the vehicle's: {0.vehicle.contact.rail_profile_radius:g}",
    ),
    "friction": ("1", "`randomize`, otherwise the vehicle's: {0.vehicle.friction:g}"),
    "creep_factor": ("1", "`randomize`, otherwise 1; multiplies all four creep coefficients"),
    "body_mass": ("kg", "`randomize`, otherwise the vehicle's: {0.vehicle.body_mass:g}"),
    "failed_actuator": ("1", "any, in a share `actuator_failure` of the episodes; from 1, 0 for none"),
    "failure_time": ("s", "the first three quarters of the episode"),
}
_METRICS = {
    "hunting_amplitude": ("m", "half the range of the leading wheelset's displacement, recent"),
    "hunting_frequency": ("Hz", "from its zero crossings, recent; 0 where no cycle was completed"),
    "acceleration_rms": ("m/s^2", "specific force about its steady value, whole episode"),
    "acceleration_peak": ("m/s^2", "its largest magnitude, whole episode"),
    "effort_rms": ("1", "moment as a share of the limit, whole episode"),
    "distance": ("m", "run since the reset"),
    "cfr_213_333": ("1", "reading of 49 CFR 213.333 as a share of its limit, recent"),
    "en_14363": ("1", "sum of guiding forces of EN 14363 as a share of its limit, recent"),
}
_FURTHER = {
    "vehicle": "Parameters of the vehicle: [vehicles](../vehicles.md).",
    "observation": "See [Observation Space](#observation-space).",
    "actuator_model": "See [Actuators](#actuators).",
    "sensors": "See [Sensors](#sensors).",
    "weights": "See [Reward](#reward).",
    "randomize": "None when left out.",
}


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], right: str = "") -> str:
    """Return a Markdown table; ``right`` names the headings to align right, with blanks between."""
    rule = ["---:" if heading in right.split() else "---" for heading in headings]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (headings, rule, *rows))


def number(value: float) -> str:
    """Write a number as the page of the vehicles does."""
    return f"{value:g}".replace("e+0", "e").replace("e+", "e")


def code(value: Any) -> str:
    """Write a default value as Python."""
    if isinstance(value, railenv.Vehicle):
        return f"`railenv.{value.name}`"
    if dataclasses.is_dataclass(value):
        return f"`{type(value).__name__}()`"
    return f"`{value!r}`"


def markdown(text: str) -> str:
    """Turn a docstring's markup into Markdown: roles, code, examples."""
    text = text.replace(":class:`BogieEnv`", "[Bogie](bogie.md)")
    text = re.sub(r":(?:class|func|meth|mod):`([^`]+)`", r"`\1`", text)
    text = re.sub(r"``([^`]+)``", lambda found: f"`{' '.join(found[1].split())}`", text)
    return re.sub(r"^(>>>.*?)(?=\n\n|\Z)", r"```python\n\1\n```", text, flags=re.MULTILINE | re.DOTALL)


def sections(kind: type) -> dict[str, str]:
    """Split a docstring at its headings; what stands before the first is under ""."""
    parts = re.split(r"^## (.+)\n", inspect.getdoc(kind) or "", flags=re.MULTILINE)
    names = ["", *parts[1::2]]
    return {name: text.strip() for name, text in zip(names, parts[::2], strict=True)}


def attributes(record: type) -> dict[str, tuple[str, str]]:
    """Type and meaning of each attribute that a record's docstring lists."""
    _, listed = (inspect.getdoc(record) or "").split("Attributes\n----------\n")
    found: dict[str, tuple[str, str]] = {}
    for names, kind, text in re.findall(
        r"^(\w[^:\n]*?) : (.+)\n((?:    .*\n?)*)", listed, re.MULTILINE
    ):
        for name in names.split(", "):
            found[name] = (kind, " ".join(text.split()))
    return found


def summary(case: Case, env: HuntingEnv) -> str:
    """Spaces, and how the environment is made."""
    rows = [
        ("action space", f"`{env.action_space}`"),
        ("observation space", f"`{env.observation_space}`"),
        ("made by", f'`gymnasium.make("{case.id}")` after `import railenv`'),
        ("anywhere, also in other processes", f'`gymnasium.make("railenv:{case.id}")`'),
    ]
    return table(("", ""), rows)


def actions(case: Case) -> str:
    """Tell what an action does, with each of the actuators."""
    rows = []
    for actuator in case.actuators:
        env = case.make(actuator=actuator)
        equipped = env.fleet.model
        for i, (mount, limit) in enumerate(
            zip(equipped.equipment.mounts, equipped.limits, strict=True)
        ):
            first, second = mount.between
            held = "frame" if first.startswith("w") else "vehicle body"
            what, unit = _APPLIED[mount.acts]
            rows.append(
                (
                    f'`"{actuator}"`',
                    str(i),
                    f"{what} on the {case.bodies[first]}, against the {case.bodies.get(second, held)}",
                    "-1",
                    "1",
                    f"{number(limit)} {unit}",
                )
            )
        if not equipped.equipment.actuated:
            rows.append((f'`"{actuator}"`', "", "nothing", "0", "0", ""))
    return table(("actuator", "num", "action", "min", "max", "1 stands for"), rows, "num min max")


def _meaning(case: Case, reading: Reading) -> str:
    name = reading.name
    if name in _OF_THE_RUN:
        return _OF_THE_RUN[name]
    found = re.fullmatch(r"([a-zA-Z]+)_(\w+)(?:\[-(\d+)\])?", name)
    assert found is not None, name
    kind, body, age = found.groups()
    text = _KINDS[kind].format(case.bodies[body], age=age)
    rest = f", from where it rests ({number(reading.rest)} m)" if reading.rest else ""
    return text.replace("1 control steps", "1 control step") + rest


def observations(case: Case, observation: str) -> str:
    """One table of all actuators' observations, with a column of numbers for each."""
    tables = {
        actuator: case.make(actuator=actuator, observation=observation).fleet.observation_table
        for actuator in case.actuators
    }
    merged: list[Reading] = []
    for entries in tables.values():
        at = 0
        for entry in entries:
            if entry not in merged:
                merged.insert(at, entry)
            at = merged.index(entry) + 1
    numbers = [{entry: str(i) for i, entry in enumerate(entries)} for entries in tables.values()]
    if all(column == numbers[0] for column in numbers):
        headings, numbers = ["num"], numbers[:1]
    else:
        headings = [f'`"{actuator}"`' for actuator in tables]
    rows = []
    for entry in merged:
        name, unit, scale, *_ = entry
        meaning = _meaning(case, entry)
        if observation == "sensors":
            meaning = meaning.replace("yaw rate behind the gyro's filter", "reading of the yaw gyro")
        limits = number(-BOUND * scale), number(BOUND * scale)
        rows.append(
            (*(c.get(entry, "") for c in numbers), f"`{name}`", meaning, unit, number(scale), *limits)
        )
    return table(
        (*headings, "name", "meaning", "unit", "scale", "min", "max"),
        rows,
        " ".join((*headings, "scale", "min", "max")),
    )


def weights() -> str:
    """Weights of the reward."""
    defaults = RewardWeights()
    rows = [
        (f"`{name}`", number(getattr(defaults, name)), meaning)
        for name, (_, meaning) in attributes(RewardWeights).items()
    ]
    return table(("weight", "default", "term"), rows, "default")


def pins(settings: Settings) -> str:
    """List what a reset may pin, and where it is drawn from otherwise."""
    names = (*RUNNING, *settings.variable)
    assert set(names) <= set(_PINS), "the pins of the page are not those of the code"
    rows = [(f"`{name}`", _PINS[name][0], _PINS[name][1].format(settings)) for name in names]
    return table(("option", "unit", "drawn from"), rows)


def metrics(env: HuntingEnv) -> str:
    """Metrics of an episode."""
    env.reset(seed=0)
    names = env.episode_metrics()
    assert set(_METRICS) == set(names), "the metrics of the page are not those of the code"
    return table(("metric", "unit", "meaning"), [(f"`{n}`", *_METRICS[n]) for n in names])


def keywords(case: Case, settings: Settings) -> str:
    """Keywords of the environment."""
    entries: dict[tuple[str, str], list[str]] = {}
    listed = attributes(Settings)
    for f in dataclasses.fields(Settings):
        if f.name != "plant":
            entries.setdefault(listed[f.name], []).append(f.name)
    rows = []
    for (kind, meaning), names in entries.items():
        if names == ["actuator"]:
            places = ", ".join(f'"{place}"' for place in case.actuators)
            kind = f"{{{places}}}"
        rows.append(
            (
                ", ".join(f"`{name}`" for name in names),
                f"`{kind}`",
                ", ".join(code(getattr(settings, name)) for name in names),
                markdown(" ".join(filter(None, (meaning, *(_FURTHER.get(n) for n in names))))),
            )
        )
    return table(("keyword", "type", "default", "meaning"), rows)


def records(record: type, values: Mapping[str, Any]) -> str:
    """Fields of a record, with the values of some of its presets."""
    rows = [
        (
            f"`{row.name}`",
            row.symbol,
            row.unit,
            *(number(getattr(value, row.name)) for value in values.values()),
            row.meaning,
            row.source,
        )
        for row in describe(record)
    ]
    names = [f"`{name}()`" for name in values]
    return table(("field", "symbol", "unit", *names, "meaning", "source"), rows, right=" ".join(names))
