"""Copies of the package, to be changed, in whose processes nothing else is touched."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import foldyn

SOURCES = Path(foldyn.__file__).parent


def copied(folder: Path, kernels: bool = False) -> Path:
    """Copy of the package below `folder`, with the kernels that are compiled if asked for."""
    package, ignored = folder / "foldyn", shutil.ignore_patterns("__pycache__")
    shutil.copytree(SOURCES, package, ignore=ignored)
    for place in SOURCES.rglob("__pycache__") if kernels else ():
        kept, ignored = package / place.relative_to(SOURCES), shutil.ignore_patterns("*.pyc")
        shutil.copytree(place, kept, copy_function=os.link, ignore=ignored)
    return package
