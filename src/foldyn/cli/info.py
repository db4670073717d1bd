"""`foldyn info`: versions, threads, optional parts, shipped cases."""

from __future__ import annotations

import os
import platform
from importlib import metadata

from foldyn import __version__
from foldyn.studies import shipped_cases

REQUIRED = ("numpy", "scipy", "numba", "xarray", "h5netcdf", "pydantic", "matplotlib", "tqdm")


def info() -> str:
    """Text of the command."""
    from foldyn.dynamics import METHODS, compiled
    from foldyn.formats import FORMATS
    from foldyn.patterns import GENERATORS
    from foldyn.structures import MASS_RULES

    lines = [
        f"foldyn {__version__}",
        f"python {platform.python_version()}, {platform.system()} {platform.machine()}",
        *(f"{name} {_version(name)}" for name in REQUIRED),
        f"processors: {os.cpu_count()}; a motion runs on one thread",
    ]
    for name in METHODS:
        lines.append(f"kernels of {name}: {'ready' if compiled(name) else 'compiled on first use'}")
    lines += [
        "optional parts: this version has none",
        f"patterns: {', '.join(GENERATORS)}; files: {', '.join(FORMATS)}",
        f"mass rules: {', '.join(MASS_RULES)}",
        "shipped cases:",
        *(f"  {name}" for name in shipped_cases()),
    ]
    return "\n".join(lines)


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing: pip install " + name
