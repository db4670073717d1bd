"""A copy of the package with a kernel in a folder that no list names, and what runs it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from package_copies import copied

PROBE = """
from foldyn.cases.waveforms import waveform
from foldyn.jit.compiled import kernel
from foldyn.materials.superlinear import moment

@kernel
def probe(w, t):
    return waveform(w, 0, t, False)[0], moment(t + t)
"""
ASK = """
import warnings
warnings.simplefilter("always")
import foldyn as fd
from foldyn.cases.waveforms import Callbacks, pack
from foldyn.probes.probe import probe
print(*probe(pack([fd.HalfSine(1.0)], Callbacks()), 0.5), sum(probe.stats.cache_hits.values()))
"""


def copy_package(folder: Path, kernels: bool = False) -> Path:
    """Copy of the package below `folder`, with its kernels if asked for; returns its folder."""
    package = copied(folder, kernels)
    (package / "probes").mkdir()
    (package / "probes" / "__init__.py").touch()
    (package / "probes" / "probe.py").write_text(PROBE, "utf-8")
    return package


def environment(package: Path, **variables: str | None) -> dict[str, str]:
    """Environment of a process in which the package is that copy; None removes a variable."""
    theirs = {name: text for name, text in os.environ.items() if not name.startswith("NUMBA_")}
    found = theirs | {"PYTHONPATH": str(package.parent)} | variables
    return {name: text for name, text in found.items() if text is not None}


def python(package: Path, code: str, **variables: str | None) -> subprocess.CompletedProcess[str]:
    """What a process said that ran some code."""
    command, where = [sys.executable, "-c", code], environment(package, **variables)
    return subprocess.run(command, env=where, capture_output=True, text=True, check=False)


def ask(package: Path, **variables: str | None) -> tuple[float, float, int]:
    """A half sine at its top, a law's moment at one radian, and how many kernels were loaded."""
    done = python(package, ASK, **variables)
    assert done.returncode == 0, done.stderr
    factor, moment, loaded = done.stdout.split()
    return float(factor), float(moment), int(loaded)


def edit(path: Path, old: str, new: str) -> None:
    """Change a source and leave its time as it was."""
    text, found = path.read_text("utf-8"), path.stat()
    assert old in text
    path.write_text(text.replace(old, new), "utf-8")
    os.utime(path, ns=(found.st_atime_ns, found.st_mtime_ns))
