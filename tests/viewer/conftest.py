"""A browser, and what pages in it complain of and ask for."""

from __future__ import annotations

import shutil

import pytest
from page_samples import ALL, page

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
SHAKY = ("GL Driver Message", "GPU stall")  # of software rendering


@pytest.fixture(scope="session")
def browser():
    playwright = pytest.importorskip("playwright.sync_api")
    if BROWSER is None:
        pytest.skip("no Chromium on the PATH")
    with playwright.sync_playwright() as started:
        arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
        chromium = started.chromium.launch(executable_path=BROWSER, args=arguments)
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    return {kind: page(kind, folder) for kind in ALL}


@pytest.fixture
def opened(browser, pages):
    """Opens a page; what it complained of and asked for is in `errors` and `asked`."""
    contexts = []

    def open_page(kind, width=1400, painter="", **options):
        context = browser.new_context(
            viewport={"width": width, "height": 900}, offline=True, **options
        )
        contexts.append(context)
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
        tab.goto(f"file://{pages[kind]}?{painter}")
        tab.wait_for_selector(".foldyn[data-ready='1']")
        return tab

    yield open_page
    for context in contexts:
        context.close()
