"""Case files with directions, links and rigid panels."""

from __future__ import annotations

import numpy as np
import pytest
from casefile_checks import check

import foldyn as fd
from case_texts import MIURA_TEXT, changed, rows

FILE = f"""{MIURA_TEXT}
[model]
kind = "bars_and_hinges"
rigid = "all"
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
[[loads]]
nodes = [4]
force = [0, 0, -1e-4]
[analysis]
kind = "statics"
load_factors = [1.0]
"""


@pytest.mark.matrix
@pytest.mark.parametrize("kind", ["bars_and_hinges", "shell"])
def test_a_case_file_with_all_of_them(read, tmp_path, kind) -> None:
    case_file = read(changed(FILE, f'model.kind = "{kind}"'))
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


WRONG = """
model.rigid = "both": must be "all", or panel numbers
model.rigid = [4] | model: rigid = [4]: panel 4 is out of range
supports[5] = { nodes = [4], direction = [0, 0, 0] } | supports[5].direction = [0, 0, 0]: must not
    be zero
supports[5] = { nodes = [4], axes = "x", direction = "z" } | supports[5].direction = "z": holds one
    direction, axes hold others
supports[5] = { nodes = [4], link = "x" } | supports[5].nodes = [4]: a link ties at least two nodes
supports[5] = { nodes = [4, 5], link = "x", axes = "x" } | supports[5].link: ties nodes together;
    leave out axes
supports[5] = { nodes = [4], to = [0, 1] } | supports[5].to = [0, 1]: must be three nodes
supports[5] = { nodes = [4], to = [0, 1, 2] } | supports[5].nodes: node 4 lies off the plane of
    nodes [0, 1, 2]
supports[5] = { nodes = [4], displacement = 0.1 } | supports[5].axis: give the axis
"""


@pytest.mark.parametrize(("edits", "message"), rows(WRONG))
def test_wrong_keys(read, edits, message) -> None:
    check(lambda text: read(text).case(), changed(FILE, edits), message)
