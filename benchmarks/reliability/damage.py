"""Files cut short at every length, or with random bits changed: refused, or read as they were."""

from __future__ import annotations

import json
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import agents
import railenv
from agents.evaluation.evaluation import load_evaluations, save_evaluations
from agents.evaluation.leaderboard import markdown
from agents.learning.recipe import recipe, recipe_of_run
from benchmarks.reliability.agent_areas import IDS, controller_files
from benchmarks.reliability.fuzz import FAILURE, Tally, check_message, limited, note
from design.reproduction.store import Piece
from design.reproduction.store import Store as Pieces
from design.studies.store import Store
from railenv.errors import RailenvError

UNCHANGED, PART, CHANGED, REFUSED = "as before", "a part", "other values", "refused"
"""What reading a damaged file gives; a part: the lines before the one that is cut."""

_SECONDS = 20.0


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes
    ----------
    name : str
    content : bytes
        Of a whole file.
    suffix : str
    read : callable
        Returns what a file holds, for comparison.
    checked : bool
        Whether the file has checksums, so that no changed content may ever be read; a text that
        people edit has none.
    """

    name: str
    content: bytes
    suffix: str
    read: Callable[[Path], Any]
    checked: bool


def kinds(leaderboard: Path) -> Iterator[Kind]:
    """Make a small file of every kind."""
    folder = Path(tempfile.mkdtemp(prefix="railenv-damage-"))
    yield Kind(
        "vehicle (TOML)",
        railenv.HIGH_SPEED_COACH.to_toml().encode(),
        ".toml",
        railenv.Vehicle.from_toml,
        False,
    )
    for name, content in controller_files().items():
        if name in ("YawRateFeedback", "LearnedPolicy"):
            agents.controllers.files.write(folder / "whole.npz", content)
            whole = (folder / "whole.npz").read_bytes()
            yield Kind(f"controller, {name} (npz)", whole, ".npz", _controller, True)
    settings = {"axes": {"conicity": [0.1, 0.2]}, "speed": 1.5}
    store = Store(folder / "store.jsonl", settings)
    store.add({k: {"critical_speed": 100.1 + k, "loss": "hunting", "note": ""} for k in range(4)})
    yield Kind(
        "store of a map (JSON lines)",
        (folder / "store.jsonl").read_bytes(),
        ".jsonl",
        lambda path: Store(path, settings).records,
        True,
    )
    pieces, piece = Pieces(folder), Piece("piece", damaged, {})
    pieces.save(piece, {"speed": np.linspace(0.0, 1.0, 20), "name": "hunting"})
    whole = pieces.path(piece).read_bytes()
    yield Kind("piece of the report (npz)", whole, ".npz", lambda p: _piece(pieces, piece, p), True)
    save_evaluations(load_evaluations(leaderboard)[:1], folder / "board.json")
    yield Kind("evaluations (JSON)", (folder / "board.json").read_bytes(), ".json", _evaluations, False)
    run = json.dumps({IDS[0]: recipe("ppo", IDS[0]).plain()}).encode()
    yield Kind(
        "run.json of a training run", run, ".json", lambda path: recipe_of_run(path).plain(), False
    )


def _controller(path: Path) -> Any:
    found: Any = agents.load(path)
    content = found.to_file()
    return content.kind, content.header, {k: v.tolist() for k, v in content.arrays.items()}


def _piece(pieces: Pieces, piece: Piece, path: Path) -> Any:
    pieces.path(piece).write_bytes(path.read_bytes())
    found = pieces.load(piece)
    return found["name"], found["speed"].tolist()


def _evaluations(path: Path) -> Any:
    found = load_evaluations(path)
    return [e.summary() for e in found], markdown(found) if found else ""


def damaged(content: bytes, lengths: int, changes: int) -> Iterator[bytes]:
    """Yield a file cut short (at every length, or so many) and with one to eight bits changed."""
    step = max(1, len(content) // lengths)
    yield from (content[:length] for length in range(0, len(content), step))
    rng = np.random.default_rng(1)
    for _ in range(changes):
        flipped = bytearray(content)
        for place in rng.integers(len(content), size=rng.choice([1, 1, 2, 8])):
            flipped[place] ^= 1 << int(rng.integers(8))
        yield bytes(flipped)


def run(kind: Kind, lengths: int, changes: int) -> Tally:
    """Read a kind of file with every damage, and count what comes of it."""
    folder = Path(tempfile.mkdtemp(prefix="railenv-damage-"))
    path = folder / f"damaged{kind.suffix}"
    path.write_bytes(kind.content)
    whole = kind.read(path)
    tally = Tally(Counter())
    for content in damaged(kind.content, lengths, changes):
        path.write_bytes(content)
        try:
            with limited(_SECONDS):
                tally.outcomes[_outcome(kind, path, whole)] += 1
        except Exception as error:  # whatever it is, it is what was looked for
            tally.outcomes[FAILURE] += 1
            note(tally.failures, error, content)
    return tally


def _outcome(kind: Kind, path: Path, whole: Any) -> str:
    try:
        found = kind.read(path)
    except RailenvError as error:
        check_message(error)
        return REFUSED
    if found == whole:
        return UNCHANGED
    if (
        kind.checked
        and isinstance(found, dict)
        and all(whole.get(key) == value for key, value in found.items())
    ):
        return PART
    assert not kind.checked, "a changed content was read"
    return CHANGED
