"""What a release says of itself is said alike everywhere."""

import re
import tomllib

import pytest

import railenv
from tests.pages import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_version_is_written_once_and_the_citation_agrees():
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert PROJECT["tool"]["hatch"]["version"] == {"path": "railenv/__init__.py"}
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.MULTILINE) == [railenv.__version__]


def test_versions_of_the_changelog_fall_and_begin_with_what_is_coming_or_current():
    found = re.findall(r"^## \[(.+?)\]", CHANGELOG, re.MULTILINE)
    assert found[0] == "Unreleased"
    numbers = [tuple(int(part) for part in version.split(".")) for version in found[1:]]
    assert numbers == sorted(numbers, reverse=True)
    current = tuple(int(part) for part in railenv.__version__.split("."))
    assert not numbers or numbers[0] <= current
    coming = CHANGELOG.split("## [Unreleased]")[1].split("\n## [")[0]
    assert current in numbers or "\n- " in coming


def test_oldest_python_is_the_same_everywhere():
    oldest = PROJECT["project"]["requires-python"].removeprefix(">=")
    assert PROJECT["tool"]["mypy"]["python_version"] == oldest
    assert PROJECT["tool"]["ruff"]["target-version"] == f"py{oldest.replace('.', '')}"
    for page in ("README.md", "CONTRIBUTING.md", "docs/tutorial.md"):
        assert f"Python {oldest} or newer" in (ROOT / page).read_text(encoding="utf-8"), page
    assert f"sys.version_info < ({oldest.replace('.', ', ')})" in (ROOT / "Makefile").read_text("utf-8")
    listed = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["project"]["classifiers"]))
    assert listed[0] == oldest


@pytest.mark.parametrize("name", [n for n in PROJECT["project"]["optional-dependencies"] if n != "dev"])
def test_every_extra_is_told_of_in_the_readme(name):
    assert f"| `{name}` |" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_extras_that_name_others_of_railenv_have_no_marker():
    """The build takes such extras apart, and what they depend on would lose the marker."""
    extras = PROJECT["project"]["optional-dependencies"].values()
    own = [text for extra in extras for text in extra if text.startswith("railenv[")]
    assert own
    assert not [text for text in own if ";" in text]


def test_every_pinned_package_is_pinned_once_and_covers_what_is_declared():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    names = [canonical(pin.partition("==")[0]) for pin in pins]
    assert len(set(names)) == len(names)
    extras = PROJECT["project"]["optional-dependencies"].values()
    for text in [*PROJECT["project"]["dependencies"], *(text for extra in extras for text in extra)]:
        name = canonical(re.match(r"[\w-]+", text)[0])
        assert name == "railenv" or name in names, name


def canonical(name):
    return re.sub(r"[-_.]+", "-", name).lower()
