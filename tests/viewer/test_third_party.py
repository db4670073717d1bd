"""Third-party code of the page is what its authors published, with its licence."""

from __future__ import annotations

import hashlib
from importlib.resources import files

HASHES = {
    "LICENSE": "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd",
    "uPlot.iife.min.js": "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f",
    "uPlot.min.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
}
"""Of uPlot 1.6.32, as `npm pack` gives it; `.ci/third-party` compares anew."""


def test_the_chart_library_is_unchanged():
    folder = files("foldyn.viewer").joinpath("third_party/uplot")
    found = {item.name: hashlib.sha256(item.read_bytes()).hexdigest() for item in folder.iterdir()}
    assert found == HASHES
