"""Assessment of a simulated run: forces, accelerations and ride beside limits (EN 14363, UIC 518)."""

from railenv.assessment.assessment import Assessment, assess
from railenv.assessment.limits import Limits
from railenv.assessment.records import History, Quantity

__all__ = ["Assessment", "History", "Limits", "Quantity", "assess"]
