"""Sweeps of motions by central differences: side by side, equal to one after the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.analyses.motion import MotionAnalysis
from foldyn.errors import InputError
from foldyn.mechanics.lanes import WIDTH
from foldyn.sweeps.batches import MOST, SECONDS, Batches
from foldyn.sweeps.evaluations import Evaluation
from foldyn.sweeps.pool import Here

ROUNDING = 1e-10
"""Of the largest value: what the order of sums may change within some hundred steps."""
MOTION = (
    HELD_MIURA_TEXT
    + """[model]
mass = "circumcenter"
fold_law = "linear"
bend_law = "linear"
[damping]
alpha = 0.2
[[loads]]
nodes = [8]
force = [0, 0, 1e-3]
history = { kind = "half_sine", duration = 0.04 }
[analysis]
kind = "dynamics"
duration = 0.08
method = "central_difference"
[output]
every = 0.002
"""
)
STIFF = {"sheet.youngs_modulus": "1e6:1.4e6:10"}
MEASURED = [
    "displacement[8,z]", "largest_displacement", "largest_displacement[8]", "strain_energy",
    "dissipated", "strain", "peak_frequency[8]", "peak_frequencies[8,z]", "peak_height[8]",
]  # fmt: skip


@pytest.fixture
def case(tmp_path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(MOTION)
    return path


def of(case: Path, vary=None, measures=MEASURED, beside=True, **how):
    with pytest.MonkeyPatch.context() as changed:
        if not beside:
            changed.setattr(MotionAnalysis, "goes_beside", False)
        return fd.sweep(case, vary or STIFF, list(measures), **{"processes": 1, **how})


def whole_motion(result, case) -> np.ndarray:
    """All that a motion holds."""
    names = [name for name in result.data_vars if "time" in result[name].dims]
    facts = [float(result.attrs[name]) for name in ("dt", "steps", "every", "critical_step")]
    scaled = [result[name].values / np.abs(result[name].values).max() for name in names]
    return np.concatenate([*(one.ravel() for one in scaled), facts])


def steps(result, case) -> int:
    return result.attrs["steps"]


def agree(found, wanted, rounding=ROUNDING):
    for name in wanted.data_vars:
        if name in ("seconds", "side_by_side", "case_file", "case"):
            continue
        one, other = found[name].values, wanted[name].values
        if one.dtype.kind != "f":
            np.testing.assert_array_equal(one, other, name)
            continue
        np.testing.assert_array_equal(np.isnan(one), np.isnan(other), name)
        assert np.nanmax(np.abs(one - other)) <= rounding * np.nanmax(np.abs(other)), name


def test_motions_of_unequal_steps_are_those_of_the_motions_alone(case):
    """Every measure, everything that a result holds, and each with its own step."""
    measures = [*MEASURED, whole_motion, steps]
    found, wanted = of(case, measures=measures), of(case, measures=measures, beside=False)
    assert len(set(found["steps"].values.tolist())) > 1
    assert found["side_by_side"].values.tolist() == [WIDTH] * WIDTH + [1] * 2
    assert (wanted["side_by_side"] == 1).all()
    assert (found["failure"] == "").all()
    agree(found, wanted)


def test_kinds_fall_apart_by_themselves(case):
    """Topologies, mass rules, durations and methods in an order that mixes them."""
    vary = {
        "sheet.thickness": [0.01, 0.011, 0.012, 0.013],
        "pattern.cells[0]": [1, 2],
        "analysis.duration": [0.06, 0.08],
        "model.mass": ["circumcenter", "consistent"],
    }
    case.write_text(MOTION.replace('kind = "miura"', 'kind = "miura"\ncells = [1, 1]'))
    measures = ["displacement[3,z]", "strain_energy"]
    found = of(case, vary, measures)
    lumped = found["side_by_side"].sel(mass="circumcenter")
    assert (lumped > 1).sum() >= 16 and lumped.max() <= WIDTH
    assert (found["side_by_side"].sel(mass="consistent") == 1).all()
    assert (found["failure"] == "").all()
    agree(found, of(case, vary, measures, beside=False))


def test_points_that_fail_say_why_as_if_they_were_alone(case):
    """One that is refused, some that become unstable; the others are what they are without."""
    case.write_text(
        MOTION.replace("duration = 0.08", "duration = 0.08\nforce = true\ndt = 5e-4").replace(
            "force = [0, 0, 1e-3]", "force = [0, 0, 1e-2]"
        )
    )
    vary = {
        "pattern.dihedral": [90.0, 500.0],
        "sheet.youngs_modulus": [2e5, 2.5e5, 3e5, 4e5, 1.4e6, 8e7, 1e50],
    }
    found, wanted = (of(case, vary, beside=beside) for beside in (True, False))
    good, bad = found["failure"].values
    assert all("dihedral = 500" in one for one in bad)
    assert good[:4].tolist() == [""] * 4
    assert "jumped by more than pi" in good[5] and "no longer finite" in good[6]
    assert (found["side_by_side"].values[0] == 7).all()
    agree(found, wanted, 1e-6)  # steps near the limit multiply rounding


def test_what_was_computed_is_kept_point_by_point(case, tmp_path):
    """Ctrl-C in the middle of a batch's points: those that are kept are not computed again."""
    seen = []

    def stop(course):
        seen.append(course)
        if course.done == 11:
            raise KeyboardInterrupt

    vary = {"sheet.youngs_modulus": "1e6:1.2e6:20"}
    with pytest.raises(KeyboardInterrupt):
        of(case, vary, folder=tmp_path / "points", progress=stop)
    assert len(list((tmp_path / "points").glob("*.npz"))) == 11
    again = of(case, vary, folder=tmp_path / "points", progress=seen.append)
    assert (seen[-1].done, seen[-1].found, seen[-1].failed) == (20, 11, 0)
    agree(again, of(case, vary, beside=False))
    sides = again["side_by_side"].values
    once_more = of(case, vary, folder=tmp_path / "points")
    np.testing.assert_array_equal(once_more["side_by_side"], sides)  # what is kept says how


@pytest.mark.thorough
def test_processes_compute_batches(case):
    vary = {"sheet.youngs_modulus": "1e6:1.2e6:24"}
    found = of(case, vary, processes=2)
    assert (found["side_by_side"] > 1).sum() >= 16
    agree(found, of(case, vary, beside=False))


def test_other_analyses_are_alone(case):
    case.write_text(MOTION.replace("central_difference", "rk4"))
    assert (of(case, measures=["strain_energy"])["side_by_side"] == 1).all()


def batches(most=MOST, count=2):
    pool = Here(lambda batch: [Evaluation(seconds=0.1) for _ in batch])
    pool.count = count
    return Batches(pool, most)


def test_batches_are_large_where_points_are_quick():
    made = batches()
    assert made.size(1000) == WIDTH  # nothing is known yet
    made.each(range(WIDTH), lambda point, found: None)
    assert made.size(1000) == MOST
    assert made.size(100) == 24  # so that both processes get two more
    assert (made.size(9), made.size(4), made.size(1)) == (5, 2, 1)
    made._seconds = 2.0 * SECONDS * made._count  # slow points: what a kill may cost counts
    assert made.size(1000) == WIDTH
    assert batches(most=1).size(1000) == 1


class Ending:
    """A pool whose process ends with every batch that holds a certain point."""

    count = 1

    def each(self, items, keep, lost=None, first=False):
        for batch in items:
            bad = 13 in batch
            keep(batch, lost(batch, "ended") if bad else [Evaluation() for _ in batch])


def test_a_point_that_ends_its_process_is_found_among_its_batch():
    found = {}
    lost = lambda point, reason: Evaluation(failure=reason, lasting=False)  # noqa: E731
    Batches(Ending()).each(range(20), found.__setitem__, lost)
    assert sorted(found) == list(range(20))
    assert [point for point, one in found.items() if one.failure] == [13]


def test_an_unknown_measure_is_refused_as_before(case):
    with pytest.raises(InputError, match="did you mean"):
        of(case, measures=["strain_enrgy"])
