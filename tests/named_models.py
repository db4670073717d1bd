"""Models by name, for tests that take options of `discretize`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foldyn.structures.presets import OF_HINGES


def named(options: Mapping[str, Any]) -> dict[str, Any]:
    """Options, with the fast preset "plate" unless they name or imply another."""
    given = {key for key, value in options.items() if value is not None}
    return {**options} if {"preset", *OF_HINGES} & given else {**options, "preset": "plate"}
