"""A browser for tests of pages, one for each process, and what pages complain of and ask for."""

from __future__ import annotations

import shutil

import pytest

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
SHAKY = ("GL Driver Message", "GPU stall")  # of software rendering


@pytest.fixture(scope="session")
def browser():
    """A headless Chromium; tests that need it skip where there is none."""
    playwright = pytest.importorskip("playwright.sync_api")
    if BROWSER is None:
        pytest.skip("needs Chromium")
    with playwright.sync_playwright() as started:
        arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
        chromium = started.chromium.launch(executable_path=BROWSER, args=arguments)
        yield chromium
        chromium.close()


def listened(context):
    """A new tab that keeps what it complains of in `errors`, what it asks for in `asked`."""
    tab = context.new_page()
    tab.errors, tab.asked = [], []
    tab.on("pageerror", lambda error: tab.errors.append(str(error)))
    tab.on(
        "console",
        lambda m: (
            m.type in ("error", "warning")
            and not any(word in m.text for word in SHAKY)
            and tab.errors.append(m.text)
        ),
    )
    tab.on("request", lambda asked: tab.asked.append(asked.url))
    return tab
