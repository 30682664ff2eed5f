"""Contact laws: the wheel and the rail it runs on, as frozen records.

Each holds what :mod:`railenv.equations.shapes` needs. Numbers are SI, angles in rad; ``eta`` is
the lateral shift of a wheel over its rail towards its own flange.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Self

from railenv import checks
from railenv.equations import shapes
from railenv.errors import ParameterError, shown
from railenv.fields import Number, Numbered, number, positive

_STEEPEST_TREAD = 0.7


def _contact_angle(*, open_low: bool = False) -> Any:
    meaning = "tangent of the contact angle at the centre"
    return number("1", meaning, needed=True, low=0.0, open_low=open_low, high=_STEEPEST_TREAD)


class LinearContact(NamedTuple):
    """Linear parameters of a contact, as Wickens uses them.

    Attributes
    ----------
    conicity : float
        Change of the rolling radius over the shift.
    contact_angle : float
        Tangent of the contact angle at the centre.
    contact_angle_rate : float
        Its change over the shift, 1/m.
    """

    conicity: float
    contact_angle: float
    contact_angle_rate: float


@dataclass(frozen=True)
class ContactLaw(Numbered):
    """Base of the contact laws."""

    law: ClassVar[shapes.Law]
    example: ClassVar[Mapping[str, float]] = MappingProxyType({})
    """Arbitrary numbers, for uses where only the structure matters."""

    def __post_init__(self) -> None:
        self.check_fields()

    @property
    def called(self) -> str:
        """Name of the law in messages."""
        return f"{type(self).__name__}"

    @property
    def flange_clearance(self) -> float | None:
        """Lateral clearance up to the flange (m), for laws with a flange."""
        return None

    @property
    def flange_angle(self) -> float | None:
        """Largest contact angle (rad), for laws with a flange."""
        return None

    @property
    def flange_top(self) -> tuple[float, float] | None:
        """Shift and lift (m) beyond which the flange becomes less steep, for laws with a flange."""
        return None

    def linear(self, amplitude: float = 0.0) -> LinearContact:
        """Return conicity, contact angle and its rate, for motions of an amplitude (m)."""
        raise NotImplementedError

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises
        ------
        UnknownNameError
            If a name is not a field.
        ParameterError
            If a value is not allowed.
        """
        names = [f.name for f in dataclasses.fields(self)]
        checks.known(f"field of {self.called}", changes, names)
        # a copy would search the contacts of profiles again
        return dataclasses.replace(self, **changes) if changes else self

    def has_table(self, field: str) -> bool:
        """Whether there is a table of this name: a law has all of them."""
        return True

    def settings(self) -> list[Any]:
        """Return an empty list: only the numbers of a law are part of the equations."""
        return []

    def with_numbers(self, values: Mapping[str, Any]) -> Self:
        """Return the law with numbers for all its texts; raise if they contradict each other."""
        return self.replace(**{f: values[f] for f in self.number_fields()})

    def named(self) -> Self:
        """Return the law with each number as the text of its own name."""
        return self.replace(**{field: field for field in self.number_fields()})

    @classmethod
    def from_mapping(cls, fields: Mapping[str, Any]) -> Self:
        """Return the law from its fields, as files have them.

        Raises
        ------
        UnknownNameError
            If it has no such field.
        ParameterError
            If one is missing, or a value is not allowed.
        """
        given = {name: value for name, value in fields.items() if name != "law"}
        own = dataclasses.fields(cls)
        checks.known(f"field of {cls.__name__}", given, [f.name for f in own])
        missing = [f.name for f in own if f.default is dataclasses.MISSING and f.name not in given]
        if missing:
            raise ParameterError(f"contact law {cls.kind!r} lacks {', '.join(missing)}")
        return cls(**given)

    def to_mapping(self) -> dict[str, Any]:
        """Return the law as plain values, for files."""
        return {"law": self.kind, **{f.name: getattr(self, f.name) for f in dataclasses.fields(self)}}


@dataclass(frozen=True)
class Cone(ContactLaw):
    """The paper's wheel: a cone on a knife edge, with a spring behind the flange.

    Parameters
    ----------
    conicity : float
        Slope of the tread.
    """

    kind = "cone"
    law = shapes.CONE
    example = MappingProxyType({"conicity": 0.05})

    conicity: Number = number(
        "1", "slope of the tread", needed=True, low=0.0, open_low=True, high=_STEEPEST_TREAD
    )

    def linear(self, amplitude: float = 0.0) -> LinearContact:
        """Return conicity, contact angle and its rate."""
        value = _plain(self.conicity)
        return LinearContact(value, value, 0.0)


@dataclass(frozen=True)
class LinearProfile(ContactLaw):
    """Wickens' three parameters: conicity, contact angle and its rate, with a spring behind the flange.

    Parameters
    ----------
    conicity : float
        Slope of the rolling radius over the lateral shift.
    contact_angle : float
        Tangent of the contact angle at the centre.
    contact_angle_rate : float
        Its change with the lateral shift, 1/m.
    """

    kind = "linear"
    law = shapes.LINEAR
    example = MappingProxyType({"conicity": 0.1, "contact_angle": 0.05, "contact_angle_rate": 10.0})

    conicity: Number = number(
        "1", "slope of the rolling radius", needed=True, low=0.0, open_low=True, high=_STEEPEST_TREAD
    )
    contact_angle: Number = _contact_angle()
    contact_angle_rate: Number = number(
        "1/m", "its change with the lateral shift", needed=True, low=0.0
    )

    def linear(self, amplitude: float = 0.0) -> LinearContact:
        """Return conicity, contact angle and its rate."""
        return LinearContact(*map(_plain, (self.conicity, self.contact_angle, self.contact_angle_rate)))


@dataclass(frozen=True)
class ArcProfile(ContactLaw):
    """A hollow circular arc on a round rail head, with a spring behind the flange.

    Parameters
    ----------
    contact_angle : float
        Tangent of the contact angle at the centre.
    wheel_profile_radius : float
        Radius of the hollow tread across the track, m; larger than that of the rail. A very large one
        is a straight tread.
    rail_profile_radius : float
        Radius of the rail head, m.
    """

    kind = "arcs"
    law = shapes.ARCS
    example = MappingProxyType(
        {"contact_angle": 0.05, "wheel_profile_radius": 0.5, "rail_profile_radius": 0.3}
    )

    contact_angle: Number = _contact_angle(open_low=True)
    wheel_profile_radius: Number = positive("m", "radius of the hollow tread across the track")
    rail_profile_radius: Number = number("m", "radius of the rail head", needed=True, low=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        wheel, rail = self.wheel_profile_radius, self.rail_profile_radius
        plain = isinstance(wheel, (int, float)) and isinstance(rail, (int, float))
        if plain and not wheel > rail:  # type: ignore[operator]
            raise ParameterError(
                f"wheel_profile_radius of ArcProfile is {wheel:g} m and rail_profile_radius {rail:g} "
                "m; the hollow of the wheel must be wider than the rail head"
            )

    def linear(self, amplitude: float = 0.0) -> LinearContact:
        """Return conicity, contact angle and its rate at the centre, roll left out."""
        wheel, rail = _plain(self.wheel_profile_radius), _plain(self.rail_profile_radius)
        tangent, nearness = _plain(self.contact_angle), 1.0 / (wheel - rail)
        rate = nearness * (1.0 + tangent * tangent) ** 1.5
        return LinearContact((1.0 + rail * nearness) * tangent, tangent, rate)


@dataclass(frozen=True)
class HollowTread(ContactLaw):
    """A tread from new to worn hollow, described by its conicity; with a spring behind the flange.

    It is the linear part of :class:`ArcProfile`: the more hollow the tread, the closer its radius comes
    to that of the rail, and the faster the contact angle changes with the shift. So conicity and
    contact angle go together, as on wheels in service.

    Parameters
    ----------
    conicity : float
        Slope of the rolling radius; not less than ``contact_angle``, that of the straight tread.
    contact_angle : float
        Tangent of the contact angle at the centre.
    rail_profile_radius : float
        Radius of the rail head, m.
    """

    kind = "hollow"
    law = shapes.HOLLOW
    example = MappingProxyType({"conicity": 0.1, "contact_angle": 0.03, "rail_profile_radius": 0.3})

    conicity: Number = number(
        "1", "slope of the rolling radius", needed=True, low=0.0, open_low=True, high=_STEEPEST_TREAD
    )
    contact_angle: Number = _contact_angle(open_low=True)
    rail_profile_radius: Number = positive("m", "radius of the rail head")

    def __post_init__(self) -> None:
        super().__post_init__()
        given, angle = self.conicity, self.contact_angle
        plain = isinstance(given, (int, float)) and isinstance(angle, (int, float))
        if plain and given < angle:  # type: ignore[operator]
            raise ParameterError(
                f"conicity of HollowTread is {given:g} and its contact_angle {angle:g}; a tread that "
                "is hollow or straight has at least that conicity"
            )

    def linear(self, amplitude: float = 0.0) -> LinearContact:
        """Return conicity, contact angle and its rate."""
        conicity, angle = _plain(self.conicity), _plain(self.contact_angle)
        return LinearContact(
            conicity, angle, (conicity / angle - 1.0) / _plain(self.rail_profile_radius)
        )


def _plain(value: Number) -> float:
    if not isinstance(value, (int, float)):
        raise ParameterError(f"a number is {shown(value)}, which is known in a vehicle only")
    return float(value)
