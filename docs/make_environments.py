"""Make the pages and animated pictures of the environments: ``python docs/make_environments.py``.

Prose comes from the environments' docstrings, tables from the records and spaces that the code uses.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import gymnasium
import numpy as np
import typer
from gymnasium.vector import AutoresetMode
from PIL import Image

import design
import railenv
from railenv.envs.environment import BogieEnv, DualWheelsetEnv, HuntingEnv
from railenv.envs.episodes import RUNNING
from railenv.envs.fleet import BOUND, REASONS
from railenv.envs.observation import Reading
from railenv.envs.settings import RANDOMIZABLE, RewardWeights, Settings
from railenv.vehicles import describe

FOLDER = Path(__file__).resolve().parent / "environments"

FRAMES_PER_SECOND = 20
PICTURE = (640, 400)
COLOURS = 40
QUIET = 1.8  # s without action
GAIN = 300.0  # action per rad


@dataclass(frozen=True)
class Case:
    """One environment, its page and what its picture shows.

    Attributes
    ----------
    kind : type
        Class of the environment.
    title : str
        Also the name in the id.
    file : str
        Name of page and picture, without suffix.
    actuators : tuple of str
        Default first.
    model : Model
        Vehicle of the picture.
    speed, radius, cant : float
        Running conditions of the picture: m/s, m, rad.
    """

    kind: type[HuntingEnv]
    title: str
    file: str
    actuators: tuple[str, ...]
    model: railenv.Model
    speed: float
    radius: float
    cant: float

    @property
    def id(self) -> str:
        """Name under which Gymnasium knows the environment."""
        return f"railenv/{self.title}-v0"

    def make(self, **keywords: Any) -> HuntingEnv:
        """Return the environment without wrappers."""
        env = gymnasium.make(self.id, **keywords).unwrapped
        assert isinstance(env, HuntingEnv)
        return env


CASES = (
    Case(
        BogieEnv,
        "Bogie",
        "bogie",
        ("secondary", "primary", "none"),
        railenv.Bogie(railenv.HIGH_SPEED_COACH),
        speed=105.0,
        radius=6500.0,
        cant=0.0873,
    ),
    Case(
        DualWheelsetEnv,
        "DualWheelset",
        "dual-wheelset",
        ("primary", "none"),
        railenv.DualWheelset(railenv.TABLE_1),
        speed=50.0,
        radius=1500.0,
        cant=0.08,
    ),
)

_BODIES = {"w1": "leading wheelset", "w2": "trailing wheelset", "b": "bogie frame"}
_KINDS = {
    "y": "lateral displacement from the track's centre, {}",
    "z": "vertical displacement, {}",
    "phi": "roll angle, {}",
    "psi": "yaw angle, {}",
    "dy": "lateral velocity, {}",
    "dz": "vertical velocity, {}",
    "dphi": "roll rate, {}",
    "dpsi": "yaw rate, {}",
    "T": "moment before the limit, actuator at the {}",
    "dT": "its rate, actuator at the {}",
    "accel": "lateral specific force behind the accelerometer's filter, {}",
    "gyro": "yaw rate behind the gyro's filter, {}",
    "accelerometer": "reading of the lateral accelerometer, {}",
    "command": "command {age} control steps ago, actuator at the {}",
}
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
    "cant": ("rad", "`cant_range`: {0.cant_range}, with the curve's sign; 0 on tangent track"),
    "irregularity_factor": ("1", "`irregularity_factor`: {0.irregularity_factor}"),
    "offset": ("m", "within `initial_offset`: {0.initial_offset:g} m, either way"),
    "conicity": ("1", "`randomize`, otherwise the vehicle's: {0.vehicle.conicity:g}"),
    "friction": ("1", "`randomize`, otherwise the vehicle's: {0.vehicle.friction:g}"),
    "creep_factor": ("1", "`randomize`, otherwise 1; multiplies all four creep coefficients"),
    "body_mass": ("kg", "`randomize`, otherwise the vehicle's: {0.vehicle.body_mass:g}"),
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

# ------------------------------------------------------------------------------ pieces


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


# ------------------------------------------------------------------------------ tables


def _summary(case: Case, env: HuntingEnv) -> str:
    rows = [
        ("action space", f"`{env.action_space}`"),
        ("observation space", f"`{env.observation_space}`"),
        ("made by", f'`gymnasium.make("{case.id}")`, with `import railenv`'),
    ]
    return table(("", ""), rows)


def _actions(case: Case) -> str:
    rows = []
    for actuator in case.actuators:
        env = case.make(actuator=actuator)
        equipped = env.fleet.model
        for i, body in enumerate(equipped.equipment.actuated):
            other = "vehicle body" if actuator == "secondary" else "frame"
            rows.append(
                (
                    f'`"{actuator}"`',
                    str(i),
                    f"moment about z on the {_BODIES[body]}, against the {other}",
                    "-1",
                    "1",
                    f"{number(equipped.actuator.limit)} N m",
                )
            )
        if not equipped.equipment.actuated:
            rows.append((f'`"{actuator}"`', "", "nothing", "0", "0", ""))
    return table(("actuator", "num", "action", "min", "max", "1 stands for"), rows, "num min max")


def _meaning(name: str) -> str:
    if name in _OF_THE_RUN:
        return _OF_THE_RUN[name]
    found = re.fullmatch(r"([a-zA-Z]+)_(w1|w2|b)(?:\[-(\d+)\])?", name)
    assert found is not None, name
    kind, body, age = found.groups()
    text = _KINDS[kind].format(_BODIES[body], age=age)
    return text.replace("1 control steps", "1 control step")


def _observations(case: Case, observation: str) -> str:
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
        name, unit, scale, _ = entry
        meaning = _meaning(name)
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


def _weights() -> str:
    defaults = RewardWeights()
    rows = [
        (f"`{name}`", number(getattr(defaults, name)), meaning)
        for name, (_, meaning) in attributes(RewardWeights).items()
    ]
    return table(("weight", "default", "term"), rows, "default")


def _pins(settings: Settings) -> str:
    assert set(_PINS) == {*RUNNING, *RANDOMIZABLE}, "the pins of the page are not those of the code"
    rows = [
        (f"`{name}`", _PINS[name][0], _PINS[name][1].format(settings))
        for name in (*RUNNING, *RANDOMIZABLE)
    ]
    return table(("option", "unit", "drawn from"), rows)


def _metrics(env: HuntingEnv) -> str:
    env.reset(seed=0)
    names = env.episode_metrics()
    assert set(_METRICS) == set(names), "the metrics of the page are not those of the code"
    return table(("metric", "unit", "meaning"), [(f"`{n}`", *_METRICS[n]) for n in names])


def _settings(case: Case, settings: Settings) -> str:
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


def _records(record: type, values: Mapping[str, Any]) -> str:
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


# ------------------------------------------------------------------------------ page


def page(case: Case) -> str:
    """Return the page of an environment."""
    env = case.make()
    settings, prose = env.settings, sections(case.kind)
    summary, _, rest = prose[""].partition("\n\n")
    text, _, example = rest.partition(">>>")
    same = "" if case.kind is BogieEnv else "As for [Bogie](bogie.md#{}).\n\n"
    sensors = case.make(observation="sensors").observation_space
    actuators = {name: getattr(railenv.Actuator, name)() for name in case.actuators if name != "none"}
    blocks = [
        f"# {case.title}",
        summary,
        f"![{case.title}: hunting on a curve, then controlled]({case.file}.gif)",
        _caption(case),
        _summary(case, env),
        "## Description",
        prose.get("Description", text),
        "## Action Space",
        prose.get("Action Space", same.format("action-space")),
        _actions(case),
        "## Observation Space",
        prose.get("Observation Space", same.format("observation-space")),
        f"An entry is the quantity divided by its scale, between {number(-BOUND)} and {number(BOUND)}; "
        "min and max are these bounds in the quantity's unit.",
        '### `observation="state"`',
        "The numbers depend on `actuator`.",
        _observations(case, "state"),
        '### `observation="sensors"`',
        f"`{sensors}`, whatever the actuator.",
        _observations(case, "sensors"),
        "## Reward",
        prose.get("Reward", same.format("reward")),
        "Change weights with `weights=RewardWeights(...)` from `railenv.envs.settings`.",
        _weights(),
        "## Starting State",
        prose.get("Starting State", same.format("starting-state")),
        "What `options` may pin, and where it is drawn from otherwise:",
        _pins(settings),
        "## Episode End",
        prose.get("Episode End", same.format("episode-end")),
        'What `info["derailed"]` may say:',
        "\n".join(f"- {reason}" for reason in REASONS if reason),
        '`info["episode_metrics"]`, and `env.unwrapped.episode_metrics()` at any step; recent means '
        "the last 2 s, or the last 100 m of track if they take longer:",
        _metrics(env),
        "## Arguments",
        prose.get("Arguments", ">>>" + example),
        "### Settings",
        _settings(case, settings),
        "### Actuators",
        f"Fields of `railenv.Actuator`. Default of `actuator_model`: {_defaults(actuators)}.",
        _records(railenv.Actuator, actuators),
        "### Sensors",
        "Fields of `railenv.Sensors`. Default of `sensors`: `Sensors.standard()`.",
        _records(
            railenv.Sensors,
            {"standard": railenv.Sensors.standard(), "ideal": railenv.Sensors.ideal()},
        ),
        "## Vector Environment",
        _vector(case),
        "## Version History",
        prose.get("Version History", sections(BogieEnv)["Version History"]),
    ]
    text = "\n\n".join(markdown(block).strip() for block in blocks if block) + "\n"
    return f"<!-- Made by docs/make_environments.py; edit the docstrings instead. -->\n\n{text}"


def _defaults(actuators: Mapping[str, Any]) -> str:
    return ", ".join(f'`Actuator.{name}()` with `actuator="{name}"`' for name in actuators)


def _caption(case: Case) -> str:
    bodies = "each wheelset" if case.file != "bogie" else "the bogie frame"
    limit = _critical_speed(case)
    return (
        f"{number(case.speed)} m/s on a curve of {number(case.radius)} m with a cant of "
        f"{number(case.cant)} rad, where the critical speed is {limit:.1f} m/s. For {number(QUIET)} s "
        f"no action, then a moment against the yaw angle of {bodies} about its equilibrium, "
        f"{number(GAIN)} times the limit per rad."
    )


def _critical_speed(case: Case) -> float:
    speed = design.critical_speed(case.model, radius=case.radius, cant=case.cant).speed
    assert speed is not None
    return speed


def _vector(case: Case) -> str:
    modes = ", ".join(f"`{mode}`" for mode in AutoresetMode)
    return f"""
`gymnasium.make_vec("{case.id}", num_envs=1024)` advances all environments in
one compiled call, in the lanes of the processor's vector units and on all its threads. Keywords are the
same. Environment `i` with the seed `s` does what the single environment does with the seed `s + i`, to
the bit.

- `autoreset_mode` takes every mode of Gymnasium: {modes}.
- `reset(options=...)` takes arrays with one value for each environment, and `reset_mask`.
- `max_episode_steps` truncates episodes before their `duration`.

Speeds: [benchmarks](../benchmarks.md).
"""


# ------------------------------------------------------------------------------ picture


def frames(case: Case, quiet: float = QUIET, controlled: float = 1.0) -> list[np.ndarray[Any, Any]]:
    """Return frames of a run that hunts without action and is controlled afterwards.

    Parameters
    ----------
    case : Case
    quiet, controlled : float
        s without and with control.
    """
    env = case.make(
        render_mode="rgb_array",
        duration=quiet + controlled,
        critical_speed=_critical_speed(case),
    )
    env.reset(
        seed=0,
        options={"speed": case.speed, "radius": case.radius, "cant": case.cant, "offset": 0.003},
    )
    fleet = env.fleet
    model = fleet.model
    yaw = [model.plant.state_names.index(f"psi_{body}") for body in model.equipment.actuated]
    every = round(1.0 / (FRAMES_PER_SECOND * env.settings.control_period))
    pictures = []
    for k in range(env.settings.steps):
        if k % every == 0:
            pictures.append(np.asarray(env.render()))
        angle = fleet.state(0)[yaw] - fleet.equilibrium(0)[yaw]
        action = -GAIN * angle * (k * env.settings.control_period >= quiet)
        env.step(np.clip(action, -1.0, 1.0))
    env.close()
    return pictures


def write_picture(pictures: Sequence[np.ndarray[Any, Any]], path: Path) -> None:
    """Write frames as an animated GIF with one palette for all."""
    images = [Image.fromarray(p).resize(PICTURE, Image.Resampling.LANCZOS) for p in pictures]
    sample = Image.new("RGB", (PICTURE[0], 3 * PICTURE[1]))
    for row, k in enumerate((0, len(images) // 2, len(images) - 1)):
        sample.paste(images[k], (0, row * PICTURE[1]))
    palette = sample.quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    reduced = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    reduced[0].save(
        path,
        save_all=True,
        append_images=reduced[1:],
        duration=math.floor(1000 / FRAMES_PER_SECOND),
        loop=0,
        optimize=False,
        disposal=1,
    )


def main(
    pictures: Annotated[bool, typer.Option(help="Make the animated pictures, too.")] = True,
) -> None:
    """Write the pages and pictures of all environments."""
    FOLDER.mkdir(exist_ok=True)
    for case in CASES:
        (FOLDER / f"{case.file}.md").write_text(page(case), encoding="utf-8")
        if pictures:
            write_picture(frames(case), FOLDER / f"{case.file}.gif")


if __name__ == "__main__":
    typer.run(main)
