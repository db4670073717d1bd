"""`foldyn info`: versions, threads, optional parts, shipped cases."""

from __future__ import annotations

import os
import platform
from importlib import metadata

from foldyn import __version__
from foldyn.errors import InputError
from foldyn.studies import shipped_cases

REQUIRED = ("numpy", "scipy", "numba", "xarray", "h5netcdf", "pydantic", "matplotlib", "tqdm")


def info() -> str:
    """Text of the command."""
    from foldyn.cases.models import MODELS
    from foldyn.dynamics import METHODS, compiled
    from foldyn.formats import FORMATS
    from foldyn.linear.frf import METHODS as FRF_METHODS
    from foldyn.mechanics.threads import MOST
    from foldyn.patterns import GENERATORS
    from foldyn.statics import METHODS as PATH_METHODS

    lines = [
        f"foldyn {__version__}",
        f"python {platform.python_version()}, {platform.system()} {platform.machine()}",
        *(f"{name} {_version(name)}" for name in REQUIRED),
        f"processors: {os.cpu_count()}; the motion of a large sheet runs on up to {MOST}",
    ]
    for name in METHODS:
        lines.append(f"kernels of {name}: {'ready' if compiled(name) else 'compiled on first use'}")
    lines += [
        f"optional parts: ffmpeg for MP4 animations, {_ffmpeg()}",
        f"optional part for camera tracking: OpenCV, {_opencv()}",
        *(f"optional solver for large structures: {text}" for text in _solvers()),
        f"methods of paths: {', '.join(PATH_METHODS)}",
        f"methods of frequency responses: {', '.join(FRF_METHODS)}",
        f"patterns: {', '.join(GENERATORS)}; files: {', '.join(FORMATS)}",
        *(
            f"model {kind}: mass {', '.join(model.masses)} (default: {model.mass})"
            for kind, model in MODELS.items()
        ),
        "shipped cases:",
        *(f"  {name}" for name in shipped_cases()),
    ]
    return "\n".join(lines)


def _ffmpeg() -> str:
    from foldyn.plots.writers import find_ffmpeg

    try:
        return f"found: {find_ffmpeg()}"
    except InputError:
        return "missing: pip install imageio-ffmpeg"


def _opencv() -> str:
    from foldyn.experiment.camera import opencv

    try:
        return f"found: {opencv().__version__}"
    except InputError:
        return "missing: pip install opencv-python-headless"


def _solvers() -> list[str]:
    from foldyn.statics import SOLVERS

    others = [(name, item) for name, item in SOLVERS.items() if item.worthwhile > 0]
    return [
        f"{name}, {'found' if item.present else 'missing: pip install ' + item.module}"
        for name, item in others
    ]


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing: pip install " + name
