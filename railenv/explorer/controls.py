"""The controls of the page: each one changes the state, and shows it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Literal

import panel as pn

from agents.problems.damper import PrimaryDamper, YawDamper
from design.style import STABLE
from railenv import PRESETS, Assembly, Cone, HollowTread, LinearProfile, ProfilePair, Vehicle, checks
from railenv.contact.laws import ContactLaw
from railenv.contact.profiles import SHIPPED, Profile
from railenv.errors import RailenvError
from railenv.explorer import dropped
from railenv.explorer.state import (
    COMMON,
    KINDS,
    LARGEST_OFFSET,
    Contact,
    State,
    Wearing,
    YawRate,
    controller_names,
)
from railenv.explorer.style import CARD, CONTROL, DROP

Change = Callable[[State], State]

RADII = (
    math.inf,
    20000.0,
    10000.0,
    8000.0,
    6250.0,
    5000.0,
    4000.0,
    3000.0,
    2500.0,
    2000.0,
    1500.0,
    1200.0,
    1000.0,
    800.0,
    600.0,
    500.0,
    400.0,
    300.0,
    250.0,
)
"""m, of the slider."""

NUMBERS: dict[str, tuple[str, float, float, float]] = {
    "friction": ("friction coefficient", 0.05, 0.6, 0.01),
    "creep_factor": ("factor on creep coefficients", 0.2, 1.5, 0.02),
    "conicity": ("conicity (wear of the tread)", 0.01, 0.5, 0.005),
    "wear": ("wear, 0 new to 1 worn", 0.0, 1.0, 0.01),
    "contact_angle": ("contact angle at the centre, its tangent", 0.005, 0.2, 0.001),
    "contact_angle_rate": ("rate of the contact angle (1/m)", 0.0, 60.0, 0.5),
    "rail_profile_radius": ("radius of the rail head (m)", 0.1, 0.6, 0.01),
    "wheel_profile_radius": ("radius of the hollow tread (m)", 0.31, 1.0, 0.01),
}
"""Labels of the numbers of the contact, and lower end, upper end and step of their sliders."""

HIGHEST_SPEED = 400.0
"""Highest speed of the range of eigenvalues, m/s."""

_OWN, _CONE, _LINEAR, _HOLLOW = (
    "as the vehicle has it",
    "cone",
    "Wickens' three numbers",
    "hollow tread",
)
_PAIR, _WEARING = "profiles", "profiles, new to worn"
_DAMPERS = {
    "as the vehicle has them": "own",
    "none": "none",
    "frame to body, on rubber ends": "yaw",
    "wheelset to frame": "primary",
}
_NO_CONTROL, _YAW_RATE = "none", "yaw rate, gain below"
_LOWEST_CONTROLLED = 20.0  # m/s, the least speed of shipped controllers
_KIND_NAMES = {"bogie": "bogie", "dual-wheelset": "dual wheelset", "coach": "whole coach"}


class Controls:
    """Sliders, choices and places to drop files on.

    Parameters
    ----------
    state : State
    change : callable
        Called with the change that a control makes to the state.
    complain : callable
        Called with a message about an invalid file.
    """

    def __init__(
        self, state: State, change: Callable[[Change], None], complain: Callable[[str], None]
    ) -> None:
        self._change, self._complain = change, complain
        self._showing = False
        self.dropped: dict[str, Vehicle | Assembly] = {}
        self.profiles: dict[str, Profile] = {}
        self.numbers: dict[str, Any] = {}
        self._make_vehicle()
        self._make_running()
        self._make_contact()
        self._make_damper()
        self._make_controller()
        self.layout = pn.Column(
            self._card(
                "Running",
                [
                    self.speed,
                    self.radius,
                    self.other_radius,
                    self.cant,
                    self.offset,
                    self.duration,
                    self.range,
                ],
            ),
            self._card("Wheels and rails", [self._number_box, self.contact, self._profile_box]),
            self._card("Vehicle", [self.vehicle, self.kind, self.vehicle_file]),
            self._card("Yaw dampers", [self.damper, self._damper_box], collapsed=True),
            self._card("Controller", [self.controller, self.gain], collapsed=True),
            sizing_mode="stretch_width",
            margin=0,
        )
        self.show(state)

    @staticmethod
    def _card(title: str, parts: list[Any], *, collapsed: bool = False) -> pn.Card:
        return pn.Card(
            *parts,
            title=title,
            sizing_mode="stretch_width",
            margin=(0, 0, 10, 0),
            stylesheets=[CARD],
            collapsed=collapsed,
        )

    # --------------------------------------------------------------------------- making

    def _slider(
        self, name: str, low: float, high: float, step: float, change: Callable[[float], Change]
    ) -> Any:
        widget = pn.widgets.EditableFloatSlider(
            label=name,
            start=low,
            end=high,
            step=step,
            value=low,
            format="0[.]0[000]",
            bar_color=STABLE,
            sizing_mode="stretch_width",
            margin=(4, 8),
            stylesheets=[CONTROL],
        )
        self._on(widget, change)
        return widget

    def _on(self, widget: Any, change: Callable[[Any], Change]) -> None:
        """Change the state when a widget is moved, unless it is only being updated."""

        def changed(event: Any) -> None:
            def wanted(state: State) -> State:
                return change(event.new)(state)

            if not self._showing and event.new is not None:
                self._change(wanted)

        widget.param.watch(changed, "value")

    def _select(self, name: str, options: list[str], change: Callable[[Any], Change]) -> Any:
        widget = pn.widgets.Select(
            label=name,
            options=options,
            sizing_mode="stretch_width",
            margin=(4, 8),
            stylesheets=[CONTROL],
        )
        self._on(widget, change)
        return widget

    def _file(
        self, name: str, endings: tuple[str, ...], opened: Callable[[str, bytes], None]
    ) -> pn.Column:
        """Return a widget on which a file is dropped, or chosen by a click."""
        widget = pn.widgets.FileInput(
            accept=",".join(endings),
            multiple=False,
            sizing_mode="stretch_width",
            margin=0,
            stylesheets=[DROP],
        )

        clearing = False

        def changed(event: Any) -> None:
            nonlocal clearing
            if clearing and not event.new:
                clearing = False
            elif event.new is not None and widget.filename:
                self._opened(widget.filename, event.new, opened)
                clearing = True
                widget.clear()  # so that the same file may be dropped again

        widget.param.watch(changed, "value")
        label = pn.pane.HTML(
            name, margin=(6, 8, 0, 8), stylesheets=[CONTROL], sizing_mode="stretch_width"
        )
        return pn.Column(label, widget, margin=(0, 0), sizing_mode="stretch_width")

    def _opened(self, name: str, content: bytes, opened: Callable[[str, bytes], None]) -> None:
        try:
            opened(name, content)
        except RailenvError as error:
            said = str(error)
            self._complain(said if name in said else f"{name}: {said}")

    def _make_vehicle(self) -> None:
        names = [v.name for v in PRESETS]
        self.vehicle = self._select(
            "vehicle", names, lambda n: lambda s: s.with_vehicle(self._named(n))
        )
        self.kind = pn.widgets.RadioButtonGroup(
            options={_KIND_NAMES[k]: k for k in KINDS},
            sizing_mode="stretch_width",
            margin=(8, 8),
            stylesheets=[CONTROL],
        )
        self._on(self.kind, lambda kind: lambda s: _of_kind(s, kind))
        self.vehicle_file = self._file(
            "or drop a vehicle's TOML file", (dropped.VEHICLE_ENDING,), self.open_vehicle
        )

    def _named(self, name: str) -> Vehicle | Assembly:
        shipped = {v.name: v for v in PRESETS}
        return self.dropped[name] if name in self.dropped else shipped[name]

    def open_vehicle(self, name: str, content: bytes) -> None:
        """Take the vehicle of a dropped file.

        Raises
        ------
        RailenvError
            If the file holds no vehicle.
        """
        vehicle = dropped.vehicle(name, content)
        label = f"{vehicle.name} ({name})"
        self.dropped[label] = vehicle
        self._change(lambda s: s.with_vehicle(vehicle))

    def _make_running(self) -> None:
        self.speed = self._slider(
            "speed (m/s)", 5.0, 200.0, 0.5, lambda v: lambda s: replace(s, speed=v)
        )
        self.radius = pn.widgets.DiscreteSlider(
            label="curve radius",
            options=_radius_options(),
            sizing_mode="stretch_width",
            margin=(4, 8),
            stylesheets=[CONTROL],
        )
        self._on(self.radius, lambda v: lambda s: replace(s, radius=v))
        self.other_radius = pn.widgets.TextInput(
            label="",
            placeholder="another radius in m, negative: other hand",
            sizing_mode="stretch_width",
            margin=(0, 8, 4, 8),
            stylesheets=[CONTROL],
        )
        self.other_radius.param.watch(self._typed_radius, "value")
        self.cant = self._slider("cant (rad)", 0.0, 0.12, 0.001, lambda v: lambda s: replace(s, cant=v))
        self.offset = self._slider(
            "offset at the start (mm)",
            0.0,
            1e3 * LARGEST_OFFSET,
            0.1,
            lambda v: lambda s: replace(s, offset=v / 1e3),
        )
        self.duration = self._slider(
            "duration of the motion (s)", 1.0, 20.0, 0.5, lambda v: lambda s: replace(s, duration=v)
        )
        self.range = pn.widgets.EditableRangeSlider(
            label="speeds of the eigenvalues (m/s)",
            start=3.0,
            end=HIGHEST_SPEED,
            step=1.0,
            value=(5.0, 200.0),
            format="0[.]0",
            bar_color=STABLE,
            sizing_mode="stretch_width",
            margin=(4, 8),
            stylesheets=[CONTROL],
        )
        self._on(self.range, lambda v: lambda s: s.with_speed_range(*v))

    def _typed_radius(self, event: Any) -> None:
        text = event.new.strip()
        if not text or self._showing:
            return
        try:
            radius = checks.number("radius", _float(text), unit="m")
            self._change(lambda s: replace(s, radius=radius))
        except RailenvError as error:
            self._complain(str(error))
        finally:
            self.other_radius.value = ""

    def _make_contact(self) -> None:
        self._number_box = pn.Column(sizing_mode="stretch_width", margin=0)
        self.contact = self._select(
            "contact", [_OWN, _CONE, _LINEAR, _HOLLOW, _PAIR, _WEARING], self._contact_changed
        )
        wheels = [n for n, kind in SHIPPED.items() if kind == "wheel"]
        rails = [n for n, kind in SHIPPED.items() if kind == "rail"]
        self.wheel = self._select("wheel", wheels, lambda n: self._pair_changed(wheel=n))
        self.rail = self._select("rail", rails, lambda n: self._pair_changed(rail=n))
        self.gauge = self._slider(
            "gauge (mm)", 1425.0, 1445.0, 0.5, lambda v: self._pair_changed(gauge=v / 1e3)
        )
        self.inclination = self._slider(
            "inclination of the rail, 1 in",
            10.0,
            60.0,
            5.0,
            lambda v: self._pair_changed(inclination=1.0 / v),
        )
        self.units = pn.widgets.Select(
            label="units of dropped text files",
            options={"as the file says": None, "mm": "mm", "m": "m"},
            sizing_mode="stretch_width",
            margin=(4, 8),
            stylesheets=[CONTROL],
        )
        self.mirror = pn.widgets.Checkbox(
            label="rail's y points to the gauge side", margin=(4, 8), stylesheets=[CONTROL]
        )
        self.wheel_file = self._file(
            "or drop a wheel's profile", dropped.PROFILE_ENDINGS, self.open_wheel
        )
        self.rail_file = self._file("or drop a rail's profile", dropped.PROFILE_ENDINGS, self.open_rail)
        self._profile_box = pn.Column(
            self.wheel,
            self.wheel_file,
            self.rail,
            self.rail_file,
            self.units,
            self.mirror,
            self.gauge,
            self.inclination,
            sizing_mode="stretch_width",
            margin=0,
        )

    def open_wheel(self, name: str, content: bytes) -> None:
        """Take a wheel's profile from a dropped file."""
        self._open_profile(name, content, "wheel")

    def open_rail(self, name: str, content: bytes) -> None:
        """Take a rail's profile from a dropped file."""
        self._open_profile(name, content, "rail")

    def _open_profile(self, name: str, content: bytes, kind: Literal["wheel", "rail"]) -> None:
        mirror = bool(self.mirror.value) and kind == "rail"
        found = dropped.profile(name, content, kind, units=self.units.value, mirror=mirror)
        self.profiles[found.name] = found
        self._change(self._pair_changed(**{kind: found}))

    def _pair_changed(self, **fields: Any) -> Change:
        """Return a change of the pair of profiles; names refer to shipped or dropped ones."""
        given = dict(fields)
        for kind in ("wheel", "rail"):
            name = fields.get(kind)
            if isinstance(name, str):  # never a path
                checks.known(f"profile of a {kind}", [name], [*SHIPPED, *self.profiles])
                given[kind] = self.profiles.get(name, name)

        def change(state: State) -> State:
            contact = state.contact
            pair = pair_of(state)
            new = ProfilePair() if pair is None else pair
            new = replace(new, **given)
            again = replace(contact, new=new) if isinstance(contact, Wearing) else new
            return _keeping_numbers(state, again)

        return change

    def _contact_changed(self, name: str) -> Change:
        def change(state: State) -> State:
            pair = pair_of(state) or ProfilePair()
            laws: dict[str, Contact] = {
                _OWN: None,
                _CONE: Cone(0.1),
                _LINEAR: LinearProfile(0.2, 0.03, 13.6),
                _HOLLOW: HollowTread(0.1, 0.034, 0.3),
                _PAIR: pair,
                _WEARING: Wearing(pair),
            }
            return state.with_contact(laws[name])

        return change

    def _make_damper(self) -> None:
        self.damper = pn.widgets.Select(
            label="yaw dampers",
            options=_DAMPERS,
            sizing_mode="stretch_width",
            margin=(4, 8),
            stylesheets=[CONTROL],
        )
        self._on(self.damper, lambda _: self._damper_changed())
        self.rate = self._slider("rate (kN s/m)", 5.0, 2500.0, 1.0, lambda _: self._damper_changed())
        self.stiffness = self._slider(
            "stiffness of its ends (MN/m)", 0.5, 20.0, 0.1, lambda _: self._damper_changed()
        )
        with self._silently():
            self.rate.value, self.stiffness.value = 133.0, 10.0
        self._damper_box = pn.Column(self.rate, self.stiffness, sizing_mode="stretch_width", margin=0)

    def _damper_changed(self) -> Change:
        kind, rate, stiffness = self.damper.value, 1e3 * self.rate.value, 1e6 * self.stiffness.value
        if kind in ("own", "none"):
            return lambda s: replace(s, damper=kind)
        if kind == "primary":
            return lambda s: replace(s, damper=PrimaryDamper(rate))
        return lambda s: replace(s, damper=YawDamper(rate, stiffness))

    def _make_controller(self) -> None:
        self.controller = self._select(
            "controller of the actuated yaw dampers", [_NO_CONTROL], self._controller_changed
        )
        self.gain = self._slider(
            "gain (kN m per rad/s)",
            0.0,
            1000.0,
            5.0,
            lambda v: lambda s: replace(s, controller=YawRate(1e3 * v)),
        )
        with self._silently():
            self.gain.value = 100.0

    def _controller_changed(self, name: str) -> Change:
        gain = 1e3 * float(self.gain.value)

        def change(state: State) -> State:
            if name == _NO_CONTROL:
                return replace(state, controller=None)
            low, high = state.speed_range
            suited = state.with_speed_range(min(max(low, _LOWEST_CONTROLLED), 0.5 * high), high)
            return replace(suited, controller=YawRate(gain) if name == _YAW_RATE else name)

        return change

    # -------------------------------------------------------------------------- showing

    @contextmanager
    def _silently(self) -> Iterator[None]:
        """Move widgets without changing the state."""
        before, self._showing = self._showing, True
        try:
            yield
        finally:
            self._showing = before

    def show(self, state: State) -> None:
        """Move all controls to their values in a state."""
        with self._silently():
            self._show_vehicle(state)
            self._show_running(state)
            self._show_contact(state)
            self._show_damper(state)
            names = [_NO_CONTROL, _YAW_RATE, *controller_names(state.kind)]
            self.controller.options = names
            chosen = state.controller
            self.controller.value = (
                _NO_CONTROL if chosen is None else _YAW_RATE if isinstance(chosen, YawRate) else chosen
            )
            self.gain.visible = isinstance(chosen, YawRate)
            if isinstance(chosen, YawRate):
                self.gain.value = chosen.gain / 1e3

    def _show_vehicle(self, state: State) -> None:
        shipped = {v.name: v for v in PRESETS}
        known = {**shipped, **self.dropped}
        label = next((n for n, v in known.items() if v == state.vehicle), None)
        if label is None:
            label = (
                state.vehicle.name
                if state.vehicle.name not in known
                else f"{state.vehicle.name} (given)"
            )
            self.dropped[label] = state.vehicle
        self.vehicle.options = [*shipped, *self.dropped]
        self.vehicle.value = label
        self.kind.value = state.kind
        self.kind.visible = isinstance(state.vehicle, Vehicle)

    def _show_running(self, state: State) -> None:
        low, high = state.speed_range
        self.speed.start, self.speed.end = low, high
        self.speed.value = state.speed
        self.range.value = (low, high)
        self.radius.options = _radius_options(state.radius)
        self.radius.value = state.radius
        self.cant.value, self.offset.value = state.cant, 1e3 * state.offset
        self.duration.value = state.duration

    def _show_contact(self, state: State) -> None:
        own = isinstance(state.vehicle, Vehicle)
        self.contact.visible = own
        self.contact.value = _contact_name(state.contact)
        pair = pair_of(state) if state.contact is not None else None
        self._profile_box.visible = own and pair is not None
        if pair is not None:
            self._show_pair(pair)
        values = number_values(state)
        if list(values) != list(self.numbers):
            self.numbers = {name: self._number(name) for name in values}
            self._number_box.objects = list(self.numbers.values())
        law = state.law
        for name, value in values.items():
            widget = self.numbers[name]
            if name == "conicity" and isinstance(law, HollowTread):
                step = NUMBERS[name][3]  # the conicity of a straight tread is its contact angle
                widget.start = step * math.ceil(float(str(law.contact_angle)) / step)
            widget.value = value

    def _number(self, name: str) -> Any:
        called, low, high, step = NUMBERS[name]
        return self._slider(called, low, high, step, lambda v: lambda s: s.with_number(name, v))

    def _show_pair(self, pair: ProfilePair) -> None:
        for widget, profile in ((self.wheel, pair.wheel), (self.rail, pair.rail)):
            if profile.name not in SHIPPED:
                self.profiles[profile.name] = profile
            names = [n for n, kind in SHIPPED.items() if kind == profile.kind]
            names += [n for n, p in self.profiles.items() if p.kind == profile.kind and n not in names]
            widget.options = names
            widget.value = profile.name
        self.gauge.value = 1e3 * pair.gauge
        if pair.inclination > 0.0:
            self.inclination.value = round(1.0 / pair.inclination, 3)

    def _show_damper(self, state: State) -> None:
        damper = state.damper
        kind = (
            damper if isinstance(damper, str) else "yaw" if isinstance(damper, YawDamper) else "primary"
        )
        own = isinstance(state.vehicle, Vehicle)
        self.damper.visible = own
        self.damper.value = kind
        self._damper_box.visible = own and not isinstance(damper, str)
        self.stiffness.visible = kind == "yaw"
        if isinstance(damper, YawDamper | PrimaryDamper):
            self.rate.value = damper.rate / 1e3
        if isinstance(damper, YawDamper):
            self.stiffness.value = damper.stiffness / 1e6


def number_values(state: State) -> dict[str, float]:
    """Return the numbers of the contact that have sliders, with their values."""
    shown, law = state.vehicle_shown, state.law
    if isinstance(shown, Assembly):
        return {n: v for n, v in shown.parameters.items() if n in NUMBERS}
    assert law is not None
    own: list[str] = [n for n in ("wear", "conicity") if n in law.number_fields()]
    own += [n for n in law.number_fields() if n not in own]
    given = dict(state.numbers)
    values = {n: float(getattr(law, n)) for n in own}
    return {**values, "friction": shown.friction, COMMON[1]: given.get(COMMON[1], 1.0)}


def pair_of(state: State) -> ProfilePair | None:
    """Return the pair of profiles of a state's contact, or its new pair."""
    contact = state.contact
    if isinstance(contact, Wearing):
        return contact.new
    law: ContactLaw | None = contact if contact is not None else state.law
    return law if isinstance(law, ProfilePair) else None


def _keeping_numbers(state: State, contact: Contact) -> State:
    """Return the state with another contact of the same kind; its numbers stay."""
    if isinstance(contact, Wearing) and isinstance(state.contact, Wearing):
        return replace(state, contact=contact)
    return state.with_contact(contact)


def _of_kind(state: State, kind: Any) -> State:
    """Return the state with another part of the vehicle; a controller that does not fit is left out."""
    keeps = state.controller is None or isinstance(state.controller, YawRate)
    keeps = keeps or state.controller in controller_names(kind)
    return replace(state, kind=kind, controller=state.controller if keeps else None)


def _contact_name(contact: Contact) -> str:
    if contact is None:
        return _OWN
    names = {Cone: _CONE, LinearProfile: _LINEAR, HollowTread: _HOLLOW, ProfilePair: _PAIR}
    return _WEARING if isinstance(contact, Wearing) else names[type(contact)]


def _radius_options(also: float = math.inf) -> dict[str, float]:
    radii = sorted({*RADII, also}, key=lambda r: -abs(r))
    return {"tangent track" if math.isinf(r) else f"{r:g} m": r for r in radii}


def _float(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
