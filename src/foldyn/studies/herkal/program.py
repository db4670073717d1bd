"""Which program computes: its version, and a digest of the sources that results depend on."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

import foldyn

COMPUTING = (
    "patterns", "materials", "mechanics", "structures", "shells", "cases", "statics", "dynamics",
    "linear", "signals",
    "studies/herkal/models.py", "studies/herkal/runs.py", "studies/herkal/metric.py",
    "studies/herkal/partners.py", "studies/herkal/sensitivity.py",
)  # fmt: skip
"""Folders and files of the package whose changes make stored results outdated."""


@cache
def program() -> str:
    """Version and digest, "0.5.0 1f0c6a2b9d3e4f58"."""
    return f"{foldyn.__version__} {digest(Path(foldyn.__file__).parent)}"


def digest(package: Path) -> str:
    """Digest of the sources of a package that compute."""
    sources = [path for part in COMPUTING for path in _sources(package / part)]
    found = hashlib.sha256()
    for path in sorted(sources):
        found.update(path.relative_to(package).as_posix().encode())
        found.update(path.read_bytes())
    return found.hexdigest()[:16]


def _sources(part: Path) -> list[Path]:
    return [part] if part.is_file() else list(part.rglob("*.py"))
