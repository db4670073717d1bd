"""Case files with all kinds of damping: run, page, stored result and what a fit may vary."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import FOLD_TEXT
from foldyn.analyses.keys import replaced
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.cli.main import main

CASE = f"""{FOLD_TEXT.replace("= 60", "= 120")}[model]
{{model}}
fold_law = "linear"
crease_stiffness = 0.05
[damping]
alpha = 0.1
modal = [0.02, 0.03]
creases = 2e-3
[[supports]]
nodes = "xmin"
[[supports]]
nodes = [2, 3]
[[supports]]
nodes = [4]
dashpot = 1e-3
direction = "z"
[[supports]]
between = [0, 5]
dashpot = 2e-3
"""
MODELS = {"bars": 'preset = "plate"', "shell": 'kind = "shell"\ndivisions = 2'}
ANALYSES = {
    "dynamics": (
        "[[loads]]\nnodes = [5]\nforce = [0, 0, 1e-3]\n"
        'history = { kind = "pulse", duration = 0.1 }\n'
        '[analysis]\nkind = "dynamics"\nmethod = "newmark"\nduration = 0.5\ndt = 0.01\n'
        "[output]\ninterval = 0.01\n"
    ),
    "modes": '[analysis]\nkind = "modes"\ncount = 2\n',
    "frf": (
        '[analysis]\nkind = "frf"\nfrequencies = { first = 0.2, last = 2, count = 10 }\n'
        "[[drive]]\nnodes = [5]\nforce = [0, 0, 1]\n"
    ),
}


@pytest.mark.matrix
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("analysis", ANALYSES)
def test_run_and_stored(model, analysis, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE.format(model=MODELS[model]) + ANALYSES[analysis])
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out/report.html").read_text("utf-8")
    for words in ("alpha 0.1 1/s", "ratios [0.02, 0.03]", "coefficient 0.002", "between [[0, 5]]"):
        assert words in page
    result = fd.load(tmp_path / "out/result.nc")
    case = fd.case_of(result)
    assert case.damping == fd.read_case(path).case().damping
    assert [place for place, _ in case.dashpots] == ["supports[2]", "supports[3]"]
    if analysis == "dynamics":
        energy = sum(result[name] for name in (*case.energy_groups, "kinetic", "dissipated"))
        assert float(result.dissipated[-1]) > 1e-3 * float(result.work[-1])
        assert np.abs(energy - result.work - energy[0]).max() < 1e-2 * float(result.work.max())


def test_values_of_the_damping_can_be_varied(tmp_path):
    """Keys of a fit lead to them as to any number of the file."""
    path = tmp_path / "case.toml"
    path.write_text(CASE.format(model=MODELS["bars"]) + ANALYSES["modes"])
    changes = {
        "damping.modal[1]": 0.05,
        "damping.creases": 0.0,
        "damping.alpha": 0.2,
        "supports[3].dashpot": 0.0,
    }
    document = replaced(read_document(path), changes)
    case = case_of_document(path, document).case()
    assert case.damping == (fd.Rayleigh(0.2), fd.ModalDamping([0.02, 0.05]), fd.CreaseDamping(0.0))
    assert case.dashpots[1][1].coefficient == 0.0


def test_the_page_on_damping_works(tmp_path):
    """Its case in Python and its tables in a case file."""
    text = (Path(__file__).resolve().parents[2] / "docs/damping.md").read_text("utf-8")
    ((_, code), (_, tables)) = re.findall(r"^```(python|toml)\n(.*?)^```$", text, re.M | re.S)
    names: dict = {}
    exec(compile(code, "damping.md", "exec"), names)
    assert names["case"].modal_damping.modes == 2 and len(names["case"].dashpots) == 2
    path = tmp_path / "case.toml"
    sheet = CASE.partition("[damping]")[0].format(model=MODELS["bars"])
    sheet = sheet.replace('"simple_fold"', '"miura"\ncells = [2, 2]').replace("= 120", "= 60")
    path.write_text(sheet + tables + ANALYSES["modes"])
    case = fd.read_case(path).case()
    assert case.rayleigh.alpha == 0.1 and case.modal_damping.modes == 2
    assert case.dashpots[1][1].between == ((0, 20), (4, 24))
