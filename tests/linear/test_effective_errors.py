"""Effective properties of bars and hinges carry their errors, by comparison with superelements."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError, ModelRangeWarning, quietly
from foldyn.linear import model_error
from verification.effective_cells import counts, numbers

pytestmark = [
    pytest.mark.usefixtures("compared"),
    pytest.mark.filterwarnings("error::foldyn.errors.FoldynWarning"),
]
PAPER = fd.Sheet(3e9, 0.3, 3e-4, density=800.0)
MIURA = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=100)
SOFT = 0.02 * PAPER.bending_modulus / 0.03  # N m/rad per m


def cell(pattern=MIURA, sheet=PAPER, model=fd.discretize, **options) -> fd.UnitCell:
    options = {"crease_stiffness": SOFT, **options}
    return fd.UnitCell(fd.Case(model(pattern, sheet, **options)))


def triangles(model=fd.discretize, crease=SOFT) -> fd.UnitCell:
    """Eight congruent triangles, whose vertices are high and low as the fields of a board."""
    i, j = np.indices((3, 3)).reshape(2, -1)
    points = np.stack([0.03 * i, 0.03 * j, 0.01 * ((i + j) % 2)], axis=1)
    squares = [(a, a + 3, a + 4, a + 1) for a in (0, 1, 3, 4)]
    faces = [face for a, b, c, d in squares for face in ((a, b, c), (a, c, d))]
    case = fd.Case(model(fd.Pattern(points, faces), PAPER, crease_stiffness=crease))
    return fd.UnitCell(case, vectors=0.06 * np.eye(3)[:2])


BLOCK = {"strain": ("membrane", "coupling"), "curvature": (None, "bending")}


def named(found) -> dict[str, float]:
    """Errors by the names of the entries in `verification.effective_cells`."""
    out = {}
    for i, row in enumerate(found.row.values):
        for j, column in enumerate(found.column.values):
            of, load = row.split()
            bends, strain = column.startswith("curvature"), column.split()[1]
            if BLOCK[of][bends]:
                out[f"{BLOCK[of][bends]}[{load},{strain}]"] = float(found.model_error[i, j])
    return out


@pytest.mark.matrix
def test_a_miura_sheet_with_soft_creases_is_right():
    found, true = fd.effective(cell()), numbers(fd.effective(cell(model=fd.superelements)))
    own, errors = numbers(found), named(found)
    assert "bending[xx,yy]" in errors and "coupling[yy,xx]" in errors
    for name in (each for each in own if "," in each):
        assert np.isfinite(errors[name]) == counts(true, name)
        if counts(true, name):
            assert errors[name] == pytest.approx(own[name] / true[name] - 1.0, abs=1e-9)
    assert 0.005 < np.nanmax(np.abs(found.model_error)) < 0.02
    assert "not_compared" not in found.attrs


def test_a_sheet_of_triangles_bends_twice_too_stiffly_and_says_so():
    with pytest.warns(ModelRangeWarning) as caught:
        found = fd.effective(triangles())
    (told,) = (str(each.message) for each in caught)
    true, own = numbers(fd.effective(triangles(fd.superelements))), numbers(found)
    assert named(found)["bending[xx,xx]"] == pytest.approx(1.1, abs=0.02)
    wrong = re.search(
        r"curvature (..), curvature (..)\) of .* is (\S+), and (\S+) with .* \(\+(\d+)%\)", told
    )
    assert wrong is not None
    name = f"bending[{','.join(sorted(wrong.groups()[:2], key=['xx', 'yy', 'xy'].index))}]"
    ours, theirs, percent = map(float, wrong.groups()[2:])
    assert named(found)[name] == pytest.approx(np.nanmax(np.abs(found.model_error)))
    assert ours == pytest.approx(own[name], rel=1e-3)
    assert theirs == pytest.approx(true[name], rel=1e-3)
    assert percent == round(100.0 * (own[name] / true[name] - 1.0))
    assert "--model superelements" in told
    assert "model_error" not in fd.effective(triangles(), check_model=False)  # and no warning


def test_what_is_not_compared_says_so(monkeypatch):
    big = fd.patterns.miura((3, 2), a=0.03, b=0.03, panel_angle=60, dihedral=100)
    assert "24 panels, more than 16" in fd.effective(cell(big)).attrs["not_compared"]
    with quietly():  # hinges without a slope, strains without stiffness
        soft = fd.effective(cell(fold_law="superlinear"))
    assert "no slope at rest" in soft.attrs["not_compared"]
    monkeypatch.setattr(model_error, "OF_STIFFNESS", (16, 0))
    assert "1 different panels, more than 0" in fd.effective(cell()).attrs["not_compared"]
    rest = fd.State(np.zeros(cell().case.structure.nodes.shape))
    for found in (
        fd.effective(cell(), check_model=False),
        fd.effective(cell(), rest),
        fd.effective(cell(model=fd.shell, divisions=1)),
    ):
        assert "model_error" not in found and "not_compared" not in found.attrs
    wrong: Any = "no"
    with pytest.raises(InputError, match='check_model = "no"'):
        fd.effective(cell(), check_model=wrong)


@pytest.mark.matrix
def test_chains_solids_and_sheets_without_density_are_compared():
    light = fd.Sheet(3e9, 0.3, 3e-4)
    tower = fd.patterns.kresling(radius=0.03, height=0.03)
    for made in (cell(tower), cell(sheet=light)):
        assert 1e-4 < np.nanmax(np.abs(fd.effective(made).model_error)) < 0.03
    found = fd.effective(cell(tower))
    assert found.model_error.sel(row="stretch", column="twist") == pytest.approx(
        found.stretch_twist / fd.effective(cell(tower, model=fd.superelements)).stretch_twist - 1.0
    )


def test_a_strain_that_costs_nothing_has_no_error():
    """Strips about creases without stiffness."""
    strip = cell(fd.patterns.simple_fold(a=0.03, b=0.03, dihedral=180), crease_stiffness=0.0)
    with pytest.warns(FoldynWarning, match="costs no energy"):
        found = fd.effective(strip)
    assert np.isnan(found.model_error.sel(row="bend_2", column="bend_2"))
    assert np.nanmax(np.abs(found.model_error)) < 0.01


@pytest.mark.matrix
def test_gradients_and_designs_are_not_compared(monkeypatch):
    monkeypatch.setattr(model_error, "superelements_of", None)  # whose call would fail

    def build(crease: float) -> fd.UnitCell:
        return triangles(crease=crease)

    what: dict[str, Any] = {"kind": "effective"}
    found = fd.sensitivity(build, {"crease": SOFT}, measures=["modulus[x]"], analysis=what)
    assert np.ravel(found.gradient_crease).item() > 0.0
    space = {"crease": (SOFT, 1.1 * SOFT)}
    own: dict[str, Any] = {"analysis": what, "method": "cma", "max_evaluations": 8}
    least = fd.design(build, space, minimize="modulus[x]", **own)
    assert SOFT <= least.parameters["crease"] < 1.1 * SOFT
