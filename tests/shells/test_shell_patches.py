"""Patch tests on irregular meshes: constant strain and constant curvature, to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from shell_lab import (
    at_rest,
    dofs,
    equilibrium,
    factor,
    grid,
    plane,
    rotation_matrix,
    sheet_of,
    split,
    tangent,
    with_rotations_on,
)  # fmt: skip

import foldyn as fd

SHEET = fd.Sheet(1e6, 0.3, 0.05)
CURVATURES = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.7, -0.4, 0.9)]  # xx, yy, xy


def skewed(x, y):
    """A quadrilateral with no right angle."""
    return plane(1.2 * x + 0.3 * y + 0.1 * x * y, 0.8 * y - 0.1 * x + 0.2 * x * y)


def irregular(jitter=0.3, nx=8, ny=7):
    return grid(nx, ny, skewed, jitter)


def rim(number):
    return np.unique(np.concatenate([number[0], number[-1], number[:, 0], number[:, -1]]))


def area_of(s):
    x = s.nodes[s.triangles]
    return 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum()


# ------------------------------------------------------------------ membrane


@pytest.mark.parametrize("size", [1e-6, 0.05])
def test_constant_strain_at_any_size_and_attitude(size):
    """x -> Q F x: no force inside, the energy of the strain E = (F^T F - 1) / 2."""
    mesh, number = irregular()
    s = sheet_of(mesh, SHEET)
    f = np.eye(3)
    f[:2, :2] += size * np.array([[1.0, 0.4], [-0.3, -0.6]])
    u = s.nodes @ (rotation_matrix(1) @ f).T - s.nodes
    force, couple = s.forces(u, np.zeros(s.rotations))
    inner = np.setdiff1d(np.arange(len(u)), rim(number))
    scale = SHEET.youngs_modulus * SHEET.thickness  # N/m; rounding of strains of Q x
    assert np.abs(force[inner]).max() < 1e-13 * scale
    assert np.abs(force).max() > 0.01 * size * scale
    assert np.abs(couple).max() < 1e-13 * scale
    e = 0.5 * (f.T @ f - np.eye(3))[:2, :2]
    nu = SHEET.poissons_ratio
    density = 0.5 * scale / (1 - nu**2) * (nu * np.trace(e) ** 2 + (1 - nu) * np.sum(e * e))
    assert s.energy(u, np.zeros(s.rotations)) == pytest.approx(density * area_of(s), rel=1e-8)


def test_constant_strain_is_found_from_the_rim():
    mesh, number = irregular()
    s = sheet_of(mesh, SHEET)
    stretch = np.diag([0.05, 0.02, 0.0]) + 0.03 * np.eye(3)[:, [1, 0, 2]] * [1, 1, 0]
    exact = s.nodes @ stretch.T
    q = at_rest(s)
    fixed = dofs(rim(number))
    q[fixed] = exact.ravel()[fixed]
    found, x = split(s, equilibrium(s, q, 0 * q, fixed, tolerance=1e-12))
    assert np.abs(found - exact).max() < 1e-14
    assert np.abs(x).max() < 1e-13


# ------------------------------------------------------------------ bending


def bent(curvature):
    """A sheet with a rotation on every side, and w = kappa : x x / 2 with its rotations."""
    mesh, number = irregular()
    s, _ = with_rotations_on(sheet_of(mesh, SHEET), rim(number))
    assert not s.sides.free.any()
    kappa = np.array([[curvature[0], curvature[2]], [curvature[2], curvature[1]]])
    x = s.nodes[:, :2]
    w = 0.5 * np.einsum("ni,ij,nj->n", x, kappa, x)
    u = np.zeros_like(s.nodes)
    u[:, 2] = w
    rotation = np.zeros(s.rotations)
    for t, corners in enumerate(s.triangles):
        p = x[corners]
        slope = np.linalg.solve(p[1:] - p[0], w[corners[1:]] - w[corners[0]])  # of the triangle
        for k in range(3):
            a, b = p[k], p[(k + 1) % 3]
            outward = np.array([b[1] - a[1], a[0] - b[0]]) / np.linalg.norm(b - a)
            beta = -(kappa @ (0.5 * (a + b)) - slope) @ outward  # as the dihedral: less on a bowl
            # of the two triangles at a smooth side, beta = d / 2 +- rotation
            share = 0.5 if s.sides.hinge[t, k] >= 0 else 1.0
            rotation[s.sides.rotation[t, k]] += share * s.sides.sign[t, k] * beta
    return s, kappa, np.concatenate([u.ravel(), rotation])


def rim_of(s):
    """Dofs of the triangles on the rim: their nodes, and the rotations of their outer sides.

    Those rotations are against the triangles, so that moments about them turn the triangles too.
    """
    own = (s.sides.hinge < 0) & (s.sides.rotation >= 0)
    nodes = np.unique(s.triangles[own.any(axis=1)])
    return np.concatenate([dofs(nodes), s.nodes.size + s.sides.rotation[own]])


@pytest.mark.parametrize("curvature", CURVATURES)
def test_constant_curvature_needs_no_force_inside(curvature):
    s, kappa, q = bent(curvature)
    matrix = tangent(s, at_rest(s))
    force, terms = matrix @ q, abs(matrix) @ np.abs(q)
    inner = np.setdiff1d(np.arange(q.size), rim_of(s))
    assert np.abs(force[inner]).max() <= 1e-15 * terms.max()  # rounding
    assert np.abs(force).max() > 1e10 * np.abs(force[inner]).max()
    nu = SHEET.poissons_ratio
    density = nu * np.trace(kappa) ** 2 + (1 - nu) * np.sum(kappa * kappa)
    energy = 0.5 * SHEET.bending_modulus * density * area_of(s)
    assert 0.5 * q @ force == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize("curvature", CURVATURES)
def test_constant_curvature_is_found_from_the_rim(curvature):
    s, _, exact = bent(curvature)
    matrix = tangent(s, at_rest(s)).tocsr()
    fixed = rim_of(s)
    free = np.setdiff1d(np.arange(exact.size), fixed)
    found = exact.copy()
    found[free] = factor(matrix[free][:, free])(-(matrix[free][:, fixed] @ exact[fixed]))
    assert np.abs(found - exact).max() < 1e-12 * np.abs(exact).max()


def test_a_plate_bent_by_moments_on_its_rim_is_bent_evenly():
    """Moments on the rim alone give the curvature of the plate's law everywhere."""
    mesh, number = irregular()
    s, rows = with_rotations_on(sheet_of(mesh, SHEET), rim(number))
    moment = np.array([[0.3, 0.1], [0.1, -0.2]])  # N m/m, any constant tensor
    load = at_rest(s)
    for t, k, r in rows:
        a, b, c = s.triangles[t, [k, (k + 1) % 3, (k + 2) % 3]]
        pa, pb, pc = s.nodes[[a, b, c], :2]
        along = (pb - pa) / np.linalg.norm(pb - pa)
        outward = np.array([along[1], -along[0]])
        normal = outward @ moment @ outward * np.linalg.norm(pb - pa)
        load[s.nodes.size + r] -= normal  # on the sheet at the side, and with it on the triangle
        height, foot = (pa - pc) @ outward, (pc - pa) @ along / np.linalg.norm(pb - pa)
        load[dofs([a, b, c], "z")] += normal / height * np.array([1 - foot, foot, -1])
        twist = along @ moment @ outward  # as Kirchhoff has it: forces at the side's ends
        load[dofs([a, b], "z")] += [-twist, twist]
    matrix = tangent(s, at_rest(s)).tocsr()
    held = number[[0, -1, 0], [0, 0, -1]]
    fixed = np.concatenate([dofs(np.arange(len(s.nodes)), "xy"), dofs(held, "z")])
    free = np.setdiff1d(np.arange(load.size), fixed)
    q = at_rest(s)
    q[free] = factor(matrix[free][:, free])(load[free])
    d, nu = SHEET.bending_modulus, SHEET.poissons_ratio
    kappa = ((1 + nu) * moment - nu * np.trace(moment) * np.eye(2)) / (d * (1 - nu**2))
    x = s.nodes[:, :2]
    w = 0.5 * np.einsum("ni,ij,nj->n", x, kappa, x)
    level = np.linalg.solve(np.c_[np.ones(3), x[held]], w[held])
    w -= np.c_[np.ones(len(x)), x] @ level
    assert np.abs(q[2 : 3 * len(x) : 3] - w).max() < 1e-10 * np.abs(w).max()
