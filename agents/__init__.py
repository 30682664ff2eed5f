"""Controllers for hunting bogies and their evaluation; none are in this version yet.

The name ``agents`` is used by other distributions too; ``__distribution__`` tells this one.
"""

__distribution__ = "railenv"

__all__: list[str] = []
