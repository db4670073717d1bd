"""`foldyn warm-up`: compiles what any run needs, once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from foldyn.cli.first_uses import STAGES, use
from foldyn.dynamics import METHODS

ALONE = """
from foldyn.cli.first_uses import use
from foldyn.dynamics import METHODS
use("bars and hinges")
print(*(name for name, method in METHODS.items() if method.loop.overloads))
"""
ASKED = """
import sys
from foldyn.jit.kernel_cache import Kept

load, asked = Kept.load_overload, set()

def watched(kept, signature, context):
    asked.add(f"{kept._source} {signature}")
    return load(kept, signature, context)

Kept.load_overload = watched
sys.path.insert(0, sys.argv[1])
"""
ALL = """
from foldyn.cli.first_uses import STAGES, use
for stage in STAGES:
    for name in stage:
        use(name)
print(*asked, sep="\\n")
"""
OTHERS = """
import reference
for name, compute in list(reference.cases(""))[::10]:
    compute()
print(*asked, sep="\\n")
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
    loop = METHODS["rk4"].loop
    assert told.stdout.split() == [name for name, one in METHODS.items() if one.loop is loop]


def test_names_are_unique() -> None:
    names = [name for stage in STAGES for name in stage]
    assert len({*names}) == len(names)
    use(names[0])
    assert use(names[0]) == 0


@pytest.mark.matrix
def test_other_cases_ask_for_no_kernel_that_is_not_compiled() -> None:
    """Whichever of them are on disk: those of `warm-up` hold those of a tenth of the references."""

    def asked(code: str) -> set[str]:
        command = [sys.executable, "-W", "ignore", "-c", ASKED + code, str(BENCHMARKS)]
        told = subprocess.run(command, capture_output=True, text=True, check=True)
        return set(told.stdout.splitlines())

    compiled, needed = asked(ALL), asked(OTHERS)
    assert len(needed) > 50
    assert needed <= compiled, needed - compiled
