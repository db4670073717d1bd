"""Intel's Math Kernel Library, from the package mkl: where it is, and its sparse solver.

The package is a set of libraries without Python; its functions are called by their C interface.
"""

from __future__ import annotations

import ctypes
import re
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from typing import Any

NAME = re.compile(r"(lib)?mkl_rt(\.\d+)*\.(so|dll)(\.\d+)*")
SAME_BITS = 2  # MKL_CBWR_AUTO: the same arithmetic in each run on one machine


@cache
def library() -> Any:
    """The loaded library, None if it is not there or cannot be loaded."""
    try:
        listed = files("mkl") or []
    except PackageNotFoundError:
        return None
    for file in listed:
        if NAME.fullmatch(file.name):
            try:
                loaded = ctypes.CDLL(str(file.locate()))
            except OSError:
                continue
            loaded.MKL_CBWR_Set(SAME_BITS)  # refused where MKL is at work already: no harm
            return loaded
    return None


def threads() -> int:
    """Threads that it works with: MKL_NUM_THREADS, OMP_NUM_THREADS, or the cores."""
    return int(library().MKL_Get_Max_Threads())
