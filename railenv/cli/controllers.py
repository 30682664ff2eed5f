"""Controllers as commands name them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from railenv.errors import ParameterError

if TYPE_CHECKING:
    import agents


def controllers(
    names: Sequence[str], problem: str = "bogie-secondary-v1"
) -> dict[str, agents.Controller]:
    """Return controllers by their names: shipped ones by name, others by their file's name.

    Shipped ones are those of a problem.

    Files of the same name in several folders go by their whole paths.

    Raises
    ------
    ParameterError
        If one is neither a shipped controller nor a file that holds one.
    """
    import agents

    found: dict[str, agents.Controller] = {}
    stems = [Path(name).stem for name in names]
    present = agents.shipped_names(problem)
    for name, stem in zip(names, stems, strict=True):
        if name in present:
            found[name] = agents.shipped(name, problem)
        elif Path(name).exists():
            found[stem if stems.count(stem) == 1 else name] = agents.load(name)
        else:
            raise ParameterError(
                f"controller {name!r} is neither a file nor shipped; shipped are "
                f"{', '.join(present) or 'none'}"
            )
    return found
