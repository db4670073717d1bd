"""Temperature on panels that bend as plates and give way at their edges: the scheme n5b8e."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.checks import tangent_error
from foldyn.dynamics import prepare
from foldyn.errors import FoldynWarning
from foldyn.statics.equilibrium import OrigamiProblem
from sheets_with_facets import STEEL, cut_across, triangulated, with_lines

SHEET = fd.Sheet(1e9, 0.3, 4e-4, 1000.0)
WIDTH, COUNT = 0.05, 5
HELD = [fd.Fix([0], "xyz"), fd.Fix([1], "xz"), fd.Fix([2], "z")]  # no more than a rigid body needs


def strip(count: int = COUNT) -> fd.Pattern:
    """Square panels in a row along x."""
    vertices = [[i * WIDTH, j * WIDTH, 0.0] for i in range(count + 1) for j in (0, 1)]
    return fd.Pattern(vertices, [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(count)])


def plates(pattern: fd.Pattern, **options) -> fd.Structure:
    return fd.discretize(pattern, SHEET, preset="n5b8e", fold_law="linear", **options)


def corners_of(structure: fd.Structure) -> list[int]:
    x = structure.nodes[:, :2]
    return [int(np.argmax(x @ way)) for way in ([-1, -1], [1, -1], [-1, 1])]


def held_at(corners: list[int]) -> list[fd.Fix]:
    return [fd.Fix([k], axes) for k, axes in zip(corners, ("xyz", "yz", "z"), strict=True)]


def off_the_paraboloid(structure: fd.Structure, load: fd.Temperature, kappa: float) -> float:
    """Largest error of the lift kappa r^2 / 2 where it is free, over the largest lift."""
    x, corners = structure.nodes, corners_of(structure)
    case = fd.Case(structure, held_at(corners), [load])
    path = fd.trace(case, load_factors=[0.0, 1.0])
    lift = 0.5 * kappa * (x[:, :2] ** 2).sum(axis=1)
    flat = np.c_[np.ones(len(x)), x[:, :2]]
    lift -= flat @ np.linalg.solve(flat[corners], lift[corners])
    assert np.abs(path.reaction[-1]).max() < 1e-6
    return float(np.abs(path.displacement.values[-1, :, 2] - lift).max() / np.abs(lift).max())


def test_a_free_strip_expands_without_stress() -> None:
    structure = plates(strip())
    path = fd.trace(
        fd.Case(structure, HELD, [fd.Temperature(30.0, expansion=1e-4)]), load_factors=[0.0, 1.0]
    )
    expected = 3e-3 * (structure.nodes - structure.nodes[0])
    np.testing.assert_allclose(path.displacement[-1], expected, atol=1e-9 * WIDTH)
    assert np.abs(path.reaction).max() < 1e-8


def test_a_free_bimetal_strip_has_timoshenkos_curvature() -> None:
    """J. Opt. Soc. Am. 11, 1925, equation 4, for layers as thick as each other."""
    layers = [(2e-4, 1e9, 1e-5), (2e-4, 2e9, 6e-5)]
    ratio = 2.0
    bend = 24 * 5e-5 * 0.01 / (4e-4 * (14 + ratio + 1 / ratio))
    load = fd.Temperature(-0.01, layers=layers)
    assert pytest.approx(bend) == -0.01 * fd.Laminate(layers).curvature
    assert off_the_paraboloid(plates(strip()), load, bend) < 1e-5


@pytest.mark.parametrize(
    "cut",
    [
        cut_across([0.25, 0.5, 0.75]),
        with_lines([(0, 0.5), (1, 0.5)]),
        with_lines([(0.35, 0), (0.55, 1)]),
        triangulated(6, seed=1),
    ],
)
def test_panels_that_are_welded_curl_as_one(cut) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        structure = fd.discretize(fd.welded(cut), STEEL)
    assert structure.edge_plates is not None
    assert off_the_paraboloid(structure, fd.Temperature(1.0, curvature=1e-5), 1e-5) < 1e-5


@pytest.mark.parametrize(("crease", "near"), [(0.02, 0.01), (2.0, 0.01)])
def test_creases_of_a_folded_sheet_stay_straight_as_in_the_shell(crease, near) -> None:
    """Where they hold back the curl; schemes without edge angles do not know of that."""
    pattern = fd.patterns.simple_fold(a=0.05, b=0.05, dihedral=120)
    load, count, found = fd.Temperature(1.0, curvature=1e-2), len(pattern.vertices), []
    for structure in (
        plates(pattern, crease_stiffness=crease),
        fd.shell(pattern, SHEET, divisions=16, fold_law="linear", crease_stiffness=crease),
    ):
        path = fd.trace(fd.Case(structure, HELD, [load]), load_factors=[0.0, 1.0])
        found.append(path.displacement.values[-1, :count])
    assert np.abs(found[0] - found[1]).max() < near * np.abs(found[1]).max()


def test_rigid_panels_do_not_curl() -> None:
    structure = plates(strip(2), rigid=[0])
    case = fd.Case(structure, HELD, [fd.Temperature(10.0, curvature=1e-4)])
    path = fd.trace(case, load_factors=[0.0, 1.0])
    corners = path.displacement.values[-1, [0, 1, 2, 3], 2]
    assert np.abs(corners).max() < 1e-6 * np.abs(path.displacement[-1]).max()


def test_the_tangent_is_exact() -> None:
    structure = plates(fd.patterns.miura((1, 1), 0.05, 0.05, dihedral=120))
    problem = OrigamiProblem(fd.Case(structure, HELD, [fd.Temperature(20.0, 1e-4, 0.02)]))
    size = len(problem.start())
    start = problem.start() + 1e-4 * np.random.default_rng(0).standard_normal(size)
    error = tangent_error(
        lambda q: problem.residual(q, 1.0), lambda q: problem.tangent(q, 1.0), start
    )
    assert error < 1e-6


def test_motion_by_heat_ends_where_statics_ends() -> None:
    load = fd.Temperature(20.0, 1e-5, 2e-3, history=fd.Ramp(0.02))
    case = fd.Case(plates(strip(2)), HELD, [load], fd.Rayleigh(alpha=60.0))
    motion = fd.simulate(case, 0.4, "generalized_alpha", every=0.02)
    end = fd.trace(case, load_factors=[0.0, 1.0]).displacement.values[-1]
    np.testing.assert_allclose(motion.displacement[-1], end, atol=1e-3 * np.abs(end).max())
    assert abs(motion.attrs["energy_error"]) < 1e-4


@pytest.mark.parametrize("cut", [None, cut_across([0.25, 0.5])], ids=["creased", "welded"])
def test_explicit_methods_stay_where_it_has_curled(cut) -> None:
    """With edge angles in balance: the state that statics find is one of equilibrium."""
    structure = plates(strip(2) if cut is None else fd.welded(cut), mass="consistent")
    load = fd.Temperature(1.0, 1e-5, 1e-3)
    case = fd.Case(structure, held_at(corners_of(structure)), [load])
    end = fd.trace(case, load_factors=[0.0, 1.0]).displacement.values[-1]
    motion = prepare(case, 1e-4, "rk4", initial=fd.State(displacement=end))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # the energies at play are rounding
        moved = motion.samples().displacement - end
    np.testing.assert_allclose(moved, 0.0, atol=1e-6 * np.abs(end).max())
