"""Variables of Numba that would stop it are answered with one message."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import foldyn

WITHOUT = {name: text for name, text in os.environ.items() if name[:6] != "NUMBA_"}
# every module that imports from Numba, alone, as if it were the first
EVERY_DOOR = """
import importlib, pathlib, sys
import foldyn.errors
package = pathlib.Path(foldyn.__file__).parent
doors = [path for path in package.rglob("*.py") if "from numba" in path.read_text("utf-8")]
for path in doors:
    name = ".".join(("foldyn", *path.relative_to(package).with_suffix("").parts))
    try:
        importlib.import_module(name)
    except foldyn.errors.InputError as error:
        assert "NUMBA_NUM_THREADS = '0'" in str(error), error
    else:
        raise AssertionError(f"{name} is imported")
    for name in [name for name in sys.modules if name.startswith("foldyn.")]:
        if name != "foldyn.errors":
            del sys.modules[name]
assert len(doors) > 8 and "numba" not in sys.modules
"""


def run(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *arguments]
    where = WITHOUT | variables | {"PYTHONPATH": str(Path(foldyn.__file__).parents[1])}
    return subprocess.run(command, env=where, capture_output=True, text=True, check=False)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("NUMBA_NUM_THREADS", "0", "must be a whole number from 1 on"),
        ("NUMBA_NUM_THREADS", "many", "must be a whole number from 1 on"),
        ("NUMBA_DISABLE_JIT", "1", "unset it, or set it to 0"),
        ("NUMBA_FUNCTION_CACHE_SIZE", "-1", "Unset or correct NUMBA_FUNCTION_CACHE_SIZE = '-1'"),
    ],
)
def test_a_variable_that_stops_kernels_is_bad_input(name, value, told):
    done = run("-m", "foldyn.cli.main", "info", **{name: value})
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith("foldyn: ") and name in line and told in line


def test_python_is_told_the_same_whatever_is_imported_first():
    done = run("-c", EVERY_DOOR, NUMBA_NUM_THREADS="0")
    assert done.returncode == 0, done.stderr


@pytest.mark.matrix
def test_a_variable_that_numba_ignores_is_one_warning():
    done = run("-m", "foldyn.cli.main", "info", NUMBA_OPT="9", NUMBA_CACHE_LOCATOR_CLASSES="none")
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert line.startswith("foldyn: warning: ") and "NUMBA_OPT" in line and "ignores" in line
