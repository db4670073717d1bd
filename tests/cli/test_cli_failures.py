"""Status 1: a computation that fails leaves what was computed, and names it."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_FOLD_TEXT
from foldyn.dynamics import Motion

# a fold whose creases do not lock, pulled shut: panel passes through panel at 0.28 s
SHUT = f"""{HELD_FOLD_TEXT}[model]
fold_law = "linear"
[[loads]]
nodes = [0, 1]
force = [0.1, 0, 0]
[analysis]
kind = "dynamics"
duration = 2.0
[output]
interval = 0.01
"""
KEPT = "foldyn: kept what was computed: "


def check_partial(file: str, duration: float) -> None:
    """The motion until the failure is there, shorter, finite, and says why it stopped."""
    result = fd.load(file)
    assert result.sizes["time"] >= 1
    assert float(result.time[-1]) < duration
    for name in ("displacement", "velocity", "kinetic", "work"):
        assert np.isfinite(result[name]).all()
    assert result.attrs["stopped_because"]
    assert len(fd.case_of(result).structure.nodes) == result.sizes["node"]


@pytest.mark.matrix
@pytest.mark.parametrize("factor", [1.2, 1.5, 10.0])
def test_a_forced_step_far_above_the_critical_one(workplace, edited, factor) -> None:
    step = f"analysis.dt = {factor * 8.73e-4}; analysis.force = true"  # critical: 8.73e-4 s
    text = edited(f"{step}; analysis.duration = 5.0; output.interval =; output.every_steps = 1")
    reason = workplace.run(text).failure("case-results/result.nc")
    assert reason.startswith("foldyn: case.toml: ") and "step" in reason
    check_partial("case-results/result.nc", 5.0)


@pytest.mark.matrix
def test_panel_through_panel(workplace) -> None:
    workplace.write(SHUT)
    failed = workplace.call("run", "case.toml")
    assert failed.new == ["case-results", "case-results/result.nc"]  # no figures
    reason = failed.failure("case-results/result.nc")
    assert "panel passed through panel: the dihedral about nodes 2-3" in reason
    assert "EnhancedLinear" in reason  # the remedy
    check_partial("case-results/result.nc", 2.0)
    result = fd.load("case-results/result.nc")
    assert float(result.time[-1]) > 0.2
    assert result.attrs["stopped_because"] in reason
    folds, _ = fd.case_of(result).structure.dihedrals(result.displacement.to_numpy()[-1])
    assert np.degrees(folds[0]) > 300.0  # the mountain (300 degrees at rest) was closing


@pytest.mark.matrix
def test_rules_that_are_done_are_kept_beside_the_one_that_fails(workplace, edited) -> None:
    # 7e-4 s is below the critical step of panel and beyond the stability limit of consistent
    step = (
        "analysis.dt = 7e-4; analysis.force = true; analysis.duration = 1.0; output.interval =; "
        "output.every_steps = 1"
    )
    text = edited(f'model.mass = ["panel", "consistent", "centroid"]; {step}')
    files = [f"case-results/result-{rule}.nc" for rule in ("panel", "consistent")]
    reason = workplace.run(text).failure(*files)
    assert reason.startswith('foldyn: case.toml: mass = "consistent": ')
    assert float(fd.load(files[0]).time[-1]) == pytest.approx(1.0, abs=7e-4)
    check_partial(files[1], 1.0)


def test_an_interrupted_list_keeps_what_was_done(workplace, edited, monkeypatch) -> None:
    run = Motion.run

    def interrupted(self, progress=None, keeping=None):
        if self.case.structure.options.mass == "centroid":
            raise KeyboardInterrupt
        return run(self, progress, keeping)

    monkeypatch.setattr(Motion, "run", interrupted)
    stopped = workplace.run(edited('model.mass = ["panel", "centroid"]'))
    kept = KEPT + "case-results/result-panel.nc"
    assert (stopped.status, stopped.err) == (130, f"foldyn: interrupted\n{kept}\n")
    assert stopped.new == ["case-results", "case-results/result-panel.nc"]
