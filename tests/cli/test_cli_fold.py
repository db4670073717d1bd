"""`foldyn fold`: files in, files out, what it says, and what it refuses."""

from __future__ import annotations

import contextlib
import json
import math
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.formats import Frame

FLAP = fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)], ["M"], "flap")


@pytest.fixture
def flap(workplace):
    """A file with a square that folds on its diagonal, its second frame folded by 40 degrees."""
    folded = fd.fold(FLAP, 40, steps=2).pattern
    fd.write_pattern(FLAP, "flap.fold", frames=[Frame("half", folded.vertices)])
    return "flap.fold"


def turned(file: str) -> float:
    pattern = fd.read_pattern(file)
    return 180.0 - math.degrees(pattern.dihedrals[0])


@pytest.mark.matrix
def test_a_pattern_is_folded_by_a_fraction(workplace, flap) -> None:
    told = workplace.good("fold", flap, "--to", "50%", "--steps", "3")
    assert told.new == ["flap-folded.fold", "flap-folded.html"]
    assert turned("flap-folded.fold") == pytest.approx(-90.0)
    assert told.out.startswith("1 of 1 mountains and valleys turn their way\nrigidly foldable")
    assert "no panels cross\nwrote flap-folded.fold\nwrote flap-folded.html\n" in told.out
    # the states on the way are frames
    for frame, angle in ((0, -90), (1, 0), (2, -30), (3, -60), (4, -90)):
        state = fd.read_pattern("flap-folded.fold", frame=frame)
        assert 180 - math.degrees(state.dihedrals[0]) == pytest.approx(angle, abs=1e-6)


@pytest.mark.matrix
def test_the_page_shows_the_way_and_a_film_only_where_it_is_asked_for(
    workplace, flap, monkeypatch
) -> None:
    """A film of a few pictures, as films have tests of their own."""
    draw = fd.plots.animate_folding
    monkeypatch.setattr(fd.plots, "animate_folding", lambda *of: draw(*of, frames=3))
    told = workplace.call("fold", flap, "--to", "50%", "--steps", "2", "--film", "gif")
    assert told.new == ["flap-folded.fold", "flap-folded.gif", "flap-folded.html"]
    page = Path("flap-folded.html").read_text()
    assert '"kind": "folding"' in page and "Rigidly foldable: panels are plane" in page
    assert "foldyn fold flap.fold --to 50% --steps 2 --film gif" in page
    assert Path("flap-folded.gif").read_bytes().startswith(b"GIF")


@pytest.mark.matrix
def test_the_way_is_a_result_that_can_be_converted(workplace, flap) -> None:
    told = workplace.call("fold", flap, "--to", "50%", "--steps", "4", "--out", "way.nc")
    assert (told.status, told.new) == (0, ["way.html", "way.nc"])
    way = fd.load("way.nc")
    np.testing.assert_allclose(
        np.degrees(way["fold_angle"][:, 0]), [0, -22.5, -45, -67.5, -90], atol=1e-3
    )
    told = workplace.call("convert", "way.nc", "way.fold")
    assert told.out.startswith("wrote way.fold: ")
    assert len(json.loads(Path("way.fold").read_text())["file_frames"]) == 5
    assert workplace.call("convert", "way.nc", "half.obj", "--frame", "2").status == 0
    assert turned("half.obj") == pytest.approx(-45.0, abs=1e-3)
    shape = fd.read_pattern("way.fold", frame="0.5 of the way")
    np.testing.assert_array_equal(shape.vertices, way["position"][2])


def test_a_pattern_is_folded_by_a_file_of_angles(workplace, flap) -> None:
    workplace.write("# a flap\nmountain, 20\n0 2 -70  # refines it\n\n", "angles.txt")
    out = ("--out", "b/bent.obj", "--steps", "2", "--no-figures", "--quiet")
    assert workplace.good("fold", flap, "--angles", "angles.txt", *out).out == ""
    vertices = fd.read_pattern("b/bent.obj").vertices
    apart = np.linalg.norm(vertices[1] - vertices[3])
    assert apart == pytest.approx(math.sqrt(2.0) * math.cos(math.radians(35.0)))


def test_a_file_of_angles_names_families(workplace) -> None:
    fd.write_pattern(FLAP.changed(families={"spine": [(0, 2)]}), "named.fold")
    workplace.write("spine 35\n", "angles.txt")
    quick = ("--steps", "2", "--no-figures")
    assert workplace.call("fold", "named.fold", "--angles", "angles.txt", *quick).status == 0
    assert turned("named-folded.fold") == pytest.approx(-35.0)
    workplace.write("spin 35\n", "angles.txt")
    told = workplace.refused("fold", "named.fold", "--angles", "angles.txt", *quick)
    assert "angles.spin: did you mean 'spine'" in told


def test_a_pattern_is_folded_to_another_frame(workplace, flap) -> None:
    told = workplace.call("fold", flap, "--to-frame", "half", "--steps", "2", "--no-figures")
    assert told.status == 0
    assert turned("flap-folded.fold") == pytest.approx(-40.0)


def test_creases_that_do_not_turn_are_told_and_kept(workplace) -> None:
    way = np.radians([0, 40, 140, 280])
    rim = np.column_stack([np.cos(way), np.sin(way)])
    faces = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)]
    vertex = fd.Pattern(np.vstack([[0, 0], rim]), faces, ["V", "V", "M", "V"])
    fd.write_pattern(vertex, "vertex.fold")
    told = workplace.call("fold", "vertex.fold", "--to", "50%", "--steps", "3", "--no-figures")
    assert told.status == 0
    assert "foldyn: warning: 2 mountains or valleys do not turn their way: creases " in told.err
    assert "2 of 4 mountains and valleys turn their way; not " in told.out
    assert told.new == ["vertex-folded.fold"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("none.fold --to 50%", "none.fold"),
        ("flap.fold", "fraction: missing; give it"),
        ("flap.fold --to 150%", "fraction = 1.5"),
        ("flap.fold --to 50% --out flap.xyz", "--out flap.xyz: name a file that ends"),
        ("flap.fold --to 50% --steps 0", "steps = 0"),
        ("flap.fold --to 50% --initial flat", 'initial = "flat"'),
        ("flap.fold --angles wrong.txt", "wrong.txt: line 2: 'valley'"),
        ("flap.fold --angles twice.txt", "twice.txt: line 2: mountain is given twice"),
        ("flap.fold --angles empty.txt", "empty.txt: is empty"),
        ("flap.fold --angles other.txt", "angles: (0, 1) is not a crease"),
        ("flap.fold --to-frame 9", "9"),
    ],
)
def test_bad_input_has_status_2_and_writes_nothing(workplace, flap, arguments, message) -> None:
    workplace.write("mountain 20\nvalley\n", "wrong.txt")
    workplace.write("mountain 20\nmountain 30\n", "twice.txt")
    workplace.write("# nothing\n", "empty.txt")
    workplace.write("0 1 30\n", "other.txt")
    assert message in workplace.refused("fold", *arguments.split())


def test_an_interrupt_keeps_the_states_until_then(workplace, flap, monkeypatch) -> None:
    class Bar(contextlib.nullcontext):
        done = 0

        def __enter__(self):
            return self

        def reset(self, _):
            pass

        def update(self):
            self.done += 1
            if self.done == 3:
                raise KeyboardInterrupt

    monkeypatch.setattr("foldyn.cli.folding.progress_bar", lambda *_, **__: Bar())
    told = workplace.call("fold", flap, "--to", "50%", "--steps", "5")
    assert told.new == ["flap-folded.fold"]
    assert told.err == (
        "foldyn: interrupted after 3 of 5 steps\nfoldyn: kept what was computed: flap-folded.fold\n"
    )
    assert turned("flap-folded.fold") == pytest.approx(-54.0)
