"""The study of waves: the two-dof unit, the rarefaction, sheets, its page and command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from verification.waves import __main__ as command
from verification.waves import kresling, report, sheets
from verification.waves import study as studies
from verification.waves.kresling import SIDES, Unit
from verification.waves.study import Plan, Study

CELLS = 64


def test_the_unit_is_the_truss_of_the_literature():
    """K = n sum over both bars of k g g^T, g the gradients of their lengths by u and phi."""
    unit = replace(Unit(), crease=0.0)
    structure, expected = unit.structure(1), np.zeros((2, 2))
    height, radius, twist = unit.height, unit.radius, np.radians(unit.twist)
    for angle in (twist, twist + 2.0 * np.pi / SIDES):
        length = np.sqrt(height**2 + 2.0 * radius**2 * (1.0 - np.cos(angle)))
        bar = int(np.abs(structure.bar_length - length).argmin())
        stiffness = unit.youngs_modulus * structure.bar_area[bar] / length
        slope = np.array([height, radius**2 * np.sin(angle)]) / length
        expected += SIDES * stiffness * np.outer(slope, slope)
    found = unit.two_dofs
    np.testing.assert_allclose(found.stiffness, expected, rtol=1e-9)
    m = unit.plate_mass + float(structure.mass.sum())
    np.testing.assert_allclose(found.mass, np.diag([m, m * radius**2]), rtol=1e-9, atol=1e-15)


def test_small_waves_between_rigid_plates_are_those_of_the_unit():
    """omega = 2 |sin(kappa/2)| sqrt(eig(M^-1 K)); creases between cells raise the slow band."""
    lines = kresling.dispersion(replace(Unit(), plate_stiffness=3e7), 6)
    assert max(report.deviations(lines, free=True)) < 1e-5
    slow, fast = report.deviations(lines, free=False)
    assert 0.05 < slow < 0.2
    assert fast < 0.01
    np.testing.assert_allclose(lines["bands"][-1], lines["two_dof"][-1], rtol=1e-5)  # at pi


@pytest.fixture(scope="module")
def impacts():
    found = {}
    for size, cells in ((1.0, CELLS), (1e-3, CELLS // 2)):
        plan = replace(studies.FULL, cells=cells)
        start = size * plan.velocity
        found[size] = kresling.impact(plan.unit, cells, start, plan.duration)
    return found


@pytest.mark.matrix
def test_a_rarefaction_overtakes_the_compression(impacts):
    """Abstract of Yasuda et al., Sci. Adv. 5, eaau2835, 2019; not where all is linear."""
    hit = kresling.overtaking(impacts[1.0])
    slow = float(np.asarray(impacts[1.0].attrs["long_waves"])[0])
    assert hit.rarefaction.speed > 1.05 * hit.compression.speed
    assert hit.compression.speed < slow
    assert 25 < hit.cell < 40
    assert hit.share > 0.6
    assert slow < hit.rarefaction.speed < 1.1 * slow
    height, width = hit.rarefaction.peak, hit.rarefaction.width
    for early, late in ((each[20:25].mean(), each[40:45].mean()) for each in (height, width)):
        assert late == pytest.approx(early, rel=0.15)  # it keeps its form
    assert height[20:45].min() > 1.5 * -np.median(hit.compression.peak[20:45])
    small = kresling.overtaking(impacts[1e-3])
    assert (small.rarefaction.arrival > small.compression.arrival)[2:20].all()
    verdict = report.verdict(impacts[1.0], hit)
    assert "What happens agrees with the paper" in verdict
    assert "It keeps its form" in verdict
    assert hit.before < 0.6  # less than the compression where it starts
    assert hit.before < small.before
    assert "does not agree" in report.verdict(impacts[1e-3], small)


@pytest.mark.matrix
def test_impacts_keep_energy_and_momentum(impacts):
    for found in impacts.values():
        assert found.attrs["energy_error"] < 1e-3
        momentum = found["momentum"].values
        np.testing.assert_allclose(momentum, momentum[0], rtol=1e-11)


@pytest.mark.matrix
def test_gaps_of_sheets_depend_on_their_fold_state():
    found = sheets.fold_states("miura", [60.0, 115.0], count=25, grid=8)
    assert found.sizes["band"] == 12
    np.testing.assert_allclose(found["frequency"][:, 0, :3], 0.0, atol=1e-3)  # three from zero
    at, low, high = sheets.widest(found, "along x")
    assert at == 115.0
    lines = found["frequency"].sel(dihedral=at).values
    leg = found["distance"].values <= np.pi + 1e-9
    assert not ((lines[leg] > low) & (lines[leg] < high)).any()
    inside = found["bottom"].sel(direction="all") >= found["bottom"].sel(direction="along x")
    there = np.isfinite(found["bottom"].sel(direction="all"))
    assert bool(inside.values[there.values].all())


@pytest.mark.matrix
def test_the_study_writes_its_page_and_goes_on(tmp_path, monkeypatch, capsys):
    plan = Plan(dihedrals=2, phases=9, cells=16)
    monkeypatch.setattr(command, "QUICK", plan)
    given = ["--quick", "--processes", "1", "--out", str(tmp_path)]
    assert command.main(given) == 0
    assert "0 runs were there" in capsys.readouterr().out
    page = (tmp_path / "report.html").read_text("utf-8")
    for words in ("a coarse run", "two degrees of freedom", "Miura sheet", "eggbox sheet"):
        assert words in page
    assert command.main(given) == 0
    assert "5 runs were there" in capsys.readouterr().out
    study = Study(plan, tmp_path)
    assert study.result("impact") is not None
    assert Study(replace(plan, velocity=1.0), study.folder).result("impact") is None
