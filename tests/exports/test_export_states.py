"""States of results as frames and as series of files, read back."""

from __future__ import annotations

import json

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.formats import diagnose
from foldyn.results.contents import pattern_of


def test_frames_have_the_angles_at_which_creases_are_folded(motion, case, tmp_path):
    (file,) = fd.export(motion, tmp_path / "x.fold", frames=3, scale=0.5)
    pattern = case.structure.pattern
    for k, sample in enumerate([0, 3, 6]):
        found = diagnose(file, frame=k + 1).pattern
        u = motion["displacement"].values[sample, : len(pattern.vertices)]
        np.testing.assert_allclose(found.vertices, pattern.vertices + 0.5 * u, atol=1e-15)
        (state,) = json.loads(file.read_text())["file_frames"][k : k + 1]
        edges = list(map(tuple, pattern.edges.tolist()))
        told = [state["edges_foldAngle"][edges.index(tuple(c))] for c in pattern.creases.tolist()]
        np.testing.assert_allclose(told, 180.0 - np.degrees(found.dihedrals), atol=1e-9)
    assert np.abs(found.dihedrals - pattern.dihedrals).max() > 0.01


def test_a_series_has_a_file_for_each_state(motion, tmp_path):
    files = fd.export(motion, tmp_path / "run.obj", every=3)
    assert [file.name for file in files] == ["run_0000.obj", "run_0001.obj", "run_0002.obj"]
    assert sorted(tmp_path.iterdir()) == files
    for file, sample in zip(files, [0, 3, 6], strict=True):
        found = diagnose(file).pattern
        x = motion["rest_position"].values + motion["displacement"].values[sample]
        np.testing.assert_array_equal(found.vertices, x[: len(found.vertices)])
    assert f"t = {0.5 + 0.25 * 3:g} s" in files[1].read_text()


def test_a_shorter_series_does_not_hide_in_a_longer_one(motion, tmp_path):
    fd.export(motion, tmp_path / "run.stl", frames=4)
    with pytest.raises(InputError, match=r"run_0003\.stl: belongs to a longer series"):
        fd.export(motion, tmp_path / "run.stl", frames=3)
    fd.export(motion, tmp_path / "run.stl", frames=4)


def test_modes_as_shapes(modes, tmp_path):
    (file,) = fd.export(modes, tmp_path / "x.fold")
    first = diagnose(file, frame=1).pattern
    largest = np.linalg.norm(first.vertices - pattern_of(modes).vertices, axis=1).max()
    assert 0.5 * 0.12 < largest / diagnose(file).pattern.size <= 0.12 * (1 + 1e-12)
    assert first.name == f"mode 1: {float(modes.frequency[0]):.6g} Hz"
    assert len(fd.export(modes, tmp_path / "x.obj", every=1)) == 3


def test_one_state_or_several(motion, tmp_path):
    with pytest.raises(InputError, match="frame: one sample or several"):
        fd.export(motion, tmp_path / "x.obj", frame=1, frames=3)
    assert fd.export(motion, tmp_path / "x.obj", frame=1) == [tmp_path / "x.obj"]
    with pytest.raises(InputError, match="SVG files hold flat patterns"):
        fd.export(motion, tmp_path / "x.svg")
