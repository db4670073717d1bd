"""Pages of all kinds, opened in a browser."""

from __future__ import annotations

import pytest
from page_samples import ALL, page

from browsers import listened


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
        tab = listened(context)
        tab.goto(f"file://{pages[kind]}?{painter}")
        tab.wait_for_selector(".foldyn[data-ready='1']")
        return tab

    yield open_page
    for context in contexts:
        context.close()
