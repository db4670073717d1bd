"""Springs, clamped edges and point masses in case files, stored results, pages and pictures."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import begins, changed, rows
from foldyn.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
FILE = """
[pattern]
kind = "simple_fold"
a = 1.0
b = 1.3
dihedral = 100
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.3
thickness = 0.01
density = 100.0
[model]
preset = "plate"
clamped = [[0, 1]]
[[supports]]
nodes = "xmin"
[[supports]]
nodes = [4]
stiffness = 30.0
direction = "-z"
[[supports]]
between = [[4, 3], [5, 2]]
stiffness = 0.05
rest_length = 0.9
[[supports]]
nodes = [5]
stiffness = 2.0
[[masses]]
nodes = "xmax"
mass = 0.25
[[loads]]
gravity = [0, 0, -0.01]
[analysis]
kind = "statics"
load_factors = [0.5, 1.0]
"""


@pytest.fixture(params=["bars_and_hinges", "shell"])
def path(request, tmp_path):
    text = FILE
    if request.param == "shell":
        text = text.replace('preset = "plate"', 'kind = "shell"\ndivisions = 2')
    (tmp_path / "case.toml").write_text(text, "utf-8")
    return tmp_path / "case.toml"


def test_a_case_file_says_all_of_it(path):
    case = fd.read_case(path).case()
    assert case.supports[1:] == (
        fd.Spring(30.0, nodes=[4], direction="-z"),
        fd.Spring(0.05, between=[(4, 3), (5, 2)], rest_length=0.9),
        fd.Spring(2.0, nodes=[5]),
    )
    assert case.masses == (fd.PointMass("xmax", 0.25),)
    assert case.structure.options.clamped == ((0, 1),)
    assert case.total_mass == pytest.approx(case.structure.total_mass + 0.5)


@pytest.mark.matrix
def test_its_result_rebuilds_the_case_and_its_page_is_written(path, tmp_path):
    case_file = fd.read_case(path)
    result = case_file.run()
    fd.save(result, tmp_path / "result.nc")
    loaded = fd.load(tmp_path / "result.nc")
    again = fd.case_of(loaded)
    case = case_file.case()
    assert again.supports == case.supports
    assert again.masses == case.masses
    assert again.structure.options == case.structure.options
    shares = fd.plots.energy_shares(loaded)
    assert shares["springs"][-1] > 0.0
    assert sum(shares.values()) == pytest.approx(1.0)
    page = case_file.analysis.page(case_file, {case_file.masses[0]: result}, tmp_path)
    text = page.read_text("utf-8")
    assert f"0.5 kg on 2 nodes, of {case.total_mass:.6g} kg in all" in text
    assert "clamped" in text


@pytest.mark.parametrize("shown", [True, False])
def test_the_picture_shows_springs_clamps_and_masses(path, shown):
    figure = fd.plots.draw_structure(fd.read_case(path).case(), supports=shown, loads=shown)
    texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    for word in ("spring", "clamped edge", "point mass, 0.25 kg"):
        assert (word in texts) == shown


def test_modes_of_the_file_with_either_model(path):
    modes = 'analysis = { kind = "modes", count = 2, state = "equilibrium" }'
    path.write_text(changed(path.read_text("utf-8"), modes))
    found = fd.read_case(path).run()
    assert (found.frequency.values > 0.0).all()
    other = "shell" if fd.read_case(path).model == "bars_and_hinges" else "bars_and_hinges"
    assert fd.read_case(path, model=other).case().structure.options.clamped == ((0, 1),)


BAD = """
supports[1].stiffness = -1: must be greater
supports[1].axes = "x" | supports[1].stiffness: ... leave out axes, or write [[supp
supports[1].direction = "up": choose one of
supports[2].between = [[4, 3], [5, 5]] | supports[2].between[1] = [5, 5]: node 5
supports[2].between = [[4, 30]] | supports[2].between ... 30
masses[0].mass = 0: must be greater than 0 kg
masses[0].mass = | masses[0].mass: missing; give it (kg)
masses[0].weight = 3 | masses[0].weight: unknown key
model.clamped = [[0, 5]] | model: clamped: (0, 5) is not a boundary edge
model.clamped = [[0, 1, 2]] | model.clamped[0] = [0, 1, 2]: must be two nodes
"""


@pytest.mark.parametrize(("edits", "message"), rows(BAD))
def test_bad_files(path, edits, message):
    path.write_text(changed(path.read_text("utf-8"), edits))
    with pytest.raises(InputError) as caught:
        fd.read_case(path)
    assert begins(str(caught.value).split("case.toml: ")[1], message), caught.value


def test_a_file_without_density_needs_a_mass_on_each_free_node(tmp_path):
    case = tmp_path / "case.toml"
    text = changed(FILE, 'sheet.density =; loads =; analysis = { kind = "modes", count = 1 }')
    case.write_text(text, "utf-8")
    with pytest.raises(InputError, match="node 2, 3, 6, 7 is free but has no mass"):
        fd.read_case(case).run()
    case.write_text(changed(text, 'masses[0].nodes = [2, 3, 4, 5]; model.scheme = "n4b5"'))
    assert np.isfinite(float(fd.read_case(case).run().frequency[0]))
