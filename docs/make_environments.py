"""Make the pages and animated pictures of the environments: ``python docs/make_environments.py``.

Prose comes from the environments' docstrings, tables from the records and spaces that the code uses.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from environment_cases import CASES, Case
from environment_pictures import QUIET, frames, write_picture
from environment_tables import (
    actions,
    keywords,
    markdown,
    metrics,
    number,
    observations,
    pins,
    records,
    sections,
    summary,
    table,
    weights,
)
from gymnasium.vector import AutoresetMode

import railenv
from railenv.envs import DERAILED
from railenv.envs.environment import BogieEnv, HuntingEnv
from railenv.envs.fleet import BOUND
from railenv.envs.settings import Settings

_AGAINST = {"psi": "the yaw angle of {} about its equilibrium", "dpsi": "the yaw rate of {}"}
_PER = {"psi": "rad", "dpsi": "rad/s"}

FOLDER = Path(__file__).resolve().parent / "environments"


def page(case: Case) -> str:
    """Return the page of an environment."""
    env = case.make()
    prose = _Prose(case)
    blocks = [
        f"# {case.title}",
        prose.summary,
        f"![{case.title}: hunting on a curve, then controlled]({case.file}.webp)",
        _caption(case),
        summary(case, env),
        "## Description",
        prose.section("Description"),
        *_spaces(case, prose),
        *_episodes(prose, env),
        *_arguments(case, prose, env.settings),
        "## Vector Environment",
        _vector(case),
        "## Version History",
        prose.section("Version History"),
    ]
    text = "\n\n".join(markdown(block).strip() for block in blocks if block) + "\n"
    return f"<!-- Made by docs/make_environments.py; edit the docstrings instead. -->\n\n{text}"


class _Prose:
    """What the docstring of an environment says, section by section."""

    def __init__(self, case: Case) -> None:
        self._own = sections(case.kind)
        self.summary, _, rest = self._own[""].partition("\n\n")
        description, _, example = rest.partition(">>>")
        self._else = {
            "Description": description,
            "Arguments": ">>>" + example,
            "Version History": sections(BogieEnv)["Version History"],
        }
        self._refers = case.kind is not BogieEnv

    def section(self, name: str) -> str:
        """Return a section, or where it is like that of the bogie, a reference to it."""
        anchor = name.lower().replace(" ", "-")
        same = f"As for [Bogie](bogie.md#{anchor})." if self._refers else ""
        return self._own.get(name, self._else.get(name, same))


def _spaces(case: Case, prose: _Prose) -> list[str]:
    sensors = case.make(observation="sensors").observation_space
    return [
        "## Action Space",
        prose.section("Action Space"),
        actions(case),
        "## Observation Space",
        prose.section("Observation Space"),
        f"An entry is the quantity divided by its scale, between {number(-BOUND)} and {number(BOUND)}; "
        "min and max are these bounds in the quantity's unit.",
        '### `observation="state"`',
        "The numbers depend on `actuator`.",
        observations(case, "state"),
        '### `observation="sensors"`',
        f"`{sensors}`, for any actuator.",
        observations(case, "sensors"),
    ]


def _episodes(prose: _Prose, env: HuntingEnv) -> list[str]:
    return [
        "## Reward",
        prose.section("Reward"),
        "Change weights with `weights=RewardWeights(...)` from `railenv.envs.settings`.",
        weights(),
        "## Starting State",
        prose.section("Starting State"),
        "What `options` may fix, and how it is drawn otherwise:",
        pins(env.settings),
        "## Episode End",
        prose.section("Episode End"),
        '`info["derailed"]`, a number in `railenv.envs.DERAILED`:',
        table(("number", "reason"), [(str(k), DERAILED[k] or "none") for k in range(len(DERAILED))]),
        "Metrics in the last `info` (0 before), and `env.unwrapped.episode_metrics()` at any step; "
        "recent means the last 2 s, or the last 100 m of track if they take longer:",
        metrics(env),
    ]


def _arguments(case: Case, prose: _Prose, settings: Settings) -> list[str]:
    kinds = [name for name in case.actuators if name not in ("both", "none")]
    actuators = {name: getattr(railenv.Actuator, name)() for name in kinds}
    return [
        "## Arguments",
        prose.section("Arguments"),
        "### Settings",
        keywords(case, settings),
        "### Actuators",
        f"Fields of `railenv.Actuator`. Default of `actuator_model`: {_defaults(actuators)}.",
        records(railenv.Actuator, actuators),
        "### Sensors",
        "Fields of `railenv.Sensors`. Default of `sensors`: `Sensors.standard()`.",
        records(
            railenv.Sensors,
            {"standard": railenv.Sensors.standard(), "ideal": railenv.Sensors.ideal()},
        ),
    ]


def _defaults(actuators: Mapping[str, Any]) -> str:
    return ", ".join(f'`Actuator.{name}()` with `actuator="{name}"`' for name in actuators)


def _caption(case: Case) -> str:
    limit = case.critical_speed
    return (
        f"{number(case.speed)} m/s on a curve of {number(case.radius)} m with a cant of "
        f"{number(case.cant)} rad, where the critical speed is {limit:.1f} m/s. For {number(QUIET)} s "
        f"no action, then a moment against {_AGAINST[case.against].format(case.actuated)}, "
        f"{number(case.gain)} times the limit per {_PER[case.against]}."
    )


def _vector(case: Case) -> str:
    modes = ", ".join(f"`{mode}`" for mode in AutoresetMode)
    return f"""
`gymnasium.make_vec("{case.id}", num_envs=1024)` advances all environments in
one compiled call, in the lanes of the processor's vector units and on all its threads. Keywords are the
same. Environment `i` with the seed `s` is bit for bit the same as the single environment with the seed
`s + i`.

- `autoreset_mode` takes every mode of Gymnasium: {modes}.
- `reset(options=...)` takes arrays with one value for each environment, and `reset_mask`.
- `max_episode_steps` truncates episodes before their `duration`.
- `render_mode` is `"rgb_array"`, or `"rgb_array_list"` for the pictures of all steps.

Speeds: [benchmarks](../benchmarks.md).
"""


def main(
    pictures: Annotated[bool, typer.Option(help="Make the animated pictures, too.")] = True,
) -> None:
    """Write the pages and pictures of all environments."""
    FOLDER.mkdir(exist_ok=True)
    for case in CASES:
        (FOLDER / f"{case.file}.md").write_text(page(case), encoding="utf-8")
        if pictures:
            write_picture(frames(case), FOLDER / f"{case.file}.webp")


if __name__ == "__main__":
    typer.run(main)
