"""A real browser without a window, for the pages: the fixtures `browser` and `page`."""

import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

# The same as has_browser in tools/setup.sh.
BROWSERS = ("chromium-headless-shell", "chromium", "google-chrome")
INSTALL = "apt-get install -y --no-install-recommends chromium-headless-shell"
VIEW = {"width": 1260, "height": 800}
PATIENCE_MS = 30_000  # on a busy machine
expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if path is None:
        pytest.fail(f"no browser among {', '.join(BROWSERS)}; install one with: {INSTALL}")
    with sync_playwright() as playwright:
        one = playwright.chromium.launch(executable_path=path)
        yield one
        one.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page that may reach this machine only, and whose scripts must not fail."""
    faults: list[str] = []
    context = browser.new_context(viewport=VIEW, accept_downloads=True)
    one = context.new_page()
    one.set_default_timeout(PATIENCE_MS)
    one.on("pageerror", lambda error: faults.append(str(error)))
    one.on("request", lambda request: faults.append(request.url) if is_elsewhere(request.url) else None)
    yield one
    context.close()
    assert faults == []


def is_elsewhere(url: str) -> bool:
    here = ("http://127.0.0.1:", "ws://127.0.0.1:", "file:", "data:", "blob:")
    return not url.startswith(here)
