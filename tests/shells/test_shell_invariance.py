"""Rigid motions do no work; internal forces balance; moments about rotations vanish at rest."""

from __future__ import annotations

import numpy as np
import pytest
from shell_lab import at_rest, forces, random_state, rotation_matrix, split, tangent

import foldyn as fd
from foldyn.errors import ComputationError, InputError
from foldyn.shells import shell

SHEET = fd.Sheet(1e6, 0.25, 0.05, density=1.0)
MODELS = {
    "simple fold": lambda: fd.patterns.simple_fold(1.0, 1.3, dihedral=60),
    "miura": lambda: fd.patterns.miura(dihedral=60),
    "kresling": fd.patterns.kresling,
    "twisted quad": lambda: fd.Pattern(
        [[0, 0, 0], [1, 0, 0.2], [1.1, 1, 0], [0, 1, 0.3]], [[0, 1, 2, 3]]
    ),
}


@pytest.fixture(params=sorted(MODELS))
def model(request):
    return shell(MODELS[request.param](), SHEET, divisions=3, crease_stiffness=5.0)


def scale(s):
    """A force to compare with: that of a strain of one over the sheet's width."""
    return s.sheet.youngs_modulus * s.sheet.thickness


def turned(s, q, seed):
    """A state moved rigidly, far."""
    u, x = split(s, q)
    shift = np.random.default_rng(seed).uniform(-3, 3, 3)
    moved = (s.nodes + u) @ rotation_matrix(seed).T + shift - s.nodes
    return np.concatenate([moved.ravel(), x])


@pytest.mark.parametrize("seed", range(3))
def test_rigid_motion_of_the_rest_state(model, seed):
    rest = at_rest(model)
    assert np.abs(forces(model, rest)).max() < 1e-14 * scale(model)
    q = turned(model, rest, seed)
    assert np.abs(q).max() > 0.5
    assert np.abs(forces(model, q)).max() < 1e-12 * scale(model)
    for state in (rest, q):
        assert 0.0 <= model.energy(*split(model, state)) < 1e-24 * scale(model)


@pytest.mark.parametrize("seed", range(3))
def test_energies_and_forces_turn_with_the_shell(model, seed):
    q = random_state(model, seed)
    before = model.energies(*split(model, q))
    after = model.energies(*split(model, turned(model, q, seed)))
    for group, value in before.items():
        assert after[group] == pytest.approx(value, rel=1e-11, abs=0.0 if value else 1e-30)
    force, couple = model.forces(*split(model, q))
    force_turned, couple_turned = model.forces(*split(model, turned(model, q, seed)))
    expected = force @ rotation_matrix(seed).T
    assert np.abs(force_turned - expected).max() < 1e-11 * np.abs(force).max()
    assert np.abs(couple_turned - couple).max() < 1e-11 * np.abs(couple).max()


@pytest.mark.parametrize("seed", range(3))
def test_internal_forces_balance(model, seed):
    """No resultant and no moment, so that momentum and angular momentum are kept."""
    q = random_state(model, seed, shift=0.3)
    u, x = split(model, q)
    force = model.forces(u, x)[0]
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    moment = np.cross(model.nodes + u, force).sum(axis=0)
    assert np.abs(moment).max() < 1e-12 * np.abs(force).max()


@pytest.mark.parametrize("name", sorted(MODELS))
def test_free_shells_have_the_six_rigid_modes_and_no_other(name):
    model = shell(MODELS[name](), SHEET, divisions=2, crease_stiffness=5.0)
    matrix = tangent(model, at_rest(model)).toarray()
    value = np.linalg.eigvalsh(matrix)
    assert np.abs(value[:6]).max() < 1e-12 * value[-1]
    assert value[6] > 1e-8 * value[-1]
    x = model.nodes
    for axis in np.eye(3):
        for u in (np.tile(axis, (len(x), 1)), np.cross(axis, x)):
            q = np.concatenate([u.ravel(), np.zeros(model.rotations)])
            assert np.abs(matrix @ q).max() < 1e-11 * value[-1]


def test_a_clamped_edge_takes_the_rigid_modes_but_needs_supports_of_its_nodes():
    """What it keeps is its tangent: turns about the edge are resisted, shifts along it are not."""
    s = shell(MODELS["simple fold"](), SHEET, divisions=3, clamped=[(0, 1)])
    force = tangent(s, at_rest(s)) @ np.concatenate(
        [np.cross([0, 1, 0], s.nodes - s.nodes[0]).ravel(), np.zeros(s.rotations)]
    )
    assert np.abs(force).max() > 1e-3 * s.sheet.bending_modulus
    along = at_rest(s)
    along[1 : s.nodes.size : 3] = 1.0
    assert np.abs(tangent(s, at_rest(s)) @ along).max() < 1e-12 * scale(s)


# ------------------------------------------------------------------ rotations in balance


def test_balanced_rotations_have_no_moment_and_least_energy(model):
    u, x = split(model, random_state(model))
    best = model.balanced(u)
    assert np.abs(model.forces(u, best)[1]).max() < 1e-12 * np.abs(model.forces(u, x)[1]).max()
    assert model.energy(u, best) < model.energy(u, x)
    assert model.energy(u) == model.energy(u, best)
    assert np.array_equal(model.internal_force(u), model.forces(u, best)[0])


@pytest.mark.parametrize("law", ["linear", "superlinear", fd.EnhancedLinear(75, 285)])
@pytest.mark.parametrize("stiffness", [1e-6, 1.0, 1e6])
def test_rotations_find_their_balance_with_any_crease(law, stiffness):
    s = shell(fd.patterns.miura(), SHEET, divisions=2, crease_stiffness=stiffness, fold_law=law)
    u, _ = split(s, random_state(s, shift=0.2))
    couple = s.forces(u, s.balanced(u))[1]
    rounding = np.finfo(float).eps * (stiffness + s.sheet.bending_modulus)
    assert np.abs(couple).max() < 20 * rounding


def test_a_crease_that_pushes_harder_the_further_it_is_has_no_balance():
    law = fd.CustomHingeLaw(
        energy_of=lambda theta, rest: -0.5 * (theta - rest) ** 2,
        moment_of=lambda theta, rest: rest - theta,
        slope_of=lambda theta, rest: -1.0,
    )
    s = shell(MODELS["simple fold"](), SHEET, divisions=1, crease_stiffness=1e6, fold_law=law)
    with pytest.raises(ComputationError, match="do not balance"):
        s.internal_force(split(s, random_state(s))[0])


def test_shapes_of_states_are_checked(model):
    with pytest.raises(InputError, match="displacement of shape"):
        model.energy(np.zeros(5))
    with pytest.raises(InputError, match="rotation of shape"):
        model.energy(np.zeros_like(model.nodes), np.zeros(3 + model.rotations))
    flat = np.zeros(model.nodes.size)
    assert model.forces(flat, np.zeros(model.rotations))[0].shape == model.nodes.shape
