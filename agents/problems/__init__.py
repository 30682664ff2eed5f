"""The problems on which controllers are compared, and the passive dampers that they have to beat.

>>> from agents.problems import problem, rate
>>> problem("bogie-secondary-v1").model().command_names
('command_b',)
"""

from agents.problems.damper import PrimaryDamper, YawDamper
from agents.problems.listed import PROBLEMS, problem
from agents.problems.problem import Problem
from agents.problems.rate import rate, rate_passive
from agents.problems.rating import Rating
from agents.problems.tuned import TunedDamper, tuned_damper

__all__ = [
    "PROBLEMS",
    "PrimaryDamper",
    "Problem",
    "Rating",
    "TunedDamper",
    "YawDamper",
    "problem",
    "rate",
    "rate_passive",
    "tuned_damper",
]
