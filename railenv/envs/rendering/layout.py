"""Layout of the page, which measures 960 by 600 units whatever the picture's size."""

from __future__ import annotations

from typing import NamedTuple

WIDTH, HEIGHT = 960.0, 600.0


class Box(NamedTuple):
    """A rectangle of the page."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """The right edge."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """The lower edge."""
        return self.top + self.height

    @property
    def centre(self) -> complex:
        """The middle."""
        return complex(self.left + self.width / 2.0, self.top + self.height / 2.0)


HEADER = Box(8, 4, 944, 48)
PLAN = Box(8, 56, 618, 320)
PLAN_ABOVE, PLAN_BELOW = Box(8, 56, 618, 20), Box(8, 356, 618, 20)
PLAN_VIEW = Box(9, 76, 616, 280)
FRONT = Box(634, 56, 318, 320)
FRONT_ABOVE, FRONT_BELOW = Box(634, 56, 318, 20), Box(634, 276, 318, 100)
FRONT_VIEW = Box(635, 76, 316, 200)
CHART = Box(8, 382, 944, 212)
