"""Boards drawn in their thickness."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.plots.boards import _placed, _solid

T = 0.1
FLAT = fd.Pattern([(0, 0), (1, 0), (2, 0), (0, 0.6), (1, 0.6), (2, 0.6)],
                  [(0, 1, 4, 3), (1, 2, 5, 4)], {(1, 4): "V"})  # fmt: skip
THICK = fd.thicken(FLAT, T)


def test_boards_at_rest_are_slabs():
    solid = _solid(THICK)
    corners = solid.nodes[6:].reshape(2, 2, 4, 3)  # board, back and front, corner
    np.testing.assert_allclose(corners[:, 0, :, 2], -T / 2, atol=1e-15)
    np.testing.assert_allclose(corners[:, 1, :, 2], T / 2, atol=1e-15)
    np.testing.assert_allclose(corners[0, 1, :, :2], FLAT.vertices[[0, 1, 4, 3], :2], atol=1e-15)
    normals = np.cross(*(np.diff(solid.nodes[solid.triangles], axis=1)[:, k] for k in (0, 1)))
    assert 0.5 * np.linalg.norm(normals, axis=1).sum() == pytest.approx(
        2 * (2 * 0.6 + 2 * T * (1 + 0.6))
    )


def test_boards_move_with_their_panels():
    """Turned by 90 degrees about the hinge line, the second board stands on its side of it."""
    vertices = THICK.vertices.copy()
    arm = vertices[[2, 5]] - vertices[[1, 4]]
    vertices[[2, 5]] = vertices[[1, 4]] + np.stack([-arm[:, 2], arm[:, 1], arm[:, 0]], axis=1)
    board = _placed(_solid(THICK), THICK, vertices)[6 + 8 :]
    np.testing.assert_allclose([board[:, 0].min(), board[:, 0].max()], [1.0, 1.0 + T], atol=1e-14)
    np.testing.assert_allclose(
        [board[:, 2].min(), board[:, 2].max()], [T / 2, T / 2 + 1.0], atol=1e-14
    )


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["bars", "shell"])
def test_one_state_or_several(model):
    sheet = fd.Sheet(1e8, 0.3, T, 500.0)
    s = (
        fd.shell(THICK, sheet, divisions=2)
        if model == "shell"
        else fd.discretize(THICK, sheet, preset="plate")
    )
    u = np.zeros_like(s.nodes)
    assert len(fd.plots.draw_boards(fd.Case(s)).axes) == 1
    assert len(fd.plots.draw_boards(s, u).axes) == 1
    figure = fd.plots.draw_boards(
        s, np.stack([u, u + 0.1]), captions=["one", "two"], title="boards"
    )
    assert len(figure.axes) == 2
    assert {"one", "two"} <= {text.get_text() for text in figure.texts}
    assert len(fd.plots.draw_boards(THICK).axes) == 1


def test_what_cannot_be_drawn():
    with pytest.raises(InputError, match=r"its panels are not thick; see foldyn\.thicken"):
        fd.plots.draw_boards(FLAT)
    with pytest.raises(InputError, match=r"displacement: shape \(2, 3\); give \(6, 3\)"):
        fd.plots.draw_boards(THICK, np.zeros((2, 3)))
