"""`foldyn warm-up`: compiles what any run needs, once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from foldyn.cli.first_uses import STAGES, use
from foldyn.dynamics import METHODS
from pairwise import FEW

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
THEN = """
from foldyn.cli.first_uses import STAGES, use
import reference

for stage in STAGES:
    for name in stage:
        use(name)
warm, others = {*asked}, list(reference.cases(""))[::int(sys.argv[2])]
for name, compute in others:
    compute()
print(len(warm), len(others), *asked - warm, sep="\\n")
"""
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.matrix
def test_what_is_there_is_not_compiled_again(workplace, monkeypatch) -> None:
    monkeypatch.setattr("foldyn.cli.first_uses.STAGES", [{"bars and hinges": ()}])
    assert workplace.call("warm-up", "--quiet").out == ""
    told = workplace.call("warm-up")
    assert (told.status, told.err, told.new) == (0, "", [])
    assert told.out.startswith("all kernels are ready (")


@pytest.mark.matrix
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
    """Whichever of them are on disk: after `warm-up`, a part of the references asks for none."""
    each = "75" if FEW else "25"
    command = [sys.executable, "-W", "ignore", "-c", ASKED + THEN, str(BENCHMARKS), each]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    compiled, others, *more = told.stdout.splitlines()
    assert int(compiled) > 100 and int(others) > (7 if FEW else 20)
    assert not more
