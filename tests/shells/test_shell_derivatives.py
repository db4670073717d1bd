"""Energies as the theory says, their derivatives, and the pattern of the tangent."""

from __future__ import annotations

import numpy as np
import pytest
from shell_lab import at_rest, forces, random_state, split, tangent

import foldyn as fd
from foldyn.checks import gradient_error, tangent_error
from foldyn.shells import shell

# thick, with stiff creases: the three parts of the energy are of one size at the states below,
# so that an error in one of them cannot hide behind another
THICK = fd.Sheet(1e6, 0.25, 0.3, density=1.0)
STIFF = 3e3


def twisted() -> fd.Pattern:
    """Panels that are not planar: an eggbox with a vertex pulled out, and a pentagon beside it."""
    box = fd.patterns.eggbox(cells=(1, 1), b=1.3)
    vertices = np.vstack([box.vertices, [[0.3, -0.4, 0.4], [1.0, -0.5, 0.6], [1.6, -0.3, 0.3]]])
    vertices[4, 2] += 0.2
    (a, b), *_ = [e for e in box.boundary.tolist() if vertices[e, 1].max() < 1e-9]
    return fd.Pattern(vertices, [*box.faces, [a, b, 11, 10, 9]])


MODELS = {
    "simple fold": (lambda: fd.patterns.simple_fold(1.0, 1.3, dihedral=60), {"clamped": [(0, 1)]}),
    "miura": (
        lambda: fd.patterns.miura(dihedral=60),
        {"fold_law": fd.EnhancedLinear(75, 285), "crease_rest": 100},
    ),
    "miura as published": (
        lambda: fd.patterns.miura(dihedral=60),
        {"fold_law": fd.EnhancedLinear(75, 285, rest="as_published"), "crease_rest": 65},
    ),
    "kresling": (fd.patterns.kresling, {"fold_law": "superlinear", "crease_rest": 170}),
    "twisted": (twisted, {"fold_law": "linear", "crease_rest": 150}),
    "one panel": (lambda: fd.Pattern([[0, 0], [1, 0], [1.2, 1], [0, 1]], [[0, 1, 2, 3]]), {}),
}


@pytest.fixture(params=sorted(MODELS))
def model(request):
    make, options = MODELS[request.param]
    return shell(make(), THICK, divisions=2, crease_stiffness=STIFF, **options)


def green_strain_energy(s, u):
    """Membrane energy from the deformation gradient of each triangle: C : E : E / 2."""
    nu, total = s.sheet.poissons_ratio, 0.0
    for corners in s.triangles:
        x = s.nodes[corners]
        rest, now = (x[1:] - x[0]).T, ((x + u[corners])[1:] - (x + u[corners])[0]).T
        in_plane = np.linalg.qr(rest).R
        f = now @ np.linalg.inv(in_plane)  # (3, 2)
        e = 0.5 * (f.T @ f - np.eye(2))
        per_area = nu * np.trace(e) ** 2 + (1.0 - nu) * np.sum(e * e)
        area = 0.5 * abs(np.linalg.det(in_plane))
        total += 0.5 * s.sheet.youngs_modulus * s.sheet.thickness / (1.0 - nu**2) * area * per_area
    return total


def dihedral(x, row):
    """Dihedral of points j, k, i, l by the angle between two arms normal to the axis."""
    j, k, *wings = x[row]
    axis = (k - j) / np.linalg.norm(k - j)
    arm, other = (p - j - ((p - j) @ axis) * axis for p in wings)
    return np.arctan2(np.cross(arm, other) @ axis, arm @ other) % (2.0 * np.pi)


def bending_energy(s, u, x):
    """Energy of the curvatures sum L/A beta n n^T of triangles without free sides, and of others.

    The others: the least over the rotations of their free sides.
    """
    nu, found, total = s.sheet.poissons_ratio, s.sides, 0.0
    rest = np.concatenate([s.nodes, found.wings])
    moved = rest.copy()
    moved[: len(u)] += u
    for j, k, _, wing in found.hinges[found.hinges[:, 3] >= len(u)]:
        moved[wing] += 0.5 * (u[j] + u[k])  # rides on its side
    for t, corners in enumerate(s.triangles):
        p = s.nodes[corners]
        normal = np.cross(p[1] - p[0], p[2] - p[0])
        area = 0.5 * np.linalg.norm(normal)
        basis = np.stack([(p[1] - p[0]) / np.linalg.norm(p[1] - p[0]), np.zeros(3)])
        basis[1] = np.cross(normal / (2.0 * area), basis[0])
        known, free = np.zeros((2, 2)), []
        for k in range(3):
            side = basis @ (p[(k + 1) % 3] - p[k])
            n = np.array([side[1], -side[0]]) / np.linalg.norm(side)
            share = np.linalg.norm(side) / area * np.outer(n, n)
            if found.free[t, k]:
                free.append(share)
                continue
            beta, h = 0.0, found.hinge[t, k]
            if h >= 0:
                turn = dihedral(moved, found.hinges[h]) - dihedral(rest, found.hinges[h])
                beta += found.weight[t, k] * turn
            if found.rotation[t, k] >= 0:
                beta += found.sign[t, k] * x[found.rotation[t, k]]
            known += beta * share

        def product(a, b):
            return nu * np.trace(a) * np.trace(b) + (1.0 - nu) * np.sum(a * b)

        if free:
            matrix = np.array([[product(a, b) for b in free] for a in free])
            least = np.linalg.lstsq(matrix, [-product(a, known) for a in free], rcond=None)[0]
            known = known + sum(beta * share for beta, share in zip(least, free, strict=True))
        total += 0.5 * s.sheet.bending_modulus * area * product(known, known)
    return total


def test_energies_are_those_of_the_theory(model):
    u, x = split(model, random_state(model))
    found = model.energies(u, x)
    assert list(found) == ["strain_membrane", "strain_bending", "strain_folds"]
    assert found["strain_membrane"] == pytest.approx(green_strain_energy(model, u), rel=1e-12)
    assert found["strain_bending"] == pytest.approx(bending_energy(model, u, x), rel=1e-11)
    assert model.energy(u, x) == pytest.approx(sum(found.values()), rel=1e-14)


def test_parts_of_the_energy_are_of_one_size_in_these_tests(model):
    found = np.array(list(model.energies(*split(model, random_state(model))).values()))
    if not len(model.fold_stiffness):
        found = found[:2]
    assert found.min() > 0.02 * found.max()


@pytest.mark.parametrize("seed", range(2))
def test_forces_are_the_gradient_and_the_tangent_their_derivative(model, seed):
    q = random_state(model, seed)
    error = gradient_error(
        lambda q: model.energy(*split(model, q)), lambda q: forces(model, q), at=q
    )
    assert error < 1e-9
    assert (
        tangent_error(lambda q: forces(model, q), lambda q: tangent(model, q), at=q, seed=seed)
        < 1e-9
    )
    matrix = tangent(model, q)
    assert abs(matrix - matrix.T).max() < 1e-14 * abs(matrix).max()


def test_pattern_of_the_tangent(model):
    """Columns ascend, none twice; symmetric; the dofs of a triangle and its neighbors only."""
    found = model.body.sheet.sparsity
    size = model.nodes.size + model.rotations
    assert size == len(found.indptr) - 1
    assert found.indptr[-1] == len(found.indices)
    rows = np.repeat(np.arange(size), np.diff(found.indptr))
    key = rows * size + found.indices
    assert (np.diff(key) > 0).all()
    assert np.array_equal(np.sort(found.indices.astype(np.int64) * size + rows), key)
    dense = tangent(model, random_state(model)).toarray()
    assert (dense.ravel()[np.setdiff1d(np.arange(size**2), key)] == 0.0).all()


def test_addresses_take_little_memory():
    """At 1e5 triangles the tables of addresses stay far below the matrix (some 2 kB a triangle)."""
    made = shell(fd.patterns.miura(), THICK, divisions=8)
    tables = sum(table.nbytes for table in made.body.sheet.sparsity[3:])
    assert tables / len(made.triangles) < 450


def test_floor_raises_the_slope_of_the_creases_only():
    s = shell(fd.patterns.miura(), THICK, divisions=2, fold_law="superlinear")
    q = at_rest(s)  # where the law has no slope
    soft, stiff = tangent(s, q), s.tangent(*split(s, q), floor=1e-3)
    straight = shell(fd.patterns.miura(), THICK, divisions=2, fold_law="linear")
    creases = tangent(straight, q) - soft
    assert abs(creases).max() > 0
    assert abs(stiff - soft - 1e-3 * creases).max() < 1e-12 * abs(creases).max()


def test_extrapolated_strain(model):
    """Stresses of a step's end without what its turn adds, side by side, in plain loops."""
    before, now = random_state(model, 1), random_state(model, 2)
    u0, u = split(model, before)[0], split(model, now)[0]
    reach = np.repeat([1.0, 1.0 / model.model.per_reach], [u.size, model.rotations])
    before, now, membrane = before * reach, now * reach, model.membranes[0].membranes.stiffness
    expected = model.body.step_tangent(now).toarray()
    for t, tri in enumerate(model.triangles):
        ends = [(tri[k], tri[(k + 1) % 3]) for k in range(3)]
        gap2 = [np.sum(((u - u0)[b] - (u - u0)[a]) ** 2) for a, b in ends]
        length2 = [np.sum((model.nodes[b] - model.nodes[a]) ** 2) for a, b in ends]
        stress = membrane[:, :, t] @ (0.5 * np.divide(gap2, length2)) / length2
        for k, (a, b) in enumerate(ends):
            for axis in range(3):
                i, j = 3 * a + axis, 3 * b + axis
                expected[[i, j], [i, j]] -= stress[k]
                expected[[i, j], [j, i]] += stress[k]
    found = model.body.step_tangent(now, before).toarray()
    assert np.abs(found - expected).max() < 1e-13 * np.abs(expected).max()
