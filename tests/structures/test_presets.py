"""Presets: which options are meant by what is said, and by what is not."""

from __future__ import annotations

import warnings
from dataclasses import asdict, replace

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases.document import from_document, to_document
from foldyn.errors import FoldynWarning, InputError
from foldyn.materials import Superlinear
from foldyn.patterns import GENERATORS
from foldyn.structures import PRESETS
from foldyn.structures.presets import implied, resolved

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
MIURA = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.2)
PAPER = {
    "scheme": "n5b8", "mass": "mixed_voronoi", "bar_law": "ogden", "bend_law": "superlinear",
    "fold_law": fd.EnhancedLinear(45.0, 315.0), "calibration": "standard",
}  # fmt: skip
"""Defaults of Foldyn before presets: the model of the paper."""
STEPS = ("crease_stiffness", "crease_rest", "clamped", "rigid", "straight", "guided",
         "membrane")  # fmt: skip


def options(**given):
    return fd.discretize(MIURA, SHEET, **given).options


def told(found) -> dict:
    return {name: value for name, value in vars(found).items() if name not in STEPS}


def test_the_default_is_plates_that_give_way_at_creases():
    plates = {"bend_law": "linear", "calibration": "plate", "bar_law": "linear"}
    assert told(options()) == PAPER | plates | {"scheme": "n5b8e", "mass": "condensed"}
    assert options() == options(preset="n5b8e") == PRESETS["n5b8e"] == PRESETS[next(iter(PRESETS))]
    assert told(options(preset="plate")) == PAPER | plates | {"mass": "consistent"}


@pytest.mark.matrix
@pytest.mark.parametrize("name", [name for name in GENERATORS if name != "simple_fold"])
def test_every_pattern_takes_the_default(name):
    """Its modes are those of what floats: six without frequency, of two tubes twelve."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        made = fd.discretize(GENERATORS[name](), SHEET)
        values = fd.modes(fd.Case(made), 13).eigenvalue.values
    free = 12 if name == "zipper_tubes" else 6
    assert made.options.scheme == "n5b8e"
    assert not values[:free].any() and values[free] > 0.0


def test_thick_panels_take_the_default():
    pattern = fd.thicken(fd.patterns.miura(), SHEET.thickness, offsets=0.0)
    held = [fd.Fix("xmin")]
    found = [
        fd.modes(fd.Case(fd.discretize(pattern, SHEET, **given), held), 1).frequency[0]
        for given in ({}, {"preset": "plate"})
    ]
    assert found[0] != found[1] and abs(found[1] / found[0] - 1.0) < 0.01


def test_the_models_of_the_paper_and_of_merlin2_have_names():
    assert told(options(preset="herkal")) == PAPER
    published = fd.EnhancedLinear(45.0, 315.0, rest="as_published")
    expected = PAPER | {"calibration": "merlin2", "fold_law": published}
    assert told(options(preset="merlin2")) == expected
    whole, named = (fd.discretize(MIURA, SHEET, **given) for given in (PAPER, {"preset": "herkal"}))
    u = 0.01 * np.sin(np.arange(whole.nodes.size)).reshape(-1, 3)
    np.testing.assert_array_equal(whole.internal_force(u), named.internal_force(u))
    np.testing.assert_array_equal(whole.mass.toarray(), named.mass.toarray())


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({}, "n5b8e"),
        ({"scheme": "n5b8e"}, "n5b8e"),
        ({"mass": "circumcenter", "bar_law": "linear", "fold_law": "linear"}, "n5b8e"),
        ({"scheme": "n5b8"}, "plate"),
        ({"scheme": "n4b5"}, "plate"),
        ({"fold_law": "superlinear"}, "plate"),
        ({"bend_law": "linear"}, "plate"),
        ({"bend_law": "plate_superlinear"}, "plate"),
        ({"calibration": "plate"}, "plate"),
        ({"calibration": "standard"}, "herkal"),
        ({"calibration": "merlin2"}, "herkal"),
        ({"calibration": "standard", "bend_law": "linear"}, "herkal"),
        ({"bend_law": "superlinear"}, "herkal"),
        ({"bend_law": Superlinear()}, "herkal"),
    ],
)
def test_what_options_stand_for_without_a_preset(given, name):
    """Scripts of before that say which calibration or that bends are superlinear mean the same."""
    assert implied(given) == name
    assert resolved(**given) == replace(PRESETS[name], **given)
    if name == "herkal":
        assert told(options(**given)) == PAPER | given


def test_what_is_given_replaces_what_the_preset_has():
    found = options(preset="herkal", mass="consistent", bend_law="linear", crease_rest=100)
    assert told(found) == PAPER | {"mass": "consistent", "bend_law": "linear"}
    assert found.crease_rest == 100
    mixed = options(preset="plate", calibration="standard")
    assert (mixed.calibration, mixed.mass, mixed.bend_law) == ("standard", "consistent", "linear")


@pytest.mark.parametrize("name", PRESETS)
def test_resolved_options_mean_themselves(name):
    """All of them, given one by one, need no preset; so stored results keep their model."""
    found = options(preset=name)
    again = options(**{key: value for key, value in vars(found).items() if value is not None})
    assert again == found and asdict(again) == asdict(found)
    case = fd.Case(fd.discretize(MIURA, SHEET, preset=name), [fd.Fix("xmin")])
    document = to_document(case)
    assert document.obstacles == ()
    assert (
        set(PAPER) <= set(document.sections["model"]) and "preset" not in document.sections["model"]
    )
    assert from_document(document.sections, document.arrays).structure.options == found


def test_positions_of_arguments_stay():
    found = fd.discretize(
        MIURA,
        SHEET,
        scheme="n4b5",
        mass="panel",
        bar_law="linear",
        fold_law="linear",
        bend_law="linear",
        calibration="standard",
    )
    assert told(found.options) == {
        "scheme": "n4b5", "mass": "panel", "bar_law": "linear", "fold_law": "linear",
        "bend_law": "linear", "calibration": "standard",
    }  # fmt: skip


LARGE = (
    'bend_law = "superlinear": needs the stiffness of large turns, but calibration = "plate" '
    'gives the stiffness of small ones; take "linear" or "plate_superlinear", or preset = "herkal"'
)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"preset": "herkel"}, "preset = \"herkel\": did you mean 'herkal'?"),
        ({"bend_law": "superlinear", "calibration": "plate"}, LARGE),
        ({"bend_law": "superlinear", "preset": "plate"}, LARGE),
        ({"calibration": "plate", "preset": "herkal"}, LARGE),
        (
            {"bend_law": "plate_superlinear", "preset": "herkal"},
            'bend_law = "plate_superlinear": h',
        ),
        ({"mass": "heavy"}, 'mass = "heavy": choose one of'),
    ],
)
def test_what_does_not_go_together_is_refused(given, message):
    with pytest.raises(InputError) as caught:
        options(**given)
    assert str(caught.value).startswith(message)
