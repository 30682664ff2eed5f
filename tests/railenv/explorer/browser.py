"""The page in a real browser: Debian's Chromium, headless, driven by Playwright."""

import contextlib
import shutil
import subprocess
import sys

NAMES = ("chromium", "chromium-browser", "google-chrome")


def executable():
    """Return where a Chromium is; None without one."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


@contextlib.contextmanager
def served(*options):
    """Serve the page in a process of its own; yield its address."""
    command = [sys.executable, "-m", "railenv.cli", "explore", "--no-browser", "--port", "0", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        address = process.stdout.readline().strip().rpartition(" ")[2]
        try:
            yield address
        finally:
            process.terminate()
            process.wait(timeout=60)


@contextlib.contextmanager
def browser():
    """Yield a browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=executable(), args=["--no-sandbox"])
        try:
            yield found
        finally:
            found.close()


DESKTOP = {"viewport": {"width": 1400, "height": 1000}}
PHONE = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "is_mobile": True,
    "has_touch": True,
}
