"""Python and plain words for the content of the page."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from agents.problems.damper import PrimaryDamper, YawDamper
from design.cycles.branch import ABOVE_HOPF
from design.stability.critical_speed import SPEED_RANGE
from railenv import PRESETS, Assembly, Profile, ProfileFamily, ProfilePair, Vehicle
from railenv.contact.laws import ContactLaw
from railenv.contact.profiles import SHIPPED
from railenv.explorer.state import State, Wearing, YawRate, contact_fields
from railenv.explorer.steps import DIAGRAM_OFFSETS, PIECE, POINTS, SPEEDS, diagram_speeds

_CLASSES = {"bogie": "Bogie", "dual-wheelset": "DualWheelset", "coach": "Coach"}


def curve(state: State) -> str:
    """Return the curve in words."""
    if math.isinf(state.radius):
        return "tangent track" if not state.cant else f"tangent track, cant {state.cant:g} rad"
    return f"R = {state.radius:g} m, cant {state.cant:g} rad"


def conditions(state: State) -> list[str]:
    """Return the conditions that a vehicle's file cannot hold, and a command with them."""
    shown = state.vehicle_shown
    model = "" if isinstance(shown, Assembly) else f" --model {state.kind}"
    where = "" if math.isinf(state.radius) else f" --radius {state.radius!r}"
    where += f" --cant {state.cant!r}" if state.cant else ""
    control, words = "", "no controller"
    if isinstance(state.controller, YawRate):
        control, words = f" --yaw-rate-gain {state.controller.gain!r}", "feedback of the yaw rate"
    elif state.controller is not None:
        control, words = f" --controller {state.controller}", f"controller {state.controller}"
    return [
        f"Shown by railenv explore at {state.speed!r} m/s on {curve(state)}, with {words}:",
        f"railenv critical-speed --vehicle FILE.toml{model}{where}{control}",
    ]


def script(state: State, *, diagram: bool = False) -> str:
    """Return a script that computes the results shown."""
    closed = state.controller is not None
    made = _Made()
    body = [*_vehicle(state, made), "", *_model(state, made), "", *_analysis(state, made)]
    if diagram:
        body += ["", *(_closed_diagram(state, made) if closed else _diagram())]
    shown = state.vehicle_shown
    kind = "" if isinstance(shown, Assembly) else f"{state.kind} of "
    title = f'"""{kind}{_plain(shown.name)} at {state.speed:g} m/s on {curve(state)}."""'
    return "\n".join([title, "", *made.imports(), "", *body, ""])


def _plain(text: str) -> str:
    """Return a name that is safe in a docstring."""
    return "".join(c if c.isalnum() or c in " _-.,:+()" else "_" for c in text)


class _Made:
    """The imports of a script."""

    def __init__(self) -> None:
        self.names = {"import numpy as np", "import design", "import railenv"}

    def needs(self, line: str) -> None:
        """Add an import line."""
        self.names.add(line)

    def imports(self) -> list[str]:
        """Return the lines in the order of isort."""
        standard = {"import math", "import tomllib"}
        own = ("design", "railenv", "agents")

        def order(line: str) -> tuple[bool, str]:
            return line.startswith("from"), line.split()[1]

        groups = [
            [n for n in self.names if n in standard],
            [n for n in self.names if n not in standard and n.split()[1].split(".")[0] not in own],
            [n for n in self.names if n.split()[1].split(".")[0] in own],
        ]
        lines: list[str] = []
        for group in groups:
            lines += ([""] if lines and group else []) + sorted(group, key=order)
        return lines


# ------------------------------------------------------------------------------ vehicle


def _vehicle(state: State, made: _Made) -> list[str]:
    vehicle, numbers = state.vehicle, dict(state.numbers)
    if isinstance(vehicle, Assembly):
        made.needs("import tomllib")
        text = vehicle.to_toml().replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
        lines = [f'PARTS = """\\\n{text}"""']
        lines += ['vehicle = railenv.Assembly.described(tomllib.loads(PARTS), "PARTS")']
        return lines
    lines = _base(vehicle)
    if state.contact is not None:
        lines += _contact(state.contact)
    if state.damper != "own":
        made.needs("from agents.problems.damper import without_dampers")
        lines.append("vehicle = without_dampers(vehicle)")
    if isinstance(state.damper, YawDamper):
        made.needs("from agents.problems.damper import YawDamper")
        d = state.damper
        lines.append(f"vehicle = YawDamper(rate={d.rate!r}, stiffness={d.stiffness!r}).on(vehicle)")
    if isinstance(state.damper, PrimaryDamper):
        made.needs("from agents.problems.damper import PrimaryDamper")
        lines.append(f"vehicle = PrimaryDamper(rate={state.damper.rate!r}).on(vehicle)")
    if numbers:
        lines.append(f"vehicle = vehicle.replace({_keywords(numbers)})")
    return lines


def _base(vehicle: Vehicle) -> list[str]:
    """Return the shipped vehicle, or the nearest one with the differences."""
    differing = {preset.name: _differing(vehicle, preset) for preset in PRESETS}
    name = min(differing, key=lambda n: len(differing[n]))
    if not differing[name]:
        return [f"vehicle = railenv.{name}"]
    rows = [f"    {field}={expression(value)}," for field, value in differing[name].items()]
    return [f"vehicle = railenv.{name}.replace(", *rows, ")"]


def _differing(vehicle: Vehicle, other: Vehicle) -> dict[str, Any]:
    names = [f.name for f in dataclasses.fields(vehicle) if f.name != "conicity"]
    pairs = {n: (getattr(vehicle, n), getattr(other, n)) for n in names}
    return {n: own for n, (own, its) in pairs.items() if own != its}


def _contact(contact: ContactLaw | Wearing) -> list[str]:
    fields = ", ".join(f"{n}={n}" for n in contact_fields(contact) if n == "contact")
    if isinstance(contact, Wearing):
        lines = [
            f"new = {expression(contact.new)}",
            f"old = railenv.worn(new, depth={contact.depth!r}, spread={contact.spread!r})",
            "contact = railenv.ProfileFamily(new, old, wear=0.0)",
        ]
        pair = "new"
    else:
        lines = [f"contact = {expression(contact)}"]
        pair = "contact.new" if isinstance(contact, ProfileFamily) else "contact"
    if "half_gauge" in contact_fields(contact):
        fields += f", half_gauge={pair}.half_contact_distance, wheel_radius={pair}.nominal_radius"
    return [*lines, f"vehicle = vehicle.replace({fields})"]


def expression(value: Any) -> str:
    """Return Python that makes a value of a vehicle's field."""
    if isinstance(value, ProfilePair):
        default = ProfilePair()
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        given = {n: v for n, v in fields.items() if v != getattr(default, n)}
        return f"railenv.ProfilePair({_keywords(given)})"
    if isinstance(value, Profile):
        return _profile(value)
    if isinstance(value, ContactLaw):
        fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
        return f"railenv.{type(value).__name__}({_keywords(fields)})"
    return repr(value)


def _profile(profile: Profile) -> str:
    if profile.name in SHIPPED and profile == Profile.named(profile.name):
        return repr(profile.name)
    points = "".join(f"        {row!r},\n" for row in profile.points.tolist())
    given = {"kind": profile.kind, "name": profile.name, "source": profile.source}
    return f"railenv.Profile.of(\n    [\n{points}    ],\n    {_keywords(given)},\n)"


def _keywords(values: dict[str, Any]) -> str:
    return ", ".join(f"{name}={expression(value)}" for name, value in values.items())


# ------------------------------------------------------------------------------ analysis


def _model(state: State, made: _Made) -> list[str]:
    if isinstance(state.vehicle, Assembly):
        changes = f".replace({_keywords(dict(state.numbers))})" if state.numbers else ""
        plant = f"railenv.Assembled(vehicle){changes}"
    else:
        plant = f"railenv.{_CLASSES[state.kind]}(vehicle)"
    if state.controller is None:
        return [f"model = {plant}"]
    made.needs("import agents")
    if isinstance(state.controller, YawRate):
        feedback = f"agents.YawRateFeedback.design(model, gain={state.controller.gain!r})"
    else:
        feedback = f"agents.shipped({state.controller!r}, {state.problem!r})"
    return [f"model = agents.equipped({plant})", f"controller = {feedback}"]


def _where(state: State, made: _Made | None = None) -> str:
    radius = "math.inf" if math.isinf(state.radius) else repr(state.radius)
    if made is not None and math.isinf(state.radius):
        made.needs("import math")
    return f"radius={radius}, cant={state.cant!r}"


def _analysis(state: State, made: _Made) -> list[str]:
    low, high = state.speed_range
    closed = state.controller is not None
    leading = state.plant().guided
    name = max(leading, key=lambda w: w.x).y if leading else state.model().state_names[0]
    lines = [
        f"where = dict({_where(state, made)})",
        f"speeds = np.linspace({low!r}, {high!r}, {SPEEDS})",
        f"locus = design.speed_locus(model, speeds, **where{', controller=controller' * closed})",
        "print(locus.critical)",
        f"print(locus.mode({state.speed!r}))",
        "",
    ]
    if closed:
        made.needs("import control")
        made.needs("from agents.evaluation.rollout import Case, Rollout")
        case = f"Case({state.speed!r}, **where, offset={state.offset!r})"
        lines += [
            f"rollout = Rollout(model, controller, [{case}])",
            f"motion = rollout.run({state.duration!r}, model.state_names)",
            "response = control.TimeResponseData(",
            "    motion.time, motion.states[:, 0].T, output_labels=list(motion.names), issiso=False",
            ")",
        ]
    else:
        lines += [
            "response = railenv.simulate(",
            f"    model, speed={state.speed!r}, **where, duration={state.duration!r},",
            f"    perturbation=dict.fromkeys(model.lateral_states, {state.offset!r}),",
            ")",
        ]
    return [*lines, f"print(design.spectrum(response, {name!r}))"]


def _diagram() -> list[str]:
    resumed = f"resume=branch, points=len(branch) + {PIECE}, parameter_range=limits"
    return [
        f"limits = ({SPEED_RANGE[0]!r}, {ABOVE_HOPF!r} * locus.critical.speed)",
        "branch = design.cycle_branch(",
        f"    model, start=locus.critical, points={PIECE}, parameter_range=limits, **where",
        ")",
        f"while branch.goes_on and len(branch) < {POINTS}:",
        f"    branch = design.cycle_branch({resumed})",
        "print(branch)",
    ]


def _closed_diagram(state: State, made: _Made) -> list[str]:
    made.needs("from agents.evaluation.diagram import closed_loop_diagram")
    speeds = ", ".join(repr(v) for v in diagram_speeds(state))
    return [
        f"offsets = {DIAGRAM_OFFSETS!r}",
        "diagram = [",
        "    closed_loop_diagram(controller, model, [v], offsets=offsets, **where)",
        f"    for v in ({speeds})",
        "]",
        "for part in diagram:",
        "    print(part.speed, part.amplitude[:, 0])",
    ]
