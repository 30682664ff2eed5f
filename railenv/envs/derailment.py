"""Limits with which control steps detect a derailment."""

from __future__ import annotations

from railenv.contact.nadal import angle_of_flange, nadal
from railenv.errors import ParameterError
from railenv.vehicles.guided import Guided

CONTACT_ANGLE = "contact angle"
"""The setting ``nadal_limit`` that takes the limit from the flange."""

DERAILED = (
    "",
    "Nadal: Y/Q above its limit over 2 m",
    "wheel lift over 2 m",
    "lateral displacement above 30 mm",
    "flange climbed onto the rail",
)
"""Reasons of a derailment, by the number ``derailed`` of an episode's info; 0 is no derailment."""

_NEVER = 1e300


def nadal_limits(setting: float | str, wheelset: Guided) -> tuple[float, float]:
    """Return the largest Y/Q of the left and right wheel of a wheelset.

    Parameters
    ----------
    setting : float or "contact angle"
        The limit; or Nadal's limit for the flanges and the friction of the wheelset.
    wheelset : Guided

    Raises
    ------
    ParameterError
        If Nadal's limit is asked for, and a wheel's contact law has no flange.
    """
    if not isinstance(setting, str):
        return setting, setting
    left, right = (_flange_angle(wheelset, side) for side in (0, 1))
    friction = wheelset.friction
    assert friction is not None
    return nadal(left, friction), nadal(right, friction)


def _flange_angle(wheelset: Guided, side: int) -> float:
    if wheelset.laws is None:
        raise ParameterError(
            f"nadal_limit is {CONTACT_ANGLE!r}, but the equations of {wheelset.name} are your own and "
            "do not give its profiles; give a number"
        )
    law = wheelset.laws[side]
    angle = angle_of_flange(law)
    if angle is None:
        raise ParameterError(
            f"nadal_limit is {CONTACT_ANGLE!r}, but the contact of {wheelset.name} is {law.called}, "
            "which has no flange with an angle; give a number, or a contact with profiles "
            "(railenv.ProfilePair, railenv.ProfileFamily)"
        )
    return angle


def flange_tops(wheelset: Guided) -> tuple[float, float, float, float]:
    """Return shift and lift (m) at the top of the left, then the right flange.

    Beyond the top the flange becomes less steep, so that the force that lifted the wheel there moves it
    on and over the rail. Wheels without a flange in their profile have no top.
    """
    laws = wheelset.laws or (None, None)
    left, right = (law.flange_top if law else None for law in laws)
    return (*(left or (_NEVER, _NEVER)), *(right or (_NEVER, _NEVER)))
