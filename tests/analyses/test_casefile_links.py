"""Case files with directions, links and rigid panels."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import MIURA_TEXT
from foldyn.errors import InputError

FILE = (
    MIURA_TEXT
    + """
[model]
kind = "{kind}"
rigid = {rigid}
fold_law = "linear"

[[supports]]
nodes = [0, 1, 2]
axes = "x"

[[supports]]
nodes = [0]
direction = "y"

[[supports]]
nodes = [0, 2]
axes = "z"

[[supports]]
nodes = [6]
direction = [0, 0, 3]

[[supports]]
nodes = [6, 8]
link = "z"

{more}

[[loads]]
nodes = [4]
force = [0, 0, -1e-4]

[analysis]
kind = "statics"
load_factors = [1.0]
"""
)


def read(tmp_path, kind="bars_and_hinges", rigid='"all"', more=""):
    (tmp_path / "case.toml").write_text(FILE.format(kind=kind, rigid=rigid, more=more), "utf-8")
    return fd.read_case(tmp_path / "case.toml")


@pytest.mark.parametrize("kind", ["bars_and_hinges", "shell"])
def test_a_case_file_with_all_of_them(tmp_path, kind) -> None:
    case_file = read(tmp_path, kind)
    case = case_file.case()
    assert case.supports[1] == fd.Fix([0], direction="y")
    assert case.supports[3] == fd.Fix([6], direction=(0, 0, 3))
    assert case.supports[4] == fd.Link([6, 8], axes="z")
    path = case_file.run()
    fd.save(path, tmp_path / "path.nc")
    again = fd.case_of(fd.load(tmp_path / "path.nc"))
    assert again.supports == case.supports
    assert again.structure.options == case.structure.options
    expected = fd.Case(
        case.structure, [fd.Fix([0, 1, 2], "x"), fd.Fix([0], "y"), fd.Fix([0, 2, 6, 8], "z")],
        case.loads,
    )  # fmt: skip
    same = fd.trace(expected, load_factors=[1.0])
    u = path.displacement.values
    np.testing.assert_allclose(u, same.displacement, atol=1e-9 * np.abs(u).max())


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"rigid": '"both"'}, r'model.rigid = "both": must be "all", or panel numbers'),
        ({"rigid": "[4]"}, r"rigid = \[4\]: panel 4 is out of range"),
        (
            {"more": "[[supports]]\nnodes = [4]\ndirection = [0, 0, 0]"},
            r"supports\[5\].direction = \[0, 0, 0\]: must not be zero",
        ),
        (
            {"more": '[[supports]]\nnodes = [4]\naxes = "x"\ndirection = "z"'},
            r'supports\[5\].direction = "z": holds one direction, axes hold others',
        ),
        (
            {"more": '[[supports]]\nnodes = [4]\nlink = "x"'},
            r"supports\[5\].nodes = \[4\]: a link ties at least two nodes",
        ),
        (
            {"more": '[[supports]]\nnodes = [4, 5]\nlink = "x"\naxes = "x"'},
            r"supports\[5\].link: ties nodes together; leave out axes",
        ),
        (
            {"more": "[[supports]]\nnodes = [4]\nto = [0, 1]"},
            r"supports\[5\].to = \[0, 1\]: must be three nodes",
        ),
        (
            {"more": "[[supports]]\nnodes = [4]\nto = [0, 1, 2]"},
            r"supports\[5\].nodes: node 4 lies off the plane of nodes \[0, 1, 2\]",
        ),
        (
            {"more": "[[supports]]\nnodes = [4]\ndisplacement = 0.1"},
            r"supports\[5\].axis: give the axis",
        ),
    ],
)
def test_wrong_keys(tmp_path, change, text) -> None:
    with pytest.raises(InputError, match=text):
        read(tmp_path, **change).case()
