"""Compile the C++ twin: `python benchmarks/build.py` or `make -C benchmarks`.

The library is made for the processor at hand, and made anew when the source, the compiler or the
processor changes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from machine import compiler_version, processor

HERE = Path(__file__).resolve().parent
SOURCE = HERE / "cpp" / "kernel.cpp"
FOLDER = HERE / "build"
LIBRARY = FOLDER / "libtwin.so"
STAMP = FOLDER / "made-with.txt"
# gnu++17, because c++17 forbids fused multiply-adds; -fno-math-errno: sqrt need not report
FLAGS = ["-O3", "-march=native", "-std=gnu++17", "-fno-math-errno", "-fPIC", "-shared"]


class NoCompilerError(RuntimeError):
    """There is no C++ compiler, or it cannot compile the twin."""


def compiler() -> str:
    """Path of the C++ compiler: $CXX, or g++.

    Raises
    ------
    NoCompilerError
        It is not there.
    """
    name = os.environ.get("CXX", "g++")
    path = shutil.which(name)
    if path is None:
        raise NoCompilerError(
            f"no C++ compiler {name!r} found: install one (Debian, Ubuntu: apt install g++), or "
            "name another: CXX=/path/to/compiler"
        )
    return path


def library() -> Path:
    """Path of the compiled twin, compiled now if it is missing or stale."""
    path = compiler()
    stamp = "\n".join([processor(), compiler_version(path), " ".join(FLAGS), SOURCE.read_text()])
    if LIBRARY.exists() and STAMP.exists() and STAMP.read_text() == stamp:
        return LIBRARY
    FOLDER.mkdir(exist_ok=True)
    command = [path, *FLAGS, "-o", str(LIBRARY), str(SOURCE)]
    print("compiling:", " ".join([Path(path).name, *FLAGS, SOURCE.name]), file=sys.stderr)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise NoCompilerError(f"{Path(path).name} cannot compile {SOURCE.name}:\n{done.stderr}")
    STAMP.write_text(stamp)
    return LIBRARY


if __name__ == "__main__":
    try:
        print(library().relative_to(HERE.parent))
    except NoCompilerError as error:
        sys.exit(f"build.py: {error}")
