"""Welds in bars and hinges: panels as plates that go on into each other, and hinges instead."""

import numpy as np
import pytest

import foldyn as fd
from foldyn import checks
from foldyn.errors import FoldynWarning, InputError
from foldyn.structures.graded import smooth_vertices
from sheets_with_facets import (
    LENGTH,
    STEEL,
    WIDTH,
    crossed_miura,
    cut_across,
    elastic,
    half_pipe,
    triangulated,
    with_lines,
)

SHELL = (130.1, 317.0, 360.5)  # Hz, of the uncut strip: tests/shells/test_shell_welds.py


@pytest.mark.parametrize(
    ("cut", "error"),
    [
        (cut_across([0.5]), 0.05),
        (cut_across([0.07]), 0.05),
        (cut_across([0.25, 0.5, 0.75]), 0.01),
        (cut_across(np.linspace(0.1, 0.9, 9)), 0.005),
        (with_lines([(0, 0.5), (1, 0.5)]), 0.01),
        (with_lines([(0.35, 0), (0.55, 1)]), 0.06),
        (triangulated(6, seed=1), 0.06),
        (triangulated(20, seed=2), 0.03),
    ],
)
def test_first_frequency_of_a_strip(cut, error):
    """Errors of the uncut strip: +117 % as it is, +1.2 % with the scheme n5b8e."""
    made = fd.discretize(fd.welded(cut), STEEL)
    assert made.options.scheme == "n5b8e"
    found = elastic(made)
    assert found[0] == pytest.approx(SHELL[0], rel=error)
    if len(cut.faces) == 10:  # many facets have the modes of the shell
        np.testing.assert_allclose(found[:3], SHELL, rtol=0.01)


@pytest.mark.parametrize(
    "options",
    [{}, {"preset": "n5b8e"}, {"scheme": "n4b5"}, {"calibration": "standard"}],
    ids=["plate", "n5b8e", "n4b5", "standard"],
)
def test_joined_panels_are_the_same_model(options):
    whole, cut = crossed_miura()
    one, other = (fd.discretize(p, STEEL, **options) for p in (whole, fd.welded(cut)))
    for name in ("nodes", "bars", "bar_area", "folds", "fold_stiffness", "bends", "bend_stiffness"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.mass.toarray(), other.mass.toarray())


def test_lines_that_stay_hardly_change_a_folded_sheet():
    whole, cut = crossed_miura()
    made = (
        fd.discretize(whole, STEEL, preset="n5b8e"),
        fd.discretize(fd.welded(cut, join=False), STEEL),
        fd.discretize(cut, STEEL, preset="n5b8e"),
    )
    plain, lines, hinges = (
        fd.modes(fd.Case(s, [fd.Fix("xmin")]), count=3).frequency.values for s in made
    )
    np.testing.assert_allclose(lines, plain, rtol=0.03)
    assert hinges[0] < 0.9 * plain[0]


def test_a_curved_sheet_of_facets():
    shell = elastic(fd.shell(fd.welded(half_pipe(8)), STEEL, divisions=6, mass="consistent"))
    made = elastic(fd.discretize(fd.welded(half_pipe(8)), STEEL))
    np.testing.assert_allclose(made[:2], shell[:2], rtol=0.05)


@pytest.mark.matrix
def test_strip_bends_far():
    """A strip of ten panels, the first held at its corners, whose tip rises by a ninth of it."""
    pattern = fd.welded(cut_across(np.linspace(0.1, 0.9, 9)))
    n = len(pattern.vertices) // 2
    tips = []
    for made in (fd.discretize(pattern, STEEL), fd.shell(pattern, STEEL, divisions=4)):
        held, force = fd.Fix([0, 1, n, n + 1]), fd.Force([n - 1, 2 * n - 1], (0, 0, 4.0))
        moved = fd.trace(fd.Case(made, [held], [force])).displacement.values[-1]
        tips.append(moved[n - 1])
    assert tips[0][2] > LENGTH / 9
    np.testing.assert_allclose(tips[0][[0, 2]], tips[1][[0, 2]], rtol=0.06)


@pytest.mark.parametrize("pattern", [half_pipe(4), triangulated(5, seed=3)], ids=["pipe", "flat"])
def test_energy_force_and_tangent(pattern):
    """Of all dofs, and of displacements alone, with the rotations of welds in balance."""
    made, random = fd.discretize(fd.welded(pattern), STEEL), np.random.default_rng(2)
    for body in (made.body, made.for_explicit.body):
        q = 1e-3 * random.standard_normal(body.size)
        assert (
            checks.gradient_error(lambda z, b=body: b.energies(z).sum(), body.internal, at=q) < 1e-6
        )
        assert checks.tangent_error(body.internal, body.tangent, at=q) < 1e-5
    u = 1e-4 * random.standard_normal(made.nodes.size)
    assert checks.tangent_error(lambda x: made.internal_force(x).ravel(), made.tangent, at=u) < 1e-5
    body, rest = made.body, made.body.sheet.model.bars.rest
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    q = np.zeros(body.size)
    q[: rest.size] = (rest @ turned.T - rest).ravel()
    assert body.energies(q).sum() < 1e-12 * STEEL.bending_modulus


def test_both_sides_of_a_weld_share_turn_and_bow():
    made = fd.discretize(fd.welded(cut_across([0.5])), STEEL)
    assert (len(made.folds), len(made.bends)) == (0, 9)
    assert made.body.size == 3 * len(made.nodes) + 2 + len(made.edge_gives)
    folded = fd.discretize(fd.welded(half_pipe(2)), STEEL)  # stays straight: no bow
    assert folded.body.size == 3 * len(folded.nodes) + 1 + len(folded.edge_gives)


@pytest.mark.parametrize(
    "method", [pytest.param("rk4", marks=pytest.mark.matrix), "generalized_alpha"]
)
def test_motion_keeps_its_energy(method):
    made = fd.discretize(fd.welded(half_pipe(3)), STEEL)
    case = fd.Case(made, [fd.Fix([0, 4])], [fd.Force([3, 7], (0, 0, 1.0))])
    result = fd.simulate(case, duration=5e-4, method=method)
    total = sum(result[name] for name in ("kinetic", *case.energy_groups)) - result.work
    assert np.abs(total).max() < 1e-4 * np.abs(result.work).max()


@pytest.mark.matrix
def test_results_keep_welds(kept):
    pattern = fd.welded(triangulated(5, seed=3))
    case = fd.Case(fd.discretize(pattern, STEEL))
    again = kept(fd.modes(case, count=8)).structure
    np.testing.assert_array_equal(again.pattern.welds, pattern.welds)
    assert again.options == case.structure.options
    np.testing.assert_array_equal(again.bend_stiffness, case.structure.bend_stiffness)


def test_hinges_instead_are_told_of():
    pattern = fd.welded(cut_across([0.5]))
    for options in ({"preset": "plate"}, {"scheme": "n5b8"}, {"calibration": "standard"}):
        with pytest.warns(FoldynWarning, match="its welds.* become hinges"):
            made = fd.discretize(pattern, STEEL, **options)
        assert made.options.scheme == "n5b8"


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_panel_that_is_bent_in_its_middle_gives_way_like_a_fold_on_a_stiff_crease():
    g, across = STEEL.bending_modulus, np.hypot(LENGTH, WIDTH)
    halves, triangles = (
        fd.discretize(fd.welded(cut, join=False), STEEL, scheme="n5b8").bend_stiffness[-1]
        for cut in (cut_across([0.5]), with_lines([(0, 0), (1, 1)]))
    )
    assert halves == pytest.approx(g * WIDTH**2 / (2 * 0.19 * LENGTH / 2 * WIDTH))
    assert triangles == pytest.approx(g * across / (2 * LENGTH * WIDTH / across / 3))


@pytest.mark.matrix
def test_a_weld_does_not_show_beside_a_clamped_edge():
    """The first frequencies of a clamped panel in two halves: those of the whole one."""
    halves = fd.discretize(fd.welded(cut_across([0.5])), STEEL, clamped="xmin")
    assert halves.options.scheme == "n5b8e"
    whole = fd.superelements(cut_across([]), STEEL, clamped="xmin")
    one = fd.modes(fd.Case(halves, [fd.Fix("xmin")]), 2).frequency.values
    other = fd.modes(fd.Case(whole, [fd.Fix("xmin")]), 2).frequency.values
    assert (np.abs(one / other - 1.0) < [1e-3, 0.035]).all()


def test_creases_know_nothing_of_welds():
    whole, cut = crossed_miura()
    lines = fd.welded(cut, join=False)
    assert lines.assignments == whole.assignments
    made = fd.discretize(lines, STEEL, crease_stiffness=list(range(1, len(lines.creases) + 1)))
    length = np.linalg.norm(np.diff(lines.vertices[lines.creases], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(made.fold_stiffness, np.arange(1, len(length) + 1) * length)
    with pytest.raises(InputError, match="no crease assigned flat"):
        fd.discretize(lines, STEEL, crease_stiffness={"flat": 1.0})


def angle_section(pieces=12):
    """Two legs of 0.5 m and a length of 6 m, welded along the fold and across."""
    points = [
        (6.0 * k / pieces, *at) for k in range(pieces + 1) for at in ((0.5, 0), (0, 0), (0, 0.5))
    ]
    faces = [
        (3 * k + j, 3 * k + 3 + j, 3 * k + 4 + j, 3 * k + 1 + j)
        for k in range(pieces)
        for j in (0, 1)
    ]
    fold = {(3 * k + 1, 3 * k + 4): "F" for k in range(pieces)}
    return fd.welded(fd.Pattern(points, faces, fold), join=False)


ANGLE = fd.Sheet(90e9, 0.3, 0.1, density=1000)
ANGLE_SHELL = (95.8, 123.77, 151.1)  # Hz: 97.41 and 96.13 first with 8 and 16 divisions, order 2


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_a_thick_folded_section():
    """Panels only five thicknesses wide: with corners rigid at welds it was 124, 198 and 311 Hz."""
    found = elastic(fd.discretize(angle_section(), ANGLE))
    np.testing.assert_allclose(found[:3], ANGLE_SHELL, rtol=0.04)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_superelements_of_a_thick_folded_section():
    """With corners rigid at welds the first frequency was 115 Hz, as it was with such a shell."""
    pattern = angle_section()
    found = elastic(fd.superelements(pattern, ANGLE))
    np.testing.assert_allclose(found[:3], ANGLE_SHELL, rtol=0.003)
    shell = fd.shell(pattern, ANGLE, divisions=8, mass="consistent", vertex_radius=0.1)
    np.testing.assert_allclose(elastic(shell)[:3], ANGLE_SHELL, rtol=0.02)


@pytest.mark.matrix
def test_frequencies_in_the_plane_do_not_depend_on_the_thickness():
    """Of a flat square of 8 x 8 welded panels.

    With corners rigid at welds the first rose from 1892 (0.01 mm) to 2358 Hz (20 mm).
    The shell of 8 divisions has 1963 Hz.
    """
    grid = [(i / 8, j / 8) for j in range(9) for i in range(9)]
    start = [9 * j + i for j in range(8) for i in range(8)]
    faces = [(k, k + 1, k + 10, k + 9) for k in start]
    pattern, found = fd.welded(fd.Pattern(grid, faces), join=False), []
    for thickness in (1e-4, 0.0125):
        made = fd.discretize(pattern, fd.Sheet(2e11, 0.3, thickness, density=7850))
        case = fd.Case(made, [fd.Fix(list(range(len(made.nodes))), "z")])
        found.append(fd.modes(case, 4).frequency.values[3])
    assert found[1] == pytest.approx(found[0], rel=0.01)
    assert found == pytest.approx([1963.0] * 2, rel=0.04)


def test_where_the_sheet_is_smooth():
    """Vertices of welds, unless a crease ends or turns there."""
    x = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (0, 2, 1), (1, 2, 1), (2, 2, 1)]
    points = [(*at, 0)[:3] for at in x]
    faces = [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)]
    pattern = fd.Pattern(points, faces, welds=[(1, 4), (4, 7)])
    assert np.flatnonzero(smooth_vertices(pattern)).tolist() == [1, 4, 7]
    points[4] = (1, 1.3, 0)
    turned = fd.Pattern([*points[:6], *points[6:]], faces, welds=[(1, 4)])
    assert np.flatnonzero(smooth_vertices(turned)).tolist() == [1]
    whole = fd.Pattern(points, faces)
    assert not smooth_vertices(whole).any()
