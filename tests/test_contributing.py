"""The lists of files and the examples in CONTRIBUTING: what they say is what there is."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.analyses import registry
from foldyn.analyses.path import PathAnalysis
from foldyn.arguments import arguments
from foldyn.cases import case, loads
from foldyn.cli.main import main
from foldyn.values import number

ROOT = Path(__file__).resolve().parents[1]
# section, the new name there, one that exists, and what mentions that in code
EXISTING = {
    "A pattern": ("hypar", "yoshimura", r"\byoshimura\b"),
    "A mass rule": ("", "", r"(def|import|:) centroid\b"),
    "A history": ("", "", r"\b(Chirp|CHIRP)\b"),
    "An integrator": ("leapfrog", "central_difference", r'(?<!")\bcentral_difference\b(?!")'),
    "A format": ("ply", "stl", r"\bstl\.write\b"),
    "An export": ("vtp", "vtkhdf", r"\bvtkhdf\.write\b"),
}
CASE = HELD_MIURA_TEXT.replace("density = 1.0", "density = 2.0")


def section(title: str) -> str:
    """Text below a heading."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    return re.split(r"\n##", text.split(f"### {title}\n")[1])[0]


def example(title: str, names: dict[str, Any]) -> dict[str, Any]:
    """What the Python example below a heading defines."""
    (code,) = re.findall(r"```python\n(.*?)```", section(title), re.S)
    exec(compile("from __future__ import annotations\n" + code, title, "exec"), names)
    return names


@pytest.mark.parametrize("title", EXISTING)
def test_files_of_an_addition_are_those_of_one_that_is_there(title):
    new, old, mention = EXISTING[title]
    listed = re.findall(r"^\d\. `(src/\S+\.pyi?)`", section(title), re.M)
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "src").rglob("*.py*")
        if path.suffix in (".py", ".pyi")
        and (re.search(mention, path.read_text("utf-8")) or (old and path.stem == old))
    }
    if title == "An integrator":
        found -= {"src/foldyn/dynamics/method_choice.py"}  # which integrator "auto" takes
    if title == "A history":
        found -= {"src/foldyn/attractors/sweep.py"}  # which sweeps by one
    assert {name.replace(new, old) if new else name for name in listed} == found
    assert len(listed) <= 3


@pytest.mark.matrix
def test_the_load(tmp_path, monkeypatch):
    """It is read, moves the sheet, is stored and read back, and has its arrows."""
    monkeypatch.setattr(loads, "number", number, raising=False)  # as the file would import it
    names = example("A load", dict(vars(loads)))
    kinds = (*loads.LOADS, names["Squeeze"])
    monkeypatch.setattr(loads, "LOADS", kinds)
    (listed,) = arguments(PathAnalysis.schema)["loads"].checks
    for check in (loads.LOAD, listed.item):
        monkeypatch.setattr(check, "kinds", kinds)
    monkeypatch.setattr(case, "LOADS", kinds)
    path = tmp_path / "case.toml"
    squeeze = "[[loads]]\nnodes = [6, 8]\nsqueeze = 1e-3\n"
    path.write_text(CASE + squeeze + '[analysis]\nkind = "statics"\nload_factors = [1]\n')
    found = fd.read_case(path).run()
    apart = found.displacement[-1].sel(node=8) - found.displacement[-1].sel(node=6)
    assert float(apart.sel(axis="y")) < -1e-3
    assert np.abs(found.reaction[-1].groupby("support_axis").sum()).max() < 1e-12
    fd.save(found, tmp_path / "result.nc")
    again = fd.case_of(fd.load(tmp_path / "result.nc"))
    assert again.loads == fd.read_case(path).case().loads
    assert np.flatnonzero(again.force_terms[0][0][:, 1]).tolist() == [6, 8]
    path.write_text(CASE + squeeze.replace("squeeze", "sqeeze") + '[analysis]\nkind = "statics"\n')
    with pytest.raises(fd.errors.InputError, match=r"loads\[0\]\.sqeeze: .*mean 'squeeze'"):
        fd.read_case(path)


def test_the_analysis(tmp_path, monkeypatch, capsys):
    """It is read, run from Python and by the command, and has its page."""
    (code,) = re.findall(r"```python\n(.*?)```", section("An analysis"), re.S)
    (tmp_path / "mass_analysis.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    analysis = import_module("mass_analysis").MassAnalysis
    monkeypatch.setitem(registry.ANALYSES, "mass", analysis)
    path = tmp_path / "case.toml"
    path.write_text(CASE + '[analysis]\nkind = "mass"\naxis = "x"\n')
    found = fd.read_case(path).run()
    area = 4 * np.sin(np.radians(60))
    assert float(found.mass) == pytest.approx(2.0 * 0.01 * area)
    assert float(fd.read_case(path).run(axis="y").center) != float(found.center)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    assert "kg" in capsys.readouterr().out
    assert "center (m)" in (tmp_path / "out/report.html").read_text("utf-8")
    path.write_text(CASE + '[analysis]\nkind = "modes"\naxis = "x"\n')
    with pytest.raises(fd.errors.InputError, match=r'only for analysis\.kind = "mass"'):
        fd.read_case(path)
