"""Sections and materials for Abaqus of sheets that repeat."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError

SHEET = fd.Sheet(3e9, 0.3, 1e-4, 1200.0)
MIURA = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=100)
CUBE = """*NODE, NSET=ALL
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
*ELEMENT, TYPE=C3D8, ELSET=CUBE
1, 1, 2, 3, 4, 5, 6, 7, 8
{}*SOLID SECTION, ELSET=CUBE, MATERIAL=SOLID
*BOUNDARY
1, 1, 3
2, 2, 3
4, 3, 3
*STEP
*STATIC
*CLOAD
2, 1, 25.0
3, 1, 25.0
6, 1, 25.0
7, 1, 25.0
1, 1, -25.0
4, 1, -25.0
5, 1, -25.0
8, 1, -25.0
*NODE PRINT, NSET=ALL
U
*END STEP
"""


def plate() -> fd.UnitCell:
    return fd.UnitCell(fd.Case(fd.discretize(MIURA, SHEET, crease_stiffness=0.01)))


def solid() -> fd.UnitCell:
    low, high = MIURA.vertices[:, 2].min(), MIURA.vertices[:, 2].max()
    both = MIURA.joined(MIURA.mirrored("z", about=(0.0, 0.0, high)), inner=True)
    made = fd.discretize(both, SHEET, crease_stiffness=0.01)
    return fd.UnitCell(fd.Case(made), [*plate().vectors.tolist(), [0.0, 0.0, 2.0 * (high - low)]])


def numbers(text: str, keyword: str) -> np.ndarray:
    """The symmetric matrix (6, 6) after a keyword."""
    after = text.split(keyword)[1].split("\n", 1)[1]
    found = np.array(re.split(r"[,\s]+", after.strip()), float)
    assert len(found) == 21
    matrix = np.zeros((6, 6))
    matrix[np.tril_indices(6)] = found  # columns of the upper triangle
    return matrix + np.tril(matrix, -1).T


def test_a_plate_is_a_general_section(tmp_path: Path):
    found = fd.effective(plate())
    (path,) = fd.export(found, tmp_path / "sheet.inp")
    text = path.read_text()
    assert f"DENSITY={found.density.item():.12g}" in text
    a, b, d = (found[name].values for name in ("membrane", "coupling", "bending"))
    np.testing.assert_allclose(
        numbers(text, "*SHELL GENERAL SECTION"), np.block([[a, b], [b.T, d]]), rtol=1e-11
    )


def test_a_solid_is_a_material_of_calculix(tmp_path: Path):
    found = fd.effective(solid())
    (path,) = fd.export(found, tmp_path / "solid.inp")
    text = path.read_text()
    order = [0, 1, 2, 5, 4, 3]
    own = numbers(text, "*ELASTIC, TYPE=ANISOTROPIC")
    np.testing.assert_allclose(own, found.stiffness.values[np.ix_(order, order)], rtol=1e-11)
    if shutil.which("ccx") is None:
        pytest.skip("needs CalculiX (ccx)")
    (tmp_path / "cube.inp").write_text(CUBE.format(text))
    subprocess.run(["ccx", "cube"], cwd=tmp_path, check=True, capture_output=True)
    rows = (tmp_path / "cube.dat").read_text().split("time")[1].split("\n")[2:10]
    moved = np.array([row.split()[1:] for row in rows], float)[6]  # corner (1, 1, 1)
    strain = 100.0 / found.modulus[0].item()
    ratios = found.poissons_ratio.sel(pair=["xy", "xz"]).values
    np.testing.assert_allclose(moved, [strain, *(-ratios * strain)], rtol=1e-5)


def angle_section() -> fd.UnitCell:
    """Legs of 50 and 30 mm along x and z, welded; the second is three times as stiff."""
    across = [(0.0, 0.0), (0.05, 0.0), (0.0, 0.03)]
    vertices = [(x, y, z) for y in (0.0, 0.02) for x, z in across]
    pattern = fd.Pattern(vertices, [(0, 1, 4, 3), (0, 3, 5, 2)], welds=[(0, 3)])
    sheet = fd.Sheet(1e9, 0.0, 1e-4, 1000.0, panels=[fd.PanelSheet([1], 3e9)])
    panels = fd.discretize(pattern, sheet, crease_stiffness=1.0)
    return fd.UnitCell(fd.Case(panels), vectors=[(0.0, 0.02, 0.0)])


@pytest.mark.matrix
def test_a_beam_is_a_general_section(tmp_path: Path):
    """Its numbers are sums over the fibers of its legs, from the line of its center of mass."""
    found = fd.effective(angle_section())
    (path,) = fd.export(found, tmp_path / "beam.inp")
    lines = [row for row in path.read_text().splitlines() if not row.startswith("**")]
    assert lines[0].startswith("*BEAM GENERAL SECTION") and lines[4] == "*CENTROID"
    section, first, moduli, offset = (np.array(lines[k].split(","), float) for k in (1, 2, 3, 5))
    along = (np.arange(500) + 0.5) / 500
    legs = np.concatenate([np.outer(along, (0.05, 0, 0)), np.outer(along, (0, 0, 0.03))])
    stiff = np.repeat([1e9 * 0.05, 3e9 * 0.03], 500) * 1e-4 / 500
    mass = np.repeat([0.05, 0.03], 500)
    axis = found.frame[0].values
    axes = np.array([first, np.cross(axis, first)])  # right-handed with the beam's direction
    place = (legs - mass @ legs / mass.sum()) @ axes.T
    middle = stiff @ place / stiff.sum()
    np.testing.assert_allclose(offset, middle, rtol=1e-3)
    one, two = (place - middle).T
    sums = [stiff.sum(), stiff @ two**2, stiff @ (one * two), stiff @ one**2]
    np.testing.assert_allclose(section[:4], sums, rtol=2e-2)
    assert section[4] == pytest.approx(found.torsional_stiffness.item(), rel=1e-9)
    assert moduli.tolist() == [1.0, 1.0]
    density = float(lines[0].split("DENSITY=")[1])
    assert density * section[0] == pytest.approx(1000.0 * 1e-4 * 0.08, rel=1e-9)


def test_what_is_no_section_is_refused(tmp_path: Path):
    tower = fd.discretize(fd.patterns.kresling(), SHEET, crease_stiffness=0.01)
    chain = fd.effective(fd.UnitCell(fd.Case(tower)))
    with pytest.raises(InputError, match="of a chain or tube that twists"):
        fd.export(chain, tmp_path / "tower.inp")
    one = fd.effective(plate())
    states = one.assign(membrane=one["membrane"].expand_dims("state"))
    with pytest.raises(InputError, match="has several states"):
        fd.export(states, tmp_path / "states.inp")
