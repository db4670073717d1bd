"""Numba's caches that no longer fit the sources."""

from __future__ import annotations

from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1] / "src" / "foldyn"
COMPILED_LAYERS = ("materials", "mechanics", "dynamics")
ENDINGS = ("nbi", "nbc")


def remove_stale_caches(source: Path = SOURCE) -> int:
    """Delete Numba's caches under `source` if any is older than the compiled layers' sources.

    Numba renews a cached function when its own file changed, but does not see a change in a
    jitted function that it imported from another file. Returns the number of files removed.
    """
    sources = [path for layer in COMPILED_LAYERS for path in (source / layer).glob("**/*.py")]
    if not sources:
        return 0
    newest = max(path.stat().st_mtime for path in sources)
    caches = [path for end in ENDINGS for path in source.glob(f"**/__pycache__/*.{end}")]
    if not any(path.stat().st_mtime < newest for path in caches if path.suffix == ".nbi"):
        return 0
    for path in caches:
        path.unlink(missing_ok=True)
    return len(caches)
