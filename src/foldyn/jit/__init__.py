"""Compilation: decorators of kernels, kernels on disk, and operations below Python.

Importing this package starts Numba, or raises one clear message if environment variables keep it
from starting. So modules that need Numba import from here first.
"""

from __future__ import annotations

import os
import warnings

from foldyn.errors import InputError, warn

UNREADABLE = "could not be parsed"  # part of Numba's message about a variable that it ignores


def start() -> None:
    """Import Numba; refuse an environment in which kernels cannot run."""
    threads = os.environ.get("NUMBA_NUM_THREADS", "1")
    try:
        enough = int(threads) >= 1
    except ValueError:
        enough = False
    if not enough:
        raise InputError(
            f"NUMBA_NUM_THREADS = {threads!r}: must be a whole number from 1 on; unset it for as "
            "many threads as there are processors"
        )
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            from numba.core import config
        except Exception as error:  # whatever Numba raises for its variables
            raise InputError(
                f"Numba, which compiles the kernels, does not start: {error}. {_variables()}"
            ) from error
    for warning in said:
        text = str(warning.message)
        if UNREADABLE in text:
            text = f"{text.splitlines()[0].rstrip('.')}; Numba ignores it"
            warn(text, "tutorial.md#install")
        else:
            warnings.warn_explicit(text, warning.category, warning.filename, warning.lineno)
    if getattr(config, "DISABLE_JIT", 0):
        raise InputError(
            "NUMBA_DISABLE_JIT is set: the kernels run compiled only; unset it, or set it to 0"
        )


def _variables() -> str:
    given = [f"{name} = {value!r}" for name, value in os.environ.items() if name[:6] == "NUMBA_"]
    if not given:
        return "No variable NUMBA_... is set: look for .numba_config.yaml here, or reinstall Numba"
    return f"Unset or correct {', '.join(sorted(given))}"


start()
