"""The page: controls, figures, and the words above them."""

from __future__ import annotations

import io
import math
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from html import escape
from typing import Any

import panel as pn

from railenv.errors import RailenvError
from railenv.explorer import computations as compute
from railenv.explorer import style
from railenv.explorer.controls import Change, Controls
from railenv.explorer.figures import (
    ContactFigures,
    DampingFigures,
    DiagramFigure,
    HistoryFigures,
    LocusFigure,
    VehicleFigures,
)
from railenv.explorer.script import curve
from railenv.explorer.state import State
from railenv.explorer.tasks import Accepted, Doing, Done, Kept, Missing, Refused, Update, refresh
from railenv.explorer.worker import Runner, Worker
from railenv.vehicles import Vehicle

GRAVITY = 9.81
"""m/s^2, for the uncompensated acceleration on a curve."""

_KMH = 3.6
_HISTORY, _MODE = "time history", "least damped mode"
_COPY = """
navigator.clipboard.writeText(text.value).then(() => {
  button.label = "Copied"
  setTimeout(() => { button.label = "Copy as Python" }, 1500)
})
"""

MakeRunner = Callable[[Callable[[Any], None], Callable[[Exception], None]], Runner]


class Page:
    """One page in one browser.

    Parameters
    ----------
    state : State, optional
        State to show first.
    runner : callable, optional
        Makes the runner of tasks, from callables that take their results and their failures; runs them
        in threads when left out.

    Attributes
    ----------
    state : State
        The last possible state.
    message : str
        The last error; empty if there is none.
    stability, present, motion, curves, diagram
        Results shown; None where there are none.
    """

    def __init__(self, state: State | None = None, runner: MakeRunner = Worker) -> None:
        self.state = State() if state is None else state
        self.wanted = self.state
        self.message = ""
        self.stability: compute.Stability | None = None
        self.present: compute.Present | None = None
        self.motion: compute.Motion | None = None
        self.curves: compute.ContactCurves | None = None
        self.diagram: compute.Diagram | None = None
        self._missing: dict[str, str] = {}
        self._kept = Kept()
        self._document: Any = pn.state.curdoc
        self._queue: deque[tuple[Callable[[Any], None], Any]] = deque()
        self._runner = runner(self._later(self.apply), self._later(self._failed))
        self._diagrams = runner(self._later(self.apply_diagram), self._later(self._failed))
        self._make_figures()
        self.controls = Controls(self.state, self.change, self.complain)
        self._make_words()
        self.layout = self._layout()
        self._start()

    # --------------------------------------------------------------------------- changes

    def change(self, change: Change) -> None:
        """Change the state; an impossible state is reported, and the previous one stays."""
        try:
            wanted = change(self.wanted)
        except RailenvError as error:
            self.complain(str(error))
            self._undo()
            return
        if wanted == self.wanted:
            return
        self.wanted = wanted
        self._damping.show_speed(wanted.speed)
        self._diagram.show_speed(wanted.speed)
        self._start()

    def _start(self) -> None:
        self._runner.start(refresh(self.wanted, self._kept))

    def _undo(self) -> None:
        """Go back to the last possible state."""
        self.wanted = self.state
        self.controls.show(self.state)

    def complain(self, message: str) -> None:
        """Show an error until something works."""
        self.message = message
        self._alert.object = f'<div role="alert">{escape(message)}</div>' if message else ""
        self._alert.visible = bool(message)

    @property
    def begin(self) -> tuple[Any, ...]:
        """Return scripts that run in the browser when the page is loaded: they animate the vehicle."""
        return self._vehicle.begin

    def close(self) -> None:
        """Stop all computations."""
        self._runner.close()
        self._diagrams.close()

    def _later(self, function: Callable[[Any], None]) -> Callable[[Any], None]:
        """Return a function that queues calls to run, in order, where the page may be changed."""
        document = self._document
        if document is None or document.session_context is None:
            return function

        def queued(item: Any) -> None:
            self._queue.append((function, item))
            document.add_next_tick_callback(partial(self._drain))

        return queued

    def _drain(self) -> None:
        """Show all that waits: callbacks of one tick come in any order."""
        while self._queue:
            function, item = self._queue.popleft()
            try:
                function(item)
            except Exception as error:  # an unexpected error is shown, and the page goes on
                self._failed(error)

    def _failed(self, error: Exception) -> None:
        """Show an unexpected error; the page goes on."""
        self.complain(f"{type(error).__name__}: {error}")
        self._show_work(None)

    # --------------------------------------------------------------------------- results

    def apply(self, update: Update) -> None:
        """Show what was computed."""
        match update:
            case Doing():
                self._show_work(update)
            case Accepted():
                self._accept(update.state)
            case Refused():
                self.complain(update.why)
                self._show_work(None)
                if self.state != update.state:
                    self._undo()
                    self._start()
            case Missing():
                self._show_missing(update)
            case compute.Stability():
                self.stability = update
                self._missing.pop("stability", None)
                self._locus.show(update)
                self._damping.show(update)
                self._show_answer()
            case compute.Present():
                self.present = update
                self._missing.pop("present", None)
                self._locus.show_present(update)
                self._damping.show_present(update)
                self._show_answer()
                if self._shows_mode:
                    self._show_vehicle()
            case compute.Motion():
                self.motion = update
                self._missing.pop("motion", None)
                self._history.show(update)
                self._history_note.object = escape(update.note)
                self._show_answer()
                if not self._shows_mode:
                    self._show_vehicle()
            case compute.ContactCurves():
                self.curves = update
                self._contact.show(update)
                self._contact_note.object = escape(update.title)
            case Done():
                self._show_work(None)

    def _accept(self, state: State) -> None:
        if state != self.state:
            self.complain("")
        before, self.state = self.state, state
        if self.wanted == state:
            self.controls.show(state)
        self._damping.show_speed(state.speed)
        self._diagram.show_speed(state.speed)
        self._show_diagram_note()
        self._show_code()
        if before.vehicle_shown != state.vehicle_shown or before.kind != state.kind:
            self.present = None

    def _show_missing(self, update: Missing) -> None:
        self._missing[update.what] = update.why
        if update.what == "stability":
            self.stability = self.present = None
            self._locus.clear()
            self._damping.clear()
        elif update.what == "present":
            self.present = None
            self._locus.clear_present()
            self._damping.clear_present()
        elif update.what == "motion":
            self.motion = None
            self._history.clear()
            self._history_note.object = escape(update.why)
        elif update.what == "contact":
            self.curves = None
            self._contact_note.object = escape(update.why)
        self._show_answer()

    def _show_vehicle(self) -> None:
        """Animate the vehicle in time, or in its least damped mode."""
        model = self.state.plant()
        if self._shows_mode:
            if self.present is None:
                return
            self._vehicle.show_mode(model, self.present)
        else:
            if self.motion is None:
                return
            self._vehicle.show_motion(model, self.motion)

    @property
    def _shows_mode(self) -> bool:
        return bool(self.moves.value == _MODE)

    # ----------------------------------------------------------------------------- words

    def _make_words(self) -> None:
        self._answer = pn.pane.HTML(
            "", sizing_mode="stretch_width", margin=0, stylesheets=[style.ANSWER]
        )
        self._alert = pn.pane.HTML(
            "",
            visible=False,
            sizing_mode="stretch_width",
            margin=(0, 0, 8, 0),
            stylesheets=[style.MESSAGE],
        )
        self._work_text = pn.pane.HTML(
            "", margin=0, sizing_mode="stretch_width", stylesheets=[style.DOING]
        )
        self._bar = pn.indicators.Progress(
            value=0, max=100, height=4, sizing_mode="stretch_width", margin=0, bar_color="info"
        )
        self._work = pn.Column(
            self._bar,
            self._work_text,
            sizing_mode="stretch_width",
            margin=0,
            styles={"opacity": "0"},
            stylesheets=[style.WORK],
        )
        self._history_note = pn.pane.HTML("", margin=(0, 6), stylesheets=[style.NOTE])
        self._contact_note = pn.pane.HTML("", margin=(0, 6, 4, 6), stylesheets=[style.NOTE])
        self.code = pn.widgets.TextAreaInput(
            value="",
            disabled=True,
            height=300,
            sizing_mode="stretch_width",
            margin=0,
            stylesheets=[style.CODE],
            max_length=10**7,
        )
        self.copy = pn.widgets.Button(label="Copy as Python", margin=0, stylesheets=[style.BUTTON])
        self.copy.js_on_click(args={"text": self.code, "button": self.copy}, code=_COPY)
        self.save = pn.widgets.FileDownload(
            callback=self._toml,
            filename="vehicle.toml",
            label="Save as TOML",
            embed=False,
            auto=True,
            margin=0,
            stylesheets=[style.BUTTON],
        )
        self._show_answer()

    def _toml(self) -> io.StringIO:
        return io.StringIO(self.state.to_toml())

    def _show_code(self) -> None:
        shown = self.diagram is not None and self.diagram.state == self.state
        self.code.value = self.state.to_python(diagram=shown)
        name = "".join(c if c.isalnum() or c in "-_" else "_" for c in self.state.vehicle.name)
        self.save.filename = f"{name.lower() or 'vehicle'}.toml"

    def _show_answer(self) -> None:
        self._answer.object = answer(
            self.state, self.stability, self.present, self.motion, self._missing
        )

    def _show_work(self, doing: Doing | None) -> None:
        """Show a progress bar, which appears only during long steps."""
        if doing is None:
            self._work.styles = {"opacity": "0", "transition-delay": "0s"}
            return
        self._bar.value = round(100 * doing.share)
        self._work_text.object = f"computing {escape(doing.what)}"
        self._work.styles = {"opacity": "1", "transition-delay": "0.25s"}

    # --------------------------------------------------------------------------- diagram

    def follow(self) -> None:
        """Start the bifurcation diagram of the present state."""
        self._follow.disabled, self._cancel.disabled = True, False
        self._diagram_bar.param.update(visible=True, active=True, value=-1)
        self._diagram_note.object = "the first point; its kernels are compiled once for each structure"
        self._diagrams.start(_diagram_task(self.state))

    def give_up(self) -> None:
        """Give up the diagram; the part computed so far stays."""
        self._diagrams.cancel()
        self._end_diagram("given up; what was computed stays")

    def apply_diagram(self, update: compute.Diagram | Missing | Done) -> None:
        """Show the present part of the diagram."""
        match update:
            case Missing():
                self._end_diagram(update.why)
            case Done():
                self._end_diagram(self.diagram.said if self.diagram else "")
            case compute.Diagram():
                self.diagram = update
                self._diagram.show(update)
                self._diagram_bar.param.update(value=min(100, round(100 * update.share)), active=True)
                self._diagram_note.object = escape(update.said)

    def _end_diagram(self, said: str) -> None:
        self._follow.disabled, self._cancel.disabled = False, True
        self._diagram_bar.visible = False
        self._diagram_note.object = escape(said)
        self._show_code()

    def _show_diagram_note(self) -> None:
        if self.diagram is None:
            return
        same = compute.same_diagram(self.diagram.state, self.state)
        self._diagram_note.object = escape(
            self.diagram.said
            if same
            else "this diagram is for the previous vehicle or curve; follow it anew"
        )

    # ---------------------------------------------------------------------------- layout

    def _make_figures(self) -> None:
        self._locus, self._damping = LocusFigure(), DampingFigures()
        self._history = HistoryFigures()
        self._vehicle = VehicleFigures(self._history.cursor)
        self._contact, self._diagram = ContactFigures(), DiagramFigure()
        self.moves = pn.widgets.RadioButtonGroup(
            options=[_HISTORY, _MODE],
            value=_HISTORY,
            margin=(4, 6),
            sizing_mode="stretch_width",
            stylesheets=[style.CONTROL],
        )
        self.moves.param.watch(lambda _: self._show_vehicle(), "value")
        self._follow = pn.widgets.Button(
            label="Follow the limit cycles", margin=(0, 8, 0, 0), stylesheets=[style.STRONG]
        )
        self._follow.on_click(lambda _: self.follow())
        self._cancel = pn.widgets.Button(
            label="Give up", disabled=True, margin=0, stylesheets=[style.BUTTON]
        )
        self._cancel.on_click(lambda _: self.give_up())
        self._diagram_bar = pn.indicators.Progress(
            value=-1,
            max=100,
            active=True,
            visible=False,
            height=8,
            sizing_mode="stretch_width",
            margin=(8, 0),
            bar_color="info",
        )
        self._diagram_note = pn.pane.HTML(
            "Limit cycles from the critical speed, through their fold; of a closed loop, what "
            "simulations settle at. It takes seconds to minutes.",
            sizing_mode="stretch_width",
            margin=(6, 0),
            stylesheets=[style.NOTE],
        )

    def _layout(self) -> pn.Column:
        def drawn(f: Any) -> pn.pane.Bokeh:
            return pn.pane.Bokeh(f, sizing_mode="stretch_width", margin=0)

        def panel(*parts: Any) -> pn.Column:
            return pn.Column(*parts, sizing_mode="stretch_width", margin=0, stylesheets=[style.PANEL])

        def grid(sheet: str, *parts: Any) -> pn.Column:
            return pn.Column(*parts, sizing_mode="stretch_width", margin=0, stylesheets=[sheet])

        profiles, *curves = self._contact.figures
        results = pn.Column(
            grid(
                style.GRID,
                panel(drawn(self._locus.figure)),
                panel(*(drawn(f) for f in self._damping.figures)),
                panel(drawn(self._history.history), self._history_note),
                panel(drawn(self._history.spectrum)),
            ),
            panel(
                grid(style.VIEWS, drawn(self._vehicle.plan), drawn(self._vehicle.front)),
                grid(style.PLAYER, self.moves, drawn(self._vehicle.play), drawn(self._vehicle.picture)),
            ),
            panel(
                self._contact_note,
                drawn(profiles),
                grid(style.THIRDS, *(drawn(f) for f in curves)),
            ),
            panel(
                pn.FlexBox(self._follow, self._cancel, margin=0, sizing_mode="stretch_width"),
                self._diagram_bar,
                self._diagram_note,
                drawn(self._diagram.figure),
            ),
            panel(
                pn.pane.HTML(
                    "<b>What is shown, as Python</b>", margin=(0, 0, 6, 0), stylesheets=[style.NOTE]
                ),
                self.code,
            ),
            sizing_mode="stretch_width",
            margin=0,
            styles={"gap": "12px"},
        )
        buttons = pn.FlexBox(self.copy, self.save, margin=0, gap="8px", width_policy="min")
        head = pn.Column(
            self._answer,
            buttons,
            self._work,
            sizing_mode="stretch_width",
            margin=0,
            stylesheets=[style.HEAD],
        )
        side = pn.Column(
            self.controls.layout, sizing_mode="stretch_width", margin=0, stylesheets=[style.SIDE]
        )
        columns = pn.Column(
            side, results, sizing_mode="stretch_width", margin=0, stylesheets=[style.COLUMNS]
        )
        return pn.Column(
            head, self._alert, columns, sizing_mode="stretch_width", margin=0, stylesheets=[style.PAGE]
        )


def _diagram_task(state: State) -> Iterator[compute.Diagram | Missing | Done]:
    try:
        yield from compute.diagram(state)
    except RailenvError as error:
        yield Missing("diagram", str(error))
        return
    yield Done()


def answer(
    state: State,
    stability: compute.Stability | None,
    present: compute.Present | None,
    motion: compute.Motion | None,
    missing: dict[str, str],
) -> str:
    """Return the words above the page, as HTML: critical speed, kind of loss, present state."""
    name = state.vehicle.name
    kind = f"{state.kind.replace('-', ' ')} of " if isinstance(state.vehicle, Vehicle) else ""
    if stability is not None:
        critical = stability.critical
        said = escape(str(critical))
        if critical.speed is not None:
            said += f" <small>({_KMH * critical.speed:.0f} km/h)</small>"
    else:
        said = escape(missing.get("stability", "computing ..."))
    dot, now = "unknown", escape(missing.get("present", ""))
    if present is not None:
        shape = present.shape
        dot = "unstable" if shape.eigenvalue.real > 0.0 else "stable"
        told = f", {shape.frequency:.2f} Hz" if shape.frequency > 0.0 else ""
        now = (
            f"at {present.speed:g} m/s ({_KMH * present.speed:.0f} km/h) {dot}: least damped is "
            f"{escape(shape.name)}{told}, damping ratio {100.0 * shape.damping:.2f} %"
        )
    where = f"{escape(kind)}{escape(name)} on {escape(curve(state))}"
    if not math.isinf(state.radius):
        felt = state.speed**2 / abs(state.radius) - GRAVITY * state.cant
        where += f", uncompensated lateral acceleration {felt:.2f} m/s²"
    return f'<h1><span class="dot {dot}"></span>{said}</h1><p>{now}</p><p>{where}</p>'
