"""A path that loses stability says so, once, and its facts always."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from trusses import VonMises, snapped

import foldyn as fd
from foldyn.errors import ComputationError, FoldynWarning, StretchWarning
from foldyn.statics import Point, Settings, trace
from foldyn.statics.recording import MOST_LISTED, stability_facts, stability_warning

STEEP = VonMises(h=2.0)  # gives way sideways at 2530 N, before its limit point
SHALLOW = VonMises()


def strut(kind="force"):
    """Two flat panels in a row, pressed together: they buckle."""
    corners = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [0, 1, 0]]
    pattern = fd.Pattern(corners, [[0, 1, 4, 5], [1, 2, 3, 4]])
    laws = {"crease_stiffness": 0.1, "fold_law": "linear", "bend_law": "linear"}
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01), preset="herkal", **laws)
    supports = [fd.Fix([0, 5], "xyz"), fd.Fix([2, 3], "yz")]
    if kind == "force":
        return fd.Case(s, supports, [fd.Force([2, 3], (-1.0, 0.0, 0.0))])
    return fd.Case(s, [*supports, fd.Impose([2, 3], "x", -1e-3)])


def told(case, *arguments, of=trace, **given):
    """The path and what was said of it."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", FoldynWarning)
        warnings.simplefilter("ignore", StretchWarning)
        path = of(case, *arguments, **given)
    return path, [str(one.message) for one in found]


@pytest.mark.parametrize("kind", ["force", "displacement"])
def test_newton_past_a_buckling_load(kind):
    """Every point is regular, and the eigenvalues tell all the same."""
    path, said = told(strut(kind), "newton", steps=10)
    counts = path.negative_eigenvalues.values
    assert set(path.point.values) == {"regular"} and counts[0] == 0 < counts[-1]
    first = int(np.argmax(counts > 0))
    factors = path.load_factor.values
    assert len(said) == 1
    where = f"is 0 at the load factor {factors[first - 1]:.4g}, {counts[first]} at"
    assert f"{where} {factors[first]:.4g}" in said[0]
    assert "method 'arc_length' locates the point" in said[0]
    assert path.attrs["unstable_points"] == (counts > 0).sum()
    assert path.attrs["stability_changes"].startswith(said[0].split("eigenvalues is ")[1][:20])


def test_a_located_bifurcation_is_told_once():
    path, said = told(STEEP.case(free="xz"), of=snapped, first_step=100.0, steps=60)
    assert len(said) == 1
    assert "is 0 up to the load factor 2530 (bifurcation), then 1." in said[0]
    changes = path.attrs["stability_changes"].split("; ")
    assert len(changes) == 4 and "(limit point), then 2" in changes[1]


def test_a_limit_point_that_was_asked_for_is_marked_and_not_warned_of():
    options = {"first_step": 0.2 * SHALLOW.limit, "steps": 20}
    path, said = told(SHALLOW.case(), "arc_length", **options)
    assert not said and "limit" in path.point.values
    assert path.attrs["unstable_points"] == (path.negative_eigenvalues.values > 0).sum() > 0
    assert "(limit point)" in path.attrs["stability_changes"]
    _, said = told(SHALLOW.case(), "arc_length", **options, settings=Settings(locate=False))
    assert len(said) == 1  # nothing marks it


def test_stable_paths_and_uncounted_ones():
    stable = told(STEEP.case(free="xz"), load_factors=[0.0, 1000.0, 2000.0])
    uncounted = told(strut(), steps=10, settings=Settings(stability=False))
    for (path, said), points, changes in (
        (stable, 0, "none"), (uncounted, -1, "not counted")
    ):  # fmt: skip
        assert not said and path.attrs["unstable_points"] == points
        assert path.attrs["stability_changes"] == changes


def test_a_path_that_stops_tells_it_too():
    with pytest.raises(ComputationError) as caught, pytest.warns(FoldynWarning, match="loses"):
        trace(STEEP.case(free="xz"), load_factors=[0.0, 2000.0, 2600.0, 1e5])
    assert caught.value.partial.attrs["unstable_points"] == 1


def test_a_path_that_begins_unstable_or_regains_stability():
    def points(*counts):
        return [Point(np.zeros(3), 0.1 * k, 1, 0.0, n) for k, n in enumerate(counts)]

    assert "is 2 from the start" in stability_warning(points(2, 2), True, False)
    assert not stability_warning(points(2, 2), False, False)  # the state was given so
    assert not stability_warning(points(1, 0), False, False)
    many = stability_warning(points(0, 1, 0, 3), False, False)
    assert "is 0 at the load factor 0, 1 at 0.1, and at 1 more places (up to 3)" in many
    long = stability_facts(points(*[0, 1] * 40), False)["stability_changes"]
    assert long.count(";") == MOST_LISTED and long.endswith("and 59 more")
