"""Panels whose bars are coupled: the membrane as corners feel it, and what sheets make of it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.linalg import eigvalsh, null_space
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn import checks
from foldyn.errors import FoldynWarning, InputError, StretchWarning
from foldyn.mechanics import threads
from foldyn.mechanics.membranes_term import MembranesTerm
from foldyn.structures.membranes import Sides, coupling
from foldyn.structures.panel_membrane import Kind, _condensed, _even, membrane_stiffness
from foldyn.structures.panel_plate import outline
from named_models import named
from pairwise import beyond

STEEL = fd.Sheet(200e9, 0.3, 3e-4, 7850.0)
RUBBER = fd.Sheet(1e6, 0.25, 0.01, 1.0)


def parallelogram(angle: float, ratio: float = 1.0) -> np.ndarray:
    side = ratio * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    return np.array([[0.0, 0.0], [1.0, 0.0], [1.0 + side[0], side[1]], side])


def sides(corners: np.ndarray, straight=(), resistance=0.0) -> Sides:
    """Of a panel in the plane; with four corners or more it has a center."""
    x = np.column_stack([corners, np.zeros(len(corners))])
    center = x.mean(axis=0) if len(x) > 3 else None
    held = [k in straight for k in range(len(x))]
    return Sides(outline(x, center, [False] * len(x), held), (resistance,) * len(x))


def ring(corners: int) -> tuple[tuple[int, int], ...]:
    """Bars of a panel: its edges, and spokes if it has a center."""
    edges = [(k, (k + 1) % corners) for k in range(corners)]
    return (*edges, *((k, corners) for k in range(corners) if corners > 3))


def strained(corners: np.ndarray) -> np.ndarray:
    """Displacements in the plane that are no rigid motion, orthonormal, as columns."""
    x, y = corners.T
    rigid = np.zeros((len(x), 2, 3))
    rigid[:, 0, 0] = rigid[:, 1, 1] = 1.0
    rigid[:, 0, 2], rigid[:, 1, 2] = -y, x
    return null_space(rigid.reshape(-1, 3).T)


SHAPES = {
    "square": parallelogram(90), "lozenge": parallelogram(60), "long": parallelogram(60, 2.0),
    "narrow": parallelogram(10), "triangle": np.array([[0, 0], [1, 0], [0.4, 0.8]]),
    "sliver": np.array([[0, 0], [1, 0], [np.cos(np.radians(10)), np.sin(np.radians(10))]]),
    "obtuse": np.array([[0, 0], [1, 0], [-0.5, 0.3]]),
    "irregular": np.array([[0, 0], [1.2, 0.1], [1.0, 0.9], [-0.1, 0.7]]),
    "pentagon": np.array([[np.cos(a), np.sin(a)] for a in 0.4 * np.pi * np.arange(5)]),
    "hexagon": np.array([[np.cos(a), np.sin(a)] for a in np.pi / 3 * np.arange(6)]),
}  # fmt: skip

LOZENGE = fd.Pattern(SHAPES["lozenge"], [(0, 1, 2, 3)])


@pytest.mark.parametrize("name", SHAPES)
def test_a_membrane_resists_all_but_rigid_motions(name):
    own = sides(SHAPES[name])
    found = membrane_stiffness(own.outline, 0.3, own.resistance)
    np.testing.assert_array_equal(found, found.T)
    values = np.linalg.eigvalsh(found)
    assert np.abs(values[:3]).max() < 1e-10
    assert values[3] > 1e-4


def test_corners_feel_it_softer_than_bars():
    """Ratios, to two digits, of an independent computation with bilinear elements, 32 an edge."""
    corners = SHAPES["lozenge"]
    bars = fd.discretize(LOZENGE, fd.Sheet(1e9, 0.3, 1e-3), membrane="bars", preset="plate")
    tangent = bars.body.tangent(np.zeros(15)) - bars.body.sheet.hinges_alone().tangent(np.zeros(15))
    plane = [3 * i + c for i in range(5) for c in (0, 1)]  # of the corners and the center
    bare = condensed(tangent.toarray()[np.ix_(plane, plane)] / 1e6, 8)  # E t
    own, free = sides(corners), strained(corners)  # an outline's first edge is along x, too
    found = membrane_stiffness(own.outline, 0.3, own.resistance)
    ratios = eigvalsh(free.T @ found @ free, free.T @ bare @ free)
    np.testing.assert_allclose(ratios, (0.15, 0.22, 0.30, 0.31, 0.84), atol=0.008)


def condensed(whole: np.ndarray, m: int) -> np.ndarray:
    """Stiffness (m, m) of the first dofs, the others at ease."""
    across = whole[m:, :m]
    return whole[:m, :m] - across.T @ np.linalg.solve(whole[m:, m:], across)


def test_the_mesh_converges_as_its_elements_do():
    """A square has no corner that spoils the order."""
    own, free = sides(SHAPES["square"]), strained(SHAPES["square"])
    lowest = []
    for mesh in (_even(own.outline, n) for n in (4, 8, 16)):
        found = _condensed([Kind(own.outline, 0.3, own.resistance)], [mesh])[0]
        lowest.append(np.linalg.eigvalsh(free.T @ found @ free)[0])
    order = np.log2((lowest[0] - lowest[1]) / (lowest[1] - lowest[2]))
    assert 1.6 < order < 2.4


def test_panels_of_as_many_corners_are_cut_alike():
    one, other = (
        _even(sides(np.array(corners)).outline, 4)
        for corners in (
            ((0, 0), (1, 0), (1.1, 0.9), (0, 1)),
            ((0, 0), (2, 0.1), (1.6, 1), (0.3, 1)),
        )
    )
    assert one.cut is other.cut and len(one.x) == len(other.x)
    assert not np.allclose(one.x, other.x)


def test_edges_that_are_held_more_and_more_become_straight():
    corners, free = SHAPES["lozenge"], strained(SHAPES["lozenge"])

    def stiffnesses(**given):
        own = sides(corners, **given)
        found = membrane_stiffness(own.outline, 0.3, own.resistance)
        return np.linalg.eigvalsh(free.T @ found @ free)

    found = [stiffnesses(resistance=value) for value in (0.0, 1e-3, 1e-1, 1e2)]
    assert (np.diff(found, axis=0) > 0.0).all()
    np.testing.assert_allclose(found[-1], stiffnesses(straight=range(4)), rtol=1e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_coupled_bars_are_the_membrane(name):
    """Condensed to the corners; no elongation of a bar is free."""
    corners = SHAPES[name]
    own, ends = sides(corners), ring(len(corners))
    found = coupling(own, ends, 0.3)
    assert np.linalg.eigvalsh(found)[0] > 1e-4 * np.linalg.eigvalsh(found)[-1]
    x = np.array([*own.outline.corners, *([own.outline.center] if own.outline.center else [])])
    longer = np.zeros((len(ends), len(x), 2))
    for k, (a, b) in enumerate(ends):
        along = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
        longer[k, a], longer[k, b] = -along, along
    longer = longer.reshape(len(ends), -1)
    wanted = membrane_stiffness(own.outline, 0.3, own.resistance)
    corners_feel = condensed(longer.T @ found @ longer, 2 * len(corners))
    np.testing.assert_allclose(corners_feel, wanted, atol=1e-9 * np.abs(wanted).max())


def test_a_panel_is_the_same_turned_renumbered_and_of_another_size():
    corners, turn = SHAPES["irregular"], np.array([[0.6, -0.8], [0.8, 0.6]])
    plain = coupling(sides(corners), ring(4), 0.3)
    other = coupling(sides(7.0 * np.roll(corners, -1, axis=0) @ turn.T), ring(4), 0.3)
    order = [1, 2, 3, 0, 5, 6, 7, 4]
    np.testing.assert_allclose(other, plain[np.ix_(order, order)], atol=1e-7 * plain.max())


@pytest.mark.parametrize(
    "options", [{}, {"preset": "n5b8e"}, {"scheme": "n4b5", "preset": "herkal"}]
)
@pytest.mark.parametrize("pattern", [fd.patterns.miura(), fd.patterns.resch(cells=(1, 1))])
def test_forces_and_tangents_are_derivatives_of_the_energy(options, pattern):
    structure = fd.discretize(pattern, RUBBER, membrane="panel", **named(options))
    body = structure.body
    shift = np.random.default_rng(1).standard_normal(structure.nodes.shape)
    q = body.dofs(0.02 * np.ptp(structure.nodes) * shift)
    assert checks.gradient_error(lambda z: body.energies(z).sum(), body.internal, at=q) < 1e-7
    assert checks.tangent_error(body.internal, body.tangent, at=q) < 1e-7


def test_turned_as_a_whole_or_folded_along_diagonals_it_has_no_strain():
    structure = fd.discretize(LOZENGE, RUBBER, membrane="panel", preset="plate")
    x = structure.nodes
    axis = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    states = [x @ Rotation.from_rotvec(1.1 * axis).as_matrix()]
    for start, end, moved in ((0, 2, 3), (1, 3, 0)):
        along = (x[end] - x[start]) / np.linalg.norm(x[end] - x[start])
        folded = x.copy()
        turn = Rotation.from_rotvec(0.7 * along)
        folded[moved] = x[start] + turn.apply(x[moved] - x[start])
        states.append(folded)
    for state in states:
        strain = structure.energies(state - x)["strain_bars"]
        assert strain < 1e-25 * RUBBER.youngs_modulus * RUBBER.thickness


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_warmth_that_all_panels_share_only_scales_a_sheet():
    """lambda = 1 + alpha T, without stress; bars by themselves do so in small strains only."""
    structure = fd.discretize(
        fd.patterns.miura(cells=(2, 2)), RUBBER, membrane="panel", preset="plate"
    )
    case = fd.Case(structure, loads=[fd.Temperature(100.0, expansion=1e-3)])
    path = fd.trace(case, "newton", load_factors=[0.0, 1.0], inertia_relief=True)
    moved = structure.nodes + path.displacement.values[-1]
    np.testing.assert_allclose(pdist(moved), 1.1 * pdist(structure.nodes), atol=1e-8)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("pattern", "worst"),
    [
        ({"panel_angle": 60, "dihedral": 90, "b": 0.08}, 0.03),
        *beyond(
            [
                ({"panel_angle": 45, "dihedral": 110}, 0.04),
                ({"panel_angle": 60, "dihedral": 110}, 0.025),
                ({"panel_angle": 60, "dihedral": 165}, 0.04),
            ]
        ),
    ],
)
def test_held_sheets_vibrate_as_the_shell(pattern, worst):
    """First three frequencies; bars alone are 7 to 46 % too high."""
    pattern = fd.patterns.miura(**{"cells": (4, 4), "a": 0.04, "b": 0.04, **pattern})

    def frequencies(structure):
        return fd.modes(fd.Case(structure, [fd.Fix("xmin")]), count=3).frequency.values

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        found = frequencies(fd.discretize(pattern, STEEL, membrane="panel", preset="plate"))
        wanted = frequencies(fd.shell(pattern, STEEL, divisions=8))
        alone = frequencies(fd.discretize(pattern, STEEL, membrane="bars", preset="plate"))
    assert np.abs(found / wanted - 1.0).max() < worst
    assert np.abs(alone / wanted - 1.0).max() > 2.0 * worst


METHODS = ("rk4", "central_difference", "dormand_prince", "newmark", "generalized_alpha",
           "energy_momentum")  # fmt: skip


@pytest.mark.matrix
@pytest.mark.parametrize("options", [{"mass": "mixed_voronoi"}, {"preset": "n5b8e"}])
def test_all_methods_find_the_same_motion(options):
    options = {"mass": "mixed_voronoi", **options}
    structure = fd.discretize(fd.patterns.miura((1, 2)), RUBBER, membrane="panel", **named(options))
    case = fd.Case(structure, [fd.Fix("xmin")], [fd.Force([14], (0, 0, 2e-3))])
    ends = {}
    for method in METHODS:
        step = {} if method == "dormand_prince" else {"dt": 2e-5, "every_steps": 1000}
        motion = fd.simulate(case, 0.02, method=method, **step)
        ends[method] = motion.displacement.values[-1]
    assert abs(motion.attrs["energy_error"]) < 1e-10  # the last one conserves it
    for method, end in ends.items():
        close = 2e-3 * np.abs(ends["rk4"]).max()
        np.testing.assert_allclose(end, ends["rk4"], atol=close, err_msg=method)


def test_a_turning_sheet_takes_few_iterations():
    """The tangent of the mean forces is their derivative; that halfway takes ten times as many."""
    iterations = []
    for membrane in ("bars", "panel"):
        structure = fd.discretize(
            fd.patterns.miura((1, 1)), RUBBER, bar_law="linear", membrane=membrane, preset="plate"
        )
        arm = structure.nodes - structure.nodes.mean(axis=0)
        start = fd.State(velocity=np.cross([0.0, 0.0, 5.0], arm))
        motion = fd.simulate(
            fd.Case(structure), 0.2, method="energy_momentum", dt=0.01, initial=start
        )
        iterations.append(motion.attrs["iterations"])
        assert motion.attrs["halved_steps"] == 0
    assert iterations[1] < 2 * iterations[0]


@pytest.mark.matrix
@pytest.mark.parametrize("preset", ["plate", "n5b8e"])
def test_extrapolated_stress_saves_iterations(preset, monkeypatch):
    """A thin sheet falls: with its true stresses Newton's method takes 1.3 to 1.5 times as many."""
    pattern = fd.patterns.miura((2, 2), a=0.025, b=0.025, panel_angle=60, dihedral=90)
    made = fd.discretize(pattern, fd.Sheet(1219e6, 0.2, 2e-4, 667.0, 2.7), preset=preset)
    case = fd.Case(made, [fd.Fix("xmin", "xyz")], [fd.Gravity((0, 0, -9.81))])

    def fallen():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StretchWarning)
            return fd.simulate(case, 0.1, method="energy_momentum", dt=4e-3)

    quick, mean = fallen(), MembranesTerm.mean_entries
    monkeypatch.setattr(
        MembranesTerm,
        "mean_entries",
        lambda term, q0, q1, way, floor: mean(term, q0, q1, (q1, q1), floor),
    )
    plain = fallen()
    np.testing.assert_allclose(plain.displacement, quick.displacement, atol=1e-8)
    assert plain.attrs["iterations"] > 1.15 * quick.attrs["iterations"]


@pytest.mark.matrix
def test_threads_share_panels(monkeypatch):
    """The same motion to rounding, whichever thread a panel's nodes belong to."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(threads, "HINGES_EACH", 500)
    sheet = fd.patterns.miura(cells=(80, 4))
    a, b, c, d = sheet.faces[-1]  # cut in two: of triangles some threads have none
    pattern = fd.Pattern(sheet.vertices, [*sheet.faces[:-1], (a, b, c), (a, c, d)])
    structure = fd.discretize(
        pattern, RUBBER, membrane="panel", mass="mixed_voronoi", preset="plate"
    )
    case = fd.Case(structure, [fd.Fix("xmin")], [fd.Gravity((0, 0, -9.81))])
    motions = []
    for count in (1, 2, 3):
        monkeypatch.setattr(threads.config, "NUMBA_NUM_THREADS", count)
        assert case.body.renumbered()[0].threads == count
        motions.append(fd.simulate(case, 2e-3, method="rk4", dt=1e-4).displacement.values)
    size = np.abs(motions[0]).max()
    for motion in motions[1:]:
        np.testing.assert_allclose(motion, motions[0], atol=1e-12 * size)


def test_what_does_not_go_together_is_refused():
    pattern = fd.patterns.miura()
    with pytest.raises(InputError, match="coupled are linear in Green strain"):
        fd.discretize(pattern, RUBBER, membrane="panel", bar_law="ogden", preset="plate")
    with pytest.raises(InputError, match='membrane = "panels": did you mean'):
        fd.discretize(pattern, RUBBER, membrane="panels", preset="plate")  # pyright: ignore[reportArgumentType]


def test_panels_that_are_not_convex_have_single_bars():
    dart = fd.Pattern([(0, 0), (1, 0), (0.3, 0.3), (0, 1)], [(0, 1, 2, 3)])
    own, alone = (
        fd.discretize(dart, RUBBER, scheme="n4b5", membrane=m, bar_law="linear")
        for m in ("panel", "bars")
    )
    u = 0.05 * np.random.default_rng(2).standard_normal(own.nodes.shape)
    np.testing.assert_allclose(own.internal_force(u), alone.internal_force(u), rtol=1e-6)


def test_a_law_of_single_bars_has_single_bars():
    pattern = fd.patterns.miura()
    assert fd.discretize(pattern, RUBBER, preset="plate").options.membrane == "panel"
    assert (
        fd.discretize(pattern, RUBBER, bar_law="ogden", preset="plate").options.membrane == "bars"
    )
    assert fd.discretize(pattern, RUBBER, membrane="bars", preset="plate").bar_law.name == "ogden"
    assert (
        fd.discretize(pattern, RUBBER, bar_law="linear", preset="plate").options.membrane == "panel"
    )


@pytest.mark.matrix
def test_stiffness_follows_the_length_without_jumps():
    """The slope is the same by small and smaller steps, which whole waves would break by 6e-4."""
    sheet = fd.Sheet(3e9, 0.3, 1e-3, 800.0)

    def first(a: float) -> float:
        pattern = fd.patterns.miura(a=a, b=0.03, dihedral=100.0)
        made = fd.discretize(pattern, sheet, preset="n5b8e")
        return np.log(fd.modes(fd.Case(made, [fd.Fix("xmin")]), 1)["frequency"].item())

    a, steps = 0.0301, 0.0301 * np.array([1e-3, 3e-4, 1e-4])
    slopes = [(first(a + step) - first(a - step)) / (2.0 * step) for step in steps]
    assert np.ptp(slopes) < 3e-6 * abs(slopes[-1]), slopes
