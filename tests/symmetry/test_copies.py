"""A case moves as its copies do: turned, mirrored, renumbered, and with its loads in halves.

Drawn at random from the registries of loads, histories, supports, dampings and laws, for every method,
paths of equilibria, and every model; see `draws` and `copies`. What fails is found again by its
seed: draw(seed, combinations).
"""

from __future__ import annotations

import numpy as np
import pytest
from copies import copied, split, symmetries
from draws import ANALYSES, EXTRAS, MODELS, SHELL, STATIC, Combination, Draw, draw

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.generalized_alpha import Alpha

# forces on held nodes, coarse steps: not what this is about
pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")

CLOSE = 1e-7  # of the largest displacement
IMPLICIT = ("newmark", "generalized_alpha")
# which kernels serve other tests, too
QUICK = [
    *(Combination(analysis, model) for model in ("plate", "herkal", "merlin2") for analysis in ANALYSES),
    *(Combination(analysis, model) for model in ("n5b8e", SHELL) for analysis in (*IMPLICIT, STATIC)),
    *(Combination(IMPLICIT[1], "plate", extra) for extra in EXTRAS),
]  # fmt: skip
ALL = [
    Combination(analysis, model, extra)
    for extra in ("", *EXTRAS)
    for model in MODELS
    for analysis in ANALYSES
]


@pytest.fixture(autouse=True)
def to_rounding(monkeypatch):
    """Equations solved to rounding: where the iteration stops depends on the numbering."""
    monkeypatch.setattr(Alpha, "tolerance", 1e-12)


def jumps_late(case: fd.Case) -> bool:
    """Whether what follows a jump of a load depends on the step before it, to the first order.

    So it does where dofs without mass are damped: their velocities there are those of that step.
    """
    damped = case.crease_damping.any() or case.rayleigh.beta > 0.0 or case.remembering
    return bool(
        len(case.body.hidden) and damped and any(load.history.jumps() for load in case.loads)
    )


def check(seed: int, drawn: Draw) -> None:
    case, found, initial = drawn.case, drawn.found, drawn.initial
    size, rng, apart = np.abs(found).max(), np.random.default_rng(seed), {}
    assert size > 1e-6 * case.structure.pattern.size
    for symmetry in symmetries(case):
        other, copy = copied(case, symmetry(case, rng))
        start = initial and fd.State(*map(copy.field, (initial.displacement, initial.velocity)))
        moved = copy.field(found)
        apart[symmetry.__name__] = np.abs(drawn.run(other, start) - moved).max() / size
    if not (drawn.analysis in METHODS and jumps_late(case)):
        apart["split"] = np.abs(drawn.run(split(case), initial) - found).max() / size
    assert max(apart.values()) < CLOSE, f"{drawn.analysis}: {apart}, {case}"


@pytest.mark.parametrize("seed", range(30))
def test_copies_move_alike(seed):
    check(seed, draw(seed, QUICK))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(1000, 1500))
def test_500_copies_move_alike(seed):
    check(seed, draw(seed, ALL))
