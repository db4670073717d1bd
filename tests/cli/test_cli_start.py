"""`foldyn run` on case files that do not start from rest."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd

FREE = ('[[supports]]\nnodes = [0, 1, 2]\naxes = "xyz"\n', "")
UNLOADED = (
    "[[loads]]\nnodes = [7]\nforce = [0.01, 0, 0]\n"
    'history = { kind = "half_sine", duration = 0.05 }\n',
    "",
)
STEP = ("duration = 0.1", "duration = 0.1\ndt = 2.5e-4")


def start(text: str) -> tuple[str, str]:
    """Edit that gives the case file its table [initial]."""
    return "[analysis]", f"[initial]\n{text}\n[analysis]"


@pytest.fixture
def first(workplace, edited) -> fd.Structure:
    """A free cell that tumbles, in first-results/result.nc."""
    workplace.write(edited(FREE, UNLOADED, STEP, start("spin = [3, -2, 5]")), "first.toml")
    done = workplace.call("run", "first.toml", "--no-figures")
    assert (done.status, done.err) == (0, "")
    return fd.case_of(fd.load("first-results/result.nc")).structure


def test_a_rigid_start_is_the_first_sample(first) -> None:
    motion = fd.load("first-results/result.nc").isel(time=0)
    assert not motion.displacement.any()
    mass = first.mass.sum(axis=1)
    arm = first.nodes - mass @ first.nodes / mass.sum()
    np.testing.assert_allclose(motion.velocity, np.cross([3, -2, 5], arm), rtol=1e-12, atol=1e-14)


def test_a_motion_goes_on_from_a_stored_one(workplace, edited, first) -> None:
    text = edited(FREE, UNLOADED, STEP, start('file = "first-results/result.nc"\nat = 4'))
    done = workplace.run(text)
    assert (done.status, done.err) == (0, "")
    one, other = fd.load("first-results/result.nc"), fd.load("case-results/result.nc")
    for name in ("displacement", "velocity"):
        np.testing.assert_array_equal(other[name][0], one[name][4])
        largest = float(np.abs(one[name]).max())
        np.testing.assert_allclose(other[name][6], one[name][10], rtol=0, atol=1e-12 * largest)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ('file = "none.nc"', 'initial.file = "none.nc": none.nc: there is no such file'),
        ('file = "case.toml"', 'initial.file = "case.toml": case.toml: is not a Foldyn result'),
        (
            'file = "first-results/result.nc"\nat = 11',
            "initial.at = 11: the result has samples 0 to 10",
        ),
        (
            "velocity = [0, 0, 1]",
            "initial: velocity = [0.0, 0.0, 1.0]: moves node 0 along z with 1",
        ),
    ],
)
def test_starts_that_cannot_be(workplace, edited, first, lines, message) -> None:
    bad = workplace.run(edited(start(lines)))
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    (line,) = bad.err.splitlines()
    assert line.startswith(f"foldyn: case.toml: {message}"), line


def test_a_start_from_another_structure(workplace, edited, first) -> None:
    cells = ("cells = [1, 1]", "cells = [1, 2]")
    bad = workplace.run(edited(cells, start('file = "first-results/result.nc"')))
    assert (bad.status, bad.new) == (2, [])
    assert 'initial.file = "first-results/result.nc": holds a motion of 13 nodes, but' in bad.err
    assert "this structure has 23; give a result of the same pattern and model" in bad.err
