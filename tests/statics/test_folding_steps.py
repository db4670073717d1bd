"""The steps by which patterns are folded: their matrix, and how many there are."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.statics.folding.energy import Aim, Curvature, FoldEnergy, Stiffness


@pytest.mark.parametrize("band", [True, False])
def test_a_step_is_newtons(band, monkeypatch):
    monkeypatch.setattr("foldyn.statics.folding.energy.takes_band", lambda *_: band)
    pattern = fd.patterns.waterbomb((2, 3), dihedral=140)
    energy, rng = (
        FoldEnergy(pattern, np.zeros(len(pattern.creases), bool)),
        np.random.default_rng(5),
    )
    x = energy.start.x + 0.03 * rng.normal(size=energy.start.x.shape)
    driven = np.where(rng.random(len(energy.signs)) < 0.6, 0.4, np.nan)
    aim = Aim(driven, np.full(len(driven), 0.2), np.full(len(driven), 0.7))
    stiffness = Stiffness(bends=0.2, creases=0.3, sides=0.15)

    def gradient(step):
        return energy.gradient(energy.evaluated(energy.start, x + step, aim, stiffness))

    here, force = energy.evaluated(energy.start, x, aim, stiffness), rng.normal(size=x.size)
    matrix, damping = energy.matrix(here, (here.bars.pulls, here.hinges.pulls)), 3.0
    solution = energy.curvature.factorized(matrix, damping)
    assert solution is not None
    step = solution(force)
    change = (gradient(1e-5 * step) - gradient(-1e-5 * step)) / 2e-5
    # the mean of the diagonal, of which the damping is a multiple, is that of all directions
    rest = force - change
    along = rest @ step.ravel() / (step**2).sum()
    np.testing.assert_allclose(rest, along * step.ravel(), atol=1e-6 * np.abs(force).max())
    assert along > damping  # bars have a stiffness of about one
    assert energy.curvature.factorized(matrix, 0.0) is None  # not a minimum


def test_larger_patterns_take_no_more_steps(monkeypatch):
    counted, evaluated = [], FoldEnergy.evaluated

    def counting(*arguments):
        counted[-1] += 1
        return evaluated(*arguments)

    monkeypatch.setattr(FoldEnergy, "evaluated", counting)
    for cells in ((3, 4), (3, 16)):
        counted.append(0)
        folding = fd.fold(fd.patterns.waterbomb(cells, dihedral=180), fraction="45%", steps=10)
        assert folding.kind == "rigid" and folding.rigid_path and not folding.wrong
    # 433 and 445 with damped Gauss-Newton steps alone
    assert max(counted) < 300 and counted[1] < 1.5 * counted[0]


@pytest.mark.matrix
def test_sheets_of_many_ways_to_fold_let_their_springs_go_in_few_steps(monkeypatch):
    solved, factorized = [0], Curvature.factorized

    def counting(*arguments):
        solved[0] += 1
        return factorized(*arguments)

    monkeypatch.setattr(Curvature, "factorized", counting)
    folding = fd.fold(fd.patterns.resch((6, 6), dihedral=180), fraction=0.55, steps=12)
    assert folding.rigid_path and not folding.wrong
    assert solved[0] < 1800  # 463; 2798 where springs are weak at once
