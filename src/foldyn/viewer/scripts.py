"""The page's script and style: our modules, joined, after the chart library."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import Any

MODULES = (
    "data", "numbers", "colors", "camera", "gl", "painter", "annotations", "vector", "charts",
    "curves", "result", "view", "analysis", "motion", "path", "folding", "modes", "response",
    "cells", "contours", "bands", "periodic", "shape", "analyses", "legend", "files", "page",
    "plots", "tables",
)  # fmt: skip
"""Modules, in an order in which each uses only earlier modules."""
_IMPORT = re.compile(r"^import (\{[^;]*\}) from \"\./(\w+)\.js\";\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:async )?(?:class|function|const) (\w+))", re.MULTILINE)


def _text(name: str) -> str:
    return files("foldyn.viewer").joinpath(name).read_text(encoding="utf-8")


def _module(name: str) -> str:
    """Wrap a module in a function called at once, so that it has its own names."""
    text = _text(f"static/{name}.js")
    names = ", ".join(found[1] for found in _EXPORT.findall(text))
    body = _EXPORT.sub(r"\1", _IMPORT.sub(r"const \1 = modules.\2;\n", text))
    return f"modules.{name} = (() => {{\n{body}return {{ {names} }};\n}})();"


def _joined(names: Iterable[str], begin: str) -> str:
    """Join modules and the call that starts them."""
    own = "\n".join(['"use strict";', "const modules = {};", *map(_module, names)])
    return f"(() => {{\n{own}\n{begin}\n}})();"


@cache
def script_of_tables() -> str:
    """Script of a document with only interactive tables."""
    return _joined(["tables"], "modules.tables.openTables();")


@cache
def script() -> str:
    """Script of a document with all interactive parts."""
    begin = "modules.page.openPages();\nmodules.plots.openPlots();\nmodules.tables.openTables();"
    return _with_charts(MODULES, begin)


@cache
def script_of_live() -> str:
    """Script of a live page, whose results are computed on request."""
    return _with_charts((*MODULES, "live"), "modules.live.openLive();")


def _with_charts(names: Iterable[str], begin: str) -> str:
    """Modules after the chart library."""
    charts = _text("third_party/uplot/uPlot.iife.min.js")
    notice = "/* uPlot 1.6.32, (c) 2022 Leon Sorokin, MIT licence: github.com/leeoniya/uPlot */"
    return f"{notice}\n{charts}\n{_joined(names, begin)}"


@cache
def style_of_text() -> str:
    """Style of a document without interactive parts."""
    return _text("static/report.css")


@cache
def style(*more: str) -> str:
    """Style of a document with interactive parts, and further styles by name."""
    own = [_text(f"static/{name}.css") for name in ("page", *more)]
    return "\n".join([_text("third_party/uplot/uPlot.min.css"), *own, style_of_text()])


def in_page(value: Any) -> str:
    """JSON for a script element: no text in it can end the element or open a comment."""
    return json.dumps(value).replace("<", "\\u003c")


def digest(text: str) -> str:
    """Digest of a script or style for a content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
