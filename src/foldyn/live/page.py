"""The page of a case file with its sliders."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from foldyn.report.page import CSS, document
from foldyn.viewer import scripts


def live_page(title: str, about: Mapping[str, Any], key: str) -> str:
    """Text of the page.

    about : what its script reads: "controls" and "offers".
    key : what its requests carry.
    """
    told = scripts.in_page({**about, "key": key})
    main = (
        f"<h1>{escape(title)}</h1>\n"
        '<div class="live" id="live"><p>This page needs JavaScript.</p></div>\n'
        f'<script type="application/json" id="live.about">{told}</script>'
    )
    css = scripts.style("live") + CSS
    return document(title, main, css, scripts.script_of_live(), "; connect-src 'self'")
