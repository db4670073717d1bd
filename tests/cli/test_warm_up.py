"""`foldyn warm-up`: compiles what any run needs, once."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from foldyn.cli.first_uses import STAGES, use
from foldyn.dynamics import METHODS
from pairwise import FEW

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
from foldyn.dynamics import METHODS
import reference

use("bars and hinges")
print(*(name for name, method in METHODS.items() if method.loop.overloads))
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


def test_names_are_unique() -> None:
    names = [name for stage in STAGES for name in stage]
    assert len({*names}) == len(names)
    use(names[0])
    assert use(names[0]) == 0


@pytest.mark.matrix
def test_kernels_are_compiled_where_they_are_used_and_all_of_them_by_warm_up() -> None:
    """Whichever of them are on disk.

    A run compiles or loads the loop of no other method than its own; after `warm-up`, a part of
    the references asks for no kernel.
    """
    each = "75" if FEW else "25"
    command = [sys.executable, "-W", "ignore", "-c", ASKED + THEN, str(BENCHMARKS), each]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    methods, compiled, others, *more = told.stdout.splitlines()
    loop = METHODS["rk4"].loop
    assert methods.split() == [name for name, one in METHODS.items() if one.loop is loop]
    assert int(compiled) > 100 and int(others) > (7 if FEW else 20)
    assert not more
