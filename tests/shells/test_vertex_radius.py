"""Shells with a radius about their vertices: graded meshes, and frequencies that have a limit."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from shell_lab import SQUARE, rotation_matrix
from test_shell_mesh import FLAT_PANELS, PATTERNS, areas, assert_fits

import foldyn as fd
from foldyn.algebra.extrapolation import convergence
from foldyn.errors import InputError
from foldyn.shells import shell
from foldyn.shells.mesh import shell_mesh
from foldyn.shells.shell import STIFF
from foldyn.structures.graded import grading

SHEET = fd.Sheet(1e6, 0.25, 0.02, density=3.0)
RADIUS = 0.02
STEEL = {t: fd.Sheet(2e11, 0.3, t, density=7850.0) for t in (3e-4, 1e-3)}


def mesh_of(pattern, divisions=4, radius=RADIUS):
    return shell_mesh(pattern, divisions, grading(pattern, divisions, radius))


def at_vertices(mesh, pattern):
    """Which triangles have a vertex for a corner."""
    return (mesh.triangles < len(pattern.vertices)).any(axis=1)


# ------------------------------------------------------------------ mesh


@pytest.mark.parametrize("divisions", [4, 8])
def test_triangles_fit_together(pattern, divisions):
    assert_fits(mesh_of(pattern, divisions), pattern)


def test_panels_keep_their_area(flat):
    mesh = mesh_of(flat)
    assert np.bincount(mesh.panel, areas(mesh)) == pytest.approx(np.array(flat.face_areas))


@pytest.mark.parametrize("radius", [1e-4, 1e-6])
def test_triangles_about_vertices_may_be_tiny(radius):
    mesh = mesh_of(SQUARE, 16, radius)
    assert areas(mesh).sum() == pytest.approx(SQUARE.face_areas.sum())
    assert 0.0 < areas(mesh).min() < 0.1 * radius**2


def test_a_twisted_panel_keeps_its_surface():
    """All nodes of a quadrilateral lie where lines between opposite edges do."""
    quad = fd.Pattern([[0, 0, 0], [1, 0, 0.2], [1, 1, 0], [0, 1, 0.3]], [[0, 1, 2, 3]])
    x, y, z = mesh_of(quad).nodes.T
    assert z == pytest.approx(0.2 * x * (1 - y) + 0.3 * y * (1 - x), abs=1e-15)


def test_corners_reach_to_the_radius(flat):
    radius = 0.1 * RADIUS
    mesh = mesh_of(flat, 8, radius)
    corner = at_vertices(mesh, flat)
    x = mesh.nodes[mesh.triangles[corner]]
    tip = mesh.triangles[corner] < len(flat.vertices)
    assert (tip.sum(axis=1) == 1).all()
    away = np.linalg.norm(x - x[tip][:, None], axis=2)[~tip]
    assert away == pytest.approx(np.full(len(away), radius), rel=0.03)  # in patches rays curve
    for points in mesh.edge_points.values():
        edge = mesh.nodes[points]
        pieces = np.linalg.norm(np.diff(edge, axis=0), axis=1)
        assert pieces[[0, -1]] == pytest.approx(radius)
        assert pieces == pytest.approx(pieces[::-1])
        assert pieces.min() > 0.3 * radius


def test_rays_and_arcs_get_finer_alike():
    counts = [grading(SQUARE, n, 0.01) for n in (4, 8, 16)]
    assert [each.rays for each in counts] == [1, 2, 4]
    steps = [each.arcs - 1 for each in counts]
    assert steps == [steps[0], 2 * steps[0], 4 * steps[0]]


def test_without_a_radius_nothing_changes():
    s = shell(FLAT_PANELS["miura"](), SHEET, divisions=3, vertex_radius=None)
    assert s.graded is None
    assert s.edge_nodes.shape[1] == 4


# ------------------------------------------------------------------ sheet


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_mass_and_its_first_moments_are_exact(flat, mass):
    graded = shell(flat, SHEET, divisions=4, mass=mass, vertex_radius=RADIUS)
    even = shell(flat, SHEET, divisions=4, mass=mass)
    assert graded.total_mass == pytest.approx(even.total_mass, rel=1e-13)
    assert graded.center_of_mass == pytest.approx(even.center_of_mass, abs=1e-13)


def test_uniform_strain_needs_no_force_but_at_corners():
    s = shell(SQUARE, SHEET, divisions=8, vertex_radius=RADIUS)
    strain = np.array([[1e-4, 3e-5, 0], [3e-5, -2e-4, 0], [0, 0, 0]])
    force = s.forces(s.nodes @ strain, np.zeros(s.rotations))[0]
    corner = at_vertices(s, SQUARE)
    rim = np.abs(s.nodes[:, :2] - 0.5).max(axis=1) > 0.5 - 1e-9
    inner = np.setdiff1d(np.flatnonzero(~rim), s.triangles[corner])
    assert len(inner) > 100
    assert np.abs(force[inner]).max() < 1e-13 * np.abs(force).max()


def test_corners_hardly_stretch():
    """A square that is pulled: its corners, stiffer by STIFF, take that much less strain."""
    s = shell(SQUARE, SHEET, divisions=8, vertex_radius=RADIUS)
    west, east = (np.abs(s.nodes[:, 0] - x) < 1e-9 for x in (0.0, 1.0))
    held = [fd.Fix(np.flatnonzero(west).tolist(), "xy"), fd.Fix(range(len(s.nodes)), "z")]
    pull = fd.Impose(np.flatnonzero(east).tolist(), "x", 1e-5)
    u = fd.trace(fd.Case(s, [*held, pull])).displacement.values[-1]
    side, (_, own) = np.roll(s.triangles, -1, axis=1), s.membranes[0]
    strain = np.einsum("tkc,kct->tk", u[side] - u[s.triangles], own.vector) * own.per_length2.T
    corner = at_vertices(s, SQUARE)
    assert np.abs(strain[corner]).max() < 5 / STIFF * np.abs(strain[~corner]).max()


@pytest.mark.matrix
def test_bending_is_as_without():
    """The corners of panels bend as the rest: a square plate vibrates as an even mesh says."""
    sheet = STEEL[1e-3]
    square = fd.Pattern(0.1 * SQUARE.vertices, [[0, 1, 2, 3]])
    found = [
        fd.modes(
            fd.Case(shell(square, sheet, divisions=16, mass="consistent", vertex_radius=radius)), 9
        )
        for radius in (None, 1e-3)
    ]
    even, graded = (each.frequency.values[6:] for each in found)
    assert graded == pytest.approx(even, rel=0.01)


@pytest.mark.parametrize("name", sorted({*PATTERNS} - {"polygons"}))
def test_rigid_motions_are_free_and_alone(name):
    s = shell(PATTERNS[name](), SHEET, divisions=4, crease_stiffness=5.0, vertex_radius=0.05)
    u = s.nodes @ rotation_matrix(3).T - s.nodes + [0.3, -0.2, 0.1]
    scale = SHEET.youngs_modulus * SHEET.thickness
    force, couple = s.forces(u, np.zeros(s.rotations))
    assert max(np.abs(force).max(), np.abs(couple).max()) < 1e-9 * scale  # rounding, times STIFF
    modes = fd.modes(fd.Case(s), 7)
    assert modes["rigid"].values.tolist() == [True] * 6 + [False]


def test_a_vertex_of_four_creases_folds_without_strain():
    """Between two folded states of one pattern nothing stretches and nothing bends."""
    before, after = (fd.patterns.miura(cells=(1, 1), dihedral=angle) for angle in (110, 60))
    s, other = (shell(each, SHEET, divisions=4, vertex_radius=RADIUS) for each in (before, after))
    assert np.array_equal(s.triangles, other.triangles)
    energies = s.energies(other.nodes - s.nodes, np.zeros(s.rotations))
    assert energies["strain_folds"] > 0.0
    for part in ("strain_membrane", "strain_bending"):
        assert energies[part] < 1e-12 * energies["strain_folds"]


# ------------------------------------------------------------------ limit


@cache
def tower(divisions, radius, thickness=1e-3, storeys=3):
    """First frequency of a tower of triangles, held along its bottom edges."""
    pattern = fd.patterns.kresling(sides=4, radius=0.04, height=0.03, twist=30, storeys=storeys)
    s = shell(
        pattern, STEEL[thickness], divisions=divisions, mass="consistent", vertex_radius=radius
    )
    held = [fd.Fix(range(4), along=True)]
    return fd.modes(fd.Case(s, held), 3).frequency.values


@pytest.mark.matrix
def test_modes_of_a_tower_come_in_pairs():
    """Its mesh has the symmetry of the tower: a quarter of a turn."""
    twisting, one, other = tower(4, 1e-3)
    assert one == pytest.approx(other, rel=1e-6)
    assert twisting < 0.9 * one


@pytest.mark.matrix
def test_frequencies_of_a_tower_converge():
    """They fall with every even mesh, and with graded ones with the order of the elements."""
    meshes = [8, 12, 16]
    found = convergence([tower(n, 1e-3, storeys=1) for n in meshes], meshes)
    assert np.all((found.order > 1.5) & (found.order < 2.5))
    half, once, twice = (tower(8, radius, storeys=1)[0] for radius in (5e-4, 1e-3, 2e-3))
    assert 1.0 > half / once > 0.98
    assert 1.0 < twice / once < 1.05


# ------------------------------------------------------------------ analyses and refusals


@pytest.mark.matrix
def test_statics_motions_and_clamps():
    pattern = fd.patterns.simple_fold(a=0.05, b=0.05, dihedral=120)
    s = shell(pattern, STEEL[1e-3], divisions=4, vertex_radius=1e-3, clamped="xmin")
    supports = [fd.Fix("xmin", "xyz")]
    case = fd.Case(s, supports, [fd.Force("xmax", (0.0, 0.0, 0.1))])
    path = fd.trace(case)
    tip = np.abs(path.displacement.values[-1]).max()
    even = shell(pattern, STEEL[1e-3], divisions=8, clamped="xmin")
    usual = np.abs(fd.trace(fd.Case(even, supports, case.loads)).displacement.values[-1]).max()
    assert tip == pytest.approx(usual, rel=0.1)
    motion = fd.simulate(case, 1e-3, dt=5e-5, every_steps=4, method="generalized_alpha")
    assert np.isfinite(motion.displacement.values).all()


def test_a_clamped_edge_that_is_moved_stays_straight():
    pattern = fd.patterns.simple_fold(a=0.05, b=0.05, dihedral=120)
    s = shell(pattern, STEEL[1e-3], divisions=4, vertex_radius=1e-3, clamped="xmin")
    low, high = s.options.clamped[0]
    case = fd.Case(s, [fd.Fix([low, high], "xy"), fd.Impose([low, high], "z", [0.0, 1e-3])])
    ((moved, _),) = case.imposed_terms
    (row,) = s.clamped_nodes
    x = np.linalg.norm(s.nodes[row] - s.nodes[row[0]], axis=1)
    assert moved[row, 2] == pytest.approx(1e-3 * x / x[-1])


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"vertex_radius": 0.3}, "vertex_radius = 0.3: an edge .* take at most a quarter .*0.25"),
        ({"vertex_radius": -1.0}, "vertex_radius = -1.0"),
        ({"vertex_radius": "t"}, "vertex_radius"),
        ({"divisions": 6}, "divisions = 6: with a vertex_radius it is a multiple of 4; take 8"),
    ],
)
def test_refusals(changes, text):
    with pytest.raises(InputError, match=text):
        shell(SQUARE, SHEET, **{"divisions": 4, "vertex_radius": RADIUS, **changes})


def test_a_panel_too_narrow_for_the_radius_is_refused():
    c, s = np.cos(np.radians(10)), np.sin(np.radians(10))
    skew = fd.Pattern([[0, 0], [1, 0], [1 + c, s], [c, s]], [[0, 1, 2, 3]])
    with pytest.raises(InputError, match=r"only 0.0872 m .* at most half of that, 0.0436"):
        shell(skew, SHEET, divisions=4, vertex_radius=0.06)
    assert len(shell(skew, SHEET, divisions=4, vertex_radius=0.04).triangles) > 50


def test_decks_have_no_stiff_corners():
    from foldyn.exports.creased_shell import creased_shell

    s = shell(SQUARE, SHEET, divisions=4, vertex_radius=RADIUS)
    with pytest.raises(InputError, match="vertex_radius: panels do not stretch about vertices"):
        creased_shell(fd.Case(s))
