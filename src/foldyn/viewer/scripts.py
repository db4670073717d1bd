"""The page's script and style: our modules, joined, behind the chart library."""

from __future__ import annotations

import base64
import hashlib
import re
from functools import cache
from importlib.resources import files

MODULES = (
    "data", "numbers", "colors", "camera", "gl", "painter", "charts", "result", "view",
    "curves", "analyses", "page",
)  # fmt: skip
"""In an order in which each uses only those before it."""
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)


def _text(name: str) -> str:
    return files("foldyn.viewer").joinpath(name).read_text(encoding="utf-8")


@cache
def script() -> str:
    """Text of the script, which draws all interactive parts of the document that holds it."""
    modules = [_EXPORT.sub("", _IMPORT.sub("", _text(f"static/{name}.js"))) for name in MODULES]
    charts = _text("third_party/uplot/uPlot.iife.min.js")
    notice = "/* uPlot 1.6.32, (c) 2022 Leon Sorokin, MIT licence: github.com/leeoniya/uPlot */"
    own = "\n".join(modules)
    return f'{notice}\n{charts}\n(() => {{\n"use strict";\n{own}\nopenPages();\n}})();'


@cache
def style() -> str:
    """Text of the style."""
    return _text("third_party/uplot/uPlot.min.css") + "\n" + _text("static/page.css")


def digest(text: str) -> str:
    """What a content security policy calls a script or style with this text."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
