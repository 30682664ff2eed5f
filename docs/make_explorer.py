"""Take the pictures of docs/how-to/explore.md in a browser: ``python docs/make_explorer.py``.

It needs the extra ``explore``, Playwright and a Chromium (``apt install chromium``).
"""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PICTURES = Path(__file__).resolve().parent / "pictures"
NAMES = ("chromium", "chromium-browser", "google-chrome")
DESKTOP: dict[str, Any] = {"viewport": {"width": 1400, "height": 1000}}
PHONE: dict[str, Any] = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "is_mobile": True,
    "has_touch": True,
}
PATIENCE = 300e3
"""ms, for a machine that does other things too, and compiles."""

_LONG = 3600e3  # ms, for limit cycles

_SHOWN = ("--vehicle", "HIGH_SPEED_COACH_S1002", "--speed", "95")


def executable() -> str | None:
    """Return where a Chromium is; None without one."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


@contextlib.contextmanager
def served(*options: str) -> Iterator[str]:
    """Serve the page in a process of its own; yield its address."""
    command = [sys.executable, "-m", "railenv.cli", "explore", "--no-browser", "--port", "0", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip().rpartition(" ")[2]
        try:
            yield address
        finally:
            process.terminate()
            process.wait(timeout=60)


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """Yield a browser without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=executable(), args=["--no-sandbox"])
        try:
            yield found
        finally:
            found.close()


def wait_for(page: Any, selector: str, pattern: str, patience: float = PATIENCE) -> Any:
    """Wait until some element shows a text; return it."""
    found = page.locator(selector).filter(has_text=re.compile(pattern)).first
    found.wait_for(state="visible", timeout=patience)
    return found


def opened(chromium: Any, address: str, size: dict[str, Any], **more: Any) -> Any:
    """Return the page of an address, when it shows its results."""
    page = chromium.new_context(**size, **more).new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(address, timeout=PATIENCE)
    wait_for(page, "p", "least damped is")
    return page


def main() -> None:
    """Take both pictures."""
    if executable() is None:
        raise SystemExit("there is no Chromium on this machine (apt install chromium)")
    with served(*_SHOWN) as address, browser() as chromium:
        page = opened(chromium, address, DESKTOP)
        page.get_by_role("button", name="Follow the limit cycles").click()
        wait_for(page, "div", "limit cycles, speed .* to ", _LONG)
        page.mouse.move(1, 1)  # away from the tools of a figure
        page.evaluate("window.scrollTo(0, 0)")
        page.wait_for_timeout(3000)
        page.screenshot(path=PICTURES / "explorer.png", full_page=True)
        phone = opened(chromium, address, PHONE)
        phone.wait_for_timeout(3000)
        phone.screenshot(path=PICTURES / "explorer-phone.png")
    for name in ("explorer.png", "explorer-phone.png"):
        print(f"wrote {PICTURES / name}")


if __name__ == "__main__":
    main()
