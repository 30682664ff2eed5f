"""The axes along which the print can be read, and every combination of them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import railenv
from benchmarks.readings.equations import bogie, dual_wheelset

MODELS = ("bogie", "dual_wheelset")

_TABLE = railenv.TABLE_1
_OWN = _TABLE.wheelset_mass
_FRAME = _TABLE.frame_mass
_BODY = _TABLE.body_mass / 2.0
_CARRIED = _FRAME + _BODY
"""kg; W_ext / g, the load of one bogie."""


@dataclass(frozen=True)
class Option:
    """One way to read the print at one place.

    Attributes
    ----------
    words : str
    bogie, dual_wheelset : mapping of str to float
        Parameters of each model that it sets; of the dual wheelset those of the bogie when empty.
    cant : float, optional
        Sign of the cant, where the axis is about it.
    contact : str, optional
        Contact, where the axis is about it.
    """

    words: str
    bogie: Mapping[str, float]
    dual_wheelset: Mapping[str, float]
    cant: float | None = None
    contact: str | None = None


@dataclass(frozen=True)
class Axis:
    """A place in the print that can be read in several ways, the corrected one first."""

    name: str
    words: str
    options: tuple[Option, ...]


def _loads(
    words: str, wheelset: tuple[float, float], frame: tuple[float, float], dual: tuple[float, float]
):
    """Return an option of the loads: shares of W_ext on a wheelset, of the body on the frame."""
    return Option(
        words,
        {
            "wheelset_lateral_load": _OWN + wheelset[0] * _CARRIED,
            "wheelset_vertical_load": _OWN + wheelset[1] * _CARRIED,
            "frame_lateral_load": _FRAME + frame[0] * _BODY,
            "frame_vertical_load": _FRAME + frame[1] * _BODY,
        },
        {
            "wheelset_lateral_load": _OWN + dual[0] * _CARRIED,
            "wheelset_vertical_load": _OWN + dual[1] * _CARRIED,
        },
    )


def _switch(words: str, on_both: bool = True, **values: float) -> Option:
    return Option(words, values, values if on_both else {})


def _frames(words: str, **values: float) -> Option:
    """Return an option that the dual wheelset, whose frame is at rest, does not feel."""
    return _switch(words, on_both=False, **values)


AXES = (
    Axis(
        "loads",
        "bookkeeping of loads",
        (
            _loads("each load once", (0.0, 0.0), (1.0, 1.0), (0.5, 0.5)),
            _loads(
                "W_ext on every wheelset, sideways and downwards", (1.0, 1.0), (1.0, 0.0), (1.0, 1.0)
            ),
            _loads("W_ext on every wheelset, sideways only", (1.0, 0.0), (1.0, 0.0), (1.0, 0.0)),
            _loads(
                "half W_ext on every wheelset, and the frame's load", (0.5, 0.5), (1.0, 0.0), (0.5, 0.5)
            ),
            _loads(
                "half W_ext on every wheelset, none on the frame", (0.5, 0.5), (0.0, 0.0), (0.5, 0.5)
            ),
        ),
    ),
    Axis(
        "lever",
        "+L psi_b in F_syw",
        (
            _frames("with the sign of the wheelset", same_lever=0.0),
            _frames("for both wheelsets", same_lever=1.0),
        ),
    ),
    Axis(
        "wheelset lever",
        "L_w psi_w in the frame's rows",
        (
            _frames("left out", wheelset_lever=0.0),
            _frames("as printed", wheelset_lever=1.0),
        ),
    ),
    Axis(
        "height",
        "-4 K_py h_G phi_b of F_syb",
        (_frames("there", no_height=0.0), _frames("missing, as printed", no_height=1.0)),
    ),
    Axis(
        "leading damper",
        "damper of the leading wheelset in F_syb",
        (
            _frames("there", no_leading_damper=0.0),
            _frames("missing, as printed", no_leading_damper=1.0),
        ),
    ),
    Axis(
        "psi_wb",
        "psi_wb of M_szw",
        (
            _switch("psi_b", spring_to_frame=1.0, spring_to_itself=0.0),
            _switch("psi_w", spring_to_frame=0.0, spring_to_itself=1.0),
            _switch("zero", spring_to_frame=0.0, spring_to_itself=0.0),
        ),
    ),
    Axis(
        "damper sign",
        "sign of M_d",
        (_switch("resists", damper_sign=-1.0), _switch("as printed", damper_sign=1.0)),
    ),
    Axis(
        "damper reaction",
        "M_d sees the frame's yaw rate and reacts on it",
        (_frames("yes", damper_on_frame=1.0), _frames("no, as printed", damper_on_frame=0.0)),
    ),
    Axis(
        "creepage",
        "yaw in the longitudinal creepage",
        (
            _switch("a dpsi/V", yaw_in_creepage=0.0),
            _switch("a psi/V, as printed", yaw_in_creepage=1.0),
        ),
    ),
    Axis(
        "pitch inertia",
        "I_wy, which Table 1 lacks",
        (
            _switch("140 kg m^2", wheelset_pitch_inertia=140.0),
            _switch("0", wheelset_pitch_inertia=0.0),
            _switch("140 kg m^2, gyroscopic terms of the other sign", wheelset_pitch_inertia=-140.0),
        ),
    ),
    Axis(
        "cant",
        "cant",
        (
            Option("0.0873 rad", {}, {}, cant=1.0),
            Option("0", {}, {}, cant=0.0),
            Option("-0.0873 rad", {}, {}, cant=-1.0),
        ),
    ),
    Axis(
        "contact",
        "contact",
        (
            Option("as corrected", {}, {}, contact="corrected"),
            Option("eqs 1 to 5 and 9 to 11 to the letter", {}, {}, contact="printed"),
        ),
    ),
)
"""Every place at which the print is read in more than one way."""


@dataclass(frozen=True)
class Reading:
    """A choice on every axis, as numbers of options."""

    choices: tuple[int, ...]

    def options(self) -> Iterator[Option]:
        """Return the option on every axis."""
        return (axis.options[i] for axis, i in zip(AXES, self.choices, strict=True))

    @property
    def cant(self) -> float:
        """Sign of the cant."""
        return next(o.cant for o in self.options() if o.cant is not None)

    @property
    def contact(self) -> str:
        """Name of the contact."""
        return next(o.contact for o in self.options() if o.contact is not None)

    def parameters(self, model: str) -> dict[str, float]:
        """Return the parameters of a model that the reading sets."""
        found: dict[str, float] = {}
        for option in self.options():
            found |= getattr(option, model)
        return found

    def key(self, model: str) -> tuple[object, ...]:
        """Return what two readings share that a model cannot tell apart."""
        values = self.parameters(model)
        if model == "dual_wheelset":  # its frame is at rest, as the ground is
            values["spring_to_frame"] = 0.0
        return (self.contact, self.cant, *sorted(values.items()))


def readings() -> list[Reading]:
    """Return every combination, the corrected reading first."""
    return [Reading(c) for c in itertools.product(*(range(len(a.options)) for a in AXES))]


@cache
def template(model: str, contact: str) -> railenv.Model:
    """Return a model of a contact, of which readings change parameters."""
    return (bogie if model == "bogie" else dual_wheelset)(contact)


def model_of(reading: Reading, model: str) -> railenv.Model:
    """Return a model as a reading has it."""
    return template(model, reading.contact).replace(**reading.parameters(model))
