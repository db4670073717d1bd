"""Loops are compiled once, whatever a case consists of: first uses would take minutes else."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.jit.kernel_cache import Kept

FOLD = fd.patterns.simple_fold(a=1.0, b=1.3, dihedral=100)
SHEET = fd.Sheet(1e6, 0.3, 0.01, density=100.0)
SPRING = fd.Spring(2.0, [4])
PLANE = fd.Contact(planes=[fd.Plane((0, 0, -2), (0, 0, 1))], panels=False)


@pytest.fixture
def asked(monkeypatch):
    """Signatures of compiled functions that were asked for since, loaded or compiled."""
    found, load = [], Kept.load_overload

    def noted(kept, signature, context):
        found.append((kept, signature))
        return load(kept, signature, context)

    monkeypatch.setattr(Kept, "load_overload", noted)
    return found


@pytest.mark.parametrize("method", ["rk4", "dormand_prince", "newmark"])
def test_a_loop_serves_all_cases(method):
    """Models and contact; springs, supports that move and creases that turn."""
    turn, moved = fd.Actuate([0], 150.0, fd.Ramp(0.2)), fd.Impose([2], "z", 0.1, fd.Ramp(0.2))
    plates = fd.discretize(FOLD, SHEET, preset="plate", clamped=[(0, 1)])
    cases = [
        fd.Case(fd.discretize(FOLD, SHEET, preset="herkal"), [fd.Fix([0, 1])]),
        fd.Case(plates, [fd.Fix([0, 1]), SPRING, moved], [turn], contact=PLANE),
        fd.Case(fd.shell(FOLD, SHEET, divisions=2), [fd.Fix([0, 1])], [fd.Pressure(1.0)]),
    ]
    for case in cases:
        fd.simulate(case, 2e-4, method=method, dt=1e-4)
    assert len(METHODS[method].loop.overloads) == 1


def test_arrays_that_cannot_be_written_compile_nothing_more(asked):
    body = fd.Case(fd.discretize(FOLD, SHEET, clamped=[(0, 1)], preset="plate"), [SPRING]).body
    q = np.zeros(body.size)
    body.tangent(q)
    asked.clear()
    q.flags.writeable = False
    body.tangent(q)
    assert not asked
