"""Stresses that color the page, the viewer and VTKHDF files."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.viewer.stage import stage

SHEET = fd.Sheet(3e9, 0.3, 1e-3, density=1000.0)
PATTERN = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)
PUSH = fd.Force([4, 5], (0.0, 0.0, -1e-3))


@pytest.fixture(scope="module", params=["superelements", "n5b8e", "herkal"])
def path(request):
    made = {
        "superelements": lambda: fd.superelements(PATTERN, SHEET, level=1, divisions=8),
        "n5b8e": lambda: fd.discretize(PATTERN, SHEET),
        "herkal": lambda: fd.discretize(PATTERN, SHEET, preset="herkal"),
    }[request.param]()
    return fd.trace(fd.Case(made, [fd.Fix([0, 1, 2, 3])], [PUSH]), steps=2)


def test_pages_color_panels_and_creases_on_request(path):
    shown = stage({"one": path}, {"one": fd.case_of(path)}, "path", [4], stresses=fd.stresses)
    known = shown.about["results"][0]["fields"]
    found = fd.stresses(path)
    assert known["crease_moment"]["on"] == "crease"
    assert ("von_mises" in known) == ("von_mises" in found)
    if "von_mises" in known:
        assert (known["von_mises"]["on"], known["von_mises"]["unit"]) == ("panel", "Pa")
    plain = stage({"one": path}, {"one": fd.case_of(path)}, "path", [4])
    assert not {"von_mises", "crease_moment"} & {*plain.about["results"][0]["fields"]}
    assert "von Mises" in fd.view(path, stresses=True).stage.html() or "von_mises" not in found


def test_vtkhdf_files_have_the_largest_stress_of_each_panel(path, tmp_path):
    found = fd.stresses(path)
    (file,) = fd.export(path, tmp_path / "path.vtkhdf", stresses=True)
    with h5py.File(file) as root:
        cells = root["VTKHDF/CellData"]
        panel = cells["panel"][:]
        moment = cells["crease_moment"][:].reshape(path.sizes["step"], -1)
        crease = cells["crease"][:]
        np.testing.assert_allclose(
            moment[:, crease >= 0], found.crease_moment.values[:, crease[crease >= 0]], rtol=1e-6
        )
        assert ("von_mises" in cells) == ("von_mises" in found)
        if "von_mises" in cells:
            own = cells["von_mises"][:].reshape(path.sizes["step"], -1)
            for number in (0, 1):
                at = (found.point_panel == number).values
                most = found.von_mises.values[:, at].max(axis=(1, 2))
                there = own[:, panel == number]
                np.testing.assert_allclose(there, np.tile(most, (there.shape[1], 1)).T, rtol=1e-6)
            assert np.isnan(own[:, panel < 0]).all()
    with pytest.raises(InputError, match="stresses"):
        fd.export(path, tmp_path / "path.vtkhdf", stresses="yes")
