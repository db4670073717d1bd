"""`foldyn fidelity`: any case file beside its shell, and case files of this kind."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import FOLD_TEXT, changed, rows
from foldyn.analyses.reading import read_as
from foldyn.errors import FoldynWarning, InputError

FOLD = f"""title = "a fold"
{FOLD_TEXT}[model]
calibration = "standard"
mass = ["mixed_voronoi", "consistent"]
bend_law = "linear"
[[supports]]
nodes = [0, 1, 2, 3]
[[supports]]
base = "x"
history = {{ kind = "step" }}
[[loads]]
nodes = [4, 5]
force = [0, 0, 1e-4]
history = {{ kind = "half_sine", duration = 0.05 }}
"""
MOTION = f'{FOLD}[initial]\nvelocity = [0, 0, 1]\n[analysis]\nkind = "dynamics"\nduration = 0.1\n'
KIND = f'{FOLD}[analysis]\nkind = "fidelity"\ncount = 2\nreference = "shell"\ndivisions = [2, 4]\n'


@pytest.mark.matrix
def test_a_motion_beside_the_shell(workplace) -> None:
    workplace.write(MOTION)
    done = workplace.call(
        "fidelity",
        "case.toml",
        "--count",
        "3",
        "--reference",
        "shell",
        "--divisions",
        "3",
        "6",
        "--figures",
        "png",
    )
    assert done.status == 0
    assert done.err.splitlines() == [
        "foldyn: warning: case.toml: foldyn fidelity leaves out [initial]: small vibrations about "
        "rest are compared, and displacements under the loads "
        "(docs/command-line.md#modes-frequency-responses-and-bands)"
    ]
    folder = "case-fidelity"
    names = ("fidelity.png", "laws.png", "report.html", "result.nc", "structure.png")
    assert done.new == [folder, *(f"{folder}/{name}" for name in names)]
    found = fd.Fidelity(fd.load(f"{folder}/result.nc"))
    models = ("own", "own (consistent)", "plate", "n5b8e")  # "standard" is its own
    assert found.models == models
    assert found.result.attrs["divisions"].tolist() == [3, 6]
    assert "deflection" in found.result  # the load acts in full
    told = done.out
    assert told.startswith("a fold: 8 nodes, ")
    assert str(found) in told
    page = (workplace.folder / folder / "report.html").read_text()
    assert "10 % up to (Hz)" in page
    assert "foldyn fidelity case.toml --count 3" in page
    for model in found.models:
        start = "scheme" if model == "n5b8e" else "calibration"
        (row,) = [part for part in page.split("<tr>") if f"<td>{model}</td><td>{start}" in part]
        worst = max(abs(mode.error) for mode in found.table(model) if mode.below)
        assert f"{100 * worst:.3g}" in row
    assert page.count("<img") == 3


@pytest.mark.matrix
def test_a_case_file_of_this_kind(workplace) -> None:
    workplace.write(KIND + 'models = ["plate"]\n')
    done = workplace.good("run", "case.toml", "--no-figures")
    assert done.new == ["case-results", "case-results/result.nc"]
    stored = fd.load("case-results/result.nc")
    case_file = fd.read_case("case.toml")
    again = case_file.run()
    np.testing.assert_allclose(again["error"], stored["error"], rtol=1e-9)
    plain = fd.fidelity(
        case_file.case(), 2, reference="shell", divisions=(2, 4), models=["plate"]
    ).result
    np.testing.assert_array_equal(plain["error"], again["error"].sel(model=["own", "plate"]))
    more = case_file.run(count=1, models=[])
    assert more["model"].values.tolist() == ["own", "own (consistent)"]
    assert more.sizes["mode"] == 1


def test_flags_stand_in_for_the_file(workplace) -> None:
    workplace.write(KIND)
    read = read_as(workplace.folder / "case.toml", "fidelity", {"count": 5, "models": ["plate"]})
    given = {"count": 5, "reference": "shell", "divisions": (2, 4), "models": ["plate"]}
    assert read.analysis.arguments == {**given, "secant": None, "vertex_radius": None}
    assert read.masses == ["mixed_voronoi"]


def test_a_response_without_its_drive(workplace) -> None:
    response = "loads =; supports = [{ nodes = [0, 1] }]; analysis.divisions =; "
    response += "analysis.reference =; analysis.count =; "
    response += 'drive = [{ nodes = [4, 5], force = [0, 0, 1] }]; analysis.kind = "frf"; '
    workplace.write(changed(KIND, response + "analysis.frequencies = [1.0]"))
    with pytest.warns(FoldynWarning, match=r"leaves out \[drive\]"):
        read = read_as(workplace.folder / "case.toml", "fidelity", {})
    assert read.case().loads == ()


BAD = """
model = { kind = "shell" } | model.kind = "shell": bars and hinges are compared with this
sheet.density = | sheet.density: missing; a comparison of frequencies needs it
analysis.divisions = [4]: give two numbers, as in (6, 12)
analysis.divisions = [4, 2]: the second mesh must be the finer
analysis.count = 0: must be at least 1
analysis.models = ["plates"] | analysis.models[0] = "plates": did you mean 'plate'? choose one of
    standard, plate
analysis.models = "plate": must be a list of names
output.nodes = [1] | output.nodes: only for analysis.kind =
supports[0].nodes = [0, 1, 2, 6] | supports[0].nodes: node 6 is the center of panel 0, where the
    shell has no node
model.mass = ["mixed_voronoi", "equi_inertia"] | model.mass[1] =
"""


@pytest.mark.parametrize(("edits", "message"), rows(BAD))
def test_what_is_refused(workplace, edits, message) -> None:
    workplace.write(changed(KIND, edits))
    line = workplace.refused("run", "case.toml")
    assert line.startswith(f"case.toml: {message}"), line


def test_a_mass_rule_that_is_refused_is_told_before_anything_runs(workplace) -> None:
    obtuse = 'pattern = { kind = "miura", panel_angle = 30, b = 4 }; '
    workplace.write(changed(KIND, f'{obtuse}model.mass = ["mixed_voronoi", "circumcenter"]'))
    with pytest.raises(InputError, match=r"models: own \(circumcenter\): .*circumcenter"):
        fd.read_case("case.toml").computation()
