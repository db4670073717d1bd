"""Boundary edges in one place: a seam is told of, layers and cuts are not."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.patterns import GENERATORS

# two squares side by side with vertices of their own along x = 1
SQUARES = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0]], float
)
FACES = [[0, 1, 2, 3], [4, 5, 6, 7]]


def told(make):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", FoldynWarning)
        make()
    return [str(one.message) for one in found]


def turned(vertices, degrees, rows):
    """Vertices with some turned about the line x = 1, z = 0."""
    out, angle = vertices.copy(), np.radians(degrees)
    x = vertices[rows, 0] - 1.0
    out[rows, 0], out[rows, 2] = 1.0 + x * np.cos(angle), x * np.sin(angle)
    return out


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e3])
@pytest.mark.parametrize("degrees", [0.0, 40.0, 120.0, 179.0])
def test_panels_that_only_look_joined(degrees, size):
    vertices = size * turned(SQUARES, degrees, [5, 6])
    said = told(lambda: fd.Pattern(vertices, FACES))
    assert len(said) == 1
    assert "boundary edges (1, 2) and (4, 7) lie in the same place but are not joined" in said[0]
    noisy = vertices * (1.0 + 1e-15 * np.arange(24).reshape(8, 3))
    assert len(told(lambda: fd.Pattern(noisy, FACES))) == 1


def test_a_slit_that_ends_inside_and_many_seams():
    slit = SQUARES.copy()
    joined = [[0, 1, 2, 3], [4, 5, 6, 2]]  # the squares share one end of the edge
    assert "(1, 2) and (2, 4)" in told(lambda: fd.Pattern(slit[:7], joined))[0]
    row = np.concatenate([SQUARES, SQUARES + np.array([2, 0, 0])])
    faces = [*FACES, *([[v + 8 for v in face] for face in FACES])]
    assert "(and 2 more such pairs)" in told(lambda: fd.Pattern(row, faces))[0]


def test_joined_panels_apart_and_layers_are_no_seams():
    assert not told(lambda: fd.Pattern(np.delete(SQUARES, [4, 7], 0), [[0, 1, 2, 3], [1, 4, 5, 2]]))
    apart = SQUARES + 1e-6 * np.repeat([[0.0], [1.0]], 4, axis=0)
    assert not told(lambda: fd.Pattern(apart, FACES))
    assert not told(lambda: fd.Pattern(turned(SQUARES, 180.0, [5, 6]), FACES))


@pytest.mark.parametrize("edge", [(1, 2), (4, 7), (7, 4)])
def test_a_cut_is_told_by_its_letter(edge, tmp_path):
    pattern = fd.Pattern(SQUARES, FACES, {edge: "B"})
    file = tmp_path / "cut.fold"
    fd.write_pattern(pattern, file)
    assert file.read_text().count('"C"') == 2
    assert not told(lambda: fd.read_pattern(file))
    file.write_text(file.read_text().replace('"C"', '"B"'))  # in a flat sheet "B" says nothing
    assert len(told(lambda: fd.read_pattern(file))) == 1


@pytest.mark.parametrize("name", GENERATORS)
def test_generators_have_no_seams(name):
    assert not told(GENERATORS[name])


@pytest.mark.parametrize("dihedral", [0.5, 90, 179.5])
def test_miura_sheets_in_any_state_have_no_seams(dihedral):
    assert not told(lambda: fd.patterns.miura(cells=(3, 3), dihedral=dihedral))


def test_a_flat_folded_stack_has_none():
    """An accordion folded shut: all panels upon each other, and two stacks of it."""
    x = np.tile([0.0, 1.0], 4)[:7]
    vertices = np.array([[a, b, 0.0] for a in x for b in (0.0, 1.0)])
    faces = [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(6)]
    letters = ["M", "V", "M", "V", "M"]
    assert not told(lambda: fd.Pattern(vertices, faces, letters))


def test_shared_patterns(shared):
    """Files of other programs, two of them folded so that edges meet: nothing to tell."""
    for file in sorted((shared / "patterns").glob("*.fold")):
        try:
            said = told(lambda file=file: fd.read_pattern(file))
        except fd.errors.InputError:
            continue
        assert not any("not joined" in text for text in said), file.name
