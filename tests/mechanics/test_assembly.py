"""A model as a list of terms: sums, copies in other processes, blocks of what is left of it."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from scipy import sparse

import foldyn as fd
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.structures.inelastic_hinges import memory

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)


@pytest.fixture
def whole() -> Assembly:
    """Bars and hinges, a clamp, springs, contact, and creases with memory."""
    pattern = fd.patterns.miura(cells=(1, 1))
    structure = fd.discretize(
        pattern,
        SHEET,
        clamped=[(0, 1)],
        fold_law=fd.Prony([0.5], [0.1]),
        membrane="bars",
        preset="plate",
    )
    floor = fd.Plane((0, 0, structure.nodes[:, 2].min() - 2e-3), (0, 0, 1))
    springs = [fd.Spring(3.0, nodes=[7], direction="x"), fd.Spring(2.0, between=[(5, 8)])]
    case = fd.Case(structure, springs, contact=fd.Contact(planes=[floor], panels=False))
    branches = memory(case.remembering, case.body)
    branches.start(np.zeros(case.body.size), "fresh")
    return case.body.with_terms(branches)


def state(body: Assembly) -> np.ndarray:
    return 1e-3 * np.random.default_rng(1).standard_normal(body.size)


def test_forces_energies_and_tangents_are_sums_over_the_list(whole):
    q, sheet = state(whole), Assembly(whole.sheet)
    assert len(whole.others) == 4
    force, energy, tangent = sheet.internal(q), sheet.energies(q).sum(), sheet.tangent(q)
    for term in whole.others:
        guarded = [whole.others[0]] if isinstance(term, ContactTerm) else []  # it sees clamps
        alone, without = Assembly(whole.sheet, *guarded, term), Assembly(whole.sheet, *guarded)
        force = force + alone.internal(q) - without.internal(q)
        energy += alone.energies(q).sum() - without.energies(q).sum()
        tangent = tangent + term.tangent(q)
    size = np.abs(force).max()
    np.testing.assert_allclose(whole.internal(q), force, atol=1e-12 * size)
    assert whole.energies(q).sum() == pytest.approx(energy, rel=1e-12)
    assert abs(whole.tangent(q) - tangent).max() < 1e-12 * abs(tangent).max()


def test_a_copy_in_another_process_finds_its_own_addresses(whole):
    """Contexts hold addresses of this process; they do not travel."""
    q = state(whole)
    force, energy = whole.internal(q), whole.energies(q)
    sent = pickle.dumps(whole)
    copy = pickle.loads(sent)
    del whole
    np.testing.assert_array_equal(copy.internal(q), force)
    np.testing.assert_array_equal(copy.energies(q), energy)


def test_blocks_of_an_assembly_serve_what_is_left_of_it(whole):
    """About a state, hinges are as stiff as they are meant to be, and there is no contact."""
    q = state(whole)
    left, blocks, u = whole.nominal(q), whole.blocks(), whole.in_rows(q)
    assert len(left.others) == len(whole.others) - 1
    pattern = blocks.pattern
    out = np.zeros((len(pattern.indices), 3, 3))
    blocks.put(left, pattern, u, u, False, out)
    shape = (3 * whole.rows, 3 * whole.rows)
    found = sparse.bsr_array((out, pattern.indices, pattern.indptr), shape=shape).toarray()
    wanted = left.step_tangent(q).toarray()
    np.testing.assert_allclose(found, wanted, atol=1e-12 * np.abs(wanted).max())


def test_planes_that_are_elsewhere_share_what_is_compiled(whole):
    """Each evaluation finds them where they are in its own assembly."""
    q, there = state(whole), np.array([[0.0, 0.0, 1e-3]])
    moved = whole.displaced(there)
    fresh = Assembly(whole.sheet, *(term.displaced(there) for term in whole.others))
    force = whole.internal(q)
    assert np.abs(moved.internal(q) - force).max() > 1e-6 * np.abs(force).max()
    np.testing.assert_array_equal(moved.internal(q), fresh.internal(q))
    np.testing.assert_array_equal(whole.internal(q), force)
    assert moved._evaluated is whole._evaluated is not fresh._evaluated
