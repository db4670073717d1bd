"""Gradients of effective properties, and designs of materials."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError

EFFECTIVE = {"kind": "effective"}
ANGLE = 60.0


def miura(dihedral: float = 100.0, panel_angle: float = ANGLE, crease: float = 1e-4) -> fd.UnitCell:
    """Cell of a Miura sheet with creases that are much softer than its panels."""
    pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=panel_angle, dihedral=dihedral)
    sheet = fd.Sheet(3e9, 0.3, thickness=1e-4, density=1200.0)
    structure = fd.discretize(pattern, sheet, crease_stiffness=crease, fold_law="linear")
    return fd.UnitCell(fd.Case(structure))


@pytest.mark.matrix
def test_the_ratio_of_a_miura_sheet_changes_as_that_of_rigid_panels():
    """-(cos theta tan gamma)^2, theta = 90 - dihedral / 2 (Schenk and Guest, PNAS 110, 2013)."""
    found = fd.sensitivity(
        miura, {"dihedral": 100.0, "panel_angle": ANGLE},
        measures=["poissons_ratio[x]", "bending_poissons_ratio[x]"], analysis=EFFECTIVE,
    )  # fmt: skip
    tilt, angle = np.radians(40.0), np.radians(ANGLE)
    by_tilt = 2.0 * np.cos(tilt) * np.sin(tilt) * np.tan(angle) ** 2
    by_angle = -2.0 * np.cos(tilt) ** 2 * np.tan(angle) / np.cos(angle) ** 2
    exact = np.radians([-0.5 * by_tilt, by_angle])  # per degree
    rates = [found["gradient_dihedral"].values, found["gradient_panel_angle"].values]
    np.testing.assert_allclose([rate[0] for rate in rates], exact, rtol=1e-4)
    np.testing.assert_allclose([rate[1] for rate in rates], -exact, rtol=3e-3)


@pytest.mark.matrix
def test_stiffness_grows_with_that_of_the_creases():
    """Of rigid panels, moduli are proportional to it, and the density is not."""
    found = fd.sensitivity(
        miura, {"crease": 1e-4}, measures=["modulus[y]", "density"], analysis=EFFECTIVE
    )
    modulus, density = found["value"].values
    rate = 1e-4 * found["gradient_crease"].values
    np.testing.assert_allclose(rate, [modulus, 0.0], rtol=1e-2, atol=1e-9 * density)


@pytest.mark.matrix
def test_a_sheet_with_a_given_ratio():
    best = fd.design(
        miura, {"dihedral": (40.0, 160.0)}, minimize="density",
        subject_to=["poissons_ratio[x] == -1.5"], analysis=EFFECTIVE,
    )  # fmt: skip
    tilt = np.arccos(np.sqrt(1.5) / np.tan(np.radians(ANGLE)))
    exact = 180.0 - 2.0 * np.degrees(tilt)
    np.testing.assert_allclose(best["parameters"]["dihedral"], exact, rtol=1e-3)


@pytest.mark.matrix
def test_case_files_are_as_their_cells(tmp_path: Path):
    path = tmp_path / "sheet.toml"
    path.write_text(
        """[pattern]
kind = "miura"
a = 0.03
b = 0.03
panel_angle = 60.0
dihedral = 100.0
[sheet]
youngs_modulus = 3e9
poissons_ratio = 0.3
thickness = 1e-4
density = 1200.0
[model]
crease_stiffness = 1e-4
fold_law = "linear"
[analysis]
kind = "effective"
"""
    )
    measures = ["poissons_ratio[x]", "bending[xx]"]
    of_file = fd.sensitivity(path, {"pattern.dihedral": 100.0}, measures=measures)
    own = fd.sensitivity(miura, {"dihedral": 100.0}, measures=measures, analysis=EFFECTIVE)
    np.testing.assert_allclose(
        of_file["gradient_pattern.dihedral"], own["gradient_dihedral"], rtol=1e-6
    )


def test_what_a_cell_lacks_is_refused():
    with pytest.raises(InputError, match=r"^axial_stiffness: this cell has none; it has poissons"):
        fd.sensitivity(miura, {"dihedral": 100.0}, measures="axial_stiffness", analysis=EFFECTIVE)
    with pytest.raises(InputError, match=r"cell"):
        fd.sensitivity(
            lambda dihedral: miura(dihedral).case, {"dihedral": 100.0}, measures="density",
            analysis=EFFECTIVE,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("measure", "analysis", "reason"),
    [
        ("mass", EFFECTIVE, "of a cell take density"),
        ("modulus[x]", {**EFFECTIVE, "state": fd.State()}, "would stay as it is while the cell"),
        (
            {"mine": (lambda r, c: float(r.density), lambda r, c: {"density": 1.0})}, EFFECTIVE,
            "no derivatives by variables of this result",
        ),
    ],
)  # fmt: skip
def test_what_has_no_gradient_is_refused(measure, analysis, reason):
    with pytest.raises(InputError, match=reason):
        fd.sensitivity(miura, {"dihedral": 100.0}, measures=measure, analysis=analysis)


def test_a_file_says_its_own_analysis(tmp_path: Path):
    path = tmp_path / "sheet.toml"
    path.write_text(
        '[pattern]\nkind = "miura"\n[sheet]\nyoungs_modulus = 3e9\npoissons_ratio = 0.3\n'
        'thickness = 1e-4\ndensity = 1200.0\n[analysis]\nkind = "effective"\n'
    )
    parameters = {"pattern.dihedral": 100.0}
    with pytest.raises(InputError, match=r"analysis: effective properties of a case file"):
        fd.sensitivity(path, parameters, measures="modulus[x]", analysis={"secant": 1.0})
    modes = {"kind": "modes", "count": 8}
    found = fd.sensitivity(path, parameters, measures="frequency[7]", analysis=modes)
    assert np.isfinite(found["gradient_pattern.dihedral"]).all()
