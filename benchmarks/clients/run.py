"""Try the clients: ``python -m benchmarks.clients.run [--only NAME ...] [--where DIR]``.

For each client a virtual environment is made, railenv is installed into it from the working tree, and
a small program of a user is run there. Writes docs/clients.json, of which ``python
docs/make_clients.py`` makes the table of docs/clients.md. Ends with status 1 if a client failed.

Pins of packages are in ``requirements/``. On Linux, PyPI's torch comes with gigabytes of CUDA packages;
where a CPU build is enough, set ``PIP_EXTRA_INDEX_URL=https://download.pytorch.org/whl/cpu``.
"""

from __future__ import annotations

import json
import platform
import shutil
import tempfile
import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from benchmarks.clients.environments import ROOT, Place, StepFailedError
from benchmarks.clients.listed import CLIENTS, Client
from railenv import checks

Only = Annotated[
    list[str] | None, typer.Option(help="Run only these, and keep the other rows of the file.")
]
Where = Annotated[
    Path | None,
    typer.Option(help="Folder for the environments, which stay there and are used again."),
]
Sources = Annotated[
    str | None,
    typer.Option(help="Clone of CleanRL's repository, a folder or an address, in place of its own."),
]


def tried(client: Client, place: Place, repository: str | None) -> dict[str, Any]:
    """Install a client where it is not yet, run its program, and return its row."""
    row: dict[str, Any] = {
        "name": client.name,
        "client": client.title,
        "version": client.source.commit[:7] if client.source is not None else None,
        "python": platform.python_version(),
    }
    start = time.perf_counter()
    try:
        if not place.python.exists():
            place.install(client)
        row["installed_in"] = round(time.perf_counter() - start, 1)
        if client.distribution:
            row["version"] = place.version(client.distribution)
        row["gymnasium"] = place.version("gymnasium")
        source = client.source and place.fetch(client.source, repository or client.source.repository)
        row |= json.loads(place.result(client.program, source))
    except StepFailedError as error:
        row["error"] = str(error)
    return row


def main(
    only: Only = None,
    where: Where = None,
    cleanrl: Sources = None,
    out: Annotated[Path, typer.Option(help="File to write to.")] = ROOT / "docs" / "clients.json",
) -> None:
    """Try RL clients on the environments, each in a virtual environment of its own."""
    names = [client.name for client in CLIENTS]
    checks.known("client", only or (), names)
    console = Console(highlight=False, markup=False, soft_wrap=True)
    rows = {row["name"]: row for row in json.loads(out.read_text())} if out.exists() else {}
    chosen = [client for client in CLIENTS if not only or client.name in only]
    for requirements in dict.fromkeys(client.requirements for client in chosen):
        folder = where / requirements if where else Path(tempfile.mkdtemp(prefix="railenv-client-"))
        try:
            for client in (client for client in chosen if client.requirements == requirements):
                rows[client.name] = tried(client, Place(folder.resolve()), cleanrl)
                console.print(str(rows[client.name]))
                kept = [rows[name] for name in names if name in rows]
                out.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
        finally:
            if where is None:
                shutil.rmtree(folder)
    failed = [client.name for client in chosen if "error" in rows[client.name]]
    console.print(f"wrote {out}; failed: {', '.join(failed) or 'none'}")
    if failed:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
