"""Meshes of any pattern fit together, keep its area, and carry its mass and momentum."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from shell_lab import SQUARE

import foldyn as fd
from foldyn.errors import InputError
from foldyn.shells import shell
from foldyn.shells.mesh import shell_mesh

SHEET = fd.Sheet(1e6, 0.25, 0.02, density=3.0)


def polygons() -> fd.Pattern:
    """A pentagon, a hexagon, a triangle and a quadrilateral, folded against each other."""
    turn = np.arange(5) * 2 * np.pi / 5
    five = np.c_[np.cos(turn), 0.9 * np.sin(turn), 0 * turn]
    edge = five[1] - five[0]
    out = np.cross(edge, [0, 0, 1]) / np.linalg.norm(edge)
    away = 0.8 * out + [0, 0, 0.6]
    six = [five[0] - 0.2 * edge + 0.4 * away, five[0] + 0.9 * away]
    six += [five[1] + 0.8 * away, five[1] + 0.3 * edge + 0.3 * away]
    top = five[3] + 0.5 * (five[4] - five[3]) + [-0.7, -0.5, 0.5]
    side = five[2] - five[1]
    wall = [five[1] + [0, 0, -0.7], five[1] + 0.8 * side + [0, 0, -0.5]]
    faces = [range(5), [1, 0, 5, 6, 7, 8], [4, 3, 9], [2, 1, 10, 11]]
    return fd.Pattern([*five, *six, top, *wall], [list(face) for face in faces])


def parallelogram(angle=60.0):
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return fd.Pattern([[0, 0], [1, 0], [1 + c, s], [c, s]], [[0, 1, 2, 3]])


FLAT_PANELS = {
    "polygons": polygons,
    "miura": lambda: fd.patterns.miura(cells=(2, 1), a=1.0, b=1.3),
    "eggbox": lambda: fd.patterns.eggbox(b=1.2),
    "kresling": lambda: fd.patterns.kresling(sides=5, storeys=2),
    "rhombus": parallelogram,
    "triangle": lambda: fd.Pattern([[0, 0], [2, 0], [0.3, 1]], [[0, 1, 2]]),
}


def twisted() -> fd.Pattern:
    """Two quadrilaterals that are not planar."""
    points = [[0, 0, 0], [1, 0, 0.2], [2, 0, 0], [0, 1, 0.3], [1, 1.1, 0], [2, 0.9, 0.4]]
    return fd.Pattern(points, [[0, 1, 4, 3], [1, 2, 5, 4]])


PATTERNS = {**FLAT_PANELS, "twisted": twisted}
DIVISIONS = [1, 2, 3, 6]


def areas(mesh):
    x = mesh.nodes[mesh.triangles]
    return 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)


def assert_fits(mesh, pattern):
    """Sides belong to two triangles, in opposite directions, or lie on the pattern's boundary."""
    assert np.array_equal(mesh.nodes[: len(pattern.vertices)], pattern.vertices)
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.nodes)))
    ways = {(t[k], t[(k + 1) % 3]) for t in mesh.triangles.tolist() for k in range(3)}
    assert len(ways) == mesh.triangles.size
    alone = {(a, b) for a, b in ways if (b, a) not in ways}
    rim = set()
    for low, high in pattern.boundary.tolist():
        points = mesh.edge_points[low, high]
        rim |= set(pairwise(points)) | set(pairwise(points[::-1]))
    assert alone <= rim
    assert 2 * len(alone) == len(rim)
    sides = len(ways) - (len(ways) - len(alone)) // 2
    ours = len(mesh.nodes) - sides + len(mesh.triangles)
    edges = len(pattern.creases) + len(pattern.boundary)
    assert ours == len(pattern.vertices) - edges + len(pattern.faces)  # Euler's characteristic


@pytest.mark.parametrize("divisions", DIVISIONS)
def test_triangles_fit_together(pattern, divisions):
    mesh = shell_mesh(pattern, divisions)
    assert_fits(mesh, pattern)
    apart = np.linalg.norm(mesh.nodes[:, None] - mesh.nodes, axis=2) + np.eye(len(mesh.nodes))
    assert apart.min() > 1e-3 / divisions  # no node twice
    shell_edges = np.concatenate([pattern.creases, pattern.boundary])
    made = shell(pattern, SHEET, divisions=divisions).edge_nodes.tolist()
    assert made == [mesh.edge_points[tuple(edge)] for edge in shell_edges.tolist()]


@pytest.mark.parametrize("divisions", DIVISIONS)
def test_points_of_edges_are_shared_and_even(pattern, divisions):
    mesh = shell_mesh(pattern, divisions)
    for edge in pattern.edges.tolist():
        points, (start, end) = mesh.edge_points[tuple(edge)], pattern.vertices[edge]
        assert [points[0], points[-1]] == edge
        on = start + np.linspace(0, 1, divisions + 1)[:, None] * (end - start)
        assert mesh.nodes[points] == pytest.approx(on, abs=1e-15)
    for crease, faces in zip(pattern.creases.tolist(), pattern.crease_faces, strict=True):
        for face in faces:
            panel = set(mesh.triangles[mesh.panel == face].ravel().tolist())
            assert set(mesh.edge_points[tuple(crease)]) <= panel


@pytest.mark.parametrize("divisions", DIVISIONS)
def test_panels_keep_their_area_and_front(flat, divisions):
    mesh = shell_mesh(flat, divisions)
    found = np.bincount(mesh.panel, areas(mesh))
    assert found == pytest.approx(np.asarray(flat.face_areas), rel=1e-13)
    x = mesh.nodes[mesh.triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / (2.0 * areas(mesh)[:, None])
    assert normal == pytest.approx(flat.face_normals[mesh.panel], abs=1e-12)


def test_cells_are_cut_at_their_shorter_diagonal():
    mesh = shell_mesh(parallelogram(60), 4)
    x = mesh.nodes[mesh.triangles]
    sides = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
    assert sides == pytest.approx(np.full(sides.shape, 0.25))  # all equilateral
    mirrored = shell_mesh(parallelogram(120), 4)
    assert areas(mirrored) == pytest.approx(areas(mesh))
    square = shell_mesh(SQUARE, 4)
    x = square.nodes[square.triangles]
    ends = np.roll(x, -1, axis=1) - x
    slope = ends[..., 0] * ends[..., 1]
    assert (slope < -1e-9).sum() == (slope > 1e-9).sum() == 16  # as many of either kind


@pytest.mark.parametrize("divisions", [1, 4])
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_mass_and_its_first_moments_are_exact(flat, divisions, mass):
    """The momentum of a translation and the center of mass, whatever the rule."""
    s = shell(flat, SHEET, divisions=divisions, mass=mass)
    weight = SHEET.density * SHEET.thickness
    assert s.mass.sum() == pytest.approx(weight * np.sum(flat.face_areas), rel=1e-13)
    exact = np.zeros(3)
    for face in flat.faces:
        x = flat.vertices[list(face)]
        for k in range(1, len(face) - 1):
            area = 0.5 * np.linalg.norm(np.cross(x[k] - x[0], x[k + 1] - x[0]))
            exact += weight * area * (x[0] + x[k] + x[k + 1]) / 3.0
    assert s.mass.sum(axis=0) @ s.nodes == pytest.approx(exact, abs=1e-13)


@pytest.mark.parametrize(("mass", "power"), [("lumped", 2), ("consistent", None)])
def test_second_moment_of_mass(mass, power):
    """Exact with the consistent matrix, as linear fields are; else off by O(h^2)."""
    errors = []
    for divisions in (2, 4, 8):
        s = shell(SQUARE, SHEET, divisions=divisions, mass=mass)
        x = s.nodes[:, 0]
        errors.append(x @ (s.mass @ x) * 3.0 / (SHEET.density * SHEET.thickness) - 1.0)
    if power is None:
        assert np.abs(errors).max() < 1e-13
    else:
        assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(power, abs=1e-6)


def test_vertices_of_no_panel_are_kept():
    pattern = fd.Pattern([[0, 0], [1, 0], [0, 1], [5, 5]], [[0, 1, 2]])
    s = shell(pattern, SHEET, divisions=1)
    force, _ = s.forces(np.zeros((4, 3)), np.zeros(0))
    assert force.shape == (4, 3)
    assert s.tangent(np.zeros((4, 3)), np.zeros(0)).shape == (12, 12)
    assert shell(pattern, SHEET, divisions=1, clamped=[(0, 1)]).body.size == 12


def test_panels_that_are_far_from_convex_are_refused():
    bent = fd.Pattern([[0, 0], [3, 0], [3, 3], [2.8, 0.2]], [[0, 1, 2, 3]])
    with pytest.raises(InputError, match=r"panel 0 \(vertices 0, 1, 2, 3\).*fd.convex\(pattern\)"):
        shell(bent, SHEET, divisions=4)
    u = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]
    with pytest.raises(InputError, match=r"panel \d+ \(vertices .* inside out: the panel is not"):
        shell_mesh(fd.Pattern(u, [list(range(8))]), 2)
