"""Identity of the program: a digest of the sources that results depend on.

Stored intermediate results carry it, so that results of another version are not reused.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

COMPUTING = (
    "jit", "patterns", "materials", "mechanics", "algebra", "structures", "shells", "cases",
    "statics", "dynamics", "linear", "signals",
)  # fmt: skip
"""Folders of the package whose changes outdate stored results."""


@cache
def program(*more: str) -> str:
    """Digest of the program, "1f0c6a2b9d3e4f58".

    Parameters
    ----------
    *more : str
        Further files and folders of the package on which a result depends.
    """
    return digest(Path(__file__).parent, *more)


def digest(package: Path, *more: str) -> str:
    """Digest of the sources of a package that compute."""
    sources = [path for part in (*COMPUTING, *more) for path in _sources(package / part)]
    found = hashlib.sha256()
    for path in sorted(sources):
        found.update(path.relative_to(package).as_posix().encode())
        found.update(path.read_bytes())
    return found.hexdigest()[:16]


def _sources(part: Path) -> list[Path]:
    inside = [path for path in part.rglob("*") if path.suffix in (".py", ".toml")]
    return [part] if part.is_file() else inside
