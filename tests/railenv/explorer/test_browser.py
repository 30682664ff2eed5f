"""The page as a person uses it, in a real browser; skipped where there is none."""

import re

import pytest

pytest.importorskip("panel", reason="needs the extra explore")
pytest.importorskip("playwright", reason="Playwright is not installed, which drives the browser")

import design
import railenv
from railenv.vehicles.lookup import named
from tests.pages import script

make_explorer = script("make_explorer")
if make_explorer.executable() is None:
    pytest.skip("there is no Chromium on this machine (apt install chromium)", allow_module_level=True)

MINE = 'base = "HIGH_SPEED_COACH"\nname = "MINE"\nconicity = 0.2\n'


@pytest.fixture(scope="module")
def address():
    with make_explorer.served() as found:
        yield found


@pytest.fixture(scope="module")
def chromium():
    with make_explorer.browser() as found:
        yield found


def opened(chromium, address, size, **more):
    """Open the page; keep what goes wrong in it and what it asks for."""
    page = chromium.new_context(**size, **more).new_page()
    page.errors, page.asked = [], []
    page.set_default_timeout(make_explorer.PATIENCE)
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.on("console", lambda m: page.errors.append(m.text) if m.type == "error" else None)
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(address, timeout=make_explorer.PATIENCE)
    make_explorer.wait_for(page, "h1", r"hunting from 114\.2856 m/s")
    make_explorer.wait_for(page, "p", "least damped is bogie hunting")
    return page


@pytest.fixture(scope="module")
def page(chromium, address):
    found = opened(
        chromium, address, make_explorer.DESKTOP, permissions=["clipboard-read", "clipboard-write"]
    )
    yield found
    found.context.close()


def shown(page):
    return page.locator("h1").first.inner_text()


def width(page):
    return page.evaluate("document.documentElement.scrollWidth")


def handle(page, k):
    """Return the handle of a slider, in the order of the page."""
    return page.locator(".noUi-handle").nth(k)


SPEED, CONICITY = 0, 7
"""Which sliders these are: before the conicity are those of running, with two handles of the range."""


def test_nothing_is_loaded_from_elsewhere_and_nothing_fails(page, address):
    assert page.errors == []
    assert [u for u in page.asked if not u.startswith((address, "blob:", "data:"))] == []
    assert width(page) <= 1400


def test_the_speed_slider_moves_the_present_speed(page):
    handle(page, SPEED).press("ArrowRight")
    make_explorer.wait_for(page, "p", r"at 100\.5 m/s \(362 km/h\) stable")
    handle(page, SPEED).press("ArrowLeft")
    make_explorer.wait_for(page, "p", r"at 100 m/s \(360 km/h\) stable")


def test_the_conicity_slider_moves_the_critical_speed(page):
    handle(page, CONICITY).press("ArrowRight")
    worn = railenv.Bogie(railenv.HIGH_SPEED_COACH_HOLLOW.replace(conicity=0.105))
    expected = design.critical_speed(worn, speed_range=(3.0, 200.0))
    make_explorer.wait_for(page, "h1", re.escape(str(expected)))
    handle(page, CONICITY).press("ArrowLeft")
    make_explorer.wait_for(page, "h1", r"114\.2856 m/s")


def test_the_vehicle_moves_and_stops(page):
    picture = "[...Bokeh.documents[0]._all_models.values()].find(m => m.timer !== undefined).value"
    first = page.evaluate(picture)
    page.wait_for_function(f"{picture} != {first}")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    still = page.evaluate(picture)
    page.wait_for_timeout(500)
    assert page.evaluate(picture) == still


def test_what_is_shown_is_copied_as_python(page):
    page.get_by_role("button", name="Copy as Python").click()
    page.get_by_role("button", name="Copied").wait_for()
    text = page.evaluate("navigator.clipboard.readText()")
    compile(text, "copied", "exec")
    assert "vehicle = railenv.HIGH_SPEED_COACH_HOLLOW\n" in text or "conicity=0.1)" in text
    assert "print(locus.mode(100.0))" in text


def test_what_is_shown_is_saved_as_toml(page, tmp_path):
    with page.expect_download() as download:
        page.get_by_text("Save as TOML").first.click()
    file = tmp_path / "saved.toml"
    download.value.save_as(file)
    assert download.value.suggested_filename == "high_speed_coach_hollow.toml"
    assert named(str(file)) == railenv.HIGH_SPEED_COACH_HOLLOW


def drop(page, target, file):
    """Drop a file on an element, as the system does it."""
    target.evaluate("e => e.scrollIntoView({block: 'center'})")  # not under what stays above the page
    box = target.bounding_box()
    at = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
    data = {"items": [], "files": [str(file)], "dragOperationsMask": 1}
    client = page.context.new_cdp_session(page)
    for kind in ("dragEnter", "dragOver", "drop"):
        client.send("Input.dispatchDragEvent", {"type": kind, **at, "data": data})


def test_a_bad_file_is_told_and_nothing_is_lost(page, tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text('base = "HIGH_SPEED_COACH"\nconicity = -1\n')
    before = shown(page)
    drop(page, page.locator("input[accept='.toml']"), file)
    make_explorer.wait_for(page, "[role=alert]", r"bad\.toml: conicity of Cone is -1")
    assert shown(page) == before


def test_a_file_beside_its_place_does_not_replace_the_page(page, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(MINE)
    before = page.url
    drop(page, page.locator("h1").first, file)
    page.wait_for_timeout(1000)
    assert page.url == before
    assert "hunting from" in shown(page)


def test_a_dropped_vehicle_is_shown(page, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(MINE)
    drop(page, page.locator("input[accept='.toml']"), file)
    mine = railenv.Bogie(railenv.HIGH_SPEED_COACH.replace(conicity=0.2))
    expected = design.critical_speed(mine, speed_range=(3.0, 200.0))
    make_explorer.wait_for(page, "h1", re.escape(str(expected)))
    make_explorer.wait_for(page, "p", "bogie of MINE on tangent track")
    page.locator("[role=alert]").first.wait_for(state="hidden")
    assert page.errors == []


def test_it_fits_a_phone(chromium, address):
    phone = opened(chromium, address, make_explorer.PHONE)
    assert width(phone) == 390
    beyond = "c => c.getBoundingClientRect().right > 391"
    wide = phone.evaluate(f"[...document.querySelectorAll('canvas')].filter({beyond}).length")
    assert wide == 0
    handle(phone, SPEED).press("ArrowRight")
    make_explorer.wait_for(phone, "p", r"at 100\.5 m/s")
    assert phone.errors == []
    phone.context.close()
