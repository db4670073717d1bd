"""The numbers of a case file that sliders change."""

from __future__ import annotations

import tomllib
from inspect import signature

import pytest
from live_samples import FOLD, MIURA

import foldyn as fd
from foldyn.analyses.reading import case_of_document
from foldyn.live.controls import ANGLES, MOST_PARTS, changed, controls
from foldyn.patterns import GENERATORS
from foldyn.studies import shipped_cases

LENGTHS = {"a", "b", "radius", "height"}


def by_name(document):
    return {control.name: control for control in controls(document)}


def test_numbers_of_pattern_sheet_and_damping():
    found = by_name(tomllib.loads(MIURA))
    assert list(found) == [
        "pattern.cells[0]", "pattern.cells[1]", "pattern.a", "pattern.b", "pattern.panel_angle",
        "pattern.dihedral", "sheet.youngs_modulus", "sheet.poissons_ratio", "sheet.thickness",
        "sheet.density", "sheet.length_scale_ratio", "damping.alpha", "damping.beta",
    ]  # fmt: skip
    assert found["pattern.cells[0]"].value == 2 and found["pattern.cells[0]"].counts
    assert found["pattern.panel_angle"].value == 60.0  # the default of the generator
    assert found["sheet.length_scale_ratio"].value == 1.0  # that of the sheet
    ratios = by_name({**tomllib.loads(FOLD), "damping": {"ratios": [[1, 0.1], [5, 0.2]]}})
    assert [n for n in ratios if "damping" in n] == [
        f"damping.ratios[{i}][{k}]" for i in (0, 1) for k in (0, 1)
    ]


@pytest.mark.parametrize("kind", GENERATORS)
def test_every_argument_of_a_generator_is_a_length_an_angle_or_counts(kind):
    table = {**tomllib.loads(FOLD), "pattern": {"kind": kind}}
    found = {control.place[1]: control for control in controls(table)}
    for name, parameter in signature(GENERATORS[kind]).parameters.items():
        if isinstance(parameter.default, bool):
            assert name not in found
            continue
        control = found[name]
        assert control.low <= control.value <= control.high
        assert control.counts or (name in ANGLES) != (name in LENGTHS), name
        assert (control.unit == "°") == (name in ANGLES)
        assert control.counts == ("int" in str(parameter.annotation))


@pytest.mark.parametrize("name", [name for name in shipped_cases() if "static" not in name])
def test_sliders_of_shipped_cases_hold_their_values(name):
    document = tomllib.loads(shipped_cases()[name].read_text("utf-8"))
    known = controls(document)
    assert all(control.low <= control.value <= control.high for control in known)
    assert changed(document, known, {control.name: control.value for control in known}) == document


def test_a_changed_number_takes_its_place(tmp_path):
    document = tomllib.loads(MIURA)
    known = controls(document)
    wanted = {"pattern.cells[1]": 3, "pattern.dihedral": 75.5, "damping.alpha": 0.5}
    after = changed(document, known, wanted)
    assert after["pattern"] == {"kind": "miura", "cells": [2, 3], "dihedral": 75.5}
    assert after["damping"] == {"alpha": 0.5}
    assert after["sheet"] == document["sheet"] and "damping" not in document
    pattern = case_of_document(tmp_path / "x.toml", after).pattern
    assert len(pattern.faces) == 24
    del document["pattern"]["cells"]  # a default as a whole, of which one number changes
    after = changed(document, controls(document), {"pattern.cells[1]": 3})
    assert after["pattern"]["cells"] == [1, 3]


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"pattern.kind": 1}, "choose one of"),
        ({"output.nodes": 1}, "choose one of"),
        ({"pattern.cells[0]": 2.5}, r"cells\[0\] = 2.5: must be a whole number, at least 1"),
        ({"pattern.cells[0]": 0}, "at least 1"),
        ({"pattern.a": "1"}, 'pattern.a = "1": must be a number'),
        ({"pattern.a": float("nan")}, "must be a finite number"),
        ({"pattern.a": True}, "must be a number"),
        ({"pattern.a": [1.0]}, "must be a number"),
        ({"pattern.cells[0]": 40, "pattern.cells[1]": 40}, f"40 x 40 is more than {MOST_PARTS}"),
    ],
)
def test_wrong_wishes_are_refused(wanted, words):
    document = tomllib.loads(MIURA)
    with pytest.raises(fd.errors.InputError, match=words):
        changed(document, controls(document), wanted)
