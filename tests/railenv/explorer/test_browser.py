"""The page as a person uses it, in a real browser; skipped where there is none."""

import re
import time

import numpy as np
import pytest

import railenv
from railenv.vehicles.lookup import named
from tests.railenv.explorer.browser import DESKTOP, PHONE, browser, executable, served

pytest.importorskip("panel", reason="needs the extra explore")
pytest.importorskip("playwright", reason="Playwright is not installed, which drives the browser")
if executable() is None:
    pytest.skip("there is no Chromium on this machine (apt install chromium)", allow_module_level=True)

PATIENCE = 240e3  # ms
MINE = 'base = "HIGH_SPEED_COACH"\nname = "MINE"\nconicity = 0.2\n'


@pytest.fixture(scope="module")
def address():
    with served() as found:
        yield found


@pytest.fixture(scope="module")
def chromium():
    with browser() as found:
        yield found


class Session:
    """A page that is open, with what went wrong in it and what it asked for."""

    def __init__(self, chromium, address, size, **more):
        self.context = chromium.new_context(**size, **more)
        self.page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.errors, self.asked = [], []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(address)
        self.wait_for("h1", r"hunting from 114\.2856 m/s")
        self.wait_for("p", "least damped is bogie hunting")

    def wait_for(self, selector, pattern):
        """Wait until some element has a text."""
        found = self.page.locator(selector).filter(has_text=re.compile(pattern)).first
        found.wait_for(state="visible")
        return found

    def slider(self, name):
        """Return the handle of a slider by its title."""
        title = re.compile(rf"^{re.escape(name)}")
        places = self.page.locator(".bk-EditableSlider, .bk-panel-models-widgets-EditableSlider")
        del places
        return self.page.get_by_text(title).first


@pytest.fixture
def session(chromium, address):
    found = Session(chromium, address, DESKTOP)
    yield found
    found.context.close()


def test_nothing_is_loaded_from_elsewhere_and_nothing_fails(session, address):
    assert session.errors == []
    outside = [u for u in session.asked if not u.startswith((address, "blob:", "data:", "ws://127.0.0.1"))]
    assert outside == []
