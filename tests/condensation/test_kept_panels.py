"""Condensed panels on disk: found again, never mistaken for others, and no reason to fail."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest

import foldyn as fd
from foldyn.condensation import library as module
from foldyn.condensation.library import _condensed, kept

PATTERN = fd.patterns.simple_fold(a=1.0, b=1.3, dihedral=70)
SHEET = fd.Sheet(2e9, 0.3, 0.02, 900.0)
MESHES = fd.superelements(PATTERN, SHEET, divisions=4).meshes
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.1, 1.3, 0.0], [0.0, 1.2, 0.0]])
PLAIN = fd.Sheet(1.0, 0.3, 0.02, 1.0)
FIBERS = fd.Sheet((1.0, 0.1), 0.3, 0.02, 1.0, shear_modulus=0.05, direction=0.0)
GIVEN = {"corners": CORNERS, "smooth": (), "sheet": PLAIN, "fibers": 0.0}


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Arguments of all condensations, which are kept in an empty folder."""
    found, condense = [], module.condense
    monkeypatch.setattr(module, "folder_for", lambda _: tmp_path)
    monkeypatch.setattr(module, "condense", lambda *a: found.append(a) or condense(*a))
    return found


def assert_equal(one, other):
    for name, value in vars(one).items():
        np.testing.assert_array_equal(value, getattr(other, name))


def test_a_panel_is_found_again_only_for_the_same_input(made):
    first = kept(**GIVEN, meshes=MESHES)
    assert_equal(kept(**GIVEN, meshes=MESHES), first)
    assert len(made) == 1
    near = CORNERS + np.array([0.0, 1e-15, 0.0]) * (CORNERS > 1.25)
    assert (near != CORNERS).sum() == 1
    other = MESHES._replace(graded=tuple(own._replace(radius=0.021) for own in MESHES.graded))
    for change in (
        {"corners": near}, {"smooth": (1,)},
        {"sheet": replace(PLAIN, poissons_ratio=np.nextafter(0.3, 1.0))},
        {"sheet": replace(PLAIN, thickness=np.nextafter(0.02, 1.0))}, {"meshes": other},
        {"sheet": FIBERS}, {"sheet": FIBERS, "fibers": 0.1},
        {"sheet": replace(FIBERS, shear_modulus=0.06)},
    ):  # fmt: skip
        count = len(made)
        for _ in range(2):
            kept(**{**GIVEN, "meshes": MESHES, **change})
        assert len(made) == count + 1, change


def test_modulus_density_and_creases_need_no_other_panel(made):
    """Frequencies are proportional to the root of modulus over density."""
    _condensed.cache_clear()
    held = [fd.Fix("xmin", along=True)]
    sheets = [
        SHEET, replace(SHEET, youngs_modulus=8e9, length_scale_ratio=2.0),
        replace(SHEET, density=100.0),
    ]  # fmt: skip
    one, stiff, light = (
        fd.modes(fd.Case(fd.superelements(PATTERN, own, divisions=4, crease_stiffness=k), held))
        for own, k in zip(sheets, (10.0, 40.0, 10.0), strict=True)
    )
    assert len(made) == 1
    for name in ("frequency", "frequency_error"):
        np.testing.assert_allclose(stiff[name], 2.0 * one[name], rtol=1e-6)
        np.testing.assert_allclose(light[name], 3.0 * one[name], rtol=1e-6)


def test_files_that_cannot_be_used_are_replaced(made, tmp_path):
    first = kept(**GIVEN, meshes=MESHES)
    (path,) = tmp_path.glob("*.npz")
    sound = path.read_bytes()
    kept(**{**GIVEN, "sheet": replace(PLAIN, thickness=0.03)}, meshes=MESHES)
    (other,) = set(tmp_path.glob("*.npz")) - {path}
    flipped = bytearray(sound)
    flipped[len(sound) // 2] ^= 1
    for damaged in (b"", sound[: len(sound) // 2], flipped, other.read_bytes()):
        path.write_bytes(damaged)
        count = len(made)
        assert_equal(kept(**GIVEN, meshes=MESHES), first)
        assert len(made) == count + 1
        assert_equal(kept(**GIVEN, meshes=MESHES), first)
        assert len(made) == count + 1


def test_a_folder_that_cannot_be_written_is_no_error(made, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", None):
        monkeypatch.setattr(module, "folder_for", lambda _, own=folder: own)
        count = len(made)
        assert_equal(kept(**GIVEN, meshes=MESHES), kept(**GIVEN, meshes=MESHES))
        assert len(made) == count + 2


def test_the_files_used_longest_ago_go(made, tmp_path, monkeypatch):
    thick = [{**GIVEN, "sheet": replace(PLAIN, thickness=t)} for t in (0.02, 0.03, 0.04)]
    names = []
    for day, own in enumerate(thick[:2]):
        kept(**own, meshes=MESHES)
        (new,) = set(tmp_path.glob("*.npz")) - set(names)
        os.utime(new, (day, day))
        names.append(new)
    kept(**thick[0], meshes=MESHES)  # used now
    monkeypatch.setattr(module, "MOST", int(2.5 * names[0].stat().st_size))
    kept(**thick[2], meshes=MESHES)
    assert names[0].exists() and not names[1].exists()
    assert len(list(tmp_path.iterdir())) == 2
