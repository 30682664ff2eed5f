"""The documentation site builds without a warning, loads nothing from elsewhere and is complete."""

import importlib
import re
import subprocess
import sys

import pytest

from tests.pages import DOCS, ROOT

inventory = pytest.importorskip("sphinx.util.inventory")
katex = pytest.importorskip("sphinxcontrib.katex")
for theme_or_extension in ("furo", "myst_parser", "numpydoc"):
    pytest.importorskip(theme_or_extension)

MODULES = ("railenv", "design", "railenv.envs", "agents", "railenv.equations.functions")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    done = subprocess.run(
        [*command, "-d", folder / "doctrees", DOCS, folder / "html"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


def test_reference_has_every_public_name(site):
    with (site / "objects.inv").open("rb") as file:
        entries = inventory.InventoryFile.load(file, "", lambda base, uri: uri)
    known = {name for kind, names in entries.items() if kind.startswith("py:") for name in names}
    for module in MODULES:
        for name in importlib.import_module(module).__all__:
            assert f"{module}.{name}" in known, f"{module}.{name} is not in docs/api"


def test_pages_load_nothing_from_elsewhere(site):
    for page in site.rglob("*.html"):
        loaded = re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=\"([^\"]+)\"", page.read_text())
        assert not [address for address in loaded if "//" in address], page.name


def test_style_sheet_of_the_equations_is_of_the_version_of_their_script(site):
    style = (site / "_static" / "katex" / "katex.min.css").read_text()
    assert f'"{katex.katex_version}"' in style
    for font in re.findall(r"url\((fonts/[^)]+\.woff2)\)", style):
        assert (site / "_static" / "katex" / font).exists()


def test_every_page_is_in_the_site(site):
    for page in DOCS.rglob("*.md"):
        assert (site / page.relative_to(DOCS)).with_suffix(".html").exists()
