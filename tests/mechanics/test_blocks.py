"""The blocked force kernels: any number of elements, empty groups, any order, reused memory."""

from __future__ import annotations

import numpy as np
import pytest
from samples import relative, state, structure

from foldyn import mechanics
from foldyn.materials import CustomHingeLaw, EnhancedLinear, bar_law, hinge_law
from foldyn.mechanics.model import BLOCK

COUNTS = [0, 1, 2, 63, 64, 65, 127, 128, 129]


def random_model(bars, folds, bends, seed=0, fold_law=None, bend_law=None):
    """Elements between random nodes of a cloud: each node in many elements."""
    rng = np.random.default_rng(seed)
    nodes = rng.uniform(0, 1, (60, 3))

    def rows(count, width):
        chosen = [rng.choice(60, width, replace=False) for _ in range(count)]
        return np.array(chosen).reshape(-1, width)

    def group(count, law, number):
        stiffness, rest = rng.uniform(0.5, 2, count), rng.uniform(1, 5, count)
        return mechanics.Hinges(rows(count, 4), stiffness, rest, law, group=number)

    groups = (
        group(folds, fold_law or EnhancedLinear(), 0),
        group(bends, bend_law or hinge_law("superlinear"), 1),
    )
    unit = rng.uniform(0.5, 2, bars)
    return mechanics.build(nodes, rows(bars, 2), unit, bar_law("ogden"), groups)


def force_of(model, u, work=None):
    out = np.full_like(u, np.nan)
    mechanics.internal_force(model, u, out, work or mechanics.force_scratch(model))
    return out


def one_by_one(model, u):
    """The force from models of one element each."""
    none = dict.fromkeys(("bar_runs", "hinge_runs"), np.zeros((0, 4), np.int64))
    total = np.zeros_like(u)
    for kind in none:
        for start, end, code, row in getattr(model, kind):
            for e in range(start, end):
                one = {**none, kind: np.array([[e, e + 1, code, row]])}
                total += force_of(model._replace(**one), u)
    return total


def test_the_block_size_is_the_one_tested():
    assert BLOCK == 64


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("which", ["bars", "folds", "bends", "all"])
def test_any_number_of_elements(count, which):
    counts = [count if which in (kind, "all") else 0 for kind in ("bars", "folds", "bends")]
    model = random_model(*counts, seed=count)
    u = np.random.default_rng(1).uniform(-0.05, 0.05, (60, 3))
    force = force_of(model, u)
    if count == 0:
        assert not force.any()
        return
    assert relative(force, one_by_one(model, u)) < 1e-13


@pytest.mark.parametrize("count", [0, 5, 65])
def test_energies_of_any_number_of_elements(count):
    """Energies are summed by group, also empty ones; the force is their gradient."""
    model = random_model(3, count, 4, seed=2)
    rng = np.random.default_rng(3)
    u, v = rng.uniform(-0.01, 0.01, (60, 3)), rng.uniform(-1, 1, (60, 3))
    up, down, here = np.empty(3), np.empty(3), np.empty(3)
    mechanics.strain_energies(model, u, here)
    assert (here[1] == 0.0) == (count == 0)
    h = 1e-6
    mechanics.strain_energies(model, u + h * v, up)
    mechanics.strain_energies(model, u - h * v, down)
    slope = (up - down).sum() / (2 * h)
    assert slope == pytest.approx(np.vdot(force_of(model, u), v), rel=1e-4)


def test_workspace_holds_the_dihedrals_and_may_be_reused():
    s = structure("miura n5b8")
    model = s.model
    work = mechanics.force_scratch(model)
    u = state(s, 1)
    first = force_of(model, u, work)
    np.testing.assert_array_equal(
        work.angle, mechanics.angles(model.rest + u, np.asarray(model.hinges))
    )
    force_of(model, state(s, 2), work)
    np.testing.assert_array_equal(force_of(model, u, work), first)


def test_two_user_laws_and_a_built_in_one_side_by_side():
    """Every run calls its own functions."""
    first = CustomHingeLaw(lambda t, r: t, lambda t, r: 1.0 + 0.0 * t, lambda t, r: 0.0)
    second = CustomHingeLaw(lambda t, r: 3 * t, lambda t, r: 3.0 + 0.0 * t, lambda t, r: 0.0)
    u = np.zeros((60, 3))
    both = random_model(5, 70, 80, seed=4, fold_law=first, bend_law=second)
    swapped = random_model(5, 70, 80, seed=4, fold_law=second, bend_law=first)
    halves = [force_of(both._replace(hinge_runs=both.hinge_runs[k : k + 1]), u) for k in (0, 1)]
    other = [
        force_of(swapped._replace(hinge_runs=swapped.hinge_runs[k : k + 1]), u) for k in (0, 1)
    ]
    assert relative(other[0], 3.0 * halves[0]) < 1e-14
    assert relative(3.0 * other[1], halves[1]) < 1e-14


def test_inputs_are_left_alone():
    s = structure("miura n5b8")
    u = state(s, 1)
    before = u.copy()
    s.energy(u), s.internal_force(u), s.tangent(u), s.dihedrals(u)
    np.testing.assert_array_equal(u, before)
    frozen = before.copy()
    frozen.setflags(write=False)
    np.testing.assert_array_equal(s.internal_force(frozen), s.internal_force(u))


def test_nan_is_not_swallowed():
    s = structure("miura n5b8")
    u = np.zeros_like(s.nodes)
    u[4, 0] = np.nan
    assert np.isnan(s.internal_force(u)[4]).all()
    assert np.isnan(s.energy(u))
    assert np.isnan(s.tangent(u).toarray()).any()
