"""What is too large is refused from an estimate: at once, and by the name of what makes it so."""

from __future__ import annotations

import dataclasses
import re
import sys
import time
import tracemalloc

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, PLATE, changed
from foldyn import ram_limit
from foldyn.cli.main import main
from foldyn.errors import InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
FORCE = fd.Force([7], (0.01, 0, 0))
MOST = 2**63 - 1
PATTERN = fd.patterns.simple_fold()


@pytest.fixture(scope="module")
def case():
    _ = fd.trace, fd.modes, fd.frf, fd.simulate  # importing them is not what is timed
    structure = fd.discretize(fd.patterns.miura(), SHEET, bend_law="linear")
    return fd.Case(structure, [fd.Fix([0, 1, 2], "xyz")], [FORCE])


def records(case, count):
    unloaded = dataclasses.replace(case, loads=())
    return fd.frf(unloaded, FORCE, frequencies=[1.0, 2.0], method="burst_random", averages=count)


LARGE = {  # what is called with a case, and how the refusal begins
    "cells": (lambda case: fd.patterns.miura((1, 10**8)), "miura: cells = .* vertices"),
    "cells of an eggbox": (lambda case: fd.patterns.eggbox((10**9, 10**9)), "eggbox: cells = "),
    "cells of any number": (lambda case: fd.patterns.miura((MOST, MOST)), "miura: cells = "),
    "sides": (lambda case: fd.patterns.kresling(sides=10**9), "kresling: sides = .* vertices"),
    "storeys": (lambda case: fd.patterns.kresling(storeys=10**9), "kresling: .*storeys = "),
    "divisions": (
        lambda case: fd.shell(PATTERN, SHEET, divisions=3000),
        "divisions = 3000: .* nodes",
    ),
    "more divisions": (lambda case: fd.shell(PATTERN, SHEET, divisions=10**12), "divisions = "),
    "steps": (lambda case: fd.trace(case, steps=10**9), "steps: a path of 1e\\+09 points"),
    "free steps": (lambda case: fd.trace(case, "arc_length", steps=MOST), "steps: .* points"),
    "modes": (lambda case: fd.modes(case, count=10**12), "count: 1e\\+12 modes"),
    "samples": (
        lambda case: fd.simulate(case, 1e6, method="rk4", every_steps=1),
        "interval: .* samples of 13 nodes",
    ),
    "averages": (lambda case: records(case, 10**9), "averages: 1e\\+09 records"),
}


@pytest.mark.parametrize("what", LARGE)
def test_what_is_too_large_is_refused_at_once(case, what):
    make, words = LARGE[what]
    tracemalloc.start()
    began = time.perf_counter()
    try:
        with pytest.raises(InputError, match=rf"^{words}.* needs about [\d.e+]+ GiB, more than"):
            make(case)
        assert tracemalloc.get_traced_memory()[1] < 2**27
    finally:
        tracemalloc.stop()
    assert time.perf_counter() - began < 2.0


def test_half_of_the_memory_is_for_those_who_ask(monkeypatch):
    monkeypatch.setattr(ram_limit, "memory", lambda: 2.0 * ram_limit.GIB)
    check = ram_limit.check_memory
    check("cells", "a pattern", 1.5 * ram_limit.GIB, "take fewer")
    with ram_limit.at_most(ram_limit.HALF):
        check("cells", "a pattern", 0.9 * ram_limit.GIB, "take fewer")
        with pytest.raises(InputError) as told:
            check("cells", "a pattern", 1.5 * ram_limit.GIB, "take fewer")
        with ram_limit.at_most(1.0):
            check("cells", "a pattern", 1.5 * ram_limit.GIB, "take fewer")
    assert str(told.value) == (
        "cells: a pattern needs about 1.5 GiB, more than half of the 2 GiB of this machine: take "
        "fewer, or continue with --force"
    )
    whole = r"3 GiB, more than the 2 GiB of this machine: take fewer$"
    with pytest.raises(InputError, match=whole):
        check("cells", "a pattern", 3.0 * ram_limit.GIB, "take fewer")


def test_the_limit_of_a_container_counts(monkeypatch, tmp_path):
    whole = ram_limit.memory()
    limit = tmp_path / "memory.max"
    monkeypatch.setattr(ram_limit, "_LIMITS", (str(limit),))
    for text, most in (("max\n", whole), ("", whole), ("1048576\n", 2.0**20)):
        limit.write_text(text)
        assert ram_limit.memory() <= most
    assert ram_limit.memory() == 2.0**20


def _peak(make) -> float:
    tracemalloc.start()
    try:
        made = make()
        return tracemalloc.get_traced_memory()[1] / len(getattr(made, "nodes", made))
    finally:
        tracemalloc.stop()


@pytest.mark.matrix
def test_estimates_are_right_within_a_factor_of_two():
    """Of what Python and NumPy allocate; the constants are of the whole process."""
    from foldyn.patterns.generators.arguments import PER_VERTEX
    from foldyn.shells.shell import PER_NODE as PER_SHELL_NODE
    from foldyn.structures.discretize import PER_NODE

    def tangent(structure):
        structure.tangent(np.zeros(structure.nodes.shape))
        return structure

    pattern = fd.patterns.miura((15, 15))
    tangent(fd.discretize(PATTERN, SHEET, bend_law="linear"))  # compiles
    tangent(fd.shell(PATTERN, SHEET, divisions=4))
    for make, per in (
        (lambda: fd.patterns.miura((15, 15)).vertices, PER_VERTEX),
        (lambda: tangent(fd.discretize(pattern, SHEET, bend_law="linear")), PER_NODE),
        (lambda: tangent(fd.shell(PATTERN, SHEET, divisions=20)), PER_SHELL_NODE),
    ):
        assert per / 2.0 < _peak(make) < per * 2.0


CASE = f"""{HELD_MIURA_TEXT}{PLATE}[[supports]]
nodes = "xmax"
axis = "x"
displacement = 0.01
[analysis]
kind = "statics"
steps = 1
"""


@pytest.mark.matrix
def test_the_command_takes_half_of_the_memory_unless_forced(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CASE)
    call = ["run", "case.toml", "--no-figures", "--quiet"]
    for needs in ("pattern.cells = [1, 10000000]", "analysis.steps = 1000000000"):
        (tmp_path / "large.toml").write_text(changed(CASE, needs))
        for more in ([], ["--force"]):  # beyond all of the memory, whatever is said
            began = time.perf_counter()
            assert main(["run", "large.toml", *more]) == 2
            assert time.perf_counter() - began < 2.0
            told = capsys.readouterr().err
            assert re.search(r"(cells = .* vertices|analysis.steps: .* points) needs about", told)
    monkeypatch.setattr(sys.modules["foldyn.structures.discretize"], "PER_NODE", 7000.0)
    monkeypatch.setattr(ram_limit, "memory", lambda: 195e3)  # the factors take 105 kB
    assert main(call) == 2
    assert "pattern: solving for 39 dofs needs about" in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir() if one.is_dir()] == []
    assert main([*call, "--force"]) == 0
