"""The environments' pages are what their generator makes of the code."""

import re

import pytest

from tests.pages import DOCS, script

LARGEST_PICTURE = 1.5e6  # bytes


make_environments = script("make_environments")
CASES = [pytest.param(case, id=case.file) for case in make_environments.CASES]


@pytest.mark.parametrize("case", CASES)
def test_page_is_generated_from_the_code(case):
    written = (DOCS / "environments" / f"{case.file}.md").read_text(encoding="utf-8")
    assert make_environments.page(case) == written


@pytest.mark.parametrize("case", CASES)
def test_picture_is_animated_and_small(case):
    from PIL import Image

    path = DOCS / "environments" / f"{case.file}.webp"
    assert path.stat().st_size < LARGEST_PICTURE
    with Image.open(path) as picture:
        assert picture.n_frames > 10
        assert picture.size == script("environment_pictures").PICTURE


@pytest.mark.parametrize("case", CASES)
def test_links_of_the_page_lead_somewhere(case):
    page = DOCS / "environments" / f"{case.file}.md"
    text = page.read_text(encoding="utf-8")
    anchors = {file: _anchors(DOCS / "environments" / file) for file in ("bogie.md", page.name)}
    for file, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", text):
        assert (page.parent / file).exists(), file
        assert not anchor or anchor in anchors[file or page.name], anchor


def _anchors(page):
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-") for heading in headings}
