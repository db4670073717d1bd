"""What a coarse mesh tells of its own error."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.analyses.provenance import mesh_error
from foldyn.linear import refinement

SHEET = fd.Sheet(1e6, 0.25, 0.01)  # without density: the ratios do not need it
LIMIT = [0.625, 1.0445, 1.903]
"""Hz, at 1 kg/m3: docs/shells.md, whose meshes of 32 pieces are within 0.1 % of it."""


def miura(divisions, supports=None):
    held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    shell = fd.shell(fd.patterns.miura(), SHEET, divisions, fold_law="linear")
    return fd.Case(shell, supports or held, [fd.Force([7], (1.0, 0.0, 0.0))])


@pytest.mark.parametrize(("divisions", "most"), [(4, 0.025), (8, 0.006)])
def test_the_error_is_told_by_one_refinement(divisions, most):
    found = refinement(miura(divisions))
    assert found is not None and found.divisions == divisions
    true = found.frequency / LIMIT - 1.0
    assert true.max() < 0.0 and abs(true).max() > 1.5 * most  # too soft
    assert np.abs(found.extrapolated / LIMIT - 1.0).max() < most
    assert 0.5 < found.error / true.min() < 1.1


def test_meshes_of_an_odd_number_of_pieces():
    found = refinement(miura(7))
    coarse = refinement(miura(3))
    assert found is not None and coarse is not None  # 3 pieces are what 7 are compared with
    gain = (found.frequency - coarse.frequency) / ((7 / 3) ** 2 - 1)
    np.testing.assert_allclose(found.extrapolated, found.frequency + gain, rtol=1e-12)


def test_where_there_is_nothing_to_compare_with():
    assert refinement(miura(1)) is None
    assert refinement(fd.Case(fd.discretize(fd.patterns.miura(), SHEET))) is None
    only_there = [fd.Fix([0, 1, 2, 20], "xyz")]  # no vertex
    assert refinement(miura(3, only_there)) is None


def test_results_of_case_files_say_it(tmp_path):
    """As attributes, on the page, and by the command; not of bars and hinges."""
    text = """
[pattern]
kind = "miura"
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
[[supports]]
nodes = "xmin"
[[loads]]
nodes = [7]
force = [1e-3, 0, 0]
[analysis]
kind = "statics"
load_factors = [1.0]
"""
    (tmp_path / "case.toml").write_text(text)
    assert "mesh_error" not in fd.read_case(tmp_path / "case.toml").run().attrs
    (tmp_path / "case.toml").write_text(text + '[model]\nkind = "shell"\ndivisions = 4\n')
    path = fd.read_case(tmp_path / "case.toml").run()
    found = refinement(fd.case_of(path))
    assert found is not None and path.attrs["mesh_error"] == pytest.approx(found.error)
    assert path.attrs["extrapolated"] == pytest.approx(found.extrapolated)
    fd.save(path, tmp_path / "path.nc")
    assert fd.load(tmp_path / "path.nc").attrs["mesh_error"] == path.attrs["mesh_error"]
    percent = f"{-100 * found.error:.2g} % too low with this mesh"
    assert percent in mesh_error(path)
