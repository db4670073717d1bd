"""Panels that cross at samples of motions and paths: said once, with time and panels, and kept."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import ComputationError, CrossingWarning, PenetrationError
from foldyn.mechanics.crossings import pairs_text
from foldyn.report.album import crossing_panels
from foldyn.results.crossings import crossings_of

PAPER = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0)


def strip(*widths: float, model=fd.discretize, **options):
    """Panels of a strip, folded upwards."""
    x = np.concatenate([[0.0], np.cumsum(widths)])
    points = [(a, b) for a in x for b in (0.0, 0.05)]
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(len(widths))]
    pattern = fd.Pattern(points, faces, ["V"] * (len(widths) - 1))
    return model(pattern, PAPER, fold_law=fd.EnhancedLinear(20, 340), **options)


def folding(structure, angle: float, history=None) -> fd.Case:
    """The middle of three panels is held, both creases are turned to an angle (degrees)."""
    driven = fd.Actuate([0, 1], angle, history)
    return fd.Case(structure, [fd.Fix([2, 3, 4, 5])], [driven], fd.Rayleigh(alpha=20.0))


@pytest.mark.parametrize("model", [fd.discretize, lambda *a, **k: fd.shell(*a, divisions=2, **k)])
def test_flaps_cross_beyond_the_angle_at_which_they_meet(model):
    # flaps and the middle are the sides of a triangle with equal sides: at 60 degrees flaps touch
    case = folding(strip(0.05, 0.05, 0.05, model=model), 40.0)
    factors = np.arange(15) / 14  # steps of 10 degrees
    with pytest.warns(CrossingWarning) as said:
        path = fd.trace(case, load_factors=factors)
    assert [str(one.message) for one in said] == [
        "panels pass through each other: 0 and 2, first at point 13 (load factor 0.928571), and "
        "at 2 of the 15 samples. Nothing keeps them apart: what follows is not what a real sheet "
        "does; give the case contact (docs/results.md#panels-that-cross)"
    ]
    assert path["crossing_panels"].values.tolist() == [[0, 2]]
    assert path["crossing_first"].values.tolist() == [13]  # of 50 degrees
    assert (path.attrs["crossing_looks"], path.attrs["crossing_samples"]) == (15, 2)


@pytest.fixture(scope="module")
def crossed():
    """A motion in which flaps cross, with what was said meanwhile."""
    case = folding(strip(0.05, 0.04, 0.045), 12.0, fd.Ramp(0.25))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        motion = fd.simulate(case, 0.3, method="rk4", interval=2e-3)
    return case, motion, said


@pytest.mark.matrix
def test_a_motion_says_once_which_panels_cross_and_when(crossed):
    _, motion, said = crossed
    assert [one.category for one in said] == [CrossingWarning]
    first = float(motion.time[motion["crossing_first"].values[0]])
    assert f"0 and 2, first at t = {first:.6g} s" in str(said[0].message)
    assert motion["crossing_panels"].values.tolist() == [[0, 2]]
    assert motion.attrs["energy_error"] < 1e-2  # which does not see it


@pytest.mark.matrix
def test_samples_with_crossings_are_those_of_an_independent_library(crossed):
    ipctk = pytest.importorskip("ipctk")
    case, motion, _ = crossed
    s = case.structure
    mesh = ipctk.CollisionMesh(s.nodes, ipctk.edges(s.triangles), s.triangles)
    displacement = motion.displacement.values
    theirs = [k for k, u in enumerate(displacement) if ipctk.has_intersections(mesh, s.nodes + u)]
    assert 10 < len(theirs) < len(displacement) - 10
    assert crossings_of(case, displacement).crossed.tolist() == theirs
    assert motion["crossing_first"].values.tolist() == theirs[:1]


def test_samples_that_are_looked_at_may_be_far_apart(crossed):
    case, motion, _ = crossed
    displacement = motion.displacement.values
    every = crossings_of(case, displacement)
    some = crossings_of(case, displacement, 40)
    assert some.first.tolist() == every.first.tolist()  # those between are looked at then
    assert len(some.looked) < 45 and some.looked[-1] == len(displacement) - 1
    text = some.text("t = 1 s", len(displacement))
    assert f"at {len(some.crossed)} of the {len(some.looked)} samples looked at." in text
    broken = displacement.copy()
    broken[-1, 0] = np.nan
    assert crossings_of(case, broken).crossed.tolist() == every.crossed.tolist()[:-1]


def test_what_was_seen_is_stored_and_shown(crossed, tmp_path):
    _, motion, _ = crossed
    fd.save(motion, tmp_path / "motion.nc")
    again = fd.load(tmp_path / "motion.nc")
    for name in ("crossing_panels", "crossing_first"):
        np.testing.assert_array_equal(again[name], motion[name])
    assert again.attrs["crossing_samples"] == motion.attrs["crossing_samples"] > 0
    (table,) = crossing_panels({"centroid": again})
    first = int(motion["crossing_first"][0])
    assert table.rows == [["centroid", 0, 2, first, float(motion.time[first])]]
    assert not crossing_panels({"centroid": motion.drop_dims("crossing")})


def test_what_crosses_at_rest_is_not_reported():
    points = [(0, 0, 0), (2, 0, 0), (1, 2, 0), (1, -1, -1), (1, 2, 1), (1, -1, 1)]
    pattern = fd.Pattern(points, [(0, 1, 2), (3, 4, 5)], [])
    case = fd.Case(fd.discretize(pattern, PAPER, preset="plate"))
    u = np.zeros((2, 6, 3))
    u[1, 3:, 0] = 5.0  # apart
    assert not len(crossings_of(case, u).crossed)
    assert crossings_of(case, u).looked.tolist() == [0, 1]


def test_the_specimen_crosses_nothing():
    path = fd.read_case(fd.studies.find_case("herkal/specimen")).run()
    assert path.attrs["crossing_samples"] == 0
    assert path.attrs["crossing_looks"] == path.sizes["step"]
    assert "crossing_panels" not in path


def test_many_pairs_are_shortened():
    pairs = np.array([[k, k + 2] for k in range(9)] + [[4, 4]])
    assert pairs_text(pairs).endswith("7 and 9 and 2 more pairs")
    assert pairs_text(pairs[-1:]) == "4 itself"


# ------------------------------------------------------------- panels that meet at their crease


def pushed(method: str, **options):
    """A Kresling tower that is pushed through itself."""
    pattern = fd.patterns.kresling(sides=6, radius=0.04, height=0.06, twist=30)
    push = fd.Force(list(range(6, 12)), (0, 0, -80.0), fd.HalfSine(0.02))
    held = fd.Fix(list(range(6)))
    case = fd.Case(
        fd.discretize(pattern, PAPER, preset="plate"), [held], [push], fd.Rayleigh(alpha=20.0)
    )
    return fd.simulate(case, 0.01, method=method, **options)


@pytest.mark.parametrize("options", [{"interval": 1e-4}, {"dt": 1e-6, "every_steps": 100}])
def test_a_law_that_locks_but_is_overcome_is_no_remedy(options):
    with pytest.raises(PenetrationError, match="locks, but is overcome") as caught:
        pushed("rk4", **options)
    assert "smaller" not in str(caught.value) and "EnhancedLinear" not in str(caught.value)
    assert "crossing_looks" in caught.value.partial.attrs


def test_steps_that_shrink_where_panels_meet_say_so():
    said = r"panels meet about nodes \d+-\d+; the law"
    with pytest.raises(ComputationError, match=said) as caught:
        pushed("dormand_prince", interval=1e-4)
    assert "rk4" not in str(caught.value)


@pytest.mark.filterwarnings("ignore:the energy balance")
def test_where_a_law_that_locks_is_missing_it_is_the_remedy_unless_steps_are_too_large():
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    structure = fd.discretize(pattern, PAPER, fold_law="linear", preset="herkal")
    v = np.zeros(structure.nodes.shape)
    v[[0, 1], 0], v[[4, 5], 0] = 10.0, -10.0
    case, start = fd.Case(structure), fd.State(velocity=v)
    step = fd.critical_step(case)
    for dt, remedy in ((0.5 * step, "fold_law = 'enhanced'"), (1.001 * step, "use a step below")):
        with pytest.raises(PenetrationError, match=remedy):
            fd.simulate(case, 0.5, method="rk4", dt=dt, every_steps=100, initial=start, force=True)
