"""Modes of bars and hinges carry their errors, by comparison with superelements."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, ModelRangeWarning
from foldyn.linear import model_error
from foldyn.linear.modes import points_of
from pairwise import beyond

pytestmark = [
    pytest.mark.usefixtures("compared"),
    pytest.mark.filterwarnings("error::foldyn.errors.ModelRangeWarning"),
]
PAPER = fd.Sheet(3e9, 0.3, 3e-4, density=800.0)
MIURA = fd.patterns.miura((1, 2), 0.03, b=0.03, panel_angle=60, dihedral=100)


def held(preset="plate", pattern=MIURA, **options) -> fd.Case:
    return fd.Case(
        fd.discretize(pattern, PAPER, preset=preset, **options), [fd.Fix(list(pattern.faces[0]))]
    )


def beside(case: fd.Case, **options) -> fd.Case:
    own = {"clamped": case.structure.options.clamped, **options}
    return case.altered(structure=fd.superelements(case.structure.pattern, PAPER, **own))


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("preset", "options"),
    [("n5b8e", {}), *beyond([("plate", {}), ("n5b8e", {"clamped": [(0, 1)]})], 1)],
)
def test_errors_are_those_relative_to_the_best_superelements(preset, options):
    case = held(preset, **options)
    found = fd.modes(case, 4)
    true = fd.modes(beside(case), 4).frequency.values
    np.testing.assert_allclose(found.model_error, found.frequency / true - 1.0, atol=0.02)
    assert "missing_frequencies" not in found.attrs


@pytest.mark.matrix
def test_modes_far_off_and_missing_are_told_in_one_line():
    case = held()
    with pytest.warns(FoldynWarning) as caught:
        found = fd.modes(case, 10)
    (told,) = caught
    assert told.category is ModelRangeWarning
    off = np.abs(found.model_error.values) > model_error.DOUBTFUL
    assert off[6:].any() and not off[:2].any()
    worst = int(np.nanargmax(np.abs(found.model_error))) + 1
    assert f"(mode {worst}: " in str(told.message) and "--model superelements" in str(told.message)
    (lost,) = np.ravel(found.attrs["missing_frequencies"])[:1]
    assert f"{lost:.4g}" in str(told.message)
    true = fd.modes(beside(case), 20).frequency.values
    assert np.abs(true / lost - 1.0).min() < 0.02


def test_rigid_modes_have_no_error():
    found = fd.modes(fd.Case(held("n5b8e").structure), 8)
    assert np.isnan(found.model_error[:6]).all() and (np.abs(found.model_error[6:]) < 0.05).all()


@pytest.mark.matrix
def test_what_is_not_compared_says_so():
    big = fd.patterns.miura((11, 10), 0.03, b=0.03, panel_angle=60, dihedral=100)
    assert "440 panels, more than 200" in fd.modes(held(pattern=big), 1).attrs["not_compared"]
    with pytest.warns(FoldynWarning, match="superlinear"):
        soft = fd.modes(held(fold_law="superlinear"), 1)
    assert "no slope at rest" in soft.attrs["not_compared"]
    case = held("n5b8e")
    state = fd.State(np.zeros(case.structure.nodes.shape))
    for found in (fd.modes(case, 1, check_model=False), fd.modes(case, 1, state=state)):
        assert "model_error" not in found and "not_compared" not in found.attrs
    shell = fd.Case(fd.shell(MIURA, PAPER, divisions=1), case.supports)
    assert "not_compared" not in fd.modes(shell, 1).attrs


@pytest.mark.matrix
@pytest.mark.filterwarnings("error::foldyn.errors.StretchWarning")
def test_responses_hold_up_to_the_first_doubtful_mode():
    case, push = held(), fd.Force([14], (0.0, 0.0, 1.0))
    own = case.altered(damping=fd.Rayleigh(alpha=1.0))
    with pytest.warns(ModelRangeWarning, match="is estimated to hold up to"):
        found = fd.frf(own, push, frequencies=[1.0, 900.0])
    f, error = found.attrs["mode_frequencies"], found.attrs["model_error"]
    good = f[np.abs(error) <= model_error.DOUBTFUL]
    assert good[0] < found.attrs["holds_to"] < 900.0
    low = fd.frf(own, push, frequencies=[1.0, float(f[0])])
    assert low.attrs["holds_to"] == low.frequency[-1]


@pytest.mark.matrix
def test_modes_that_resemble_nothing_have_no_error():
    case = held("n5b8e")
    superelements = beside(case, level=1)
    found = fd.modes(superelements, 3)
    points = points_of(superelements, found)
    shape = np.concatenate([found["shape"], found["between_shape"]], axis=1)
    turned = np.roll(fd.modes(case, 3)["shape"].values, 1, axis=1)
    own = model_error.judged(
        case, found.frequency.values, turned, points, found.frequency.values, shape
    )
    assert np.isnan(own.error).any() and len(own.lost) > 0
    assert "resemble" in own.doubts(np.ones(3, bool)) and "missing" in own.doubts(np.ones(3, bool))


@pytest.mark.matrix
def test_bands_far_off_are_told():
    """Those of the gallery's cell, whose gap lies near 500 Hz and with the model near 330 Hz."""
    sheet = fd.Sheet(3e9, 0.3, thickness=2.4e-4, density=1200.0, length_scale_ratio=10.0)
    pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=60)
    cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet, preset="plate")))
    with pytest.warns(ModelRangeWarning, match=r"bands .*differ by more than 5% from superel"):
        found = fd.bands(cell, cell.path("G-X", 9), count=6)
    error = found["model_error"].values
    chosen = np.flatnonzero(np.isfinite(error).any(axis=1))
    assert len(chosen) == 8
    fine = cell.with_case(fd.Case(fd.superelements(pattern, sheet, level=3)))
    some = chosen[-3:]
    true = fd.bands(fine, found["wave_vector"].values[some], count=6, track=False)
    own = found["frequency"].values[some]
    rank = own.argsort(axis=1)
    ratio = np.take_along_axis(own, rank, axis=1) / true["frequency"].values
    stated = 1.0 + np.take_along_axis(error[some], rank, axis=1)
    np.testing.assert_allclose(stated, ratio, rtol=0.02)
    assert ratio.min() < 0.7  # the gap is told of
    assert "model_error" not in fd.bands(cell, [[0.1, 0.0]], count=1, check_model=False)


def test_of_rigid_panels_there_are_few_modes_to_compare():
    case = held(rigid="all")
    assert abs(fd.modes(case, 1).model_error.item()) < 1e-3
    for each in (case, beside(case, rigid="all")):
        found = fd.frf(each, fd.Force([4], (0.0, 0.0, 1.0)), frequencies=[1.0, 2.0])
        assert found.attrs["holds_to"] == 2.0
