"""Virtual environments, one for the clients of one requirements file, and programs run in them."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from benchmarks.clients.listed import Client, Source

ROOT = Path(__file__).resolve().parent.parent.parent
LONGEST = 1200.0
"""s, after which an installation or a program is ended."""

_LINES = 30  # of what was printed last, to keep of a failure
_RESULT = "result: "


class StepFailedError(Exception):
    """A step of a client's run ended with an error; the message is what it printed last."""


@dataclass(frozen=True)
class Place:
    """A folder with the virtual environment of a client."""

    folder: Path

    @property
    def python(self) -> Path:
        """Its interpreter."""
        return self.folder / "bin" / "python"

    def install(self, client: Client) -> None:
        """Make the environment and install the client and railenv, from the working tree.

        Raises
        ------
        StepFailedError
            If something cannot be installed.
        """
        pinned, alone = client.requirement_files
        self._run([sys.executable, "-m", "venv", "--clear", str(self.folder)])
        pip = [str(self.python), "-m", "pip", "install", "--quiet"]
        self._run([*pip, "-r", str(pinned), str(ROOT)])
        if alone is not None:
            self._run([*pip, "--no-deps", "-r", str(alone)])

    def fetch(self, source: Source, repository: str) -> Path:
        """Return a folder with the files of a repository, at the commit of the source.

        Raises
        ------
        StepFailedError
            If they cannot be had.
        """
        folder = self.folder / "source"
        if not folder.exists():
            self._run(["git", "clone", "--quiet", "--no-checkout", repository, str(folder)])
            self._run(["git", "-C", str(folder), "checkout", "--quiet", source.commit])
        return folder

    def version(self, distribution: str) -> str:
        """Return the version of an installed package."""
        code = f"import importlib.metadata as m; print(m.version({distribution!r}))"
        return self._run([str(self.python), "-c", code]).strip()

    def result(self, program: Path, source: Path | None) -> str:
        """Run a program in a folder of its own, and return the line of its result, as JSON.

        Raises
        ------
        StepFailedError
            If the program fails, or prints no result.
        """
        work = self.folder / "work" / program.stem
        work.mkdir(parents=True, exist_ok=True)
        scripts = f"{self.folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
        threads = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
        variables = {**os.environ, **threads, "PATH": scripts}
        variables.pop("PYTHONPATH", None)
        if source is not None:
            variables["CLIENT_SOURCE"] = str(source)
        printed = self._run([str(self.python), str(program)], work, variables)
        found = [line for line in printed.splitlines() if line.startswith(_RESULT)]
        if not found:
            raise StepFailedError("the program printed no result")
        return found[-1].removeprefix(_RESULT)

    def _run(
        self, command: list[str], folder: Path | None = None, variables: dict[str, str] | None = None
    ) -> str:
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                check=False,
                cwd=folder,
                env=variables,
                timeout=LONGEST,
            )
        except subprocess.TimeoutExpired:
            raise StepFailedError(f"not done after {LONGEST:g} s") from None
        if done.returncode != 0:
            lines = (done.stdout + done.stderr).rstrip().splitlines()[-_LINES:]
            told = "\n".join([*lines, f"(exit status {done.returncode})"])
            raise StepFailedError(self._without_paths(told))
        return done.stdout

    def _without_paths(self, text: str) -> str:
        """Leave out where the environment and the working tree happen to lie."""
        for folder, name in ((self.folder, "ENVIRONMENT"), (ROOT, "RAILENV"), (Path.home(), "~")):
            text = text.replace(str(folder), name)
        return text
