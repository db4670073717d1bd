"""`foldyn warm-up`: compiles what is asked for once, and nothing else."""

from __future__ import annotations

import subprocess
import sys

import pytest

from foldyn.dynamics import METHODS, warm_up
from foldyn.dynamics.warm_up import MODELS, USUAL, together
from foldyn.errors import InputError
from foldyn.structures import PRESETS

ALONE = """
from foldyn.dynamics import METHODS
from foldyn.dynamics.warm_up import warm_up
warm_up("rk4", "herkal")
print(*(name for name, method in METHODS.items() if method.loop.overloads))
"""


def test_what_is_there_is_not_compiled_again(workplace) -> None:
    words = ("warm-up", "--methods", "rk4", "--models", "herkal", "plate")
    workplace.call(*words)
    told = workplace.call(*words)
    assert (told.status, told.err, told.new) == (0, "", [])
    lines = told.out.splitlines()
    assert lines[::2] == ["1 of 2: rk4, herkal", "2 of 2: rk4, plate"]
    assert all(line.startswith("    ready: ") for line in lines[1::2])
    assert workplace.call(*words, "--quiet").out == ""


def test_a_run_compiles_its_own_method_alone() -> None:
    """Loaded or compiled: no other method's loop is there."""
    told = subprocess.run(
        [sys.executable, "-c", ALONE], capture_output=True, text=True, check=True, timeout=500
    )
    assert told.stdout.split() == ["rk4"]


def test_only_what_goes_together_is_compiled() -> None:
    pairs = together(METHODS, MODELS)
    assert {(method, preset) for method in METHODS for preset in PRESETS} & {*pairs}
    assert ("rk4", "shell") not in pairs and ("newmark", "shell") in pairs
    assert {*USUAL["methods"]} <= {*METHODS} and {*USUAL["models"]} <= {*MODELS}
    with pytest.raises(InputError, match="rk4: do not take shell"):
        together(["rk4"], ["shell"])


@pytest.mark.parametrize("words", [("--methods", "rk5"), ("--models", "rk4")])
def test_unknown_names_are_bad_input(workplace, words) -> None:
    told = workplace.call("warm-up", *words)
    assert (told.status, told.out) == (2, "")
    assert f'foldyn: {words[0]} = "{words[1]}": ' in told.err and "choose one of all" in told.err


def test_all_means_all(workplace, monkeypatch) -> None:
    asked = []
    monkeypatch.setattr(warm_up, "warm_up", lambda *pair: asked.append(pair) or 0)
    workplace.call("warm-up", "--methods", "all", "--models", "all")
    assert asked == together(METHODS, MODELS)
