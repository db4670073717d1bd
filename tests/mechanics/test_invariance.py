"""Rigid motions do no work; forces balance; force and tangent turn with the structure."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from samples import MODELS, relative, rotation, state, structure

NAMES = sorted(MODELS)
STRESSED = {"miura n5b8 merlin2"}  # folds that are not stress-free at rest


def forces_of(s):
    """A force to compare with: that of a strain of one percent in every bar."""
    return 0.01 * s.sheet.youngs_modulus * s.bar_area.max()


def rigid_modes(x):
    """Translations and infinitesimal rotations of nodes x, columns (3n, 6)."""
    columns = [np.tile(e, (len(x), 1)) for e in np.eye(3)]
    columns += [np.cross(e, x) for e in np.eye(3)]
    return np.stack([c.ravel() for c in columns], axis=1)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(4))
def test_rigid_motion_of_the_rest_state(name, seed):
    """A large rotation and translation: no force, the energy of the rest state."""
    s = structure(name)
    shift = np.random.default_rng(seed).uniform(-3, 3, 3)
    u = s.nodes @ rotation(seed).T + shift - s.nodes
    assert np.abs(u).max() > 0.5
    zero = np.zeros_like(u)
    force = np.abs(s.internal_force(zero)).max()
    if name in STRESSED:
        assert force > 1e-6 * forces_of(s)
    else:
        assert force < 1e-15 * forces_of(s)
        assert all(0.0 <= e < 1e-18 for e in s.energies(zero).values())
    rest = s.internal_force(zero) @ rotation(seed).T
    assert np.abs(s.internal_force(u) - rest).max() < 1e-11 * forces_of(s)
    assert s.energy(u) == pytest.approx(s.energy(zero), rel=1e-12, abs=1e-16)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_force_and_tangent_turn_with_the_structure(name, seed):
    s = structure(name)
    u = state(s, seed)
    q = rotation(seed + 100)
    turned = (s.nodes + u) @ q.T + np.random.default_rng(seed).uniform(-1, 1, 3) - s.nodes
    assert s.energy(turned) == pytest.approx(s.energy(u), rel=1e-12)
    assert relative(s.internal_force(turned), s.internal_force(u) @ q.T) < 1e-12
    big = np.kron(np.eye(len(u)), q)
    assert relative(s.tangent(turned).toarray(), big @ s.tangent(u).toarray() @ big.T) < 1e-12


@settings(max_examples=40)
@given(name=st.sampled_from(NAMES), seed=st.integers(0, 10**6), amplitude=st.floats(1e-6, 0.15))
def test_forces_balance_and_tangents_know_rigid_modes(name, seed, amplitude):
    """At any state: no resultant, no moment; K times a rotation is the rotated force."""
    s = structure(name)
    u = state(s, seed, amplitude)
    k, f = s.tangent(u), s.internal_force(u)
    size = np.abs(f).max() * len(f) + 1e-12 * forces_of(s)
    assert np.abs(f.sum(axis=0)).max() < 1e-13 * size
    assert np.abs(np.cross(s.nodes + u, f).sum(axis=0)).max() < 1e-12 * size
    scale = np.abs(k).sum(axis=1).max() * np.abs(s.nodes).max()
    modes = rigid_modes(s.nodes + u)
    assert np.abs(k @ modes[:, :3]).max() < 1e-12 * scale
    for axis, column in zip(np.eye(3), modes[:, 3:].T, strict=True):
        assert np.abs(k @ column - np.cross(axis, f).ravel()).max() < 1e-12 * scale


@pytest.mark.parametrize("name", NAMES)
def test_tangent_at_rest(name):
    s = structure(name)
    k = s.tangent(np.zeros_like(s.nodes))
    assert k.shape == (s.nodes.size, s.nodes.size)
    scale = np.abs(k).sum(axis=1).max()
    assert np.abs((k - k.T).toarray()).max() < 1e-15 * scale
    if name not in STRESSED:
        assert np.abs(k @ rigid_modes(s.nodes)).max() < 1e-14 * scale * np.abs(s.nodes).max()
        assert np.linalg.eigvalsh(k.toarray()).min() > -1e-12 * scale


@pytest.mark.parametrize("name", NAMES)
def test_force_is_gradient_and_tangent_its_slope(name):
    """Central differences of second order, in every model."""
    s = structure(name)
    u, v = state(s, 3), state(s, 4, 1.0)

    def errors(h):
        force = (s.energy(u + h * v) - s.energy(u - h * v)) / (2 * h)
        slope = (s.internal_force(u + h * v) - s.internal_force(u - h * v)) / (2 * h)
        along = float(np.vdot(s.internal_force(u), v))
        tangent = s.tangent(u) @ v.ravel()
        return np.array([abs(force / along - 1), relative(slope.ravel(), tangent)])

    coarse, fine = errors(2e-3), errors(1e-3)
    np.testing.assert_allclose(np.log2(coarse / fine), 2.0, atol=0.15)
    assert fine.max() < 1e-2
