"""Case files: what a good one gives, and the one message that a bad one gets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from case_texts import changed
from foldyn.analyses import read_case
from foldyn.cases import Chirp, Constant, Force, Gravity, Pulse, Rayleigh, Table
from foldyn.errors import InputError
from foldyn.formats import write_pattern
from foldyn.materials import EnhancedLinear
from foldyn.patterns import miura
from foldyn.structures import MASS_RULES, PRESETS, Sheet


def test_the_example_of_the_design(read, example, tmp_path) -> None:
    found = read(example)
    assert found.path == tmp_path / "case2.toml"
    assert found.title == "an example"
    assert found.masses == ["circumcenter"]
    assert found.sheet == Sheet(1e6, 0.25, 0.01, 1000.0, 1.0)
    np.testing.assert_array_equal(found.pattern.vertices, miura(dihedral=60).vertices)
    case = found.case()
    assert case.structure.options == replace(
        PRESETS["herkal"], mass="circumcenter", fold_law=EnhancedLinear(45, 315, "stress_free")
    )
    assert case.damping == Rayleigh(0.02, 0.0)
    np.testing.assert_array_equal(case.supported_dofs, range(9))
    ((forces, history),) = case.load_terms
    np.testing.assert_array_equal(np.argwhere(forces), [[6, 0], [7, 0], [8, 0]])
    assert forces[7, 0] == 0.01
    assert history == Pulse(1.0)
    assert found.analysis.kind == "dynamics"
    given = {"method": "rk4", "duration": 20.0, "dt": None, "interval": 0.01, "force": False}
    given |= {"tolerance": None, "start": 0.0, "spectral_radius": None, "device": "cpu"}
    assert found.analysis.arguments == given
    np.testing.assert_array_equal(found.output.nodes, [6, 7])


def test_what_is_left_out_has_its_default(read, short) -> None:
    found = read(short)
    assert found.title == ""
    assert found.masses == [PRESETS["n5b8e"].mass]
    case = found.case()
    assert case.structure.options == PRESETS["n5b8e"]
    assert case.damping == Rayleigh()
    assert case.load_terms[0][1] == Constant()
    np.testing.assert_array_equal(found.output.nodes, [6, 7])  # the loaded ones
    assert found.analysis.arguments["interval"] == 10.0 / 2000
    assert found.analysis.arguments["method"] == "auto"


def test_sampling_by_steps(read, short) -> None:
    found = read(short + "[output]\nevery_steps = 5\nnodes = 'zmax'")
    assert found.analysis.arguments["every_steps"] == 5
    assert "interval" not in found.analysis.arguments
    height = found.pattern.vertices[:, 2]
    np.testing.assert_array_equal(found.output.nodes, np.flatnonzero(height > 0.1))


def test_axis_and_range_of_the_figures(read, short) -> None:
    output = read(short + "[output]\naxis = 'y'\nmax_frequency = 5\nanimation = 'mp4'").output
    assert output.animation == "mp4"
    assert (output.axis, output.max_frequency) == ("y", 5.0)
    assert isinstance(output.max_frequency, float)
    output = read(short).output
    assert (output.axis, output.max_frequency, output.animation) == (None, None, None)


def test_a_byte_order_mark_is_no_obstacle(read, short) -> None:
    assert read("\ufeff" + short).title == ""


@pytest.mark.matrix
def test_a_list_of_mass_rules_makes_a_case_each(read, short) -> None:
    rules = list(MASS_RULES)
    found = read(changed(short, f"model.mass = {rules}"))
    assert found.masses == rules
    assert [found.case(rule).structure.options.mass for rule in rules] == rules
    assert found.case() is found.case(rules[0])
    assert found.case("panel").structure.mass.sum() == pytest.approx(
        found.case("consistent").structure.mass.sum(), rel=1e-14
    )
    with pytest.raises(InputError, match="did you mean 'centroid'"):
        found.case("centroids")


def test_model_values_per_crease_and_laws_by_name(read, short) -> None:
    model = 'model = { preset = "herkal", bar_law = "linear", fold_law = "linear" }; '
    model += 'model.bend_law = { kind = "linear" }; model.crease_rest = 120; '
    model += "model.crease_stiffness = [0.1, 0.2, 0.3, 0.4]"
    structure = read(changed(short, model)).case().structure
    assert structure.bar_law.name == structure.fold_law.name == structure.bend_law.name == "linear"
    np.testing.assert_allclose(structure.fold_rest, np.radians(120.0), rtol=1e-15)
    np.testing.assert_allclose(structure.fold_stiffness, [0.1, 0.2, 0.3, 0.4], rtol=1e-12)


def test_an_inline_table_as_history(read, short) -> None:
    history = 'loads[0].history = { kind = "table", times = [0, 1], values = [0, 2.5] }'
    found = read(changed(short, history))
    assert found.case().loads[0].history == Table([0.0, 1.0], [0.0, 2.5])


def test_gravity_alone_and_beside_a_force(read, short) -> None:
    alone = read(changed(short, "loads[0] = { gravity = [0, 0, -9.81] }"))
    assert alone.case().loads == (Gravity((0, 0, -9.81)),)
    np.testing.assert_array_equal(alone.output.nodes, [3, 4, 5, 6, 7, 8])  # what can move
    sweep = '{ kind = "chirp", from_frequency = 1, to_frequency = 5, duration = 2 }'
    both = read(changed(short, f"loads[1] = {{ gravity = [0, 0, -9.81], history = {sweep} }}"))
    assert both.case().loads == (
        Force([7, 6], (1, 0, 0)),
        Gravity((0, 0, -9.81), Chirp(1.0, 5.0, 2.0)),
    )
    np.testing.assert_array_equal(both.output.nodes, [6, 7])  # those with a force


def test_a_table_from_a_file_beside_the_case_file(
    read, short, tmp_path, monkeypatch, tmp_path_factory
) -> None:
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    (tmp_path / "data").mkdir()
    (tmp_path / "data/pulse.csv").write_text("t [ms],F [mN],n\n0,0,0\n5,20,4\n")
    text = short.replace("force = [1, 0, 0]", "force = [1, 0, 0]\nhistory = {{ {} }}")
    file = 'kind = "table", file = "data/pulse.csv"'
    forces = read(text.format(f'{file}, unit = "N"')).case()
    assert forces.loads[0].history == Table([0.0, 0.005], [0.0, 0.02])
    named = read(text.format(f'{file}, time = "t", value = "n"')).case()
    assert named.loads[0].history == Table([0.0, 0.005], [0.0, 4.0])


def test_patterns_inline_and_from_a_file(read, short, tmp_path) -> None:
    inline = "pattern = { vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]], "
    inline += 'faces = [[0, 1, 3], [1, 2, 3]], assignments = ["U"] }; loads[0].nodes = [2]'
    pattern = read(changed(short, inline)).pattern
    assert pattern.assignments == ("U",)
    write_pattern(pattern, tmp_path / "sheet.fold")
    found = read(changed(short, 'pattern = { file = "sheet.fold" }; loads[0].nodes = [2]'))
    np.testing.assert_array_equal(found.pattern.vertices, pattern.vertices)
    assert found.pattern.faces == pattern.faces
    assert found.pattern.assignments == ("U",)


def test_files_that_cannot_be_read(tmp_path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: there is no such file"):
        read_case(tmp_path / "none.toml")
    with pytest.raises(InputError, match=r"is a folder; give a case file"):
        read_case(tmp_path)
    path = tmp_path / "broken.toml"
    path.write_text("[sheet]\nthickness = \n")
    with pytest.raises(InputError, match=r"broken\.toml: is not valid TOML: .*line 2"):
        read_case(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"broken\.toml: is not a text file in UTF-8"):
        read_case(path)
