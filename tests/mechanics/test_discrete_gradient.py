"""Forces of the conserving method: their work, their resultant and moment, their limit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.mechanics import angles
from foldyn.mechanics.discrete_gradient import (
    add_bar_forces,
    add_bar_tangent,
    add_hinge_forces,
    add_hinge_tangent,
    discrete_gradient,
    mean_moment,
    mean_stress,
)
from foldyn.mechanics.step_tangent import expected_stress
from pairwise import in_pairs

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
CUBIC = fd.CustomHingeLaw(
    energy_of=lambda t, r: 0.5 * (t - r) ** 2 + 0.25 * (t - r) ** 4,
    moment_of=lambda t, r: (t - r) + (t - r) ** 3,
    slope_of=lambda t, r: 1.0 + 3.0 * (t - r) ** 2,
    name="cubic",
)
LAWS = {
    "linear": ("linear", "linear", "linear"),
    "superlinear": ("ogden", "superlinear", "superlinear"),
    "locking": ("ogden", fd.EnhancedLinear(75, 285), "linear"),
    "custom": ("linear", CUBIC, CUBIC),
}


def miura(laws: str) -> fd.Structure:
    bar, fold, bend = LAWS[laws]
    pattern = fd.patterns.miura(cells=(2, 1), a=1.0, b=1.0, panel_angle=60, dihedral=70)
    return fd.discretize(pattern, SHEET, bar_law=bar, fold_law=fold, bend_law=bend, preset="herkal")


def two_states(s: fd.Structure, turn: float, deform: float, seed: int = 0) -> list[np.ndarray]:
    """Displacements of a deformed sheet, and of one deformed a little more, turned and shifted."""
    rng = np.random.default_rng(seed)
    one = 0.03 * rng.standard_normal(s.nodes.shape)
    other = one + deform * rng.standard_normal(s.nodes.shape)
    rotation = Rotation.from_rotvec(turn * np.array([0.48, -0.6, 0.64])).as_matrix()
    return [one, (s.nodes + other) @ rotation.T - s.nodes + np.array([0.3, -1.0, 2.0])]


def forces(s: fd.Structure, u0: np.ndarray, u1: np.ndarray) -> np.ndarray:
    model, force = s.model, np.zeros(s.nodes.shape)
    before = angles(model.rest + u0, model.hinges)
    add_bar_forces(model, u0, u1, force)
    add_hinge_forces(model, u0, u1, before, np.empty_like(before), force)
    return force


@pytest.mark.parametrize(
    ("laws", "deform", "turn"), in_pairs(LAWS, [1e-9, 1e-4, 0.02], [0.0, 1e-3, 0.3, 1.5])
)
def test_work_is_the_change_of_the_energy(laws, deform, turn):
    """Exactly, for each law, however far the step goes; without resultant and moment."""
    s = miura(laws)
    u0, u1 = two_states(s, turn, deform)
    force, energy = forces(s, u0, u1), s.energy(u0)
    scale = np.abs(force).max()
    assert (force * (u1 - u0)).sum() == pytest.approx(s.energy(u1) - energy, abs=2e-13 * energy)
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
    middle = s.nodes + 0.5 * (u0 + u1)
    assert np.abs(np.cross(middle, force).sum(axis=0)).max() < 1e-12 * scale


@pytest.mark.parametrize("laws", LAWS)
def test_a_rigid_motion_turns_the_forces_with_the_body(laws):
    """Half turned, they are the internal forces, but for the mean positions being nearer."""
    s = miura(laws)
    u0, u1 = two_states(s, 0.4, 0.0)
    middle = Rotation.from_rotvec(0.2 * np.array([0.48, -0.6, 0.64])).as_matrix()
    turned = s.internal_force(u0) @ middle.T
    # bars along the axis keep their force, those across act along directions cos(0.2) as long
    w = 2.0 * np.tan(0.2) * np.array([0.48, -0.6, 0.64])
    square = np.eye(3) * (1.0 + w @ w / 4.0) - np.outer(w, w) / 4.0
    values, vectors = np.linalg.eigh(square)
    shrink = (vectors / np.sqrt(values)) @ vectors.T
    np.testing.assert_allclose(
        forces(s, u0, u1), turned @ shrink, atol=1e-12 * np.abs(turned).max()
    )


@pytest.mark.parametrize("laws", ["linear", "locking", "custom"])
def test_small_steps_give_the_internal_force_in_the_middle(laws):
    """The difference falls with the square of the step."""
    s = miura(laws)
    rng = np.random.default_rng(3)
    middle = 0.02 * rng.standard_normal(s.nodes.shape)
    step = rng.standard_normal(s.nodes.shape)
    sizes, errors = np.array([4e-3, 2e-3, 1e-3]), []
    for h in sizes:
        found = forces(s, middle - h * step, middle + h * step)
        errors.append(np.abs(found - s.internal_force(middle)).max())
    assert observed_order(sizes, errors) == pytest.approx(2.0, abs=0.1)


def test_nothing_moves_nothing_breaks():
    """Equal states, and states that differ by rounding, give the internal force."""
    for laws in LAWS:
        s = miura(laws)
        u = 0.03 * np.random.default_rng(1).standard_normal(s.nodes.shape)
        wanted = s.internal_force(u)
        scale = np.abs(wanted).max()
        np.testing.assert_allclose(forces(s, u, u), wanted, atol=1e-12 * scale)
        near = u * (1.0 + 1e-15)
        np.testing.assert_allclose(forces(s, u, near), wanted, atol=1e-9 * scale)


@pytest.mark.parametrize(("turn", "order"), [(0.0, 3.0), (0.7, 2.0)])
def test_gradient_of_the_dihedral_needs_little_help(turn, order):
    """What is made up along the deformation is of third order in it, of second with a rotation."""
    x0 = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.4, 0.9, 0.3], [0.6, -0.8, 0.2]])
    deform = np.random.default_rng(7).standard_normal((4, 3))
    rotation = Rotation.from_rotvec(turn * np.array([0.48, -0.6, 0.64])).as_matrix()
    rows = np.array([[0, 1, 2, 3]], np.uint32)
    sizes, missing = np.array([1e-2, 5e-3, 2.5e-3]), []
    for size in sizes:
        x1 = (x0 + size * deform) @ rotation.T
        turned = float(angles(x1, rows)[0] - angles(x0, rows)[0])
        points, plain, gradient = (np.empty((4, 3)) for _ in range(3))
        mean = 0.5 * (x0 + x1)
        discrete_gradient(mean, x1 - x0, turned, points, plain, gradient)
        assert (gradient * (x1 - x0)).sum() == pytest.approx(turned, abs=1e-14)
        assert np.abs(np.cross(mean, gradient).sum(axis=0)).max() < 1e-13
        assert np.abs(gradient.sum(axis=0)).max() < 1e-13
        # points = A (mean about its center): without the correction the gradient is A^-1 plain
        stretch = np.linalg.lstsq(mean - mean.mean(axis=0), points, rcond=None)[0].T
        bare = plain @ np.linalg.inv(stretch).T
        missing.append(turned - (bare * (x1 - x0)).sum())
    assert observed_order(sizes, missing) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("laws", LAWS)
def test_tangent_is_the_derivative_of_the_forces(laws):
    """To first order in the step: the error of the blocks falls with it."""
    s = miura(laws)
    model, pattern = s.model, s.body.sheet.sparsity
    u0 = two_states(s, 0.0, 0.0)[0]
    step = np.random.default_rng(5).standard_normal(s.nodes.shape)
    direction = np.random.default_rng(6).standard_normal(s.nodes.shape)
    sizes, errors = np.array([4e-3, 2e-3, 1e-3]), []
    before = angles(model.rest + u0, model.hinges)
    for size in sizes:
        u1 = u0 + size * step
        data = np.zeros((len(pattern.indices), 3, 3))
        stress = np.empty((2, len(model.bars)))
        for row, u in zip(stress, (u0, u1), strict=True):
            expected_stress(model, u, u, False, row)
        add_bar_tangent(model, u0, u1, stress.mean(axis=0), pattern.bar_slots, data)
        add_hinge_tangent(model, u0, u1, before, 0.0, pattern.hinge_slots, data)
        row = np.repeat(np.arange(len(s.nodes)), np.diff(pattern.indptr))
        found = np.zeros(s.nodes.shape)
        np.add.at(found, row, np.einsum("kij,kj->ki", data, direction[pattern.indices]))
        h = 1e-6
        wanted = forces(s, u0, u1 + h * direction) - forces(s, u0, u1 - h * direction)
        errors.append(np.abs(found - wanted / (2.0 * h)).max() / np.abs(found).max())
    assert errors[-1] < 2e-3
    assert observed_order(sizes, errors) > 0.8


def test_mean_values_are_quotients():
    """Closed forms: linear laws give the mean stress and moment, whatever the change."""
    code, address = 0, np.zeros(3, np.int64)
    for x, change in ((0.1, 0.3), (-0.2, 0.5), (0.4, 1e-14), (0.0, 0.0)):
        stress, slope = mean_stress(code, address, x, change)
        assert stress == pytest.approx(0.5 * x + 0.5 * change, rel=1e-12)
        assert slope == pytest.approx(0.5)
        p = np.zeros(4)
        moment, slope = mean_moment(code, address, p, 1.0, 1.0, 1.0 + x, change)
        assert moment == pytest.approx(x + 0.5 * change, rel=1e-12)
        assert slope == pytest.approx(0.5)
    # superlinear through its rest angle: (3/7)(b^(7/3) - a^(7/3)) / (a + b)
    moment, _ = mean_moment(1, address, np.zeros(4), 1.0, 1.0, 0.9, 0.3)
    assert moment == pytest.approx(3 / 7 * (0.2 ** (7 / 3) - 0.1 ** (7 / 3)) / 0.3, rel=1e-12)
