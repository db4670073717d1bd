"""Edges that give way near their ends: gradients, balance, rigid turns, work of mean forces."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import foldyn as fd
from foldyn.checks import gradient_error, tangent_error
from foldyn.mechanics.following import following_force
from foldyn.structures.membranes import energies, with_gives


@pytest.fixture(scope="module")
def sheet() -> fd.Sheet:
    return fd.Sheet(2e11, 0.3, 3e-4, density=7850.0)


@pytest.fixture(scope="module", params=["miura", "kresling", "mixed"])
def structure(request, sheet):
    if request.param == "miura":
        pattern = fd.patterns.miura(cells=(1, 2), a=0.04, b=0.05, panel_angle=60, dihedral=110)
    elif request.param == "kresling":
        pattern = fd.patterns.kresling(sides=5, radius=0.04, height=0.03, twist=30)
    else:  # panels with three corners beside those with four
        x = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0.3], [0.5, -0.8, 0.4]]) * 0.05
        pattern = fd.Pattern(x, [[0, 1, 2, 3], [1, 0, 4]])
    return fd.discretize(pattern, sheet, preset="n5b8e")


@pytest.fixture(scope="module")
def state(structure):
    """Dofs of a state with strains about as large as turns."""
    rng = np.random.default_rng(3)
    q = 1e-3 * rng.standard_normal(structure.body.size)
    q[structure.nodes.size :] *= 0.1
    return q


def first_of(structure) -> int:
    """The dof of the first give."""
    return structure.body.size - len(structure.edge_gives)


def test_every_edge_between_two_panels_gives_way_at_both_ends(structure) -> None:
    creases = {tuple(sorted(edge)) for edge in structure.folds[:, :2].tolist()}
    edges = [tuple(edge) for edge in structure.edge_gives.tolist()]
    assert {edge: edges.count(edge) for edge in set(edges)} == dict.fromkeys(creases, 2)


def test_forces_are_the_gradient_and_the_tangent_that_of_forces(structure, state) -> None:
    body, tangent = structure.body, structure.body.tangent(state)
    error = gradient_error(lambda q: body.energies(q).sum(), body.internal, at=state, size=1e-5)
    assert error < 1e-6
    assert tangent_error(body.internal, body.tangent, at=state, size=1e-5) < 1e-6
    assert abs(tangent - tangent.T).max() < 1e-12 * abs(tangent).max()


def test_a_turned_sheet_keeps_its_energy_and_its_gives(structure, state) -> None:
    u = state[: structure.nodes.size].reshape(-1, 3)
    c, s = np.cos(2.0), np.sin(2.0)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    turned = (structure.nodes + u) @ turn.T - structure.nodes
    body, first = structure.body, first_of(structure)
    here, there = body.dofs(u), body.dofs(turned)
    assert_allclose(there[first:], here[first:], rtol=1e-9, atol=1e-15)
    assert_allclose(body.energies(there), body.energies(here), rtol=1e-9)
    rigid = structure.nodes @ turn.T - structure.nodes
    assert sum(structure.energies(rigid).values()) < 1e-20 * sum(body.energies(here))


def test_gives_in_balance_are_those_without_force(structure, state) -> None:
    u = state[: structure.nodes.size].reshape(-1, 3)
    q, first = structure.body.dofs(u), first_of(structure)
    x, strains = structure.nodes + u, []
    for _, own in structure.membranes:
        way = x[own.nodes[:, own.ends[:, 1]]] - x[own.nodes[:, own.ends[:, 0]]]
        strains.append(0.5 * ((way**2).sum(axis=2).T * own.per_length2 - 1.0)[:, None])
    found = with_gives(structure.membranes, strains)
    for (_, own), both in zip(structure.membranes, found, strict=True):
        assert_allclose(q[first + own.gives.T], both[len(own.ends) :, 0], rtol=1e-9, atol=1e-18)
    forces = structure.body.internal(q)
    size = np.abs(forces).max()
    assert np.abs(forces[structure.nodes.size :]).max() < 1e-9 * size


def test_stiffness_with_gives_is_positive_definite(structure) -> None:
    """And softer than with edges whose displacements are linear."""
    u = np.zeros(structure.nodes.size)
    stiff = np.linalg.eigvalsh(structure.tangent(u.reshape(-1, 3)).toarray())
    assert stiff[0] > -1e-9 * stiff[-1]
    assert (stiff > 1e-9 * stiff[-1]).sum() == len(u) - 6
    first = first_of(structure)
    gives = structure.body.tangent(np.zeros(structure.body.size))[first:, first:].toarray()
    assert np.linalg.eigvalsh(gives)[0] > 0.0


def test_energies_of_panels_add_up(structure, state) -> None:
    u = state[: structure.nodes.size].reshape(1, -1, 3)
    panels = energies(structure.membranes, structure.nodes, u, len(structure.pattern.faces))
    assert_allclose(panels.sum(), structure.energies(u[0])["strain_bars"], rtol=1e-9)


def test_a_sheet_that_swells_evenly_has_no_stress(structure) -> None:
    """The loads of a uniform strain are in balance where all lengths have grown alike."""
    growth = 1e-4
    force = structure.internal_force(growth * structure.nodes).ravel()
    count = len(structure.pattern.faces)
    swollen = structure.swollen(np.tile(growth * np.eye(3), (count, 1, 1)), np.zeros(count))
    load = following_force(swollen.forces, growth * structure.nodes.ravel(), np.ones((1, 1)))
    assert_allclose(load[: force.size], force, atol=1e-6 * np.abs(force).max())


def test_edges_that_are_held_do_not_give(sheet) -> None:
    """A boundary edge that is straight stiffens the sheet further than one that does not bow."""
    pattern = fd.patterns.miura(cells=(1, 1), a=0.04, b=0.05, panel_angle=60, dihedral=110)
    held = fd.discretize(pattern, sheet, preset="n5b8e", straight="xmin")
    loose = fd.discretize(pattern, sheet, preset="n5b8e")
    u = np.zeros_like(pattern.vertices, shape=(len(loose.nodes), 3))
    difference = (held.tangent(u) - loose.tangent(u)).toarray()
    values = np.linalg.eigvalsh(difference)
    assert values[0] > -1e-6 * values[-1] and values[-1] > 1.0
