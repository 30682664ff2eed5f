"""The clients: their programs, and what has to be installed for them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROGRAMS, REQUIREMENTS = HERE / "programs", HERE / "requirements"


@dataclass(frozen=True)
class Source:
    """A repository of programs that are no package, at one commit."""

    repository: str
    commit: str


@dataclass(frozen=True)
class Client:
    """A client, and the program that uses it as its users do.

    Attributes
    ----------
    name : str
        Of the row; the program is ``programs/NAME.py``, with underscores.
    title : str
        What the client calls itself.
    requirements : str
        ``requirements/REQUIREMENTS.txt`` is installed for it, and then, without its own requirements,
        what stands in ``requirements/REQUIREMENTS.no-deps.txt``, if there is such a file.
    distribution : str
        The package whose version is told; empty for a client that is a repository.
    source : Source, optional
        What is fetched for it, beside the packages.
    """

    name: str
    title: str
    requirements: str
    distribution: str
    source: Source | None = None

    @property
    def program(self) -> Path:
        """The program that is run."""
        return PROGRAMS / f"{self.name.replace('-', '_')}.py"

    @property
    def requirement_files(self) -> tuple[Path, Path | None]:
        """What is installed, and what without its own requirements."""
        alone = REQUIREMENTS / f"{self.requirements}.no-deps.txt"
        return REQUIREMENTS / f"{self.requirements}.txt", alone if alone.exists() else None


CLEANRL = Source("https://github.com/vwxyzjn/cleanrl", "fe8d8a03c41a7ef5b523e2e354bd01c363e786bb")

CLIENTS = (
    Client("gymnasium-checks", "Gymnasium", "gymnasium", "gymnasium"),
    Client("cleanrl-ppo", "CleanRL", "cleanrl", "", CLEANRL),
    Client("cleanrl-sac", "CleanRL", "cleanrl", "", CLEANRL),
    Client("rl-zoo3-ppo", "RL Baselines3 Zoo", "rl-zoo3", "rl_zoo3"),
    Client("sbx-ppo", "SBX", "sbx-rl", "sbx-rl"),
    Client("sbx-sac", "SBX", "sbx-rl", "sbx-rl"),
    Client("torchrl-ppo", "TorchRL", "torchrl", "torchrl"),
    Client("tianshou-ppo", "Tianshou", "tianshou", "tianshou"),
    Client("skrl-ppo", "skrl", "skrl", "skrl"),
    Client("rllib-ppo", "RLlib", "rllib", "ray"),
    Client("minari-record", "Minari", "minari", "minari"),
    Client("d3rlpy-iql", "d3rlpy", "d3rlpy", "d3rlpy"),
)
