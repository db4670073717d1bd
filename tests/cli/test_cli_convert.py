"""`foldyn convert`: pattern files read, checked and written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import diagnose

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)


def written(path: str) -> Any:
    return json.loads(Path(path).read_text())


@pytest.fixture
def files(workplace):
    """A flat sheet with letters, in a file without a unit."""
    folded = fd.patterns.miura()
    flat = fd.patterns.miura(dihedral=180).changed(assignments=folded.assignments)
    fd.write_pattern(flat, "sheet.fold", frames=[fd.formats.Frame("folded", folded.vertices)])
    text = written("sheet.fold")
    del text["frame_unit"]
    Path("sheet.fold").write_text(json.dumps(text))
    return workplace


def test_convert(files) -> None:
    told = files.good("convert", "sheet.fold", "sheet.svg", "--unit", "mm")
    assert told.out == "wrote sheet.svg: 9 vertices, 4 panels, 4 creases\n"
    assert told.new == ["sheet.svg"]
    found = diagnose("sheet.svg").pattern
    assert found.size == pytest.approx(1e-3 * fd.patterns.miura(dihedral=180).size)


def test_what_was_assumed_is_said(files) -> None:
    told = files.call("convert", "sheet.fold", "sheet.obj", "--scale", "0.01", "--quiet")
    assert (told.status, told.out) == (0, "")
    assert "sheet.fold: the file does not say its unit" in told.err


def test_a_frame(files) -> None:
    assert files.call("convert", "sheet.fold", "a.obj", "--frame", "1", "--unit", "m").status == 0
    told = files.call("convert", "sheet.fold", "b.obj", "--frame", "folded", "--unit", "m")
    assert told.status == 0
    np.testing.assert_array_equal(diagnose("b.obj").pattern.vertices, fd.patterns.miura().vertices)
    assert Path("a.obj").read_text() == Path("b.obj").read_text()


def test_check(files) -> None:
    told = files.good("convert", "--check", "sheet.fold")
    assert told.new == []
    assert "sheet.fold: <Pattern 'miura': 9 vertices, 4 faces, 4 creases>" in told.out
    assert "assumptions:" in told.out and "repairs: none" in told.out
    assert "Maekawa holds at 1, Kawasaki at 1" in told.out
    told = files.call("convert", "--check", "sheet.fold", "sheet.stl")
    assert told.status == 0 and told.new == ["sheet.stl"]
    assert "Maekawa" in told.out and "wrote sheet.stl" in told.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["sheet.fold"], "OUT: missing; name the file to write, or give --check"),
        (["none.fold", "a.obj"], "none.fold: there is no such file"),
        (["sheet.fold", "a.xyz"], "a.xyz: has the unknown extension '.xyz'"),
        (["sheet.fold", "a.svg", "--frame", "1"], "SVG files hold flat patterns"),
        (["sheet.fold", "a.obj", "--unit", "ell"], 'unit = "ell": choose one of'),
        (["sheet.fold", "a.obj", "--scale", "-1"], "scale = -1.0"),
        (["sheet.fold", "a.obj", "--every", "2"], "--every: only for results"),
        (["sheet.fold", "no/a.obj"], "cannot be written: No such file"),
    ],
)
def test_bad_input_has_status_2_and_writes_nothing(files, arguments, message) -> None:
    told = files.call("convert", *arguments)
    assert (told.status, told.out, told.new) == (2, "", [])
    assert message in told.err


@pytest.fixture
def result(workplace):
    """A motion of a Miura cell with six samples."""
    case = fd.Case(fd.discretize(fd.patterns.miura(), SHEET, preset="plate"), [fd.Fix([0, 1, 2])])
    motion = fd.simulate(case, 0.005, method="rk4", dt=1e-3, initial=None, force=True)
    fd.save(motion, "run.nc")
    return workplace, motion


@pytest.mark.matrix
def test_a_result_with_its_states(result) -> None:
    workplace, motion = result
    count = motion.sizes["time"]
    told = workplace.call("convert", "run.nc", "run.fold")
    assert (told.status, told.new) == (0, ["run.fold"])
    assert told.out.startswith("wrote run.fold: ") and told.out.endswith(" kB\n")
    assert len(written("run.fold")["file_frames"]) == count
    workplace.call("convert", "run.nc", "some.fold", "--every", "4")
    assert len(written("some.fold")["file_frames"]) == len({*range(0, count, 4), count - 1})
    for arguments in (["run.stl"], ["a.obj", "--frame", "0"], ["a.fold", "--frame", "2"]):
        assert workplace.call("convert", "run.nc", *arguments).status == 0
    assert "file_frames" not in written("a.fold")


@pytest.mark.matrix
def test_a_result_as_a_series(result) -> None:
    told = result[0].call("convert", "run.nc", "run.obj", "--frames", "4")
    assert told.new == [f"run_000{k}.obj" for k in range(4)]
    assert told.out.startswith("wrote run_0000.obj to run_0003.obj (4 files): ")
    told = result[0].refused("convert", "run.nc", "run.obj", "--frames", "3")
    assert "run_0003.obj: belongs to a longer series" in told


@pytest.mark.matrix
def test_a_result_is_known_by_its_content(result) -> None:
    Path("run.nc").rename("run.result")
    assert result[0].call("convert", "run.result", "run.glb", "--quiet").new == ["run.glb"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.fold", "--unit", "mm"], "--unit: only for pattern files"),
        (["a.fold", "--check"], "--check: only for pattern files"),
        (["a.fold", "--frame", "last"], "--frame = last: give the number of a sample"),
        (["a.fold", "--frame", "99"], "frame = 99: the result has the samples 0 to"),
        (["a.obj", "--every", "0"], "--every = 0: must be a whole number, at least 1"),
        (["a.obj", "--every", "2", "--frames", "3"], "--frames: give either every or frames"),
        (["a.obj", "--frame", "2", "--frames", "3"], "--frame: one sample or several"),
        (["a.glb", "--frame", "2"], "--frame: not an option of the format glb; did you mean"),
        (["a.glb", "--seconds", "0"], "--seconds = 0.0: must be at least 0.001 s"),
        (["a.obj", "--scale", "nan"], "--scale = nan: must be a finite number"),
        (["a.glb", "--scale", "1e40"], "--scale = 1e+40: must be in size at most 1e+06"),
        (["run.nc", "--format", "glb"], "run.nc: is the result itself; name another file"),
        (["a.glb", "--format", "gbl"], "--format = \"gbl\": did you mean 'glb'?"),
        (["no/a.glb"], "no/a.glb: the folder no does not exist"),
        (["."], ".: is a folder; name a file in it"),
        (["a.xyz"], "unknown extension"),
    ],
)
def test_bad_input_for_a_result(result, arguments, message) -> None:
    assert message in result[0].refused("convert", "run.nc", *arguments)


def test_slips_of_drawing_are_told_and_mended(files) -> None:
    flat = fd.patterns.miura(cells=(2, 2), a=0.03, b=0.04, panel_angle=65, dihedral=180)
    off = flat.vertices + [(5e-5 * (k % 3), 0, 0) for k in range(len(flat.vertices))]
    fd.write_pattern(flat.changed(vertices=off), "hand.fold")
    told = files.good("convert", "--check", "hand.fold")
    assert "nearly flat-foldable" in told.out
    moved = next(line for line in told.out.splitlines() if "to be moved, to fold flat" in line)
    assert "; the 10 that move most (um): " in moved and moved.count(" by ") == 10
    told = files.call("convert", "hand.fold", "true.fold", "--flat-foldable", "--tolerance", "1e-4")
    assert told.status == 0 and "to where they fold flat" in told.err
    mended = diagnose("true.fold")
    assert not mended.diagnosis.doubts
    assert np.abs(mended.pattern.vertices - off).max() < 1e-4
    fd.save(fd.fold(fd.patterns.simple_fold(dihedral=150), 40, steps=1).path, "x.nc")
    told = files.call("convert", "x.nc", "x.fold", "--flat-foldable")
    assert told.status == 2 and "--flat-foldable: only for pattern files" in told.err


def test_slips_of_drawing_in_case_files(files) -> None:
    flat = fd.patterns.miura(cells=(2, 2), a=0.03, b=0.04, panel_angle=65, dihedral=180)
    off = flat.vertices + [(5e-5 * (k % 3), 0, 0) for k in range(len(flat.vertices))]
    fd.write_pattern(flat.changed(vertices=off), "hand.fold")
    rest = "[sheet]\nyoungs_modulus = 1e9\npoissons_ratio = 0.3\nthickness = 2e-4\ndensity = 800\n"
    rest += '[model]\npreset = "plate"\n'
    case = '[pattern]\nfile = "hand.fold"\n{}\n' + rest + '[analysis]\nkind = "modes"\ncount = 7\n'
    Path("x.toml").write_text(case.format("tolerance = 1e-4\nflat_foldable = true"))
    with pytest.warns(FoldynWarning, match="to where they fold flat"):
        pattern = fd.read_case("x.toml").case().structure.pattern
    assert diagnose("hand.fold", flat_foldable=True).pattern.vertices == pytest.approx(
        pattern.vertices
    )
    Path("x.toml").write_text(case.format("tolerance = 0.5"))
    with pytest.raises(InputError, match=r"tolerance = 0\.5: must be at most a 20th"):
        fd.read_case("x.toml")
