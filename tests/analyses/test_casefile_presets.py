"""Presets in case files: what they mean, what they leave to other keys, and what stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from casefile_checks import check

import foldyn as fd
from case_texts import HELD_FOLD_TEXT as FOLD
from foldyn.structures import PRESETS, ModelOptions
from foldyn.structures.presets import resolved
from foldyn.studies import shipped_cases

MOTION = '[analysis]\nkind = "dynamics"\nduration = 0.1\n'


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_that_of_python(read, name):
    found = read(f'{FOLD}[model]\npreset = "{name}"\n{MOTION}')
    assert found.masses == [PRESETS[name].mass]
    assert found.case().structure.options == PRESETS[name]


@pytest.mark.parametrize(
    ("model", "given"),
    [
        ("", {}),
        ('scheme = "n4b5"', {"scheme": "n4b5"}),
        ('calibration = "standard"', {"calibration": "standard"}),
        ('bend_law = "superlinear"', {"bend_law": "superlinear"}),
        ('preset = "herkal"\nmass = "panel"', {"preset": "herkal", "mass": "panel"}),
    ],
)
def test_what_a_file_says_means_what_it_means_in_python(read, model, given):
    options = read(f"{FOLD}[model]\n{model}\n{MOTION}").case().structure.options
    assert options == resolved(**given)


def test_several_masses_have_the_other_options_of_the_preset(read):
    found = read(f'{FOLD}[model]\npreset = "herkal"\nmass = ["panel", "consistent"]\n{MOTION}')
    options = [found.case(rule).structure.options for rule in found.masses]
    assert options == [resolved("herkal", mass=rule) for rule in ("panel", "consistent")]


@pytest.mark.parametrize(
    ("model", "message"),
    [
        ('preset = "herkel"', "model.preset = \"herkel\": did you mean 'herkal'?"),
        ("preset = 1", "model.preset = 1: "),
        ('kind = "shell"\npreset = "plate"', "model.preset: only for model.kind"),
        (
            'preset = "plate"\nbend_law = "superlinear"',
            'model: bend_law = "superlinear": needs the stiffness of large turns',
        ),
    ],
)
def test_messages(read, model, message):
    check(read, f"{FOLD}[model]\n{model}\n{MOTION}", message)


def test_a_shell_keeps_the_folds_of_the_preset(tmp_path: Path):
    """MERLIN2's have a moment at rest where they are drawn in their locking range."""
    for name, rest in (("merlin2", "as_published"), ("herkal", "stress_free")):
        text = FOLD.replace("dihedral = 60", "dihedral = 40")
        (tmp_path / "case.toml").write_text(f'{text}[model]\npreset = "{name}"\n{MOTION}')
        shell = fd.read_case(tmp_path / "case.toml", model="shell", divisions=2).case().structure
        assert shell.fold_law == fd.EnhancedLinear(rest=rest)


@pytest.mark.matrix
def test_results_state_their_model_whole(read, tmp_path: Path):
    """Not by the name of a preset, whose meaning may change."""
    for name in PRESETS:
        motion = read(f'{FOLD}[model]\npreset = "{name}"\n{MOTION}').run()
        fd.save(motion, tmp_path / "motion.nc")
        stored = fd.load(tmp_path / "motion.nc")
        assert "preset" not in str(stored["case"].values)
        assert f'calibration = "{PRESETS[name].calibration}"' in str(stored["case"].values)
        assert fd.case_of(stored).structure.options == PRESETS[name]


@pytest.mark.matrix
def test_shipped_cases_name_the_model_that_they_had():
    """The options of before there were presets, whatever the default is."""
    for name, path in shipped_cases().items():
        assert 'preset = "herkal"\n' in path.read_text("utf-8"), name
        options = fd.read_case(path).case().structure.options
        assert options.calibration == "standard"
        bends = "linear" if name == "gallery/miura-popthrough" else "superlinear"
        assert (options.scheme, options.bar_law, options.bend_law) == ("n5b8", "ogden", bends)


def test_stored_options_of_the_time_before_presets(read):
    """A stored case of the model that was the default then rebuilds it to the bit."""
    from foldyn.cases.document import from_document, to_document

    case = read(f'{FOLD}[model]\npreset = "herkal"\n{MOTION}').case()
    document = to_document(case)
    assert document.sections["model"] == {
        "scheme": "n5b8", "mass": "mixed_voronoi", "bar_law": "ogden", "bend_law": "superlinear",
        "fold_law": {"kind": "enhanced", "theta1": 45.0, "theta2": 315.0, "rest": "stress_free"},
        "calibration": "standard", "membrane": "bars",
    }  # fmt: skip
    again = from_document(document.sections, document.arrays).structure
    np.testing.assert_array_equal(again.fold_stiffness, case.structure.fold_stiffness)
    np.testing.assert_array_equal(again.bend_stiffness, case.structure.bend_stiffness)
    assert again.options == ModelOptions(**vars(PRESETS["herkal"]))
