"""Models of bars and hinges beyond their range: that is told, on the wrong side of each limit."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import ModelRangeWarning
from foldyn.structures.beyond_range import plate_frequency, range_of
from foldyn.structures.stretching import most

CARD = fd.Sheet(4e9, 0.3, 4e-4, density=800.0)
FLAP = fd.patterns.simple_fold(dihedral=80)
MIURA = fd.patterns.miura(cells=(1, 1), a=0.05, b=0.045, panel_angle=65, dihedral=100)


def told(make) -> list[str]:
    """What is said of the range of a model, at the user's line."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        make()
    found = [one for one in caught if one.category is ModelRangeWarning]
    assert {one.filename for one in found} <= {__file__}
    return [str(one.message) for one in found]


def strip(panels: int, width: float) -> fd.Pattern:
    """A flat strip of length 1 m along y."""
    rows = panels + 1
    vertices = [(x, k / panels) for k in range(rows) for x in (0.0, width)]
    faces = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(panels)]
    return fd.Pattern(vertices, faces, {(2 * k, 2 * k + 1): "U" for k in range(1, panels)})


def angle_section(fold: float) -> fd.Pattern:
    """Two legs that are welded along their fold (degrees, 0 of a plate)."""
    turn = np.radians(fold)
    leg = np.array([[0.3, 0.0], [0.0, 0.0], [-0.3 * np.cos(turn), 0.3 * np.sin(turn)]])
    vertices = [(0.4 * k, *place) for k in range(2) for place in leg]
    faces = [(0, 3, 4, 1), (1, 4, 5, 2)]
    return fd.welded(fd.Pattern(vertices, faces, {(1, 4): "F"}), join=False)


def pinned(structure) -> float:
    return float(fd.modes(fd.Case(structure, [fd.Fix("ymin or ymax")]), 1).frequency.values[0])


@pytest.mark.matrix
def test_strips_with_stiff_creases():
    """A pinned strip with rigid creases is a beam: told where its frequency is off."""
    metal = fd.Sheet(7e10, 0.0, 0.008, density=2700.0)
    modulus = metal.bending_modulus
    exact = np.pi / 2.0 * np.sqrt(modulus / (2700.0 * 0.008))
    for width, preset, loud in ((0.08, "plate", True), (0.6, "plate", True), (0.2, "n5b8e", False)):
        pattern, stiff = strip(5, width), 2.9 * modulus / 0.2
        make = lambda p=pattern, k=stiff, m=preset: fd.discretize(  # noqa: E731
            p, metal, preset=m, crease_stiffness=k
        )
        assert len(told(make)) == loud
        made = make()
        in_series = exact / np.sqrt(1.0 + modulus / (stiff * 0.2))  # creases smeared out
        assert (abs(pinned(made) / in_series - 1.0) > 0.08) == loud
    soft = 0.29 * modulus / 0.2
    assert (
        told(lambda: fd.discretize(strip(5, 0.6), metal, crease_stiffness=soft, preset="plate"))
        == []
    )
    square = strip(5, 0.2)
    assert (
        told(lambda: fd.discretize(square, metal, crease_stiffness=10.0 * soft, preset="plate"))
        == []
    )
    (text,) = told(
        lambda: fd.discretize(strip(5, 0.6), metal, crease_stiffness=1.1 * soft, preset="plate")
    )
    assert '--model superelements) in linear analyses, else preset = "n5b8e" (docs' in text


@pytest.mark.parametrize("preset", ["plate", "n5b8e"])
def test_stiff_creases(preset):
    width = float(MIURA.face_areas.max() / 0.045)  # beside the shorter edges
    whole = CARD.bending_modulus / width

    def made(times):
        return fd.discretize(MIURA, CARD, preset=preset, crease_stiffness=times * whole)

    assert told(lambda: made(2.9)) == []
    (text,) = told(lambda: made(3.1))
    assert "is 3.1 times as stiff as its panels" in text and "preset" not in text
    assert (
        told(
            lambda: fd.discretize(
                MIURA, CARD, crease_stiffness=9 * whole, rigid="all", preset="plate"
            )
        )
        == []
    )
    assert told(lambda: fd.shell(MIURA, CARD, divisions=2, crease_stiffness=9.0 * whole)) == []
    herkal = {"preset": "herkal", "crease_stiffness": 9.0 * whole}
    assert told(lambda: fd.discretize(MIURA, CARD, **herkal)) == []


def test_skew_panels():
    for angle, loud in ((32.5, True), (33.5, False)):
        pattern = fd.patterns.miura(panel_angle=angle, dihedral=110)
        sheet = fd.Sheet(4e9, 0.3, 0.005)
        assert len(told(lambda p=pattern, s=sheet: fd.discretize(p, s, preset="plate"))) == loud
        assert told(lambda p=pattern, s=sheet: fd.discretize(p, s, preset="n5b8e")) == []


@pytest.mark.matrix
def test_limits_themselves_are_within_range_whatever_rounding_says():
    for dihedral in (100, 115, 125, 140):
        skew = fd.patterns.miura(panel_angle=33, dihedral=dihedral)
        assert (
            told(lambda p=skew: fd.discretize(p, fd.Sheet(4e9, 0.3, 0.005), preset="plate")) == []
        )
    for ratio in (0.1, 0.2, 0.35, 0.4):
        foam = fd.Sheet(3e7, ratio, 4e-3)
        for width in (0.03, 0.05, 0.07):
            flap = fd.patterns.simple_fold(a=width, b=0.1, dihedral=120)
            stiff = 3.0 * foam.bending_modulus / width
            assert (
                told(
                    lambda p=flap, s=foam, k=stiff: fd.discretize(
                        p, s, crease_stiffness=k, preset="plate"
                    )
                )
                == []
            )


@pytest.mark.parametrize(("fold", "sine"), [(90.0, 1.0), (30.0, 0.5)])
def test_folded_welds(fold, sine):
    """Told of a thickness over length and sine of the fold beyond 0.05; nothing of flat welds."""
    for share, loud in ((0.048, False), (0.052, True)):
        sheet = fd.Sheet(4e9, 0.3, share * 0.4 * sine)
        assert len(told(lambda s=sheet: fd.discretize(angle_section(fold), s))) == loud
    assert told(lambda: fd.discretize(angle_section(0.0), sheet)) == []


def test_nearly_flat_creases():
    sheet = fd.Sheet(4e9, 0.3, 0.01)
    for sine, loud in ((0.01 / 0.16, True), (0.01 / 0.14, False)):
        fold = 180.0 - np.degrees(np.arcsin(sine))
        pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=fold)
        assert len(told(lambda p=pattern: fd.discretize(p, sheet, preset="plate"))) == loud
        assert told(lambda p=pattern: fd.discretize(p, sheet, preset="n5b8e")) == []
    # flat creases do bow
    assert told(lambda: fd.discretize(strip(4, 0.25), sheet, preset="plate")) == []


def test_clamped_edges():
    few = fd.patterns.miura(cells=(2, 2))
    more = fd.patterns.miura(cells=(5, 1))
    sheet = fd.Sheet(4e9, 0.3, 0.005)
    assert (
        "clamped edges"
        in told(lambda: fd.discretize(few, sheet, clamped="xmin", preset="plate"))[0]
    )
    assert told(lambda: fd.discretize(FLAP, sheet, clamped="xmin", preset="n5b8e")) == []
    assert told(lambda: fd.discretize(more, sheet, clamped="xmin", preset="plate")) == []


def test_the_range_of_models():
    """Shares of the plate frequency, of the panels that bend; none of shells and plain bars."""
    plate = plate_frequency(MIURA, CARD)
    square = 13.47 / (2 * np.pi) * np.sqrt(CARD.bending_modulus / (800.0 * 4e-4)) / 0.05**2
    assert plate == pytest.approx(square)
    for preset, share in (("plate", 0.6), ("herkal", 0.6), ("n5b8e", 0.8)):
        made = fd.discretize(MIURA, CARD, preset=preset)
        assert range_of(made) == pytest.approx((share * plate, share))
    thin = [fd.PanelSheet([3], thickness=2e-4)]
    other = fd.Sheet(4e9, 0.3, 4e-4, density=800.0, panels=thin)
    assert range_of(fd.discretize(MIURA, other, preset="plate"))[0] == pytest.approx(0.3 * plate)
    assert range_of(fd.discretize(MIURA, other, rigid=[3], preset="plate"))[0] == pytest.approx(
        0.6 * plate
    )
    assert range_of(fd.discretize(MIURA, CARD, rigid="all", preset="plate"))[0] == np.inf
    assert range_of(fd.shell(MIURA, CARD, divisions=2))[0] == np.inf
    s = fd.discretize(MIURA, CARD, preset="plate")
    assert range_of(fd.Structure(s.nodes, s.bars, s.bar_area, s.sheet))[0] == np.inf


@pytest.mark.matrix
def test_modes_above_the_range():
    """Those of a unit: the panels' own begin where the models have none."""
    for preset, share in (("plate", 0.6), ("n5b8e", 0.8)):
        case = fd.Case(fd.discretize(MIURA, CARD, preset=preset))
        found = fd.modes(case, 14).frequency.values
        inside = int((found <= share * plate_frequency(MIURA, CARD)).sum())
        assert 6 < inside < 14
        assert told(lambda c=case, n=inside: fd.modes(c, n)) == []
        (text,) = told(lambda c=case: fd.modes(c, 14))
        assert text.startswith(f"modes {inside + 1} to 14 lie above ")
        assert "--model superelements), or the shell (docs" in text
        assert told(lambda c=case, n=inside: fd.modes(c, n + 1))[0].startswith("mode ")
    shell = fd.Case(fd.shell(MIURA, CARD, divisions=2, mass="consistent"))
    assert told(lambda: fd.modes(shell, 14)) == []


@pytest.mark.matrix
def test_responses_and_bands_above_the_range():
    structure, limit = (
        fd.discretize(MIURA, CARD, preset="plate"),
        0.6 * plate_frequency(MIURA, CARD),
    )
    held, push = fd.Case(structure, [fd.Fix("xmin")]), fd.Force([6], (0.0, 0.0, 1.0))
    assert told(lambda: fd.frf(held, push, frequencies=np.linspace(0.2, 0.99, 5) * limit)) == []
    (text,) = told(lambda: fd.frf(held, push, frequencies=np.linspace(0.2, 1.01, 5) * limit))
    assert text.startswith(f"frequencies up to {1.01 * limit:.4g} Hz lie above {limit:.4g} Hz")
    cell, long = fd.UnitCell(fd.Case(structure)), [[0.06, 0.02], [0.05, 0.03]]
    tops = fd.bands(cell, long, count=9).frequency.values.max(axis=0)
    inside = int((tops <= limit).sum())
    assert 0 < inside < 9
    assert told(lambda: fd.bands(cell, long, count=inside)) == []
    for found in (fd.bands, fd.linear.damped_bands):
        with pytest.warns(ModelRangeWarning) as caught:
            found(cell, long, count=9)
        assert [one.filename for one in caught] == [__file__]
        text = str(caught[0].message)
        assert text.startswith(f"bands {inside + 1} to 9 lie above") and "superelements" not in text
    assert len(told(lambda: fd.linear.attenuation(cell, [1.01 * limit], phase=1.0))) == 1
    assert told(lambda: fd.linear.attenuation(cell, [0.99 * limit], phase=1.0)) == []


def test_what_stretches():
    """Limits by model: single bars, membranes, and edges that give way in closed sheets alone."""
    sheet = fd.Sheet(4e9, 0.3, 0.01, density=800.0)
    tube = fd.patterns.miura_tube(cells=1)
    limits = {
        name: [most(fd.discretize(p, sheet, preset=name)) for p in (FLAP, tube)]
        for name in ("herkal", "plate", "n5b8e")
    }
    assert limits == {"herkal": [0.05, 0.05], "plate": [0.4, 0.4], "n5b8e": [np.inf, 0.5]}
    assert most(fd.discretize(fd.patterns.kresling(), sheet, preset="plate")) == 0.1
    assert most(fd.discretize(angle_section(0.0), sheet)) == 0.5
    assert most(fd.shell(tube, sheet, divisions=2)) == np.inf


@pytest.mark.parametrize(
    "model", [fd.discretize, lambda p, s, **k: fd.shell(p, s, divisions=2, **k)]
)
def test_the_default_fold_law_locks(model):
    """Its slope is 1/cos^2 of how far a crease rests into the range from 45 degrees to closed."""
    sheet = fd.Sheet(4e9, 0.3, 0.005)
    closed, open_ = (fd.patterns.simple_fold(dihedral=angle) for angle in (24.0, 41.0))
    (text,) = told(lambda: model(closed, sheet))
    stiffer = 1.0 / np.cos(0.5 * np.pi * (45.0 - 24.0) / 45.0) ** 2
    assert "crease 0 rests at 336 degrees" in text and f"{stiffer:.3g} times as stiff" in text
    texts = told(lambda: model(fd.patterns.simple_fold(dihedral=1.0), sheet))
    assert any("locks, which keeps it shut, so that its panels move as one:" in t for t in texts)
    assert told(lambda: model(open_, sheet)) == []
    for law in ("linear", "enhanced", fd.EnhancedLinear(theta1=30, theta2=330)):
        assert told(lambda law=law: model(closed, sheet, fold_law=law)) == []
    assert len(told(lambda: model(open_, sheet, crease_rest=330.0))) == 1
