"""Other numbers for nodes and elements: the same mechanics."""

from __future__ import annotations

import numpy as np
import pytest
from samples import CUBIC, MODELS, relative, state, structure
from test_blocks import force_of, random_model

import foldyn as fd
from foldyn import mechanics
from foldyn.mechanics.model import GROUP, node_order, renumber
from foldyn.mechanics.strips import reach


def shuffled(model, seed=0):
    order = np.random.default_rng(seed).permutation(len(model.rest))
    return order, *renumber(model, order)


def energies(model, u):
    out = np.empty(3)
    mechanics.strain_energies(model, u, out)
    return out


def check_same_mechanics(model, u, order, other, rows):
    """Force, dihedrals, energies and tangent of the renumbered model are those of the model."""
    work, other_work = mechanics.force_scratch(model), mechanics.force_scratch(other)
    force = force_of(model, u, work)
    moved = np.ascontiguousarray(u[order])
    assert relative(force_of(other, moved, other_work), force[order]) < 1e-13
    np.testing.assert_allclose(other_work.angle, work.angle[rows], rtol=1e-14)
    np.testing.assert_allclose(energies(other, moved), energies(model, u), rtol=1e-12)
    np.testing.assert_array_equal(other.hinge_group, model.hinge_group[rows])
    np.testing.assert_array_equal(order[other.hinges], model.hinges[rows])
    dofs = (3 * order[:, None] + np.arange(3)).ravel()
    tangent = mechanics.tangent(model, mechanics.sparsity(model), u).toarray()
    again = mechanics.tangent(other, mechanics.sparsity(other), moved).toarray()
    assert relative(again, tangent[np.ix_(dofs, dofs)]) < 1e-13


@pytest.mark.parametrize("name", MODELS)
def test_renumbered_structures_behave_alike(name):
    s = structure(name)
    order, other, rows = shuffled(s.model)
    check_same_mechanics(s.model, state(s, 1), order, other, rows)


@pytest.mark.parametrize("count", [0, 1, 65, 200])
def test_renumbered_elements_of_mixed_and_user_laws_behave_alike(count):
    model = random_model(count, count, 30, seed=count, bend_law=CUBIC)
    u = np.random.default_rng(1).uniform(-0.05, 0.05, (60, 3))
    order, other, rows = shuffled(model, 2)
    check_same_mechanics(model, u, order, other, rows)
    assert [run[2] for run in other.hinge_runs] == [run[2] for run in model.hinge_runs]


@pytest.mark.matrix
def test_node_order_brings_neighbors_together():
    """Across a sheet of 30 x 8 cells there are 17 vertices and 16 centers; its own numbers
    put all centers after all vertices."""
    pattern = fd.patterns.miura(cells=(30, 8))
    model = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01), preset="plate").model
    order = node_order(model)
    assert sorted(order) == list(range(len(model.rest)))
    other, _ = renumber(model, order)
    assert reach(model) > 1000
    assert reach(other) <= 2 * (17 + 16)
    again = node_order(other)
    assert reach(renumber(other, again)[0]) <= reach(other)


def test_node_order_keeps_numbers_that_are_good():
    pattern = fd.patterns.kresling(sides=6, storeys=12)
    model = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01), preset="plate").model
    np.testing.assert_array_equal(node_order(model), np.arange(len(model.rest)))


def test_node_order_without_bars_or_with_parts_that_do_not_touch():
    apart = random_model(0, 3, 3)
    assert sorted(node_order(apart)) == list(range(60))
    some = random_model(5, 0, 0)
    assert sorted(node_order(some)) == list(range(60))


def test_elements_stand_by_groups_of_lowest_nodes_and_apart_within():
    model = random_model(0, 300, 0, seed=5)
    lowest = model.hinges.min(axis=1).astype(int)
    assert (np.diff(lowest // GROUP) >= 0).all()
    first = lowest[lowest < GROUP]
    distinct = len(set(first))
    assert len(set(first[:distinct])) == distinct
