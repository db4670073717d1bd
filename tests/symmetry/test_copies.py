"""A case moves as its copies do: turned, mirrored, renumbered, and with its loads in halves.

Drawn at random from the registries of loads, histories, supports, dampings and laws, for every
method, for paths of equilibria, and for every model; see `draws` and `copies`. What fails is found
again by its seed: draw(seed, combinations).
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from copies import copied, split, symmetries
from draws import ANALYSES, EXTRAS, MODELS, SHELL, SMALL, STATIC, Combination, Draw, draw

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.generalized_alpha import Alpha
from pairwise import FEW

# forces on held nodes, coarse steps: not what this is about
pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")

CLOSE = 1e-7  # of the largest displacement
TOUCHED = 1e4  # times as much in the first samples in which a motion touches something
SOON = 3  # such samples; what is later is not compared
STIFF = 1e3
ROUNDED = 1e-11  # forces that are rounding errors but for a part CLOSE times STIFF
IMPLICIT = ("newmark", "generalized_alpha")
TRAPEZOID = ("rk4", "central_difference")  # by which they find the work of loads in a step
# which kernels serve other tests, too; `make test` takes every other one
QUICK = [
    *(Combination(one, model) for model in ("plate", "herkal", "merlin2") for one in ANALYSES),
    *(Combination(one, model) for model in ("n5b8e", SHELL) for one in (*IMPLICIT, STATIC)),
    *(Combination("generalized_alpha", "plate", extra) for extra in EXTRAS),
    *(Combination(one, "plate", "air") for one in ("rk4", "central_difference")),
]
SLOW = Combination("generalized_alpha", SHELL)
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


def jumps_late(case: fd.Case, found) -> bool:
    """Whether it matters that half of a history jumps a little earlier.

    So it does where damped dofs have no mass and a load jumps: their velocities there are those of
    the step before. Where the velocity of damped supports jumps, which no step ends at. And where
    that of any supports jumps at a sample, which then has half of the jump, or that of rest angles
    where the work is that of the trapezoid rule, which takes the velocity on one side of the jump.
    """
    damped = case.crease_damping.any() or case.rayleigh.beta > 0.0 or case.remembering
    late = len(case.body.hidden) and any(load.history.jumps() for load in case.loads)
    knots = knots_of((*case.imposed_terms, *case.base_terms))
    turning = knots_of(case.rest_terms if found.attrs["method"] in TRAPEZOID else ())
    sampled = np.isclose(np.append(knots, turning)[:, None], found.time.values, atol=1e-6).any()
    return bool(sampled or (damped and (late or knots.size)))


def knots_of(terms) -> np.ndarray:
    """Times at which histories of terms have a kink or a jump."""
    return np.array([knot for _, history in terms for knot in history.knots()])


def check(seed: int, drawn: Draw) -> None:
    case, initial = drawn.case, drawn.initial
    rng, apart = np.random.default_rng(seed), {}
    for symmetry in symmetries(case):
        other, copy = copied(case, symmetry(case, rng))
        start = initial and fd.State(*map(copy.field, (initial.displacement, initial.velocity)))
        apart[symmetry.__name__] = furthest(case, drawn.found, drawn.run(other, start), copy.field)
    if not (drawn.analysis in METHODS and jumps_late(case, drawn.found)):
        apart["split"] = furthest(case, drawn.found, drawn.run(split(case), initial), np.array)
    assert max(apart.values()) < CLOSE, f"{drawn.analysis}: {apart}, {case}"


def furthest(case: fd.Case, one, other, field) -> float:
    """Largest difference of the displacements of two results of a case over their size.

    field : what becomes of vectors (..., n, 3) from the one to the other. Energies and the sum of
    the reactions, in which stiff bars multiply differences, must be as near but for `STIFF`; of
    what is held everywhere they are rounding errors, whose size is that of forces at a strain of 1.
    """
    force, size = ROUNDED * float(case.body.scale().max()), case.structure.pattern.size
    pairs = [(field(one.displacement.values), other.displacement.values, 1.0, 0.0)]
    pairs.append((field(reactions(one)).sum(axis=1), reactions(other).sum(axis=1), STIFF, force))
    energies = [name for name in ("work", "kinetic", "dissipated") if name in one]
    values = (np.moveaxis(found[energies].to_array().values, 0, -1) for found in (one, other))
    pairs.append((*values, STIFF, SMALL * size * force))
    leeway = leeways(one)
    if one.attrs.get("steps") != other.attrs.get(
        "steps"
    ):  # rounding ends a step at an event or not
        leeway = np.maximum(leeway, TOUCHED)
    return max(
        float((largest(a - b) / leeway).max())
        / (max(float(largest(a).max()), least) or 1.0)
        / stiff
        for a, b, stiff, least in pairs
    )


def largest(values: np.ndarray) -> np.ndarray:
    """Largest absolute value in each sample (samples, ...)."""
    return np.abs(values).reshape(len(values), -1).max(axis=1, initial=0.0)


def leeways(result) -> np.ndarray:
    """How much more each sample of a result may differ, as something touches or has touched.

    So it may where the flow of a fluid is found anew after so many steps, and these are adaptive.
    """
    if result.attrs.get("flows", 0) > 1 and METHODS[result.attrs["method"]].adaptive:
        return np.full(len(result.displacement), TOUCHED)
    if "contact_force" not in result or "time" not in result.dims:
        return np.ones(len(result.displacement))
    touching = (result.contact_force.values > 0.0).any(axis=1)
    since = np.cumsum(np.logical_or.accumulate(touching))  # samples since the first contact
    return np.select([since == 0, since <= SOON], [1.0, TOUCHED], np.inf)


def reactions(result) -> np.ndarray:
    """Forces of the supports (samples, n, 3), N."""
    out = np.zeros(result.displacement.shape)
    axis = ["xyz".index(name) for name in result.support_axis.values]
    out[:, result.support_node.values, axis] = result.reaction.values
    return out


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(seed, marks=pytest.mark.matrix) if one == SLOW or seed % 2 else seed
        for seed, one in enumerate(QUICK)
        if one != SLOW or not FEW  # that of newmark is tried, which has the same loop
    ],
)
def test_copies_move_alike(seed):
    check(seed, draw(seed, QUICK))


@pytest.mark.matrix
@pytest.mark.parametrize("seed", range(1000, 1000 + int(os.environ.get("DRAWS", "500"))))
def test_many_copies_move_alike(seed):
    check(seed, draw(seed, ALL))
