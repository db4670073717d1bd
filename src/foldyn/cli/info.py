"""`foldyn info`: versions, threads, optional packages, shipped cases."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Callable
from functools import partial
from importlib import metadata

from foldyn import __version__
from foldyn.errors import InputError, optional
from foldyn.studies import shipped_cases


def info() -> str:
    """Return the text that `foldyn info` prints."""
    from foldyn.cases.models import MODELS
    from foldyn.dynamics import METHODS, compiled
    from foldyn.dynamics.gpu import card
    from foldyn.dynamics.gpu.checks import no_card
    from foldyn.experiment.camera import opencv
    from foldyn.formats import FORMATS
    from foldyn.formats.dxf import ezdxf
    from foldyn.linear.frf import METHODS as FRF_METHODS
    from foldyn.mechanics.threads import MOST
    from foldyn.patterns import GENERATORS
    from foldyn.plots.writers import find_ffmpeg
    from foldyn.statics import METHODS as PATH_METHODS
    from foldyn.statics import SOLVERS
    from foldyn.structures import PRESETS

    video = _part(find_ffmpeg, "imageio-ffmpeg")
    camera = _part(lambda: opencv().__version__, "opencv-python-headless")
    clusters = _part(partial(_installed, "distributed"), "distributed")
    moving, drawn = (_part(partial(_installed, name), name) for name in ("nlopt", "cma"))
    drawings = _part(lambda: f"ezdxf {ezdxf().__version__}", "ezdxf")
    processors = os.cpu_count() or 1
    ready = sum(map(compiled, METHODS))
    needed = (one for one in metadata.requires("foldyn") or () if "extra ==" not in one)
    lines = [
        f"foldyn {__version__}",
        f"python {platform.python_version()}, {platform.system()} {platform.machine()}",
        *sorted(map(_version, needed)),
        f"processors: {processors}; the motion of a large sheet runs on up to "
        f"{min(MOST, processors)}",
        *(
            f"kernels of {name}: {'ready' if compiled(name) else 'compiled on first use'}"
            for name in METHODS
        ),
        f"kernels of {ready} of {len(METHODS)} methods ready; foldyn warm-up compiles all",
        f"optional parts: ffmpeg for MP4 animations, {video}",
        f"optional part for camera tracking: OpenCV, {camera}",
        f"optional part for pattern files in DXF: {drawings}",
        f"optional part for sweeps on clusters: Dask, {clusters}",
        f"NVIDIA GPU: {no_card() or card.name()}",
        f"optional parts for inverse design: NLopt, {moving}; CMA-ES, {drawn}",
        *(
            f"linear solver from {solver.worthwhile:,} directions: {name}, "
            + ("found" if solver.found() else f'missing: pip install "{solver.package}"')
            for name, solver in SOLVERS.items()
            if solver.worthwhile > 0 and solver.wheels
        ),
        f"methods of paths: {', '.join(PATH_METHODS)}",
        f"methods of frequency responses: {', '.join(FRF_METHODS)}",
        f"patterns: {', '.join(GENERATORS)}; files: {', '.join(FORMATS)}",
        *(
            f"model {kind}: mass {', '.join(model.masses)} (default: {model.options().mass})"
            for kind, model in MODELS.items()
        ),
        f"presets of bars and hinges: {', '.join(PRESETS)} (default: {next(iter(PRESETS))})",
        "shipped cases:",
        *(f"  {name}" for name in shipped_cases()),
    ]
    return "\n".join(lines)


def _part(look: Callable[[], object], package: str) -> str:
    """Say where an optional package was found, or how to install it."""
    try:
        return f"found: {look()}"
    except InputError:
        return f"missing: pip install {package}"


def _installed(name: str) -> str:
    optional(name, "", "")
    return metadata.version(name)


def _version(requirement: str) -> str:
    name = re.split(r"[^\w.-]", requirement)[0]
    try:
        return f"{name} {metadata.version(name)}"
    except metadata.PackageNotFoundError:
        return f"{name} missing: pip install {name}"
