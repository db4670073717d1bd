"""[imperfection] in case files: random fields, shapes of a result, sweeps, and wrong tables."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError

CASE = """
[pattern]
vertices = [[0, 0], [0.25, 0], [0.5, 0], [0.75, 0], [1, 0], [1, 0.1], [0.75, 0.1], [0.5, 0.1],
            [0.25, 0.1], [0, 0.1]]
faces = [[0, 1, 8, 9], [1, 2, 7, 8], [2, 3, 6, 7], [3, 4, 5, 6]]
fold_angles = [0, 0, 0]
facets = "weld"
[sheet]
youngs_modulus = 1e9
poissons_ratio = 0.0
thickness = 1e-3
[model]
kind = "shell"
divisions = 4
[[supports]]
nodes = [0, 9]
axes = "xz"
[[supports]]
nodes = [4, 5]
axes = "z"
[[supports]]
nodes = [0]
axes = "y"
[[loads]]
nodes = [4, 5]
force = [-0.01, 0, 0]
"""
BUCKLED = '[analysis]\nkind = "buckling"\ncount = 2\n'
PATH = '[analysis]\nkind = "statics"\nsteps = 4\n'


def written(tmp_path, text, name="case.toml"):
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return path


def test_a_random_field_is_the_function(tmp_path):
    table = "[imperfection]\namplitude = 1e-3\ncorrelation = 0.3\nseed = 2\n"
    perfect = fd.read_case(written(tmp_path, CASE + PATH)).pattern
    read = fd.read_case(written(tmp_path, CASE + table + PATH))
    made = fd.imperfect(perfect, 1e-3, correlation=0.3, seed=2)
    np.testing.assert_array_equal(read.pattern.vertices, made.vertices)
    assert np.ptp(read.pattern.vertices[:, 2]) > 0.0
    other = read.with_values({"imperfection.seed": 3}).pattern
    assert np.abs(other.vertices - made.vertices).max() > 0.0
    none = read.with_values({"imperfection.amplitude": 0.0}).pattern
    np.testing.assert_array_equal(none.vertices, perfect.vertices)


def test_shapes_of_a_result(tmp_path):
    buckled = fd.read_case(written(tmp_path, CASE + BUCKLED)).run()
    fd.save(buckled, tmp_path / "shapes.nc")
    table = '[imperfection]\namplitude = 2e-3\nfile = "shapes.nc"\nmodes = 1\n'
    read = fd.read_case(written(tmp_path, CASE + table + PATH))
    heights = read.pattern.vertices[:, 2]
    shape = buckled["shape"].sel(mode=1, axis="z").values[: len(heights)]
    np.testing.assert_allclose(np.abs(heights), 2e-3 * np.abs(shape / np.abs(shape).max()))
    path = read.run()
    assert float(np.abs(path["displacement"].sel(axis="z")).max()) > 0.0


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ("amplitude = 1e-3", "imperfection: give correlation .* or file"),
        ("amplitude = 1e-3\ncorrelation = 0.1\nmodes = 2", r"imperfection\.modes: is not for a"),
        ('amplitude = 1e-3\nfile = "a.nc"\nseed = 2', r"imperfection\.seed: is not for shapes"),
        ('amplitude = 1e-3\nfile = "a.nc"', r"imperfection\.file = .a\.nc."),
        ('amplitude = "a"\ncorrelation = 0.1', r"imperfection\.amplitude"),
        ("amplitude = -1\ncorrelation = 0.1", r"imperfection\.amplitude = -1"),
        ("correlation = 0.1", r"imperfection\.amplitude: missing"),
        ("amplitude = 1\ncorrelation = 0.1\nsize = 2", r"imperfection\.size"),
    ],
)
def test_refused_tables(tmp_path, table, told):
    with pytest.raises(InputError, match=told):
        fd.read_case(written(tmp_path, f"{CASE}[imperfection]\n{table}\n{PATH}"))
