"""Numba's cached kernels that no longer fit the sources.

Numba renews a cached function when its own file changed, but does not see a change in a compiled
function that it imported from another file, and would go on with the old one: a wrong number
without a word. So all caches go as soon as one is older than the newest source that is compiled.
"""

from __future__ import annotations

from pathlib import Path

SOURCE = Path(__file__).resolve().parent
COMPILED_LAYERS = ("materials", "mechanics", "dynamics")


def remove_stale_caches(source: Path = SOURCE) -> int:
    """Delete the caches under `source` if any is stale; returns the number of files removed."""
    layers = [source / layer for layer in COMPILED_LAYERS]
    sources = [path for layer in layers for path in layer.rglob("*.py")]
    indexes = [path for layer in layers for path in layer.rglob("__pycache__/*.nbi")]
    if not sources or not indexes:
        return 0
    try:
        newest = max(path.stat().st_mtime for path in sources)
        if all(path.stat().st_mtime >= newest for path in indexes):
            return 0
        stale = [path for layer in layers for path in layer.rglob("__pycache__/*.nb[ic]")]
        for path in stale:
            path.unlink(missing_ok=True)
    except OSError:  # another process does the same, or the folder is read-only: then it is fixed
        return 0
    return len(stale)
