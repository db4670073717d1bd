"""The JSON Schema of case files: it knows what they may say, and what it means."""

from __future__ import annotations

import json
import tomllib

import pytest

from case_texts import HELD_MIURA_TEXT, MODES_TEXT, PLATE, changed
from foldyn.analyses.registry import case_schema
from foldyn.cli.main import main
from foldyn.errors import InputError
from foldyn.studies import find_case, shipped_cases

FRF_TEXT = f"""{HELD_MIURA_TEXT}{PLATE}[[drive]]
nodes = [7]
force = [0.01, 0, 0]
[analysis]
kind = "frf"
frequencies = [1, 2]
"""
PATH_TEXT = f"""{HELD_MIURA_TEXT}[[loads]]
nodes = [7]
force = [0.01, 0, 0]
[analysis]
kind = "statics"
"""
MOTION_TEXT = f"""{HELD_MIURA_TEXT}[[loads]]
nodes = [7]
force = [0.01, 0, 0]
history = {{ kind = "pulse", duration = 0.1 }}
[analysis]
kind = "dynamics"
duration = 1.0
"""
BROKEN = [
    (MODES_TEXT, "titel = 'a'"),
    (MODES_TEXT, "sheet.thickness = -1.0"),
    (MODES_TEXT, "sheet.thickness = 'thin'"),
    (MODES_TEXT, "sheet.thicknes = 0.01"),
    (MODES_TEXT, "sheet.youngs_modulus ="),
    (MODES_TEXT, "pattern.kind = 'mura'"),
    (MODES_TEXT, "pattern.cell = [1, 1]"),
    (MODES_TEXT, "model.scheme = 'n5'"),
    (MODES_TEXT, "model.fold_law = 'cubic'"),
    (MODES_TEXT, "model.fold_law.kind = 'enhanced'; model.fold_law.theta = 60"),
    (MODES_TEXT, "analysis.kind = 'mode'"),
    (MODES_TEXT, "analysis.count = 0"),
    (MODES_TEXT, "analysis.count = 2.5"),
    (MODES_TEXT, "analysis.duration = 1.0"),
    (MODES_TEXT, "supports[0].stiffness = '1'"),
    (MODES_TEXT, "supports = 3"),
    (MODES_TEXT, "damping.alpha = -1"),
    (MODES_TEXT, "damping.modal = { ratio = 0.1 }"),
    (MODES_TEXT, "output.axis = 'w'"),
    (MODES_TEXT, "drive = []"),
    (FRF_TEXT, "drive = []"),
    (FRF_TEXT, "drive[0].force = [0.01, 0]"),
    (FRF_TEXT, "drive[0].history = { kind = 'constant' }"),
    (PATH_TEXT, "loads[0].history = { kind = 'constant' }"),
    (PATH_TEXT, "analysis.until = { node = 7, axis = 'w', displacement = 1.0 }"),
    (MOTION_TEXT, "loads[0].history.kind = 'puls'"),
    (MOTION_TEXT, "loads[0].history.duration = '1 s'"),
    (MOTION_TEXT, "analysis.duration ="),
    (MOTION_TEXT, "output.interval = true"),
]


@pytest.fixture(scope="module")
def schema():
    return case_schema()


@pytest.fixture(scope="module")
def mistakes(schema):
    """Validator of documents."""
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft7Validator.check_schema(schema)
    return lambda text: list(jsonschema.Draft7Validator(schema).iter_errors(tomllib.loads(text)))


@pytest.mark.parametrize("name", shipped_cases())
def test_shipped_cases_are_valid(mistakes, name):
    assert not mistakes(find_case(name).read_text("utf-8"))


@pytest.mark.parametrize("text", [MODES_TEXT, FRF_TEXT, PATH_TEXT, MOTION_TEXT])
def test_files_that_the_broken_ones_are_made_of_are_valid(mistakes, text):
    assert not mistakes(text)


@pytest.mark.parametrize(("text", "edits"), BROKEN)
def test_broken_files_are_refused_by_both(mistakes, read, text, edits):
    broken = changed(text, edits)
    with pytest.raises(InputError):
        read(broken)
    assert mistakes(broken)


def test_every_key_of_a_table_is_explained(schema):
    tables = schema["definitions"]
    unexplained = {
        f"{name}.{key}"
        for name, table in tables.items()
        for key, one in table["properties"].items()
        if not one.get("description") and not name.endswith("Schema") and key != "kind"
    }
    assert not unexplained
    sheet, motion = tables["Sheet"], tables["MotionSection"]
    either = [one["required"] for one in sheet["anyOf"]]
    assert either == [["youngs_modulus", "poissons_ratio", "thickness"], ["plies"]]
    assert sheet["properties"]["thickness"]["exclusiveMinimum"] == 0.0
    assert motion["properties"]["kind"]["enum"] == ["dynamics"]
    assert "s" in motion["properties"]["duration"]["description"]


def test_the_command_writes_it(schema, capsys):
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(schema))
