"""The kinds of linear controllers, which files can hold and learned policies can have as a base."""

from __future__ import annotations

from agents.controllers.h_infinity import HInfinity
from agents.controllers.lqg import LQG
from agents.controllers.lqr import LQR
from agents.controllers.output_feedback import OutputFeedback
from agents.controllers.passive import Passive
from agents.controllers.scheduled import ScheduledController
from agents.controllers.yaw_rate import YawRateFeedback

LINEAR: tuple[type[ScheduledController], ...] = (
    HInfinity,
    LQG,
    LQR,
    OutputFeedback,
    Passive,
    ScheduledController,
    YawRateFeedback,
)
