"""Large motions and stretched panels of the fidelity study: how they start, what is stored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import ComputationError
from foldyn.linear.reference import elastic as modes_of
from foldyn.linear.reference import modes_at_rest
from pairwise import beyond
from verification.fidelity import motions
from verification.fidelity.cases import documented
from verification.fidelity.motion_results import (
    SHELL,
    STORED,
    Run,
    beside,
    compared,
    grouped,
    read,
    size,
    summaries,
    told,
    untold,
    write,
)
from verification.fidelity.motions import (
    Motion,
    Release,
    Started,
    fold_of,
    released,
    runs,
    structures,
    vertex_mass,
)
from verification.fidelity.statics import LAWS
from verification.fidelity.stretching import pressed, sheet, stiffness, tower


def elastic(case, structure, count):
    """Its lowest elastic frequencies and shapes."""
    return modes_of(modes_at_rest(case.case(structure), count), count)


DOCS = Path(__file__).resolve().parents[2] / "docs"
TRUE = Run("c", "20", SHELL, 0.99, 0.9, (1.0, 1.02, 0.98, 1.0), (1.0,) * 9)


@pytest.mark.parametrize("name", ["miura", "eggbox", "simple_fold"])
def test_folds_are_dihedrals_at_rest_and_when_turned(name):
    pattern = fd.patterns.GENERATORS[name](dihedral=70)
    rest = np.zeros_like(pattern.vertices)
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = pattern.vertices @ turn.T - pattern.vertices
    for crease, dihedral in enumerate(pattern.dihedrals):
        found = fold_of(pattern, crease, np.stack([rest, moved]))
        np.testing.assert_allclose(found, dihedral - np.pi, atol=1e-12)


def test_folds_of_another_dihedral():
    """A simple fold of 60 degrees opened to 100: its fold changes by 40."""
    one, other = (fd.patterns.simple_fold(dihedral=d) for d in (60, 100))
    change = fold_of(one, 0, other.vertices - one.vertices) - fold_of(one, 0, 0 * one.vertices)
    assert abs(np.degrees(change)) == pytest.approx(40.0)


def test_vertices_share_their_panels():
    pattern = fd.patterns.miura(a=1.0, b=2.0, panel_angle=30)
    weight = vertex_mass(pattern)
    assert weight.sum() == pytest.approx(4.0)  # four panels of 1 m2
    assert weight[4] == pytest.approx(1.0)  # the middle vertex has a quarter of each


@pytest.fixture(scope="module")
def fold():
    case = documented()[1]  # one panel held; a dihedral of 60 degrees
    made = structures(case.pattern(), case.sheet, 4)
    return case, made, Release.of(case, made[SHELL], elastic(case, made[SHELL], 1)[1][0])


@pytest.mark.matrix
def test_all_models_are_held_at_the_same_fold(fold):
    case, made, release = fold
    wanted = np.radians([5.0, 30.0])
    for structure in made.values():
        held = release.held(structure, wanted)
        np.testing.assert_allclose([h.fold for h in held], wanted, rtol=1e-3)
        np.testing.assert_allclose([release.fold(h.displacement) for h in held], wanted, rtol=1e-3)
        opened = fold_of(case.pattern(), release.crease, held[1].displacement)
        assert np.degrees(np.pi - abs(opened)) == pytest.approx(90.0, abs=0.1)  # 60 and 30


def test_the_loads_are_scaled_by_the_linear_shell(fold):
    """A thousandth of a degree is reached under the forces of a radian times as much."""
    _, made, release = fold
    small = np.radians(1e-3)
    (held,) = release.held(made[SHELL], [small])
    assert held.fold == pytest.approx(small, rel=1e-3)
    assert release.largest(made[SHELL], small) >= small


@pytest.mark.matrix
def test_an_amplitude_beyond_the_path_is_left_out():
    case = documented()[39]  # an eggbox that gives way at 12 degrees
    made = structures(case.pattern(), case.sheet, 4)
    release = Release.of(case, made[SHELL], elastic(case, made[SHELL], 1)[1][0])
    assert np.degrees(release.largest(made[SHELL], np.radians(50.0))) < 20.0
    within = motions._reachable(release, made[SHELL], (5.0, 20.0, 50.0))
    assert within[0] == 5.0
    assert 5.0 < within[-1] < 15.0
    held = release.held(made[SHELL], np.radians([*within, 40.0]))
    assert len(held) < len(within) + 1


@pytest.mark.matrix
def test_stored_results_are_what_the_code_gives():
    case = documented()[1]
    again = runs(next(iter(released(case))))
    stored = grouped(read())[case.name, "5"]
    assert [run.model for run in again] == [SHELL, *LAWS] == list(stored)
    for run in again:
        kept = stored[run.model]
        assert run.mesh == pytest.approx(kept.mesh, abs=1e-4)
        assert run.share == pytest.approx(kept.share, abs=2e-3)
        np.testing.assert_allclose(run.period, kept.period, rtol=2e-4)
        np.testing.assert_allclose(run.alike, kept.alike, atol=2e-3)


@pytest.mark.matrix
def test_small_motions_have_the_linear_frequency():
    """A degree of fold: the shell's period is that of its first mode to the error of the step."""
    case = documented()[1]
    started = next(iter(released(case, (1.0,), 4)))
    motion = started.motion[SHELL]()
    found = motions.cycles(motion.coordinate, motion.dt, *started.band, released=True)
    shell = structures(case.pattern(), case.sheet, 4)[SHELL]
    frequency = elastic(case, shell, 1)[0][0]
    np.testing.assert_allclose(found.period, 1.0 / frequency, rtol=2e-3)


def test_enough_runs():
    """At least twelve cases, the paper's four pulses, three amplitudes, all models."""
    starts = grouped(read())
    assert len({case for case, start in starts if start != "pulse"}) >= 12
    assert {case for case, start in starts if start == "pulse"} == {f"case{k}" for k in range(1, 5)}
    assert {"5", "20", "50"} <= {start for _, start in starts}
    assert all(list(every)[1:] == list(LAWS) for every in starts.values() if len(every) > 1)
    assert len(untold(read())) + len(next(iter(compared(read()).values()))) == len(starts)


def test_a_period_is_told_by_enough_regular_cycles():
    assert told(TRUE)
    assert not told(TRUE._replace(period=TRUE.period[:2]))
    assert not told(TRUE._replace(share=0.3))
    assert not told(TRUE._replace(period=(1.0, 1.3, 0.8, 1.1)))


def test_a_run_beside_the_shell():
    """Periods of 0.99 times the mesh's are right; a run without cycles is infinitely wrong."""
    own = TRUE._replace(model="m", period=(1.04, 1.04, 1.04), alike=(0.9, 0.8, 1.0))
    found = beside(TRUE, own)
    assert found.error == pytest.approx(1.04 / (0.99 * 1.0) - 1.0)
    assert found.largest == pytest.approx(1.04 / (0.99 * 0.98) - 1.0)
    assert found.mac == pytest.approx(0.9)
    lost = beside(TRUE, Run("c", "20", "m", 0.99, note="unstable"))
    assert lost.error == np.inf
    assert lost.mac == 0.0
    told_of = summaries([TRUE, own]).splitlines()
    (line,) = [line for line in told_of if "all" in line]
    assert "| all | m | 1 | 0 % | 5.05 % |" in line


def test_sizes():
    assert [size(start) for start in ("5", "4", "20", "31", "50")] == [
        "to 5 degrees", "to 5 degrees", "to 20 degrees", "to 50 degrees", "to 50 degrees",
    ]  # fmt: skip


def test_runs_survive_writing_and_reading(tmp_path):
    write(read(), tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_text("utf-8") == STORED.read_text("utf-8")


def test_motions_that_fail_are_told():
    """A model without a motion has a note; without the shell there is nothing to compare."""
    t = np.arange(0.0, 8.0, 0.01)
    pattern = fd.patterns.simple_fold()
    vertices = np.cos(2 * np.pi * t)[:, None, None] * np.ones((1, 6, 3))

    def good():
        return Motion(0.01, np.cos(2 * np.pi * t), vertices)

    def bad():
        raise ComputationError("the fold is not reached: at all")

    def started(**motion):
        return Started("c", "5", pattern, 1.0, (0.4, 2.5), True, motion)

    first, second, third = runs(started(shell=good, a=bad, b=good))
    assert (first.note, second.note) == ("", "the fold is not reached")
    assert third.alike == pytest.approx((1.0,) * len(third.alike))
    assert [run.note for run in runs(started(shell=bad, b=good))] == ["the fold is not reached"]


@pytest.mark.matrix
def test_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(motions, "AMPLITUDES", (5.0,))
    one = next(iter(released(documented()[1], (2.0,), 2)))
    monkeypatch.setattr(motions, "every", lambda cases, studies: [one])
    assert motions.main(["--out", str(tmp_path)]) == 0
    told_of = capsys.readouterr()
    assert "| all | plate, linear | 1 |" in told_of.out
    assert len(read(tmp_path / "motions.csv")) == 5  # the shell and four models


@pytest.mark.matrix
def test_why_panels_harden():
    """A panel bowed by its crease stretches its spokes; the shell's bends without stretching.

    Energy of case 1 closed by 40 degrees, over 64 times that at 5 degrees: the shell's law is
    nearly linear, and so is that of panels with spokes of a hundredth of the area.
    """
    case = documented()[0]
    made = structures(case.pattern(), case.sheet, 4)
    release = Release.of(case, made[SHELL], elastic(case, made[SHELL], 1)[1][0])
    closing = replace(release, sense=-release.sense, force=-release.force)
    plate = fd.discretize(case.pattern(), case.sheet, preset="plate", membrane="bars")
    spokes = (plate.bars >= len(case.pattern().vertices)).any(axis=1)
    soft = replace(plate, bar_area=np.where(spokes, 0.01, 1.0) * plate.bar_area)

    def growth(structure):
        small, large = closing.held(structure, np.radians([5.0, 40.0]))
        return structure.energy(large.displacement) / structure.energy(small.displacement) / 64.0

    shell, hard, weak = (growth(s) for s in (made[SHELL], plate, soft))
    assert shell == pytest.approx(1.0, abs=0.02)
    assert hard > 1.08
    assert weak == pytest.approx(1.0, abs=0.04)


@pytest.mark.matrix
@pytest.mark.parametrize(("thickness", "plate", "n5b8e"), [(1e-3, -0.18, -0.22), (3e-4, 0.17, 0.0)])
def test_towers_whose_rims_bow_in_their_plane(thickness, plate, n5b8e):
    """Thick ones are too soft: bows turn the creases, which resist that in the shell alone."""
    found = stiffness(tower(thickness, (8, 12)), "z")
    assert found["plate"][0] == pytest.approx(plate, abs=0.03)
    assert found["n5b8e"][0] == pytest.approx(n5b8e, abs=0.03)
    assert found["plate, bars"][0] > 3.0
    assert found["standard"][0] > 3.0


@pytest.mark.matrix
def test_the_force_at_which_a_tower_snaps():
    """Its error is that of the stiffness, less a few percent."""
    found = pressed(tower(1e-3, (8, 12)), steps=8)
    for model, error in (("plate", -0.13), ("n5b8e", -0.18)):
        assert found[model] == pytest.approx([error] * 2, abs=0.03)
    assert found["plate, bars"].min() > 3.0


@pytest.mark.parametrize("axis", beyond("xyz"))
def test_sheets_between_two_rims(axis):
    found = stiffness(sheet(3, (4, 8)), axis)
    assert 0.0 < found["plate"][0] < 0.15
    assert -0.12 < found["n5b8e"][0] < 0.05
    assert found["plate, bars"][0] > 0.4
