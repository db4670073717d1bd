"""What meshes tell of their own error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from xarray import Dataset

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.algebra.extrapolation import SETTLED, convergence, doubt, extrapolated, limits
from foldyn.analyses.provenance import mesh_error
from foldyn.linear import refinement
from foldyn.linear.reference import MeshModes, same_modes

STEEL = fd.Sheet(2e11, 0.3, 1e-4, density=7850.0)
SHEET = fd.Sheet(1e6, 0.25, 0.01)  # without density: the ratios do not need it
LIMIT = [0.625, 1.0445, 1.903]
"""Hz, at 1 kg/m3; meshes of 32 pieces are within 0.1 % of it."""


def miura(divisions, supports=None):
    held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    shell = fd.shell(fd.patterns.miura(), SHEET, divisions=divisions, fold_law="linear")
    return fd.Case(shell, supports or held, [fd.Force([7], (1.0, 0.0, 0.0))])


@pytest.mark.parametrize("divisions", [4, 8])
def test_the_error_is_told_by_the_order_that_meshes_show(divisions):
    """As large as it is or larger: the observed orders, 1.1 to 1.7, are on their way to 2."""
    found = refinement(miura(divisions))
    assert found is not None and found.divisions == divisions
    assert found.meshes == (divisions // 4, divisions // 2, divisions)
    assert found.order.min() > 1.0 and found.order.max() < 1.8
    true = found.frequency / LIMIT - 1.0
    assert true.max() < 0.0  # too soft
    assert 1.0 < found.error / true.min() < 1.6
    np.testing.assert_allclose(found.extrapolated, LIMIT, rtol=0.03 if divisions == 4 else 5e-3)


@pytest.mark.parametrize(("divisions", "meshes"), [(1, (1, 2, 4)), (2, (1, 2, 4)), (3, (1, 3, 6))])
def test_where_coarser_meshes_lack_finer_ones_stand_in(divisions, meshes):
    found, other = refinement(miura(divisions)), refinement(miura(meshes[-1]))
    assert found is not None and other is not None and found.meshes == meshes
    assert found.frequency == pytest.approx(found.frequencies[meshes.index(divisions)])
    assert found.frequencies[-1] == pytest.approx(other.frequency, rel=1e-8)
    assert np.isnan(found.error) or found.error < -0.05


@pytest.mark.matrix
def test_meshes_that_have_not_converged():
    """A tower that is ever stiffer: with 16 pieces it is beyond the limit by 4 and 8."""
    pattern = fd.patterns.kresling(sides=6, radius=1.0, height=0.9, twist=30)
    tower, finer = (
        fd.Case(fd.shell(pattern, STEEL, divisions=n), [fd.Fix("zmin")]) for n in (8, 16)
    )
    found = refinement(tower)
    assert found is not None and np.isnan(found.error) and np.isnan(found.order).all()
    assert np.isnan(found.extrapolated).all()
    by_two = extrapolated(found.frequencies[1], found.frequencies[2], 2.0)
    after = refinement(finer).frequency  # still on its way, and beyond that limit
    assert (after > by_two * 1.01).all()
    assert found.changes == pytest.approx([0.71, 0.27], abs=0.01)


@pytest.mark.parametrize("divisions", [(2, 4, 8), (1, 3, 7), (3, 6, 12)])
def test_observed_orders(divisions):
    """Of 5 + 3 n^-p: exact from 1 to 2, on the safe side up to 3, and none beyond."""
    orders = np.array([0.8, 1.1, 1.5, 2.0, 2.6, 3.2])
    values = np.array([5.0 + 3.0 * float(n) ** -orders for n in divisions])
    found = convergence(values, divisions)
    np.testing.assert_array_equal(np.isnan(found.order), [True, *[False] * 4, True])
    np.testing.assert_allclose(found.order[1:5], orders[1:5], rtol=1e-9)
    np.testing.assert_allclose(found.limit[1:4], 5.0, rtol=1e-9)
    assert values[2, 4] - 5.0 < values[2, 4] - found.limit[4]
    turning = convergence([[1.0, 1.0], [1.02, 1.0002], [1.01, 1.0001]], divisions)
    np.testing.assert_array_equal(np.isnan(turning.limit), [True, False])
    assert turning.order[1] == 2.0  # of what hardly changes none can be told, nor need be


def test_modes_are_followed_where_meshes_change_their_order():
    """Shapes at common nodes tell which is which, and what a mesh does not have is nan."""
    pattern = fd.patterns.miura()
    fine, coarse = (fd.shell(pattern, SHEET, divisions=n) for n in (4, 2))
    shapes = np.zeros((2, len(fine.nodes), 3))
    shapes[0, :, 2], shapes[1, :, 0] = fine.nodes[:, 0], fine.nodes[:, 1]
    swapped = np.zeros((2, len(coarse.nodes), 3))
    swapped[0, :, 0], swapped[1, :, 2] = coarse.nodes[:, 1], coarse.nodes[:, 0]
    own = MeshModes(fine, np.array([1.0, 1.1]), shapes, Dataset())
    other = MeshModes(coarse, np.array([0.9, 1.0]), swapped, Dataset())
    lacks = MeshModes(coarse, np.array([0.9]), swapped[:1], Dataset())
    found = same_modes(own, [lacks, other, own], 2)
    np.testing.assert_array_equal(found, [[np.nan, 0.9], [1.0, 0.9], [1.0, 1.1]])


def test_a_coarse_mesh_without_modes():
    """A plate that is held at its corners is rigid on the coarsest mesh."""
    square = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
    found = refinement(fd.Case(fd.shell(square, SHEET, divisions=4), [fd.Fix([0, 1, 2, 3])]))
    assert found is not None and np.isnan(found.error) and np.isnan(found.frequencies[0]).all()
    told = fd.modes(fd.Case(fd.shell(square, replace(SHEET, density=1.0), divisions=2)), 1)
    said = mesh_error(told.assign_attrs(found.facts()))
    assert "cannot be judged: with 1 piece of every edge" in said


def test_where_there_is_nothing_to_compare_with():
    assert refinement(miura(32)) is None  # dear
    assert refinement(fd.Case(fd.discretize(fd.patterns.miura(), SHEET, preset="plate"))) is None
    only_there = [fd.Fix([0, 1, 2, 20], "xyz")]  # no vertex
    assert refinement(miura(3, only_there)) is None


@pytest.mark.matrix
def test_results_of_case_files_say_it(read, tmp_path):
    """As attributes, on the page, and by the command; not of bars and hinges."""
    text = f"""{HELD_MIURA_TEXT}[[loads]]
nodes = [7]
force = [1e-3, 0, 0]
[analysis]
kind = "statics"
load_factors = [1.0]
"""
    assert "mesh_error" not in read(text).run().attrs
    path = read(f'{text}[model]\nkind = "shell"\ndivisions = 4\n').run()
    found = refinement(fd.case_of(path))
    assert found is not None and path.attrs["mesh_error"] == pytest.approx(found.error)
    assert path.attrs["extrapolated"] == pytest.approx(found.extrapolated)
    fd.save(path, tmp_path / "path.nc")
    assert fd.load(tmp_path / "path.nc").attrs["mesh_error"] == path.attrs["mesh_error"]
    percent = f"about {-100 * found.error:.2g} % too low with this mesh, by meshes of 1, 2 and 4"
    assert percent in mesh_error(path)
    unsettled = path.assign_attrs(mesh_error=np.nan, mesh_changes=[0.71, -0.273])
    assert mesh_error(unsettled).startswith(
        "this mesh has not converged: with 1, 2 and 4 pieces of every edge one of the lowest "
        "frequencies changes by +71 % and then by -27 %"
    )


@pytest.mark.parametrize(
    "frequencies",
    [  # Hz, with 4, 8, 12, 16 and 24 divisions, graded toward vertices
        (0.0710836, 0.0723806, 0.0726157, 0.0726971, 0.0727570),  # free irregular quads
        (0.305125, 0.314968, 0.316331, 0.316967, 0.317298),
        (0.418916, 0.424208, 0.425279, 0.425662, 0.425938),  # waterbomb held along an edge
        (5.89898, 6.31198, 6.39974, 6.43056, 6.45312),
        (2.09918, 2.01307, 1.98643, 1.97567, 1.96725),  # waterbomb held at its corners
    ],
)
def test_doubt_is_about_what_finer_meshes_show(frequencies):
    divisions, values = [4, 8, 12, 16, 24], np.array(frequencies)[:, None]
    finest = limits(values[2:], divisions[2:], observed=True)
    for first in (0, 1):
        meshes, own = divisions[first : first + 3], values[first : first + 3]
        off = np.abs(finest / limits(own, meshes, observed=True) - 1.0)
        assert SETTLED <= doubt(own, meshes) < 0.03
        assert off <= doubt(own, meshes) + SETTLED  # order 1.2 of the second overshoots by 0.07 %


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("radius", "divisions"), [(None, (4, 8)), pytest.param(2e-3, (8, 12), marks=pytest.mark.matrix)]
)
def test_a_panel_that_touches_a_clamp_has_no_limit(radius, divisions):
    """Even meshes settle too slowly, and with a radius they agree on what depends on it."""
    cell = fd.patterns.miura(cells=(1, 1), a=0.08, b=0.1, panel_angle=65, dihedral=100)
    sheet = fd.Sheet(3e9, 0.3, 1e-3, density=900.0)

    def told(edges):
        ends = sorted({node for edge in edges for node in edge})
        structure = fd.discretize(cell, sheet, preset="n5b8e", clamped=edges)
        case = fd.Case(structure, [fd.Fix(ends, along=True)])
        return fd.fidelity(
            case, 1, reference="shell", divisions=divisions, models=[], vertex_radius=radius
        )

    touching, whole = told([(1, 2)]), told([(0, 1), (1, 2)])
    assert touching.result.attrs["touched_clamp"] == 1
    assert np.isnan(touching.result.mesh_error).all()
    assert "touches a clamped edge at vertex 1 alone" in touching.notes[0]
    assert "touched_clamp" not in whole.result.attrs
    assert np.isfinite(whole.result.mesh_error).all()
    shell = fd.shell(cell, sheet, divisions=4, clamped=[(1, 2)])
    judged = refinement(fd.Case(shell, [fd.Fix([1, 2], along=True)]))
    said = Dataset(attrs=judged.facts())
    assert np.isnan(judged.error) and "no mesh converges" in mesh_error(said)
