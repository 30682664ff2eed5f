"""Dropped files: only their bytes are read, and what is wrong with them is told."""

import contextlib
import pathlib
from unittest import mock

import pytest

import railenv
from railenv.errors import ParameterError, RailenvError
from railenv.explorer import dropped

assert (
    railenv.PRESETS
)  # the shipped vehicles, which read the data of the package, are made before the tests
GOOD = b'base = "HIGH_SPEED_COACH"\nname = "MINE"\nconicity = 0.2\n'


def off_the_disk(read, *given):
    """Call a function while no path can be read."""

    def refused(*_, **__):
        raise AssertionError("a path was read")

    with contextlib.ExitStack() as stack:
        stack.enter_context(mock.patch("builtins.open", refused))
        for name in ("open", "read_bytes", "read_text", "stat"):
            stack.enter_context(mock.patch.object(pathlib.Path, name, refused))
        return read(*given)


def test_numbers_and_parts_are_read_from_bytes():
    assert off_the_disk(dropped.vehicle, "mine.toml", GOOD) == railenv.HIGH_SPEED_COACH.replace(
        name="MINE", conicity=0.2
    )
    parts = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly
    assert off_the_disk(dropped.vehicle, "parts.toml", parts.to_toml().encode()) == parts


def test_profiles_are_read_from_bytes():
    lines = "\n".join(f"{y:.3f},{-((y / 100) ** 2):.6f}" for y in range(-36, 37))
    found = off_the_disk(
        dropped.profile, "C:\\mine\\head.csv", f"y_mm,z_mm\n{lines}\n".encode(), "rail"
    )
    assert (found.name, found.kind, len(found.y)) == ("head", "rail", 73)


@pytest.mark.parametrize(
    "contact",
    [
        '[contact]\nlaw = "profiles"\nwheel = "{path}"\n',
        '[contact]\nlaw = "family"\nwear = 0.5\n[contact.new]\nrail = "{path}"\n[contact.worn]\n',
    ],
)
def test_a_path_within_a_file_is_not_followed(contact, tmp_path):
    path = tmp_path / "wheel.csv"
    text = 'base = "HIGH_SPEED_COACH"\nname = "MINE"\n' + contact.format(path=path)
    with pytest.raises(ParameterError, match=r"names the file .*no file\s+that is not dropped"):
        off_the_disk(dropped.vehicle, "mine.toml", text.encode())


def test_a_path_within_parts_is_not_followed():
    text = railenv.Bogie(railenv.HIGH_SPEED_COACH).assembly.to_toml()
    text = text.replace(
        "[[wheelset]]", '[[wheelset]]\nright_contact = {law = "profiles", rail = "/a.csv"}', 1
    )
    with pytest.raises(ParameterError, match=r"names the file '/a\.csv' as its rail"):
        off_the_disk(dropped.vehicle, "parts.toml", text.encode())


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("mine.toml", b"this is no toml", r"^mine\.toml is not a TOML file"),
        ("../../mine.toml", b"\xff\xfe\x00", r"^mine\.toml is not a TOML file"),
        ("mine.toml", b'base = "HIGH_SPEED_COACH"\nspeed = 3\n', "unknown field in mine.toml: 'speed'"),
        ("mine.toml", b'base = "HIGH_SPEED_COACH"\nconicity = -1.0\n', "conicity"),
        ("mine.toml", b"  \n", "is empty"),
        ("mine.json", GOOD, r"must end in \.toml"),
        ("mine.toml", b"#" * (dropped.LARGEST + 1), "a dropped file has at most"),
    ],
)
def test_bad_vehicles_are_told(name, content, message):
    with pytest.raises(RailenvError, match=message):
        off_the_disk(dropped.vehicle, name, content)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("w.csv", b"1,2\n3,4\n", "does not state its units"),
        ("w.csv", b"y_mm,z_mm\n1,2\nx,4\n", r"'w\.csv', line 3 is 'x,4'"),
        ("w.exe", b"MZ", "must end in"),
        ("w.prr", b"point.begin\npoint.end\n", "the profile of a rail, not of a wheel"),
    ],
)
def test_bad_profiles_are_told(name, content, message):
    with pytest.raises(RailenvError, match=message):
        off_the_disk(dropped.profile, name, content, "wheel")
