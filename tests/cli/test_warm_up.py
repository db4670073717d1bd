"""`foldyn warm-up`: compiles what any run needs, once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from foldyn.cli.first_uses import STAGES, use

ALONE = """
from foldyn.cli.first_uses import use
from foldyn.dynamics import METHODS
use("bars and hinges")
print(*(name for name, method in METHODS.items() if method.loop.overloads))
"""
OTHERS = """
import sys
sys.path.insert(0, sys.argv[1])
import reference
from foldyn.cli.first_uses import count_compiled
for name, compute in list(reference.cases(""))[::10]:
    with count_compiled() as compiled:
        compute()
    if compiled():
        print(name, compiled())
"""
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.matrix
def test_what_is_there_is_not_compiled_again(workplace, monkeypatch) -> None:
    few = ("bars and hinges", "several motions at once")
    monkeypatch.setattr("foldyn.cli.first_uses.STAGES", [{name: ()} for name in few])
    workplace.call("warm-up")
    told = workplace.call("warm-up")
    assert (told.status, told.err, told.new) == (0, "", [])
    assert told.out.startswith("all kernels are ready (")
    assert workplace.call("warm-up", "--quiet").out == ""


def test_a_run_compiles_its_own_method_alone() -> None:
    """Loaded or compiled: no other method's loop is there."""
    told = subprocess.run(
        [sys.executable, "-c", ALONE], capture_output=True, text=True, check=True, timeout=500
    )
    assert told.stdout.split() == ["rk4"]


def test_names_are_unique() -> None:
    names = [name for stage in STAGES for name in stage]
    assert len({*names}) == len(names)
    use(names[0])
    assert use(names[0]) == 0


@pytest.mark.matrix
def test_nothing_is_left_to_compile(tmp_path) -> None:
    """Neither for a second call nor for computations of other cases."""
    where = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}

    def run(*words: str) -> str:
        command = [sys.executable, "-W", "ignore", *words]
        return subprocess.run(command, env=where, capture_output=True, text=True, check=True).stdout

    assert run("-m", "foldyn.cli.main", "warm-up").startswith("compiled ")
    assert run("-c", OTHERS, str(BENCHMARKS)) == ""
