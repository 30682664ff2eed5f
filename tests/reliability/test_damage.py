"""Damaged and hostile files: refused with a message, and nothing in them is executed."""

import io
import pickle
import struct
import subprocess
import sys
import zipfile
from signal import SIGKILL

import numpy as np
import pytest

import agents
import railenv
from benchmarks.reliability import damage
from railenv import files
from railenv.errors import ParameterError
from tests.pages import DOCS

KINDS = {kind.name: kind for kind in damage.kinds(DOCS / "leaderboard.json")}


@pytest.mark.parametrize("name", KINDS)
def test_damaged_files_are_refused_or_give_what_they_held(name):
    tally = damage.run(KINDS[name], 60, 60)
    assert not tally.failures
    assert tally.outcomes[damage.REFUSED] > 30


class Bomb:
    """A pickle that makes a file when it is opened."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


@pytest.fixture
def bomb(tmp_path):
    made = Bomb(tmp_path / "exploded")
    pickle.loads(pickle.dumps(made)).close()
    assert made.path.exists(), "the bomb itself must work"
    made.path.unlink()
    yield made
    assert not made.path.exists()


def _archive(path, members, mode=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", mode) as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def _npy(array, **keywords):
    stream = io.BytesIO()
    np.save(stream, array, **keywords)
    return stream.getvalue()


def _header(text, data=b""):
    line = text.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(line)) + line + data


@pytest.mark.parametrize("member", ["header.npy", "A.npy"])
@pytest.mark.parametrize("kind", ["YawRateFeedback", "LearnedPolicy"])
def test_pickles_in_controller_files_are_not_opened(bomb, tmp_path, kind, member):
    path = tmp_path / "controller.npz"
    agents.controllers.files.write(path, damage.controller_files()[kind])
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for content in (
        _npy(np.array([bomb], dtype=object), allow_pickle=True),
        pickle.dumps(bomb),
        _header("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }", pickle.dumps(bomb)),
    ):
        _archive(path, {**members, member: content})
        with pytest.raises(ParameterError, match="is not a controller's file, or is damaged"):
            agents.load(path)
    path.write_bytes(pickle.dumps(bomb))
    with pytest.raises(ParameterError, match="damaged"):
        agents.load(path)


def test_pickles_in_place_of_other_files_are_not_opened(bomb, tmp_path):
    for name, kind in KINDS.items():
        path = tmp_path / f"bomb{kind.suffix}"
        path.write_bytes(pickle.dumps(bomb))
        with pytest.raises(ParameterError):
            kind.read(path)
        assert not bomb.path.exists(), name


@pytest.mark.parametrize(
    "text",
    [
        "name = \"__import__('os').system('touch exploded')\"",
        "base = \"TABLE_1\"\nconicity = \"__import__('os').system('touch exploded')\"",
        "!!python/object/apply:os.system ['touch exploded']",
    ],
)
def test_code_in_vehicle_files_is_text(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(ParameterError):
        railenv.Vehicle.from_toml("mine.toml")
    assert not (tmp_path / "exploded").exists()


def test_code_in_recipes_is_not_executed(tmp_path, monkeypatch):
    pytest.importorskip("yaml")
    monkeypatch.chdir(tmp_path)
    for tag in ("apply:os.system", "new:os.system", "name:os.system"):
        (tmp_path / "mine.yml").write_text(
            f"railenv/Bogie-v1:\n  seed: !!python/object/{tag} ['touch exploded']\n"
        )
        with pytest.raises(ParameterError, match="cannot be read"):
            agents.learning.recipe.recipe("ppo", "railenv/Bogie-v1", None, tmp_path / "mine.yml")
    assert not (tmp_path / "exploded").exists()


def test_archives_that_unpack_to_gigabytes_are_refused(tmp_path):
    path = tmp_path / "bomb.npz"
    zeros = bytes(2**20)
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("A.npy", "w") as member,
    ):
        for _ in range(files.LARGEST // 2**20 + 1):
            member.write(zeros)
    assert path.stat().st_size < 2**20
    with pytest.raises(ParameterError, match=r"unpacks to 26\d{7} bytes; it must not be more than"):
        agents.load(path)


@pytest.mark.parametrize("shape", ["(10**12,)", "(1000000000000,)", "(-1,)", "(2, 3)"])
def test_headers_that_ask_for_other_sizes_are_refused(tmp_path, shape):
    path = tmp_path / "bomb.npz"
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}"
    _archive(path, {"header.npy": _header(text, bytes(8))})
    with pytest.raises(ParameterError, match="damaged"):
        agents.load(path)


@pytest.mark.parametrize("opening", ["[", "{'a':", "("])
def test_deeply_nested_text_is_refused(tmp_path, opening):
    text = opening.replace("'", '"') * 100_000
    path = tmp_path / "deep.npz"
    _archive(path, {"header.npy": _npy(np.array(text))})
    with pytest.raises(ParameterError, match="damaged"):
        agents.load(path)
    (tmp_path / "deep.toml").write_text(f"name = {text}")
    with pytest.raises(ParameterError, match="not a TOML file"):
        railenv.Vehicle.from_toml(tmp_path / "deep.toml")
    (tmp_path / "deep.json").write_text(text)
    with pytest.raises(ParameterError, match="not a file of evaluations"):
        agents.load_evaluations(tmp_path / "deep.json")


def test_a_file_is_the_old_one_or_the_new_one_when_its_writer_is_killed(tmp_path):
    path = tmp_path / "kept"
    files.write_whole(path, "old")
    for function in ("fsync", "replace"):
        script = (
            "import os, signal\nfrom railenv.files import write_whole\n"
            f"os.{function} = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
            f"write_whole({str(path)!r}, 'new')\n"
        )
        done = subprocess.run([sys.executable, "-c", script], check=False)
        assert done.returncode == -SIGKILL
        assert path.read_text() == "old"
    files.write_whole(path, "new")
    assert path.read_text() == "new"


def test_a_failed_write_leaves_nothing_behind(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        files.write_whole(tmp_path / "kept", "new")
    assert not list(tmp_path.iterdir())
